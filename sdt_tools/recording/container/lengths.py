"""Whether the lengths inside a record agree with its own: what tells a damaged length from a whole record.

The specification lets a record have more bytes at its end than its fields need, so that an exact fit vouches for a
record, and a looser one does not.
"""

import struct
from collections.abc import Callable
from typing import Final

from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.records import Channel, Metadata, Schema

from sdt_tools.recording.container.chunk import MAX_CHUNK_BYTES
from sdt_tools.recording.container.records import HEAD, UNREADABLE, body_of

_CHUNK_HEAD: Final = struct.Struct("<QQQII")
_CHUNK_FIXED: Final = _CHUNK_HEAD.size + 8  # and the name of the compression
_INDEX_FIXED: Final = 6
_KNOWN: Final = frozenset(Opcode)
_READERS: Final[dict[int, Callable[[ReadDataStream], object]]] = {
    Opcode.SCHEMA: Schema.read,
    Opcode.CHANNEL: Channel.read,
    Opcode.METADATA: Metadata.read,
}


def chunk_fits(view: memoryview, body: int, length: int) -> bool:
    """Whether a chunk's lengths agree; one with bytes after its data must have a record behind it."""
    used = _chunk_used(view, body, length)
    return used == length or (used is not None and _record_follows(view, body + length))


def chunk_reaches_beyond(view: memoryview, body: int, length: int) -> bool:
    """Whether a chunk is whole but for its end, which the file lacks: all its lengths agree."""
    return body + length > len(view) and _chunk_used(view, body, length) == length


def adds_up(view: memoryview, opcode: int, body: int, length: int) -> bool:
    """Whether the fields of a record take exactly the room that it has; False for kinds that do not tell."""
    if opcode == Opcode.CHUNK:
        return _chunk_used(view, body, length) == length
    if opcode == Opcode.MESSAGE_INDEX:
        return length >= _INDEX_FIXED and _uint(view, body + 2, 4) == length - _INDEX_FIXED
    if opcode == Opcode.ATTACHMENT:
        return _attachment_used(view, body, length) == length
    read = _READERS.get(opcode)
    if read is None:
        return False
    stream = body_of(view, body, length)
    try:
        read(stream)
    except UNREADABLE:
        return False
    return stream.count == length


def _chunk_used(view: memoryview, body: int, length: int) -> int | None:
    """The room that a chunk's fields take; None where they do not agree."""
    if length < _CHUNK_FIXED or body + _CHUNK_FIXED > len(view):
        return None
    start_ns, end_ns, size, _, name_length = _CHUNK_HEAD.unpack_from(view, body)
    if start_ns > end_ns or _CHUNK_FIXED + name_length > length:
        return None
    data_length = _uint(view, body + _CHUNK_HEAD.size + name_length, 8)
    if size != data_length if name_length == 0 else size > MAX_CHUNK_BYTES:
        return None
    used = _CHUNK_FIXED + name_length + data_length
    return used if used <= length else None


def _attachment_used(view: memoryview, body: int, length: int) -> int:
    at = 16  # both times
    for size in (4, 4, 8):  # name, media type, data
        if at + size > length:
            return -1
        at += size + _uint(view, body + at, size)
    return at + 4  # checksum


def _record_follows(view: memoryview, at: int) -> bool:
    if at + HEAD.size > len(view):
        return at == len(view)
    opcode, length = HEAD.unpack_from(view, at)
    return opcode in _KNOWN and at + HEAD.size + length <= len(view)


def _uint(view: memoryview, at: int, size: int) -> int:
    return int.from_bytes(view[at : at + size], "little")
