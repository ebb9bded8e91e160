"""Rerun beside a terminal app: the frame that the app shows, at the same stamp on Rerun's timeline."""

from collections.abc import Sequence

from rerun.experimental import ViewerClient

from sdt_tools.errors import RunError
from sdt_tools.frames import Received
from sdt_tools.view.observer import RerunObserver
from sdt_tools.view.timeline import TIME
from sdt_tools.view.viewer import open_window, viewer_url


class RerunBeside:
    """Shows frames in a viewer, in whatever order they come, and moves its time to each."""

    def __init__(self, port: int) -> None:
        self._observer = RerunObserver.to_viewer(viewer_url(port))
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
        try:
            self._client.set_time(TIME, timestamp=stamp_ns / 1e9, play_state="paused")
        except (RuntimeError, OSError):
            raise RunError("the viewer is gone; labeling goes on without it") from None

    def close(self) -> None:
        """The app has ended; the viewer stays."""
        self._observer.close()
