"""Rerun beside a terminal app: the frame that the app shows, at the same stamp on Rerun's timeline."""

import time
from collections.abc import Sequence
from typing import Final

import numpy as np
from rerun.experimental import ViewerClient

from sdt_tools.errors import RunError
from sdt_tools.frames import Received
from sdt_tools.view.observer import RerunObserver
from sdt_tools.view.timeline import TIME
from sdt_tools.view.viewer import open_window, viewer_url

ARRIVAL_S: Final = 2.0


class RerunBeside:
    """Shows frames in a viewer, in whatever order they come, and moves its time to each."""

    def __init__(self, port: int) -> None:
        self._observer = RerunObserver.to_viewer(viewer_url(port), period_ns=0)
        self._client = ViewerClient.connect(viewer_url(port))
        self._seen: set[int] = set()

    @classmethod
    def in_window(cls) -> "RerunBeside":
        """In a window of its own, on this machine; it stays. Raises ViewerError where none opens."""
        return cls(open_window())

    def show(self, messages: Sequence[Received], stamp_ns: int) -> None:
        """Draw what was measured at ``stamp_ns``, once, and go there. Raises RunError where the viewer is gone."""
        if stamp_ns not in self._seen:
            self._seen.add(stamp_ns)
            for received in messages:
                self._observer.observe(received)
            self._observer.flush()
        end_s = time.monotonic() + ARRIVAL_S
        while not self._is_gone_to(stamp_ns):
            if time.monotonic() > end_s:
                raise RunError("the viewer does not answer; labeling goes on without it")
            time.sleep(0.02)

    def _is_gone_to(self, stamp_ns: int) -> bool:
        """Whether the viewer's time is moved; it is not before the first of the data has arrived."""
        try:
            self._client.set_time(TIME, timestamp=np.datetime64(stamp_ns, "ns"), play_state="paused")
        except (RuntimeError, OSError):
            return False
        return True

    def close(self) -> None:
        """The app has ended; the viewer stays."""
        self._observer.close()
