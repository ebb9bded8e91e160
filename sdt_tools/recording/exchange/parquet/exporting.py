"""Recordings into Parquet: a folder with one file a topic, and a manifest."""

from contextlib import ExitStack
from pathlib import Path
from typing import Any, Final

import polars as pl
import pyarrow as pa
import pyarrow.parquet as pq

from sdt_tools.errors import RecordingError
from sdt_tools.recording.exchange.about import about_of
from sdt_tools.recording.exchange.carried import Carried, outgoing
from sdt_tools.recording.exchange.parquet.columns import PLACE, RECEIVED, STAMP, arrow_schema, to_columns
from sdt_tools.recording.exchange.parquet.manifest import Manifest, TopicFile, write_manifest
from sdt_tools.recording.exchange.placing import placed
from sdt_tools.recording.exchange.summary import ExportSummary
from sdt_tools.recording.messages.topics import CAMERA_IMAGE, TOPIC_BY_NAME, Topic
from sdt_tools.recording.reader import Recording
from sdt_tools.recording.session import SOFTWARE

_GROUP_ROWS: Final = 1024
_GROUP_BYTES: Final = 8 << 20
"""A row group is written when it holds this many rows or bytes: all that is in memory of a topic."""


def export_parquet(path: Path, out: Path) -> ExportSummary:
    """Export the recording ``path`` to the folder ``out``, which appears when it is whole.

    Raises RecordingError for what is no recording or holds no messages, OutputExistsError, DiskRefusedError.
    """
    with Recording.open(path) as recording, placed(out, out.name) as folder:
        about = about_of(recording)
        folder.mkdir()
        rows = _write(recording, folder)
        files = {
            topic: TopicFile(file=file_name(topic), topic_schema=TOPIC_BY_NAME[topic].schema, rows=count)
            for topic, count in rows.items()
        }
        manifest = Manifest(
            software=SOFTWARE,
            recording=path.name,
            session=dict(about.session),
            stats=dict(about.stats),
            config_toml=about.config_toml,
            topics=files,
        )
        write_manifest(manifest, folder)
        _check(folder, manifest)
        return ExportSummary.of(recording, out, rows)


def file_name(topic: str) -> str:
    """Of the file of ``topic``: ``/lidar/scan`` is in ``lidar_scan.parquet``."""
    return f"{topic.strip('/').replace('/', '_')}.parquet"


class _TopicWriter:
    """The file of one topic, being written group by group."""

    def __init__(self, path: Path, topic: Topic, first: Any) -> None:
        self.rows = 0
        self._topic = topic
        self._schema = arrow_schema(topic, first)
        compression = "none" if topic.name == CAMERA_IMAGE else "zstd"  # JPEG does not compress
        self._file = pq.ParquetWriter(path, self._schema, compression=compression)
        self._clear()

    def take(self, place: int, carried: Carried) -> None:
        """One message, the ``place``th of the recording."""
        row = to_columns(self._topic, carried.message)
        row |= {PLACE: place, RECEIVED: carried.received_ns, STAMP: carried.stamp_ns}
        self._group.append(row)
        self._size += carried.message.ByteSize()
        self.rows += 1
        if len(self._group) >= _GROUP_ROWS or self._size >= _GROUP_BYTES:
            self._flush()

    def close(self) -> None:
        """Write what is pending, and the file's end."""
        if self._group:
            self._flush()
        self._file.close()

    def _flush(self) -> None:
        try:
            batch = pa.record_batch(
                [pa.array([row[field.name] for row in self._group], field.type) for field in self._schema],
                schema=self._schema,
            )
        except (pa.ArrowInvalid, OverflowError) as error:
            raise RecordingError(
                f"{self._topic.name}: some message does not fit the columns of the first ({str(error).splitlines()[0]})"
            ) from None
        self._file.write_batch(batch)
        self._clear()

    def _clear(self) -> None:
        self._group: list[dict[str, Any]] = []
        self._size = 0


def _write(recording: Recording, folder: Path) -> dict[str, int]:
    writers: dict[str, _TopicWriter] = {}
    with ExitStack() as closing:
        for place, carried in enumerate(outgoing(recording)):
            topic = carried.topic
            writer = writers.get(topic.name)
            if writer is None:
                writer = writers[topic.name] = _TopicWriter(folder / file_name(topic.name), topic, carried.message)
                closing.callback(writer.close)
            writer.take(place, carried)
    return {topic: writer.rows for topic, writer in sorted(writers.items())}


def _check(folder: Path, manifest: Manifest) -> None:
    for topic, entry in manifest.topics.items():
        found = pl.scan_parquet(folder / entry.file).select(pl.len()).collect().item()
        if found != entry.rows:
            raise RecordingError(f"{entry.file}: {found} of {entry.rows} messages of {topic} read back; check the disk")
