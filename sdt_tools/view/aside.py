"""A viewer beside a robot: what it is shown goes through a thread, so that a viewer which hangs holds up nothing."""

import threading
from collections import deque
from typing import Final

from sdt_tools.frames import Received
from sdt_tools.protocols import Observer

WAITING: Final = 500
"""Messages: about two seconds of a robot with a camera."""
CLOSE_S: Final = 3.0


class Aside:
    """An Observer that passes on to ``observer`` what it sees, in a thread of its own.

    ``observe`` never waits: while ``WAITING`` messages wait, further ones are left out. ``close`` waits no longer than
    ``close_s``; what hangs then is left behind and does not keep the process from ending.
    """

    def __init__(self, observer: Observer, waiting: int = WAITING, close_s: float = CLOSE_S) -> None:
        self.left_out = 0
        self._observer = observer
        self._most = waiting
        self._close_s = close_s
        self._waiting: deque[Received] = deque()
        self._ending = False
        self._changed = threading.Condition()
        self._thread = threading.Thread(target=self._run, name="viewer", daemon=True)
        self._thread.start()

    def observe(self, received: Received) -> None:
        """Have it shown, soon."""
        with self._changed:
            if len(self._waiting) >= self._most:
                self.left_out += 1
                return
            self._waiting.append(received)
            self._changed.notify()

    def close(self) -> None:
        """Show what waits, and close the other; may be called twice."""
        with self._changed:
            self._ending = True
            self._changed.notify()
        self._thread.join(self._close_s)

    def _run(self) -> None:
        while (received := self._next()) is not None:
            self._observer.observe(received)
        self._observer.close()

    def _next(self) -> Received | None:
        with self._changed:
            while not self._waiting and not self._ending:
                self._changed.wait()
            return self._waiting.popleft() if self._waiting else None
