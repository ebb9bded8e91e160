"""What a recording holds, as its summary says it: instant for a closed file, counted for one that was cut off."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from sdt_tools.clock import SECOND_NS
from sdt_tools.recording.container.reader import Damage
from sdt_tools.recording.reader import Recording
from sdt_tools.recording.summary import TopicSummary


@dataclass(frozen=True)
class InspectReport:
    """A recording at a glance. Times are those of receipt; ``foreign_topics`` are passed over by everything else."""

    path: Path
    size_bytes: int
    recording_id: str
    start_ns: int | None
    end_ns: int | None
    truncated: bool
    damage: tuple[Damage, ...]
    topics: Mapping[str, TopicSummary]
    foreign_topics: tuple[str, ...]
    session: Mapping[str, str]
    stats: Mapping[str, str]
    config_toml: str

    @property
    def duration_s(self) -> float:
        """From the first message to the last."""
        return 0.0 if self.start_ns is None or self.end_ns is None else (self.end_ns - self.start_ns) / SECOND_NS

    @property
    def messages(self) -> int:
        """Messages of all our topics."""
        return sum(topic.count for topic in self.topics.values())

    def document(self) -> dict[str, object]:
        """The report for machines."""
        return {
            "path": str(self.path),
            "size_bytes": self.size_bytes,
            "recording_id": self.recording_id,
            "duration_s": self.duration_s,
            "start_ns": self.start_ns,
            "end_ns": self.end_ns,
            "messages": self.messages,
            "truncated": self.truncated,
            "damage": [vars(damage) for damage in self.damage],
            "topics": {
                name: {"schema": topic.schema, "count": topic.count, "hz": topic.hz}
                for name, topic in self.topics.items()
            },
            "foreign_topics": list(self.foreign_topics),
            "session": dict(self.session),
            "stats": dict(self.stats),
            "config": self.config_toml,
        }


def inspect_recording(path: Path) -> InspectReport:
    """Look at ``path``. Raises RecordingError where it is missing, not an MCAP, or without our topics."""
    with Recording.open(path) as recording:
        topics = recording.topics
        return InspectReport(
            path=path,
            size_bytes=recording.size_bytes,
            recording_id=recording.recording_id,
            start_ns=min((t.first_ns for t in topics.values() if t.first_ns is not None), default=None),
            end_ns=max((t.last_ns for t in topics.values() if t.last_ns is not None), default=None),
            truncated=recording.truncated,
            damage=recording.damage,
            topics=topics,
            foreign_topics=recording.foreign_topics,
            session=recording.session,
            stats=recording.stats,
            config_toml=recording.config_toml,
        )
