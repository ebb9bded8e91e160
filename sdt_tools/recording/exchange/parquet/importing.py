"""Parquet folders into recordings."""

import heapq
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import pyarrow as pa
import pyarrow.parquet as pq

from sdt_tools.errors import OutputExistsError, RecordingError
from sdt_tools.recording.copying import new_file
from sdt_tools.recording.exchange.carried import Carried, Incoming
from sdt_tools.recording.exchange.parquet.columns import (
    PLACE,
    RECEIVED,
    STAMP,
    TIMES,
    from_columns,
    message_fields,
)
from sdt_tools.recording.exchange.parquet.manifest import TopicFile, read_manifest
from sdt_tools.recording.messages.topics import CAMERA_IMAGE, TOPIC_BY_NAME, Topic

_BATCH_ROWS: Final = 256
_BATCH_IMAGES: Final = 8


@dataclass(frozen=True)
class ParquetImportSummary:
    """What came over, by topic; ``left_out`` names topics that are not ours, and columns that are none of a topic."""

    recording_id: str
    path: Path
    messages: Mapping[str, int]
    left_out: tuple[str, ...]

    def document(self) -> dict[str, object]:
        """The summary for machines."""
        return {
            "recording_id": self.recording_id,
            "path": str(self.path),
            "messages": dict(self.messages),
            "left_out": list(self.left_out),
        }


def import_parquet(folder: Path, out: Path) -> ParquetImportSummary:
    """Import a ``folder`` that was exported into the recording ``out``, which appears when it is whole.

    Rows may have been dropped, added or changed since; the recording keeps its identity. Raises RecordingError, naming
    the file, for what is missing, damaged, or lacks a column; OutputExistsError.
    """
    if out.exists():
        raise OutputExistsError(out)
    manifest = read_manifest(folder)
    known = {topic: entry for topic, entry in manifest.topics.items() if topic in TOPIC_BY_NAME}
    left_out = [topic for topic in manifest.topics if topic not in known]
    sources = []
    for name, entry in known.items():
        path, topic = folder / entry.file, TOPIC_BY_NAME[name]
        left_out += [f"{entry.file}: {column}" for column in _foreign_columns(path, topic, entry)]
        sources.append(_rows(path, topic))
    with new_file(out) as file:
        incoming = Incoming(file, manifest.about)
        for _, _, carried in heapq.merge(*sources, key=lambda row: row[:2]):
            incoming.take(carried)
        messages = incoming.close({})
        if not messages:
            raise RecordingError(f"{folder}: holds no messages; nothing was imported")
    return ParquetImportSummary(manifest.session.get("recording_id", ""), out, messages, tuple(left_out))


def _foreign_columns(path: Path, topic: Topic, entry: TopicFile) -> list[str]:
    if entry.topic_schema != topic.schema:
        raise RecordingError(f"{path}: holds {entry.topic_schema}; {topic.name} is {topic.schema}")
    with _opened(path) as file:
        names = file.schema_arrow.names
    needed = {RECEIVED, STAMP, *(field.name for field in message_fields(topic))}
    missing = sorted(needed - set(names))
    if missing:
        raise RecordingError(f"{path}: has no column {', '.join(missing)}; {topic.name} needs it")
    return [name for name in names if name not in needed | set(TIMES)]


def _rows(path: Path, topic: Topic) -> Iterator[tuple[int, int, Carried]]:
    """Messages by time of receipt and place; a batch of rows is in memory at a time."""
    number = 0
    with _opened(path) as file:
        try:
            for batch in _batches(file, _BATCH_IMAGES if topic.name == CAMERA_IMAGE else _BATCH_ROWS):
                for row in batch.to_pylist():
                    received_ns, stamp_ns, place = int(row[RECEIVED]), int(row[STAMP]), row.get(PLACE)
                    carried = Carried(topic, received_ns, stamp_ns, from_columns(topic, row))
                    yield received_ns, number if place is None else int(place), carried
                    number += 1
        except (pa.ArrowException, TypeError, ValueError, KeyError, OSError) as error:
            reason = str(error).splitlines()[0] if str(error) else type(error).__name__
            raise RecordingError(f"{path}: row {number}: {reason}; the file is damaged, or not as it was") from None


def _batches(file: pq.ParquetFile, rows: int) -> Iterator[pa.RecordBatch]:
    """One row group after the other: asked for all at once, they are read ahead."""
    for group in range(file.num_row_groups):
        yield from file.iter_batches(rows, row_groups=[group], use_threads=False)


def _opened(path: Path) -> pq.ParquetFile:
    try:
        return pq.ParquetFile(path)
    except FileNotFoundError:
        raise RecordingError(f"{path}: no such file, but the manifest names it; copy the folder again") from None
    except (pa.ArrowException, OSError) as error:
        raise RecordingError(f"{path}: not a Parquet file that can be read: {str(error).splitlines()[0]}") from None
