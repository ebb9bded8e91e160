"""What a recording holds and whether it can be trusted: instant for a closed file, counted for any other."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from sdt_tools.clock import SECOND_NS
from sdt_tools.errors import OutputExistsError
from sdt_tools.recording.container.reader import Damage
from sdt_tools.recording.incomplete import Incomplete
from sdt_tools.recording.reader import Recording
from sdt_tools.recording.summary import TopicSummary
from sdt_tools.recording.timing.document import pairs_document, topic_document
from sdt_tools.recording.timing.health import FileState, Health, Reason, health_reasons, verdict
from sdt_tools.recording.timing.summary import Timing, disagreements, has_timing, noted_timing, timing_of


@dataclass(frozen=True)
class InspectReport:
    """A recording at a glance. Times are those of receipt; ``foreign_topics`` are passed over by everything else.

    ``counted`` says that the numbers come from the messages, not from what the file says of itself; in
    ``disagreements`` stands, a line each, where the two differ, as far as both were asked.
    """

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
    timing: Timing
    counted: bool
    disagreements: tuple[str, ...]
    reasons: tuple[Reason, ...]

    @property
    def duration_s(self) -> float:
        """From the first message to the last."""
        return 0.0 if self.start_ns is None or self.end_ns is None else (self.end_ns - self.start_ns) / SECOND_NS

    @property
    def messages(self) -> int:
        """Messages of all our topics."""
        return sum(topic.count for topic in self.topics.values())

    @property
    def incomplete(self) -> Incomplete:
        """What there is to say where it is cut off or damaged."""
        return Incomplete(self.path, self.truncated, self.start_ns, self.end_ns, self.messages, self.damage)

    @property
    def health(self) -> Health:
        """The verdict, as ``timing.health`` explains it."""
        return verdict(self.reasons)

    def dropped(self, topic: str) -> int:
        """Messages of ``topic`` that the recorder says it dropped."""
        return dropped_by_recorder(self.stats).get(topic, 0)

    def topic_document(self, name: str) -> dict[str, object]:
        """One topic for machines."""
        topic = self.topics[name]
        timing = topic_document(self.timing.topics.get(name), self.dropped(name))
        return {"schema": topic.schema, "count": topic.count, "hz": topic.hz, **timing}

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
            "health": str(self.health),
            "health_reasons": [{"health": str(reason.health), "text": reason.text} for reason in self.reasons],
            "topics": {name: self.topic_document(name) for name in self.topics},
            "pairs": pairs_document(self.timing.pairs),
            "numbers_from": "messages" if self.counted else "stats",
            "disagreements": list(self.disagreements),
            "foreign_topics": list(self.foreign_topics),
            "session": dict(self.session),
            "stats": dict(self.stats),
            "config": self.config_toml,
        }


def inspect_recording(path: Path, full: bool = False) -> InspectReport:
    """Look at ``path``: what its stats say, and without stats of its timing, or with ``full``, what its messages say.

    Raises RecordingError where it is missing, not an MCAP, or without our topics.
    """
    with Recording.open(path) as recording:
        noted = None if full or not recording.counted else _noted(recording)
        timing = noted or timing_of(recording.stamps(), recording.pauses)
        topics = recording.topics if noted is not None else _counted_topics(recording, timing)
        differences = _differences(recording, timing) if full else ()
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
            timing=timing,
            counted=noted is None,
            disagreements=differences,
            reasons=health_reasons(timing, _state(recording, differences)),
        )


def draw_timing(report: InspectReport, out: Path) -> None:
    """Draw the timing of the recording that ``report`` is of to the PNG ``out``; all its messages are counted for it.

    Raises OutputExistsError where ``out`` exists, DiskRefusedError where it cannot be written.
    """
    from sdt_tools.recording.timing.figure import timing_figure  # matplotlib takes a while to import

    if out.exists():
        raise OutputExistsError(out, "--plot")
    with Recording.open(report.path) as recording:
        stamps, pauses = recording.stamps(), recording.pauses
    title = f"{report.path.name}: {report.duration_s:.1f} s, {report.health}"
    timing_figure(stamps, pauses, out, title)


def dropped_by_recorder(stats: Mapping[str, str]) -> dict[str, int]:
    """Messages that the recorder dropped, by topic, as ``sdt.stats`` says."""
    prefix = "dropped."
    return {
        name.removeprefix(prefix): int(text)
        for name, text in stats.items()
        if name.startswith(prefix) and text.isdecimal()
    }


def _noted(recording: Recording) -> Timing | None:
    if not has_timing(recording.stats):
        return None
    counts = {name: topic.count for name, topic in recording.topics.items()}
    return noted_timing(recording.stats, counts)


def _counted_topics(recording: Recording, timing: Timing) -> dict[str, TopicSummary]:
    summaries = {}
    for name, schema in sorted(recording.schemas.items()):
        topic = timing.topics.get(name)
        if topic is None:
            summaries[name] = TopicSummary(name, schema, 0, None, None)
        else:
            summaries[name] = TopicSummary(name, schema, topic.count, topic.first_ns, topic.last_ns)
    return summaries


def _differences(recording: Recording, counted: Timing) -> tuple[str, ...]:
    """Where the file's summary and its stats say other than its messages."""
    lines = []
    for name, topic in recording.topics.items() if recording.counted else ():
        found = counted.topics[name].count if name in counted.topics else 0
        if topic.count != found:
            lines.append(f"{name}: the summary counts {topic.count} messages, the file holds {found}")
    return (*lines, *disagreements(recording.stats, counted))


def _state(recording: Recording, differences: tuple[str, ...]) -> FileState:
    stats = recording.stats
    lost = stats.get("lost", "")
    return FileState(
        truncated=recording.truncated,
        damaged=len(recording.damage),
        lost=int(lost) if lost.isdecimal() else 0,
        failed=stats.get("ending") == "failed",
        disagreements=len(differences),
        dropped=dropped_by_recorder(stats),
    )
