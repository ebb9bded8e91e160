"""Edits that are decided and checked: what becomes of which recording. Nothing is written yet."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import isfinite
from pathlib import Path
from typing import Final, TypeVar

from sdt_tools.clock import SECOND_NS
from sdt_tools.errors import OutputExistsError, RecordingError, UsageError
from sdt_tools.recording.container.reader import McapReader
from sdt_tools.recording.editing.span import Span, chosen_span, parse_moment, whole_span
from sdt_tools.recording.reader import recording_id_of

MOST_PARTS: Final = 9999


@dataclass(frozen=True)
class Part:
    """A new recording and the intervals of the original that it holds, in order."""

    out: Path
    spans: tuple[Span, ...]


@dataclass(frozen=True)
class Cut:
    """New recordings made of one: ``parts`` of it, without ``dropped_topics``. ``action`` is trim, split or drop."""

    action: str
    original: Path
    parts: tuple[Part, ...]
    dropped_topics: tuple[str, ...] = ()

    @property
    def out_option(self) -> str:
        """The option that says where they are made."""
        return "--out-dir" if self.action == "split" else "--out"

    @property
    def originals(self) -> tuple[Path, ...]:
        """The one recording."""
        return (self.original,)

    @property
    def outs(self) -> tuple[Path, ...]:
        """The new recordings."""
        return tuple(part.out for part in self.parts)


@dataclass(frozen=True)
class Merge:
    """One recording made of several, which are in the order of their time."""

    originals: tuple[Path, ...]
    out: Path
    out_option: str = "--out"

    @property
    def outs(self) -> tuple[Path, ...]:
        """The one new recording."""
        return (self.out,)


Plan = TypeVar("Plan", Cut, Merge)


def plan_trim(path: Path, start: str | None, end: str | None, out: Path) -> Cut:
    """What was received from ``start`` to ``end``, the end excluded; without one of them from, or to, the very end.

    Moments are as ``parse_moment`` has them. Raises UsageError for an interval that is none, or without messages;
    RecordingError for what is no recording; OutputExistsError.
    """
    if start is None and end is None:
        raise UsageError(f"{path}: say --from, --to or both; all of it is a copy")
    with McapReader(path) as source:
        span = chosen_span(path, whole_span(source), start, end)
        _check_holds(source, [span])
    return _free(Cut("trim", path, (Part(out, (span,)),)))


def plan_split(path: Path, points: Sequence[str], out_dir: Path) -> Cut:
    """Parts that end and begin at ``points``, called ``<name>_01`` and so on; those without messages are left out.

    Raises UsageError where the points are not in order, or one is not within; else as ``plan_trim``.
    """
    with McapReader(path) as source:
        whole = whole_span(source)
        moments = [parse_moment(point, whole.start_ns) for point in points]
        for point, moment_ns in zip(points, moments, strict=True):
            if not whole.start_ns < moment_ns < whole.end_ns:
                raise UsageError(
                    f"{path}: --at {point} does not lie within the recording; it has messages "
                    f"from {whole.start_ns}ns to {whole.end_ns - 1}ns"
                )
        for (before, before_ns), (after, after_ns) in pairwise(zip(points, moments, strict=True)):
            if before_ns >= after_ns:
                raise UsageError(f"{path}: --at {after} comes after --at {before}; give the points in order, each once")
        return _split(source, [whole.start_ns, *moments, whole.end_ns], out_dir)


def plan_split_every(path: Path, seconds: float, out_dir: Path) -> Cut:
    """Parts that last ``seconds`` each, the last one shorter; named, and left out, as ``plan_split`` does.

    Raises UsageError for no time at all, or for more than 9,999 parts; else as ``plan_trim``.
    """
    if not (isfinite(seconds) and seconds * SECOND_NS >= 1):
        raise UsageError(f"--every {seconds:g}: no time that a part can last; give seconds, as in 10 or 0.5")
    every_ns = round(seconds * SECOND_NS)
    with McapReader(path) as source:
        whole = whole_span(source)
        if (whole.end_ns - whole.start_ns) // every_ns >= MOST_PARTS:
            raise UsageError(f"{path}: --every {seconds:g} makes more than {MOST_PARTS} parts; choose longer ones")
        return _split(source, [*range(whole.start_ns, whole.end_ns, every_ns), whole.end_ns], out_dir)


def plan_drop_topics(path: Path, topics: Sequence[str], out: Path) -> Cut:
    """All but ``topics``. Raises UsageError for a topic that is not there, or where none remains; as ``plan_trim``."""
    with McapReader(path) as source:
        whole = whole_span(source)
        there = {channel.topic for channel in source.channels.values()}
        for topic in topics:
            if topic not in there:
                raise UsageError(f"{path}: has no topic {topic}; it has {', '.join(sorted(there))}")
        _check_holds(source, [whole], topics)
    return _free(Cut("drop", path, (Part(out, (whole,)),), tuple(sorted(set(topics)))))


def plan_drop_interval(path: Path, start: str | None, end: str | None, out: Path) -> Cut:
    """All but what was received from ``start`` to ``end``. Raises as ``plan_trim``, also where nothing remains."""
    with McapReader(path) as source:
        whole = whole_span(source)
        gone = chosen_span(path, whole, start, end)
        around = (Span(whole.start_ns, gone.start_ns), Span(gone.end_ns, whole.end_ns))
        spans = tuple(span for span in around if span.start_ns < span.end_ns)
        _check_holds(source, spans)
    return _free(Cut("drop", path, (Part(out, spans),)))


def plan_merge(paths: Sequence[Path], out: Path) -> Merge:
    """All of ``paths`` in one, by log time.

    Raises UsageError for fewer than two, or one recording given twice; RecordingError for what is no recording or
    holds no messages; OutputExistsError.
    """
    if len(paths) < 2:
        raise UsageError("give two recordings or more to merge")
    begins: list[tuple[int, int, Path]] = []
    seen: dict[str, Path] = {}
    for place, path in enumerate(paths):
        with McapReader(path) as source:
            recording_id = recording_id_of(source)
            if recording_id in seen:
                raise UsageError(f"{path} and {seen[recording_id]} are one recording ({recording_id}); give it once")
            seen[recording_id] = path
            begins.append((whole_span(source).start_ns, place, path))
    return _free(Merge(tuple(path for _, _, path in sorted(begins)), out))


def _split(source: McapReader, moments: Sequence[int], out_dir: Path) -> Cut:
    path = source.path
    parts = []
    width = max(2, len(str(len(moments) - 1)))
    for number, (start_ns, end_ns) in enumerate(pairwise(moments), start=1):
        out = out_dir / f"{path.stem}_{number:0{width}}{path.suffix}"
        if next(_entries(source, [Span(start_ns, end_ns)], ()), None) is not None:
            parts.append(Part(out, (Span(start_ns, end_ns),)))
    return _free(Cut("split", path, tuple(parts)))


def _check_holds(source: McapReader, spans: Iterable[Span], dropped_topics: Sequence[str] = ()) -> None:
    if next(_entries(source, spans, dropped_topics), None) is None:
        raise RecordingError(f"{source.path}: no message would be left; choose another part")


def _entries(source: McapReader, spans: Iterable[Span], dropped_topics: Sequence[str]) -> Iterator[object]:
    kept = {number for number, channel in source.channels.items() if channel.topic not in dropped_topics}
    for span in spans:
        yield from source.entries(kept, span.start_ns, span.end_ns)


def _free(plan: Plan) -> Plan:
    for out in plan.outs:
        if out.exists():
            raise OutputExistsError(out, plan.out_option)
    return plan
