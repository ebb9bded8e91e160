"""How a recording goes, and what came of it."""

import signal
from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Final


class Ending(StrEnum):
    """Why a recording ended."""

    TIME = "time"
    SOURCE = "source"
    STOPPED = "stopped"
    """By a key or whoever holds the controls."""
    INTERRUPTED = "interrupted"
    TERMINATED = "terminated"
    HANGUP = "hangup"
    DISK = "disk"
    FAILED = "failed"


ENDING_BY_SIGNAL: Final[Mapping[int, Ending]] = {
    signal.SIGINT: Ending.INTERRUPTED,
    signal.SIGTERM: Ending.TERMINATED,
    signal.SIGHUP: Ending.HANGUP,
}


@dataclass(frozen=True)
class RecordingProgress:
    """Where a recording stands: seconds recorded of those asked for, wall time, messages by topic, bytes written.

    ``dropped`` messages were given up by the recorder, ``missing`` ones never came from their sensor; ``disk_left_s``
    is how long the disk has room at the present rate, None while that is not known.
    """

    recorded_s: float
    total_s: float | None
    wall_s: float
    counts: Mapping[str, int]
    size_bytes: int
    dropped: int
    missed_deadlines: int
    missing: int = 0
    disk_left_s: float | None = None
    state: str = ""
    """What is going on where that is not plain recording, as in ``take_003 paused``."""
    running: bool = True
    """Whether something is being recorded, or paused."""
    paused: bool = False


@dataclass(frozen=True)
class RecordingSummary:
    """What was recorded. ``frames`` are messages by topic.

    ``dropped`` are those that the recorder gave up because disk or encoder could not keep up, ``missing`` those that
    the sensors' stamps show never to have come. ``missed_deadlines`` are, in real time, ticks that
    came more than half a period late and decisions that could not be made within their period; ``forced`` of the
    ``decisions`` were not the driver's own. ``pauses_ns`` are half-open, in host time.
    """

    recording_id: str
    ending: Ending
    seconds: float
    wall_s: float
    frames: Mapping[str, int]
    dropped: Mapping[str, int]
    missing: Mapping[str, int]
    missed_deadlines: int
    decisions: int
    forced: int
    size_bytes: int
    pauses_ns: tuple[tuple[int, int], ...] = ()

    @property
    def interrupted(self) -> bool:
        """Whether the user stopped it."""
        return self.ending is Ending.INTERRUPTED

    @property
    def real_time_factor(self) -> float:
        """Seconds recorded in a second."""
        return self.seconds / self.wall_s if self.wall_s > 0 else 0.0

    @property
    def lost_frames(self) -> int:
        """Messages that are not in the recording, whoever lost them."""
        return sum(self.dropped.values()) + sum(self.missing.values())
