"""An MCAP file, written: chunks, indexes, statistics and checksums as the specification has them.

The container knows nothing of what its messages mean. Each message keeps two times: when it was logged (by the host)
and when it was published (by the sensor). Schemas and channels stand before the chunks, so that a lost chunk never
takes them along. Messages gather in two chunks at a time, one compressed (lz4) and one for data that is compressed
already; both are finished together, so that whoever reads scans alone never touches the images.
"""

import os
import struct
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from io import FileIO
from pathlib import Path
from typing import Final

import lz4.frame
from isal.isal_zlib import crc32
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import (
    Attachment,
    AttachmentIndex,
    Channel,
    ChunkIndex,
    DataEnd,
    Footer,
    Header,
    McapRecord,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
    SummaryOffset,
)

from sdt_tools.errors import DiskRefusedError, OutputExistsError, RecordingError

MAGIC: Final = b"\x89MCAP0\r\n"
CHUNK_BYTES: Final = 1 << 20
"""A chunk is finished when it holds this much, before compression."""

_MESSAGE_HEAD: Final = struct.Struct("<BQHIQQ")
_MESSAGE_FIXED: Final = 22  # channel, sequence, log time, publish time
_INDEX_ENTRY: Final = struct.Struct("<QQ")
_INDEX_HEAD: Final = struct.Struct("<BQHI")
_CHUNK_HEAD: Final = struct.Struct("<BQQQQII")
_FOOTER_CHECKED: Final = struct.Struct("<BQQQ")

_PARTS: Final = 1024
"""So many the system takes at once (IOV_MAX, at least 1024 wherever there are terminals)."""
_INDEX_RECORD_BYTES: Final = 256
"""No record of the summary but a schema is longer, names as we give them."""


@dataclass
class _OpenChunk:
    """Messages that are not in the file yet."""

    compressed: bool
    parts: list[bytes] = field(default_factory=list)
    size: int = 0
    start_ns: int = 0
    end_ns: int = 0
    indexes: dict[int, bytearray] = field(default_factory=dict)

    def add(self, channel_id: int, sequence: int, log_ns: int, publish_ns: int, data: bytes) -> None:
        if not self.parts:
            self.start_ns = self.end_ns = log_ns
        elif log_ns < self.start_ns:
            self.start_ns = log_ns
        elif log_ns > self.end_ns:
            self.end_ns = log_ns
        head = _MESSAGE_HEAD.pack(Opcode.MESSAGE, _MESSAGE_FIXED + len(data), channel_id, sequence, log_ns, publish_ns)
        self.parts += (head, data)
        index = self.indexes.get(channel_id)
        if index is None:
            index = self.indexes[channel_id] = bytearray()
        index += _INDEX_ENTRY.pack(log_ns, self.size)
        self.size += len(head) + len(data)


class McapFile:
    """An MCAP file being written; the path must not exist.

    Raises OutputExistsError for a path that does, DiskRefusedError naming path and cause when the disk refuses. After
    such a refusal the file is cut back to its last whole record; ``drop_last_chunk`` makes room for the file's end.
    """

    def __init__(self, path: Path, library: str, chunk_bytes: int = CHUNK_BYTES, profile: str = "") -> None:
        self.path = path
        self._chunk_bytes = chunk_bytes
        self._schemas: dict[tuple[str, str, bytes], Schema] = {}
        self._channels: list[Channel] = []
        self._sequences: list[int] = [0]
        self._chunks = (_OpenChunk(compressed=True), _OpenChunk(compressed=False))
        self._chunk_indexes: list[ChunkIndex] = []
        self._chunk_counts: list[dict[int, int]] = []
        self._attachments: list[AttachmentIndex] = []
        self._metadata: list[MetadataIndex] = []
        self._counts: Counter[int] = Counter()
        self._size = 0
        self._file = _create(path)
        self._write(MAGIC + _record(Header(profile, library)))

    @property
    def size(self) -> int:
        """Bytes in the file so far."""
        return self._size

    @property
    def pending(self) -> int:
        """Bytes that wait in memory for their chunk to be finished."""
        return sum(chunk.size for chunk in self._chunks)

    @property
    def end_bytes(self) -> int:
        """Bytes that the summary and the footer will need: about, and rather too many."""
        schemas = sum(len(schema.data) for schema in self._schemas.values())
        return schemas + _INDEX_RECORD_BYTES * (
            len(self._chunk_indexes) + len(self._channels) + len(self._attachments) + len(self._metadata) + 8
        )

    @property
    def counts(self) -> dict[str, int]:
        """Messages in the file, by topic; those that wait are not among them."""
        counts: Counter[str] = Counter()
        for channel in self._channels:
            counts[channel.topic] += self._counts[channel.id]
        return dict(sorted(counts.items()))

    def add_channel(
        self,
        topic: str,
        schema: str,
        schema_data: bytes,
        *,
        schema_encoding: str = "protobuf",
        encoding: str = "protobuf",
        metadata: Mapping[str, str] | None = None,
    ) -> int:
        """Announce a topic; the number to write its messages with. An empty name and data are no schema."""
        schema_id = self._schema_id(schema, schema_encoding, schema_data)
        channel = Channel(len(self._channels) + 1, topic, encoding, metadata=dict(metadata or {}), schema_id=schema_id)
        self._write(_record(channel))
        self._channels.append(channel)
        self._sequences.append(0)
        return channel.id

    def _schema_id(self, name: str, encoding: str, data: bytes) -> int:
        if not name and not data:
            return 0
        known = self._schemas.get((name, encoding, data))
        if known is None:
            known = Schema(len(self._schemas) + 1, data, encoding, name)
            self._write(_record(known))
            self._schemas[name, encoding, data] = known
        return known.id

    def add_message(self, channel_id: int, log_ns: int, publish_ns: int, data: bytes, compress: bool = True) -> None:
        """Take a message into the open chunk; ``compress`` chooses which one."""
        self._sequences[channel_id] += 1
        compressed, plain = self._chunks
        (compressed if compress else plain).add(channel_id, self._sequences[channel_id], log_ns, publish_ns, data)
        if compressed.size + plain.size >= self._chunk_bytes:
            self.finish_chunks()

    def add_metadata(self, name: str, entries: Mapping[str, str]) -> None:
        """Write a metadata record; chunks that are open stay open."""
        record = _record(Metadata(name, dict(entries)))
        self._metadata.append(MetadataIndex(self._write(record), len(record), name))

    def add_attachment(
        self, name: str, media_type: str, data: bytes, log_ns: int, created_ns: int | None = None
    ) -> None:
        """Write a file into the file, made when it is logged unless another time is given."""
        made_ns = log_ns if created_ns is None else created_ns
        record = _record(Attachment(create_time=made_ns, log_time=log_ns, name=name, media_type=media_type, data=data))
        offset = self._write(record)
        self._attachments.append(AttachmentIndex(offset, len(record), made_ns, log_ns, len(data), name, media_type))

    def finish_chunks(self) -> None:
        """Hand what is pending to the operating system: from here on it survives the end of this process."""
        chunks, self._chunks = self._chunks, (_OpenChunk(compressed=True), _OpenChunk(compressed=False))
        for chunk in chunks:
            if chunk.parts:
                self._write_chunk(chunk)

    def drop_last_chunk(self) -> bool:
        """Cut the file back to before its last chunk, and all that follows it; whether there was one.

        What is dropped no longer counts. It is for a disk that has no room for the file's end.
        """
        if not self._chunk_indexes:
            return False
        self._size = self._chunk_indexes.pop().chunk_start_offset
        self._counts.subtract(self._chunk_counts.pop())
        self._metadata = [entry for entry in self._metadata if entry.offset < self._size]
        self._attachments = [entry for entry in self._attachments if entry.offset < self._size]
        os.ftruncate(self._file.fileno(), self._size)
        self._file.seek(self._size)
        return True

    def sync(self) -> None:
        """Have the disk keep what was handed over: from here on it survives a power cut.

        May be called by another thread.
        """
        os.fsync(self._file.fileno())

    def finish(self) -> None:
        """Write what is pending, the summary and the footer. After a refusal it may be called again."""
        self.finish_chunks()
        self._write(self._end())
        try:
            os.fsync(self._file.fileno())
        except OSError as error:
            raise self._refused(error) from None

    def close(self) -> None:
        """Let go of the file; may be called twice. Without ``finish`` it is left as one that was cut off."""
        self._file.close()

    def _write_chunk(self, chunk: _OpenChunk) -> None:
        compression, parts = "", chunk.parts
        if chunk.compressed:
            compression, parts = "lz4", [lz4.frame.compress(b"".join(parts), block_linked=False)]  # smaller, sooner
        checksum = 0
        for part in chunk.parts:
            checksum = crc32(part, checksum)
        data_length, name = sum(map(len, parts)), compression.encode()
        length = _CHUNK_HEAD.size - 9 + len(name) + 8 + data_length
        head = _CHUNK_HEAD.pack(Opcode.CHUNK, length, chunk.start_ns, chunk.end_ns, chunk.size, checksum, len(name))
        head += name + struct.pack("<Q", data_length)
        chunk_length = len(head) + data_length
        offset = self._size
        indexes, index_offsets = b"", {}
        for channel_id, entries in chunk.indexes.items():
            index_offsets[channel_id] = offset + chunk_length + len(indexes)
            indexes += _INDEX_HEAD.pack(Opcode.MESSAGE_INDEX, 6 + len(entries), channel_id, len(entries)) + entries
        self._write(head, *parts, indexes)
        self._chunk_indexes.append(
            ChunkIndex(
                message_start_time=chunk.start_ns,
                message_end_time=chunk.end_ns,
                chunk_start_offset=offset,
                chunk_length=chunk_length,
                message_index_offsets=index_offsets,
                message_index_length=len(indexes),
                compression=compression,
                compressed_size=data_length,
                uncompressed_size=chunk.size,
            )
        )
        counts = {channel_id: len(entries) // _INDEX_ENTRY.size for channel_id, entries in chunk.indexes.items()}
        self._chunk_counts.append(counts)
        self._counts.update(counts)

    def _end(self) -> bytes:
        data_end = _record(DataEnd(0))
        summary_start = self._size + len(data_end)
        summary, offsets = b"", b""
        for group in self._summary_groups():
            if group:
                records = b"".join(map(_record, group))
                offsets += _record(SummaryOffset(records[0], summary_start + len(summary), len(records)))
                summary += records
        offsets_start = summary_start + len(summary)
        checked = summary + offsets + _FOOTER_CHECKED.pack(Opcode.FOOTER, 20, summary_start, offsets_start)
        footer = _record(Footer(summary_start, offsets_start, crc32(checked)))
        return data_end + summary + offsets + footer + MAGIC

    def _summary_groups(self) -> list[list[McapRecord]]:
        chunks = self._chunk_indexes
        statistics = Statistics(
            message_count=sum(self._counts.values()),
            schema_count=len(self._schemas),
            channel_count=len(self._channels),
            attachment_count=len(self._attachments),
            metadata_count=len(self._metadata),
            chunk_count=len(chunks),
            message_start_time=min((chunk.message_start_time for chunk in chunks), default=0),
            message_end_time=max((chunk.message_end_time for chunk in chunks), default=0),
            channel_message_counts={channel: count for channel, count in sorted(self._counts.items()) if count},
        )
        return [
            [*self._schemas.values()],
            [*self._channels],
            [statistics],
            list(chunks),
            list(self._attachments),
            list(self._metadata),
        ]

    def _write(self, *parts: bytes) -> int:
        """Write all of ``parts`` or nothing; the offset they begin at."""
        offset = self._size
        try:
            for first in range(0, len(parts), _PARTS):
                self._write_out(parts[first : first + _PARTS])
        except OSError as error:
            os.ftruncate(self._file.fileno(), offset)
            self._file.seek(offset)
            raise self._refused(error) from None
        self._size += sum(map(len, parts))
        return offset

    def _write_out(self, parts: Sequence[bytes]) -> None:
        written = os.writev(self._file.fileno(), parts)
        if written < sum(map(len, parts)):  # a nearly full disk takes a part; the rest is refused, or goes on its own
            rest = memoryview(b"".join(parts))[written:]
            while rest:
                rest = rest[self._file.write(rest) :]

    def _refused(self, error: OSError) -> DiskRefusedError:
        return DiskRefusedError(
            f"{self.path}: cannot be written after {self._size / 1e6:.1f} MB: {error.strerror}; "
            "make room on that disk or record elsewhere (what was written before is kept)"
        )


def _create(path: Path) -> FileIO:
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise RecordingError(f"{path}: its folder cannot be made: {error.strerror}; choose another --out") from None
    try:
        return path.open("xb", buffering=0)
    except FileExistsError:
        raise OutputExistsError(path) from None
    except OSError as error:
        raise RecordingError(f"{path}: cannot be created: {error.strerror}; choose another --out") from None


def _record(record: McapRecord) -> bytes:
    builder = RecordBuilder()
    record.write(builder)
    data: bytes = builder.end()  # type: ignore[no-untyped-call]
    return data
