"""Parts of one recording, written."""

from pathlib import Path

from sdt_tools.recording.container.reader import McapReader
from sdt_tools.recording.copying import RecordCopy, new_file
from sdt_tools.recording.editing.latched import Carried, LastKnown, carried_in, latched_topics
from sdt_tools.recording.editing.pauses import pauses_between, recorded
from sdt_tools.recording.editing.plan import Cut, Part
from sdt_tools.recording.editing.provenance import EditedRecording, original, write_beginning, write_end
from sdt_tools.recording.reader import recording_id_of
from sdt_tools.recording.session import derived_id


class Cutter:
    """Writes the parts of ``cut``, one after another in the order of their time, out of ``source``."""

    def __init__(self, source: McapReader, cut: Cut) -> None:
        self._source = source
        self._cut = cut
        self._kept = frozenset(n for n, c in source.channels.items() if c.topic not in cut.dropped_topics)
        self._known = LastKnown(source)
        self._passed_ns: int | None = None
        self._was_carried = frozenset(c for c in carried_in(source) if c.topic not in cut.dropped_topics)

    def write(self, part: Part, path: Path) -> EditedRecording:
        """Write ``part`` at ``path``; all messages as they are, before them what holds from before."""
        source, cut = self._source, self._cut
        recording_id = _part_id(recording_id_of(source), cut, part)
        with new_file(path, profile=source.header.profile) as file:
            write_beginning(file, [source], recording_id)
            copy = RecordCopy(file)
            for number in self._kept:
                copy.announce(source, source.channels[number])
            carried: frozenset[Carried] = frozenset()
            for place, span in enumerate(part.spans):
                if place > 0:  # what stands before the gap is in the part already
                    self._known, self._passed_ns = LastKnown(source), part.spans[place - 1].end_ns
                self._known.pass_over(self._passed_ns, span.start_ns)
                self._passed_ns = span.start_ns
                carried |= self._known.write(copy, span.start_ns, self._kept)
                carried |= {c for c in self._was_carried if span.touches(c.at_ns, c.at_ns)}
                for entry in source.entries(self._kept, span.start_ns, span.end_ns):
                    copy.take(source, entry)
            file.finish_chunks()
            edited = EditedRecording(
                out=part.out,
                action=cut.action,
                recording_id=recording_id,
                originals=(original(source, part.spans),),
                spans=part.spans,
                dropped_topics=cut.dropped_topics,
                messages=file.counts,
                carried=carried,
                latched_topics=latched_topics(source),
            )
            write_end(file, edited, copy.stats(pauses_between(recorded(source, part.spans))))
        return edited


def _part_id(original_id: str, cut: Cut, part: Part) -> str:
    spans = [f"{span.start_ns}-{span.end_ns}" for span in part.spans]
    return derived_id("edit", cut.action, original_id, *spans, "without", *cut.dropped_topics)
