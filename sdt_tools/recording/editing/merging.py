"""Several recordings, written as one: the union of what they hold, by log time."""

from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from heapq import merge
from itertools import groupby
from pathlib import Path
from typing import Final
from zlib import crc32

from sdt_tools.errors import RecordingError
from sdt_tools.recording.container.reader import McapReader, RawEntry
from sdt_tools.recording.copying import RecordCopy, new_file
from sdt_tools.recording.editing.latched import Carried, carried_in, latched_topics, place_of
from sdt_tools.recording.editing.pauses import pauses_between, recorded, spans_of
from sdt_tools.recording.editing.plan import Merge
from sdt_tools.recording.editing.provenance import EditedRecording, original, write_beginning, write_end
from sdt_tools.recording.editing.span import Span, whole_span
from sdt_tools.recording.messages.topics import CAMERA_IMAGE, LIDAR_SCAN
from sdt_tools.recording.reader import recording_id_of
from sdt_tools.recording.session import derived_id

_SENSORS: Final = (LIDAR_SCAN, CAMERA_IMAGE)
"""Topics whose stamps labels go by."""
_Numbered = tuple[int, RawEntry]
"""A message and the place of its recording among those that are merged."""


def write_merged(plan: Merge, path: Path) -> EditedRecording:
    """Write all messages of the originals at ``path``.

    A message that several hold (same topic, times and data: their parts overlap) is written once. So is one that was
    carried to the beginning of a part and stands in another original where it belongs. Messages of one moment keep the
    order of the originals. Raises RecordingError for originals that saw different things at one moment.
    """
    with ExitStack() as stack:
        sources = [stack.enter_context(McapReader(original)) for original in plan.originals]
        recording_id = derived_id("edit", "merge", *map(recording_id_of, sources))
        wholes = [whole_span(source) for source in sources]
        carried = [carried_in(source) for source in sources]
        needless = _needless(sources, carried)
        with new_file(path, profile=_profile(sources)) as file:
            write_beginning(file, sources, recording_id)
            copy = RecordCopy(file)
            for source in sources:
                for channel in source.channels.values():
                    copy.announce(source, channel)
            streams = [_numbered(place, source, needless[place]) for place, source in enumerate(sources)]
            shared = 0
            for _, moment in groupby(merge(*streams, key=_log_ns), key=_log_ns):
                found = list(moment)
                once = list(_union(sources, found))
                _check_kinship(plan, sources, once)
                shared += len(found) - len(once)
                for place, entry in once:
                    copy.take(sources[place], entry)
            file.finish_chunks()
            edited = EditedRecording(
                out=plan.out,
                action="merge",
                recording_id=recording_id,
                originals=tuple(original(s, [whole]) for s, whole in zip(sources, wholes, strict=True)),
                spans=tuple(wholes),
                dropped_topics=(),
                messages=file.counts,
                carried=frozenset().union(*(own - gone for own, gone in zip(carried, needless, strict=True))),
                latched_topics=frozenset().union(*map(latched_topics, sources)),
                shared=shared,
                interleaved=_overlaps(wholes),
            )
            pauses = pauses_between(span for source in sources for span in recorded(source, spans_of(source)))
            write_end(file, edited, copy.stats(pauses))
    return edited


def _profile(sources: Sequence[McapReader]) -> str:
    """The profile that all keep to; none where they differ."""
    profiles = {source.header.profile for source in sources}
    return profiles.pop() if len(profiles) == 1 else ""


def _numbered(place: int, source: McapReader, needless: frozenset[Carried]) -> Iterator[_Numbered]:
    """The messages of ``source``, but for each of ``needless`` one that is it."""
    left_out = {(c.topic, c.at_ns, c.publish_ns, c.crc32) for c in needless}
    moments = {c.at_ns for c in needless}
    for entry in source.entries():
        if entry.log_ns in moments and (found := place_of(source, entry)) in left_out:
            left_out.remove(found)
        else:
            yield place, entry


def _log_ns(numbered: _Numbered) -> int:
    return numbered[1].log_ns


def _union(sources: Sequence[McapReader], moment: Sequence[_Numbered]) -> Iterator[_Numbered]:
    """The messages of one moment, each as often as the recording that holds it most often."""
    if moment[0][0] == moment[-1][0]:
        yield from moment
        return
    written: Counter[tuple[str, int, bytes]] = Counter()
    for place, own in groupby(moment, key=lambda numbered: numbered[0]):
        met: Counter[tuple[str, int, bytes]] = Counter()
        for _, entry in own:
            message = sources[place].channels[entry.channel_id].topic, entry.publish_ns, entry.data
            met[message] += 1
            if met[message] > written[message]:
                written[message] += 1
                yield place, entry


def _check_kinship(plan: Merge, sources: Sequence[McapReader], moment: Sequence[_Numbered]) -> None:
    """Refuse recordings that saw different things at one moment: a label's stamp would mean both.

    Raises RecordingError, naming the two.
    """
    seen: dict[tuple[str, int], tuple[int, bytes]] = {}
    for place, entry in moment:
        topic = sources[place].channels[entry.channel_id].topic
        if topic not in _SENSORS:
            continue
        before, data = seen.setdefault((topic, entry.publish_ns), (place, entry.data))
        if before != place and data != entry.data:
            raise RecordingError(
                f"{plan.originals[before]} and {plan.originals[place]}: both hold a message of {topic} taken at "
                f"{entry.publish_ns} ns, but not the same: these are different drives, which cannot be told apart in "
                "one recording; keep them as two"
            )


def _needless(sources: Sequence[McapReader], carried: Sequence[frozenset[Carried]]) -> list[frozenset[Carried]]:
    """The carried messages of each recording that another holds where they belong, or nearer to there."""
    earliest: dict[tuple[str, int, int, int], int] = {}
    for own in carried:
        for c in own:
            origin = (c.topic, c.log_ns, c.publish_ns, c.crc32)
            earliest[origin] = min(c.at_ns, earliest.get(origin, c.at_ns))
    return [
        frozenset(
            c
            for c in own
            if c.at_ns > earliest[c.topic, c.log_ns, c.publish_ns, c.crc32]
            or any(_holds(other, c) for at, other in enumerate(sources) if at != place)
        )
        for place, own in enumerate(carried)
    ]


def _holds(source: McapReader, carried: Carried) -> bool:
    """Whether the message that was carried stands in ``source`` at its own time."""
    numbers = frozenset(number for number, channel in source.channels.items() if channel.topic == carried.topic)
    return any(
        entry.publish_ns == carried.publish_ns and crc32(entry.data) == carried.crc32
        for entry in source.entries(numbers, carried.log_ns, carried.log_ns + 1)
    )


def _overlaps(wholes: Sequence[Span]) -> tuple[Span, ...]:
    """Where recordings, which are in the order of their beginning, overlap."""
    found = []
    end_ns = wholes[0].end_ns
    for whole in wholes[1:]:
        if whole.start_ns < end_ns:
            found.append(Span(whole.start_ns, min(end_ns, whole.end_ns)))
        end_ns = max(end_ns, whole.end_ns)
    return tuple(found)
