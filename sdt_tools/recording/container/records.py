"""Records in the bytes of an MCAP file, and what a look at them gathers."""

import struct
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from io import BytesIO
from typing import Final

from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Channel, Header, Metadata, Schema

from sdt_tools.recording.container.chunk import Segment

HEAD: Final = struct.Struct("<BQ")
UNREADABLE: Final = (McapError, struct.error, UnicodeDecodeError, IndexError, ValueError, OverflowError)
"""What the record classes raise on bytes that are not a record."""


@dataclass(frozen=True)
class Gap:
    """Bytes that are no records, between some that are: the log times just before and after, and what happened."""

    start_ns: int
    end_ns: int
    reason: str


@dataclass
class FileIndex:
    """What a file holds and where. ``counts`` (messages by channel) is None where only counting would tell."""

    header: Header = field(default_factory=lambda: Header(profile="", library=""))
    segments: list[Segment] = field(default_factory=list)
    channels: dict[int, Channel] = field(default_factory=dict)
    schemas: dict[int, Schema] = field(default_factory=dict)
    metadata: list[Metadata] = field(default_factory=list)
    attachments: list[tuple[int, int]] = field(default_factory=list)
    """Offset and length of the attachment records."""
    counts: Mapping[int, int] | None = None
    truncated: bool = False
    gaps: list[Gap] = field(default_factory=list)
    harmless: list[str] = field(default_factory=list)
    """Damage that costs no message."""


def records(view: memoryview, start: int, end: int) -> Iterator[tuple[int, int, int]]:
    """Opcode, offset of the body and length of the body of each record; a last one may reach beyond ``end``."""
    at = start
    while at + HEAD.size <= end:
        opcode, length = HEAD.unpack_from(view, at)
        yield opcode, at + HEAD.size, length
        at += HEAD.size + length


def body_of(view: memoryview, offset: int, length: int) -> ReadDataStream:
    """The body of a record, for the record classes to read."""
    return ReadDataStream(BytesIO(view[offset : offset + length]))


def take_record(view: memoryview, index: FileIndex, opcode: int, body: int, length: int) -> None:
    """Take a header, schema, channel, metadata or attachment into ``index``; of two with one number the first counts.

    A record that is damaged costs itself.
    """
    try:
        if opcode == Opcode.HEADER:
            index.header = Header.read(body_of(view, body, length))
        elif opcode == Opcode.SCHEMA:
            schema = Schema.read(body_of(view, body, length))
            if schema.id:  # zero says that there is none, and readers must not take it
                index.schemas.setdefault(schema.id, schema)
        elif opcode == Opcode.CHANNEL:
            channel = Channel.read(body_of(view, body, length))
            index.channels.setdefault(channel.id, channel)
        elif opcode == Opcode.METADATA:
            index.metadata.append(Metadata.read(body_of(view, body, length)))
        elif opcode == Opcode.ATTACHMENT:
            index.attachments.append((body - HEAD.size, HEAD.size + length))
    except UNREADABLE:
        return
