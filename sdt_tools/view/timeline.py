"""The timelines that things are logged on, and what stays true between two stamps.

``time`` is the moment of a measurement in UTC; ``frame`` counts the recording's scans, and a message between two scans
belongs to the earlier one. Where there are errors to step through, what was known at each is logged once more on a
timeline of its own, ``error``, which counts them.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Final, Protocol, runtime_checkable

import numpy as np
import rerun as rr
from jaxtyping import Bool, Int64

TIME: Final = "time"
FRAME: Final = "frame"
ERROR: Final = "error"

LONGEST_HOLD_NS: Final = 500_000_000
"""A sampled state is never taken to last longer than this after its last sample."""


@runtime_checkable
class Rows(Protocol):
    """Where on the timelines rows lie."""

    def __len__(self) -> int: ...

    def at(self, rows: Int64[np.ndarray, "chosen"] | Bool[np.ndarray, "rows"] | slice) -> "Rows":
        """Some of the rows."""
        ...

    def columns(self) -> list[rr.TimeColumn]:
        """As Rerun takes them."""
        ...


@dataclass(frozen=True, eq=False)
class When:
    """Rows on the timelines ``time`` and ``frame``."""

    stamps_ns: Int64[np.ndarray, "rows"]
    frames: Int64[np.ndarray, "rows"]

    def __len__(self) -> int:
        return len(self.stamps_ns)

    def at(self, rows: Int64[np.ndarray, "chosen"] | Bool[np.ndarray, "rows"] | slice) -> "When":
        """Some of the rows."""
        return When(self.stamps_ns[rows], self.frames[rows])

    def columns(self) -> list[rr.TimeColumn]:
        """As Rerun takes them; stamps stay exact to the nanosecond."""
        return [
            rr.TimeColumn(TIME, timestamp=self.stamps_ns.view("datetime64[ns]")),
            rr.TimeColumn(FRAME, sequence=self.frames),
        ]


@dataclass(frozen=True, eq=False)
class Steps:
    """Rows on the timeline ``error``."""

    numbers: Int64[np.ndarray, "rows"]

    def __len__(self) -> int:
        return len(self.numbers)

    def at(self, rows: Int64[np.ndarray, "chosen"] | Bool[np.ndarray, "rows"] | slice) -> "Steps":
        """Some of the rows."""
        return Steps(self.numbers[rows])

    def columns(self) -> list[rr.TimeColumn]:
        """As Rerun takes them."""
        return [rr.TimeColumn(ERROR, sequence=self.numbers)]


@dataclass(frozen=True, eq=False)
class Both:
    """Rows on all three timelines."""

    when: When
    steps: Steps

    def __len__(self) -> int:
        return len(self.steps)

    def at(self, rows: Int64[np.ndarray, "chosen"] | Bool[np.ndarray, "rows"] | slice) -> "Both":
        """Some of the rows."""
        return Both(self.when.at(rows), self.steps.at(rows))

    def columns(self) -> list[rr.TimeColumn]:
        """As Rerun takes them."""
        return [*self.when.columns(), *self.steps.columns()]


def when(stamps_ns: Int64[np.ndarray, "rows"], scan_stamps_ns: Int64[np.ndarray, "scans"]) -> When:
    """Rows at ``stamps_ns`` in a recording whose scans were taken at ``scan_stamps_ns``, in order."""
    frames = np.searchsorted(scan_stamps_ns, stamps_ns, side="right") - 1
    return When(np.ascontiguousarray(stamps_ns), np.maximum(frames, 0).astype(np.int64))


def send(stream: rr.RecordingStream, entity: str, rows: Rows, columns: Iterable[rr.ComponentColumn]) -> None:
    """Log whole columns under ``entity``; nothing for no rows."""
    if len(rows):
        stream.send_columns(entity, indexes=rows.columns(), columns=columns, strict=True)


def hold_ns(stamps_ns: Int64[np.ndarray, "samples"]) -> int:
    """How long a sample of a state sampled at ``stamps_ns`` holds: 2.5 of its usual periods, at most 0.5 s."""
    if len(stamps_ns) < 2:
        return LONGEST_HOLD_NS
    return min(LONGEST_HOLD_NS, int(2.5 * float(np.median(np.diff(stamps_ns)))))


def held(stamps_ns: Int64[np.ndarray, "samples"], at_ns: Int64[np.ndarray, "rows"]) -> Int64[np.ndarray, "rows"]:
    """For each of ``at_ns`` the sample that holds then; -1 where none does."""
    if not len(stamps_ns):
        return np.full(len(at_ns), -1, np.int64)
    newest = np.searchsorted(stamps_ns, at_ns, side="right") - 1
    age_ns = at_ns - stamps_ns[np.maximum(newest, 0)]
    return np.where((newest >= 0) & (age_ns <= hold_ns(stamps_ns)), newest, -1).astype(np.int64)


@dataclass(frozen=True, eq=False)
class Changes:
    """A state over time, told by its changes; the empty state is a gap."""

    stamps_ns: Int64[np.ndarray, "changes"]
    states: tuple[str, ...]


def changes(stamps_ns: Int64[np.ndarray, "samples"], states: Sequence[str], hold: int | None = None) -> Changes:
    """The changes of a sampled state: a run of equal samples is one, and what does not hold any more leaves a gap.

    A sample holds for ``hold`` nanoseconds, or as ``hold_ns`` says.
    """
    hold = hold_ns(stamps_ns) if hold is None else hold
    told: list[tuple[int, str]] = []
    now, newest_ns = "", 0
    for stamp_ns, state in zip(stamps_ns.tolist(), states, strict=True):
        if now and stamp_ns - newest_ns > hold:
            told.append((newest_ns + hold, ""))
            now = ""
        if state != now:
            told.append((stamp_ns, state))
        now, newest_ns = state, stamp_ns
    if now:
        told.append((newest_ns + hold, ""))
    return Changes(np.array([stamp for stamp, _ in told], np.int64), tuple(state for _, state in told))
