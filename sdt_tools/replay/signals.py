"""What the operator did with his arms, as far as a recording knows it: gestures, and what may be taken for one."""

from dataclasses import dataclass
from typing import Final

import numpy as np
from jaxtyping import Float64, Int64

from sdt_tools.frames import OperatorState
from sdt_tools.recording.messages.topics import OPERATOR_STATE
from sdt_tools.recording.reader import Recording

SIGNAL_HOLDS_NS: Final = 2_500_000_000
"""What he does is told when it changes and at least once a second."""


@dataclass(frozen=True, eq=False)
class Signals:
    """All that the operator signalled, in order of stamps."""

    told: tuple[OperatorState, ...]

    def at(self, stamps_ns: Int64[np.ndarray, "frames"]) -> list[OperatorState | None]:
        """What he did at each stamp; None where that is not known."""
        told_ns = np.array([signal.stamp_ns for signal in self.told], np.int64)
        latest = np.searchsorted(told_ns, stamps_ns, side="right") - 1
        return [
            self.told[row] if row >= 0 and stamp_ns - self.told[row].stamp_ns <= SIGNAL_HOLDS_NS else None
            for row, stamp_ns in zip(latest.tolist(), stamps_ns.tolist(), strict=True)
        ]

    def arms_changed_s(self, stamps_ns: Int64[np.ndarray, "frames"]) -> Float64[np.ndarray, "frames"]:
        """Seconds from each stamp to the nearest change of gesture or behaviour; NaN where there is none."""
        kinds = [(signal.gesture, signal.behaviour) for signal in self.told]
        changed = [row for row in range(1, len(kinds)) if kinds[row] != kinds[row - 1]]
        changes_ns = np.array([self.told[row].stamp_ns for row in changed], np.int64)
        if not len(changes_ns):
            return np.full(len(stamps_ns), np.nan)
        after = np.searchsorted(changes_ns, stamps_ns)
        later_ns = np.abs(changes_ns[np.minimum(after, len(changes_ns) - 1)] - stamps_ns)
        earlier_ns = np.abs(stamps_ns - changes_ns[np.maximum(after - 1, 0)])
        nearest_s: Float64[np.ndarray, "frames"] = np.minimum(later_ns, earlier_ns) * 1e-9
        return nearest_s


def read_signals(recording: Recording) -> Signals:
    """All signals in ``recording``. Raises RecordingError as ``Recording.messages`` does."""
    messages = (received.message for received in recording.messages((OPERATOR_STATE,)))
    signals = [message for message in messages if isinstance(message, OperatorState)]
    return Signals(tuple(sorted(signals, key=lambda signal: signal.stamp_ns)))
