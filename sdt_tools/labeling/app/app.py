"""The labeling app as a whole."""

import signal
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from sdt_tools.labeling.app.desk import Beside, Desk, Task
from sdt_tools.labeling.app.screen import LabelingScreen
from sdt_tools.labeling.app.state import State
from sdt_tools.labeling.frame_labels import UNSAID
from sdt_tools.terminal.app import TerminalApp, follow_the_terminal
from sdt_tools.terminal.hangup import hangup_watched


class LabelingApp(TerminalApp[None]):
    """Labels what is on ``desk``; ``beside`` shows the same frame elsewhere."""

    TITLE = "sdt label"

    def __init__(self, desk: Desk, beside: Beside | None = None, now_ns: Callable[[], int] = time.time_ns) -> None:
        super().__init__()
        self._labeling = LabelingScreen(desk, beside, now_ns)

    @property
    def state(self) -> State:
        """Where the labeler stands."""
        return self._labeling.state

    def on_mount(self) -> None:
        """Begin."""
        self.push_screen(self._labeling)


@dataclass(frozen=True)
class Sitting:
    """What came of it: ``labelled`` of ``frames`` have the labeler's label now, ``conflicts`` are left.

    ``ended_by`` a signal (SIGTERM, or SIGHUP where the terminal is gone), not by the labeler.
    """

    frames: int
    labelled: int
    labelled_before: int
    conflicts: int
    counts: dict[str, int]
    ended_by: signal.Signals | None = None


def label_by_hand(task: Task, beside: Beside | None = None) -> Sitting:
    """Open the app on a terminal, and return when the labeler has ended it.

    Raises LabelError or RecordingError where recording, journal, predictions or suspects do not serve.
    """
    try:
        with Desk(task) as desk:
            app = LabelingApp(desk, beside)
            before = int(np.count_nonzero(desk.opened.mine != UNSAID))
            follow_the_terminal()
            with hangup_watched(app.hung_up):
                app.run()
    finally:
        if beside is not None:
            beside.close()
    state = app.state
    return Sitting(
        frames=len(state.labels),
        labelled=int(np.count_nonzero(state.mine != UNSAID)),
        labelled_before=before,
        conflicts=int(state.labels.disputed.sum()),
        counts=dict(zip(state.classes, state.labels.counts(state.mine), strict=True)),
        ended_by=app.ended_by,
    )
