"""The emergency stop: one latch for all who can pull it and all who must stand still while it is pulled."""

import threading
from collections.abc import Callable


class EmergencyStop:
    """Latches until it is released. May be pulled and asked from any thread.

    ``heard`` functions are called in the thread of whoever pulls or releases, with the reason, empty on release. They
    must not wait, and not raise.
    """

    def __init__(self) -> None:
        self._reason = ""
        self._heard: list[Callable[[str], None]] = []
        self._lock = threading.Lock()

    @property
    def reason(self) -> str:
        """Why it is pulled; empty where it is not."""
        return self._reason

    def tell(self, heard: Callable[[str], None]) -> None:
        """Have ``heard`` called from now on; at once, too, where it is pulled already."""
        with self._lock:
            self._heard.append(heard)
            reason = self._reason
        if reason:
            heard(reason)

    def pull(self, why: str) -> None:
        """Stop. The first reason stands."""
        if not why:
            raise ValueError("an emergency stop has a reason")
        with self._lock:
            if self._reason:
                return
            self._reason = why
            heard = tuple(self._heard)
        for hear in heard:
            hear(why)

    def release(self) -> None:
        """End it. Nothing moves by that alone."""
        with self._lock:
            if not self._reason:
                return
            self._reason = ""
            heard = tuple(self._heard)
        for hear in heard:
            hear("")
