"""Recordings of which less can be read than was recorded: whoever reads them says so, in these words."""

from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path

from sdt_tools.clock import SECOND_NS
from sdt_tools.recording.container.reader import Damage
from sdt_tools.recording.reader import Recording


@dataclass(frozen=True)
class Incomplete:
    """A recording that was cut off (``truncated``) or is damaged.

    ``messages`` of our topics, received from ``start_ns`` to ``end_ns``, both None of none, are what there is to read.
    """

    path: Path
    truncated: bool
    start_ns: int | None
    end_ns: int | None
    messages: int
    damage: tuple[Damage, ...]

    def lines(self) -> Iterator[str]:
        """What a person is told: a line about the cut, and one about each stretch that is lost."""
        if self.truncated and self.start_ns is not None and self.end_ns is not None:
            after_s = (self.end_ns - self.start_ns) / SECOND_NS
            yield (
                f"{self.path}: cut off at {self.end_ns} ns, {after_s:.2f} s after its start; the {self.messages:,} "
                "messages up to there are read; `sdt repair` finishes it"
            )
        elif self.truncated:
            yield f"{self.path}: cut off before its first message; `sdt repair` finishes it"
        for damage in self.damage:
            yield f"{self.path}: {damage.text}"

    def document(self) -> dict[str, object]:
        """The same for machines."""
        return {
            "path": str(self.path),
            "truncated": self.truncated,
            "start_ns": self.start_ns,
            "end_ns": self.end_ns,
            "messages": self.messages,
            "damage": [asdict(damage) for damage in self.damage],
        }


def incomplete(recording: Recording) -> Incomplete | None:
    """What is missing of ``recording`` as far as it was read by now; None where that was whole."""
    if not recording.truncated and not recording.damage:
        return None
    topics = recording.topics.values()  # counted where it is cut, which may meet damage
    return Incomplete(
        path=recording.path,
        truncated=recording.truncated,
        start_ns=min((topic.first_ns for topic in topics if topic.first_ns is not None), default=None),
        end_ns=max((topic.last_ns for topic in topics if topic.last_ns is not None), default=None),
        messages=sum(topic.count for topic in topics),
        damage=recording.damage,
    )
