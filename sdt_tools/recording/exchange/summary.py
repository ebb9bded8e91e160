"""What went out of a recording."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path

from sdt_tools.recording.container.reader import Damage
from sdt_tools.recording.reader import Recording


@dataclass(frozen=True)
class ExportSummary:
    """What went out, by topic of the output; what stayed behind, by topic of the recording; what could not be read."""

    path: Path
    messages: Mapping[str, int]
    left_out: Mapping[str, int]
    truncated: bool
    damage: tuple[Damage, ...]

    @classmethod
    def of(cls, recording: Recording, out: Path, messages: Mapping[str, int]) -> "ExportSummary":
        """Of ``recording``, all of which was read, with ``messages`` in ``out`` now."""
        return cls(out, messages, recording.foreign_counts, recording.truncated, recording.damage)

    def document(self) -> dict[str, object]:
        """The summary for machines."""
        return {
            "path": str(self.path),
            "messages": dict(self.messages),
            "left_out": dict(self.left_out),
            "truncated": self.truncated,
            "damage": [asdict(damage) for damage in self.damage],
        }
