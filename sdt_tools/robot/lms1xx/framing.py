"""Telegrams in a stream of bytes, in both dialects of the SICK command language.

CoLa-A: STX, text, ETX. CoLa-B: four STX, the length of the body (32 bits, big-endian), the body, and all its bytes
XORed. TCP splits and merges them anywhere. (SICK, *Telegram Listing*, 8014631, chapter 2.)
"""

from collections.abc import Iterator
from enum import Enum
from functools import reduce
from operator import xor
from typing import Final, Protocol, runtime_checkable

import numpy as np

STX: Final = b"\x02"
ETX: Final = b"\x03"
MAGIC: Final = STX * 4
_HEAD_BYTES: Final = len(MAGIC) + 4
LONGEST_BODY: Final = 0x10000
"""No telegram of an LMS1xx is nearly as long: 1081 rays with both echoes and their strengths take 22 kB as text."""
_FIRST_LETTER: Final = b"s"
"""Every body begins with it: ``sRN``, ``sAN``, ``sSN`` and the like."""


class Dialect(Enum):
    """The two ways to write a telegram."""

    A = "a"
    B = "b"

    @property
    def label(self) -> str:
        """As SICK calls it."""
        return f"CoLa-{self.name}"


def checksum(body: bytes) -> int:
    """All bytes of a CoLa-B body XORed."""
    if len(body) < 64:
        return reduce(xor, body, 0)
    return int(np.bitwise_xor.reduce(np.frombuffer(body, np.uint8)))


def framed(dialect: Dialect, body: bytes) -> bytes:
    """``body`` as it goes over the wire."""
    if dialect is Dialect.A:
        return STX + body + ETX
    return MAGIC + len(body).to_bytes(4, "big") + body + bytes([checksum(body)])


@runtime_checkable
class Splitter(Protocol):
    """Cuts a stream into bodies of telegrams. It never raises, whatever it is fed."""

    damaged: int
    """Telegrams that were begun and given up: cut off, or with a wrong checksum."""
    skipped: int
    """Bytes that belong to no whole telegram."""

    @property
    def pending(self) -> bytes:
        """What was fed and is no whole telegram yet."""
        ...

    def feed(self, data: bytes) -> list[bytes]:
        """Take the next bytes of the stream; the bodies that they complete."""
        ...


def splitter_for(dialect: Dialect) -> Splitter:
    """A new splitter for streams in ``dialect``."""
    return TextSplitter() if dialect is Dialect.A else BinarySplitter()


class TextSplitter:
    """Finds CoLa-A telegrams. Text has no checksum: what stands between STX and ETX, without another STX, is one."""

    def __init__(self) -> None:
        self.damaged = 0
        self.skipped = 0
        self._buffer = bytearray()
        self._searched = 0
        """Up to here the buffer holds no ETX."""

    @property
    def pending(self) -> bytes:
        """What was fed and is no whole telegram yet."""
        return bytes(self._buffer)

    def feed(self, data: bytes) -> list[bytes]:
        """Take the next bytes of the stream; the bodies that they complete."""
        self._buffer += data
        return list(self._bodies())

    def _bodies(self) -> Iterator[bytes]:
        buffer = self._buffer
        while (end := buffer.find(ETX, self._searched)) >= 0:
            start = buffer.rfind(STX, 0, end)
            if start < 0:
                self._skip(end + 1)
                continue
            self.damaged += buffer.count(STX, 0, start)
            self.skipped += start
            body = bytes(buffer[start + 1 : end])
            self._drop(end + 1)
            yield body
        self._searched = len(buffer)
        newest = buffer.rfind(STX)
        if newest < 0 or len(buffer) - newest > LONGEST_BODY:
            self.damaged += buffer.count(STX)
            self._skip(len(buffer))
        elif newest > 0:
            self.damaged += buffer.count(STX, 0, newest)
            self._skip(newest)

    def _skip(self, count: int) -> None:
        self.skipped += count
        self._drop(count)

    def _drop(self, count: int) -> None:
        del self._buffer[:count]
        self._searched = max(self._searched - count, 0)


class BinarySplitter:
    """Finds CoLa-B telegrams whose checksum is right.

    A length that was damaged may ask for more bytes than there are: a whole telegram within them ends the waiting.
    """

    def __init__(self) -> None:
        self.damaged = 0
        self.skipped = 0
        self._buffer = bytearray()

    @property
    def pending(self) -> bytes:
        """What was fed and is no whole telegram yet."""
        return bytes(self._buffer)

    def feed(self, data: bytes) -> list[bytes]:
        """Take the next bytes of the stream; the bodies that they complete."""
        self._buffer += data
        return list(self._bodies())

    def _bodies(self) -> Iterator[bytes]:
        while True:
            start = self._buffer.find(MAGIC)
            if start < 0:
                self._skip(max(len(self._buffer) - len(MAGIC) + 1, 0))
                return
            self._skip(start)
            end = self._end(0)
            if end is not None and end <= len(self._buffer):
                body = self._checked(0, end)
                if body is None:
                    self.damaged += 1
                    self._skip(1)
                    continue
                del self._buffer[:end]
                yield body
            elif end is None and len(self._buffer) >= _HEAD_BYTES:
                self._skip(1)  # no telegram begins so
            else:
                inner = self._whole_one_within()
                if inner is None:
                    return
                self.damaged += 1
                self._skip(inner)

    def _end(self, start: int) -> int | None:
        """Where the telegram at ``start`` ends; None where its head is not all there, or that of no telegram."""
        head = bytes(self._buffer[start : start + _HEAD_BYTES + 1])
        if len(head) < _HEAD_BYTES or head[_HEAD_BYTES:] not in (b"", _FIRST_LETTER):
            return None
        length = int.from_bytes(head[len(MAGIC) : _HEAD_BYTES], "big")
        return start + _HEAD_BYTES + length + 1 if 0 < length <= LONGEST_BODY else None

    def _checked(self, start: int, end: int) -> bytes | None:
        body = bytes(self._buffer[start + _HEAD_BYTES : end - 1])
        return body if body[:1] == _FIRST_LETTER and checksum(body) == self._buffer[end - 1] else None

    def _whole_one_within(self) -> int | None:
        """Where a whole telegram begins behind the one that is waited for."""
        start = self._buffer.find(MAGIC, 1)
        while start >= 0:
            end = self._end(start)
            if end is not None and end <= len(self._buffer) and self._checked(start, end) is not None:
                return start
            start = self._buffer.find(MAGIC, start + 1)
        return None

    def _skip(self, count: int) -> None:
        self.skipped += count
        del self._buffer[:count]
