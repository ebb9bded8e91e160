"""What an edited recording says of itself: whose part it is, what was done, and what else came along."""

import hashlib
import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from sdt_tools.recording.container.file import McapFile
from sdt_tools.recording.container.reader import Damage, McapReader
from sdt_tools.recording.editing.latched import CARRIED, EDIT, LATCHED, Carried, carried_text
from sdt_tools.recording.editing.span import Span, seconds_of
from sdt_tools.recording.reader import recording_id_of
from sdt_tools.recording.session import SESSION, SOFTWARE, STATS


@dataclass(frozen=True)
class Original:
    """A recording that was edited, and how far it could be read: damage within what was asked for."""

    path: Path
    recording_id: str
    truncated: bool
    damage: tuple[Damage, ...]


@dataclass(frozen=True)
class EditedRecording:
    """A new recording. ``spans`` of its originals are in it; ``messages`` by topic, the ``carried`` among them.

    ``latched_topics`` are those of others whose messages hold on. ``shared`` messages stand in several originals and
    here once; in ``interleaved`` intervals originals overlap.
    """

    out: Path
    action: str
    recording_id: str
    originals: tuple[Original, ...]
    spans: tuple[Span, ...]
    dropped_topics: tuple[str, ...]
    messages: Mapping[str, int]
    carried: frozenset[Carried]
    latched_topics: frozenset[str] = frozenset()
    shared: int = 0
    interleaved: tuple[Span, ...] = ()

    @property
    def seconds(self) -> float:
        """From the first moment in it to the last."""
        return seconds_of(Span(self.spans[0].start_ns, max(span.end_ns for span in self.spans)))

    def document(self) -> dict[str, object]:
        """The report for machines."""
        return {
            "out": str(self.out),
            "action": self.action,
            "recording_id": self.recording_id,
            "originals": [asdict(original) | {"path": str(original.path)} for original in self.originals],
            "spans_ns": [[span.start_ns, span.end_ns] for span in self.spans],
            "dropped_topics": list(self.dropped_topics),
            "messages": dict(self.messages),
            "carried": len(self.carried),
            "shared": self.shared,
            "interleaved_ns": [[span.start_ns, span.end_ns] for span in self.interleaved],
        }


def original(source: McapReader, spans: Iterable[Span]) -> Original:
    """What there is to say of ``source`` once it was read."""
    spans = list(spans)
    met = tuple(d for d in source.damage if any(span.touches(d.start_ns, d.end_ns) for span in spans))
    return Original(source.path, recording_id_of(source), source.truncated, met)


def write_beginning(file: McapFile, sources: Sequence[McapReader], recording_id: str) -> None:
    """The session with its new id, the attachments, and the metadata of others, each once."""
    file.add_metadata(SESSION, _session(sources, recording_id))
    _write_attachments(file, sources)
    written: list[tuple[str, dict[str, str]]] = []
    for source in sources:
        for record in source.metadata:
            entries = (record.name, dict(record.metadata))
            if record.name not in (SESSION, STATS) and entries not in written:
                file.add_metadata(*entries)
                written.append(entries)


def write_end(file: McapFile, edited: EditedRecording, stats: Mapping[str, str]) -> None:
    """``sdt.stats`` with what is true of the new recording, ``stats`` that were counted in it, and ``sdt.edit``.

    What the originals' stats say of drops, gaps or decisions is about the whole of each: it is not taken over.
    """
    file.add_metadata(STATS, {**stats, "seconds": f"{edited.seconds:.3f}"})
    originals = [
        {
            "name": original.path.name,
            "recording_id": original.recording_id,
            "truncated": original.truncated,
            "damage": [asdict(damage) for damage in original.damage],
        }
        for original in edited.originals
    ]
    file.add_metadata(
        EDIT,
        {
            "action": edited.action,
            "originals": json.dumps(originals),
            "spans_ns": json.dumps([[span.start_ns, span.end_ns] for span in edited.spans]),
            "dropped_topics": json.dumps(edited.dropped_topics),
            "shared": str(edited.shared),
            CARRIED: carried_text(edited.carried),
            LATCHED: json.dumps(sorted(edited.latched_topics)),
        },
    )


def _session(sources: Sequence[McapReader], recording_id: str) -> dict[str, str]:
    """What the originals say of their sessions; where they differ, all their words."""
    words: dict[str, list[str]] = {"recording_id": [], "software_version": []}
    for source in sources:
        records = [record.metadata for record in source.metadata if record.name == SESSION]
        for name, value in (records[-1] if records else {}).items():
            known = words.setdefault(name, [])
            if value and value not in known:
                known.append(value)
    said = {name: " + ".join(values) for name, values in words.items()}
    return said | {"recording_id": recording_id, "software_version": SOFTWARE}


def _write_attachments(file: McapFile, sources: Sequence[McapReader]) -> None:
    """Those of all ``sources``; of one that differs from an earlier recording's, the name tells its recording."""
    written: set[tuple[str, bytes]] = set()
    names: set[str] = set()
    for source in sources:
        for attached in source.attachments():
            what = (attached.name, hashlib.sha256(attached.data).digest())
            if what not in written:
                name = f"{source.path.stem}.{attached.name}" if attached.name in names else attached.name
                file.add_attachment(name, attached.media_type, attached.data, attached.log_time, attached.create_time)
                written.add(what)
        names |= {name for name, _ in written}
