"""A recording that was cut off or damaged, finished into one that every reader opens."""

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Final

from sdt_tools.errors import RecordingError
from sdt_tools.recording.container.reader import Damage, McapReader
from sdt_tools.recording.copying import RecordCopy, new_file
from sdt_tools.recording.messages.topics import is_ours
from sdt_tools.recording.reader import decoded
from sdt_tools.recording.session import STATS
from sdt_tools.recording.timing.pauses import pauses_in
from sdt_tools.recording.timing.summary import ENTRY

REPAIRED: Final = "sdt.repair"


@dataclass(frozen=True)
class RepairReport:
    """What was saved, by topic, and what could not be: intervals of log time, and messages where their number is known.

    ``lost`` counts by topic what the original's summary promises and is not there; None where it has no summary.
    """

    path: Path
    out: Path
    messages: Mapping[str, int]
    truncated: bool
    damage: tuple[Damage, ...]
    lost: Mapping[str, int] | None

    @property
    def sound(self) -> bool:
        """Whether there was nothing to repair."""
        return not self.truncated and not self.damage and not any((self.lost or {}).values())

    def document(self) -> dict[str, object]:
        """The report for machines."""
        return {
            "path": str(self.path),
            "out": str(self.out),
            "messages": dict(self.messages),
            "truncated": self.truncated,
            "damage": [asdict(damage) for damage in self.damage],
            "lost": None if self.lost is None else dict(self.lost),
            "sound": self.sound,
        }


def repair_recording(path: Path, out: Path) -> RepairReport:
    """Take all that can be read of ``path``, topics of others too, over into the new file ``out``.

    The original is only read. Profile and library stay. The file says in its metadata ``sdt.repair`` what was wrong
    with the original; ``sdt.stats`` are taken over with their counts and timing put right, and where a cut has taken
    them, they are counted, and the pauses read from the log.
    Raises OutputExistsError where ``out`` exists; RecordingError for a path that is missing or not an MCAP, that holds
    nothing to save, and where the repaired file does not read back: then there is none.
    """
    with McapReader(path) as source, new_file(out, source.header.library, source.header.profile) as file:
        copy = RecordCopy(file)
        for attached in source.attachments():
            file.add_attachment(
                attached.name, attached.media_type, attached.data, attached.log_time, attached.create_time
            )
        for record in source.metadata:
            if record.name not in (STATS, REPAIRED):
                file.add_metadata(record.name, record.metadata)
        for channel in source.channels.values():
            copy.announce(source, channel)
        ours = frozenset(
            number
            for number, channel in source.channels.items()
            if is_ours(channel.topic, source.schema_name(channel), channel.message_encoding)
        )
        for entry in source.entries():
            if entry.channel_id in ours and not source.is_checked(entry.offset) and decoded(source, entry) is None:
                continue  # in the new file a checksum would vouch for it
            copy.take(source, entry)
        file.finish_chunks()
        messages = file.counts
        if not source.channels and not source.metadata:
            raise RecordingError(f"{path}: nothing in it can be read; there is nothing to save")
        report = RepairReport(path, out, messages, source.truncated, source.damage, _lost(source, messages))
        stats = [dict(record.metadata) for record in source.metadata if record.name == STATS]
        if stats or copy.has_ours:
            kept = {name: text for name, text in (stats or [{}])[-1].items() if not name.startswith(ENTRY)}
            file.add_metadata(STATS, kept | copy.stats(pauses_in(source)))
        file.add_metadata(
            REPAIRED,
            {
                "original": path.name,
                "truncated": str(source.truncated).lower(),
                "damage": json.dumps([asdict(damage) for damage in source.damage]),
            },
        )
    return report


def _lost(source: McapReader, messages: Mapping[str, int]) -> dict[str, int] | None:
    if source.counts is None:
        return None
    promised: dict[str, int] = {}
    for number, channel in source.channels.items():
        promised[channel.topic] = promised.get(channel.topic, 0) + source.counts.get(number, 0)
    return {topic: max(0, count - messages.get(topic, 0)) for topic, count in promised.items()}
