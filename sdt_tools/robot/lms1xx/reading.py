"""The values in a telegram's body, read in both dialects.

As text, numbers without a sign are hexadecimal and negative ones two's complement of their width; a sign means decimal.
Devices and clients mix both, so values are parsed, never compared as text. In binary all is big-endian.
"""

import re
import struct
from typing import Final, Protocol, runtime_checkable

import numpy as np
from jaxtyping import Int64

from sdt_tools.robot.lms1xx.framing import Dialect

SPACE: Final = b" "
_HEX: Final = re.compile(rb"[0-9A-Fa-f]+")
_DECIMAL: Final = re.compile(rb"[+-][0-9]+")
_HEX_LIST: Final = re.compile(rb"[0-9A-Fa-f ]*")
BINARY: Final = {8: ">u1", 16: ">u2"}


class TelegramError(Exception):
    """A telegram that is not what it should be; the text says where it breaks off."""


@runtime_checkable
class FieldReader(Protocol):
    """Reads values one after the other. Every method raises TelegramError where there is no such value."""

    @property
    def at_end(self) -> bool:
        """Whether nothing is left."""
        ...

    def unsigned(self, bits: int) -> int:
        """An integer of at most ``bits``."""
        ...

    def signed(self, bits: int) -> int:
        """An integer in two's complement of ``bits``, or with a sign."""
        ...

    def real(self) -> float:
        """A number in IEEE single precision."""
        ...

    def word(self, length: int) -> str:
        """A name of ``length`` bytes."""
        ...

    def string(self) -> str:
        """Text behind its length of 16 bits."""
        ...

    def short_string(self) -> str:
        """Text behind its length, which some documents give 8 bits and some 16."""
        ...

    def array(self, bits: int, count: int) -> Int64[np.ndarray, "values"]:
        """``count`` integers."""
        ...


class TextReader:
    """CoLa-A."""

    def __init__(self, data: bytes) -> None:
        self._data = data
        self._place = 0

    @property
    def at_end(self) -> bool:
        """Whether nothing but blanks is left."""
        return not self._data[self._place :].strip(SPACE)

    def token(self) -> bytes:
        """What stands up to the next blank."""
        while self._data[self._place : self._place + 1] == SPACE:
            self._place += 1
        end = self._data.find(SPACE, self._place)
        end = len(self._data) if end < 0 else end
        token = self._data[self._place : end]
        if not token:
            raise TelegramError(f"cut off after {len(self._data)} bytes")
        self._place = end
        return token

    def unsigned(self, bits: int) -> int:
        """An integer of at most ``bits``."""
        token = self.token()
        value = _number(token)
        if not 0 <= value < 1 << bits:
            raise TelegramError(f"{_shown(token)} is no unsigned number of {bits} bits")
        return value

    def signed(self, bits: int) -> int:
        """An integer in two's complement of ``bits``, or with a sign."""
        token = self.token()
        value = _number(token)
        if _DECIMAL.fullmatch(token):
            if -(1 << bits - 1) <= value < 1 << bits - 1:
                return value
        elif value < 1 << bits:
            return value - (1 << bits) if value >> bits - 1 else value
        raise TelegramError(f"{_shown(token)} is no signed number of {bits} bits")

    def real(self) -> float:
        """A number in IEEE single precision, its bits in hexadecimal."""
        token = self.token()
        if not _HEX.fullmatch(token) or len(token) > 8:
            raise TelegramError(f"{_shown(token)} is no number in IEEE single precision")
        return _real(int(token, 16).to_bytes(4, "big"))

    def word(self, length: int) -> str:
        """A name, whose end the next blank tells."""
        del length
        return _text(self.token())

    def string(self) -> str:
        """Text behind its length; it may hold blanks."""
        length = self.unsigned(16)
        start = self._place + 1 if length else self._place
        end = start + length
        if end > len(self._data) or self._data[end : end + 1] not in (b"", SPACE):
            raise TelegramError(f"a text of {length} characters was announced, and is not there")
        self._place = end
        return _text(self._data[start:end])

    def short_string(self) -> str:
        """The same: a length has no width in text."""
        return self.string()

    def array(self, bits: int, count: int) -> Int64[np.ndarray, "values"]:
        """``count`` integers."""
        parts = self._data[self._place :].split(None, count)
        values = parts[:count]
        if len(values) < count:
            raise TelegramError(f"cut off after {len(values)} of {count} values")
        text = SPACE.join(values)
        if _HEX_LIST.fullmatch(text):
            numbers = np.array([int(value, 16) for value in values], dtype=np.int64)
        else:
            numbers = np.array([_number(value) for value in values], dtype=np.int64)
        if count and (numbers.min() < 0 or int(numbers.max()) >> bits):
            raise TelegramError(f"a value among {count} has more than {bits} bits")
        self._place = len(self._data) - (len(parts[count]) if len(parts) > count else 0)
        return numbers


class BinaryReader:
    """CoLa-B."""

    def __init__(self, data: bytes) -> None:
        self._data = data
        self._place = 0

    @property
    def at_end(self) -> bool:
        """Whether nothing is left."""
        return self._place >= len(self._data)

    def unsigned(self, bits: int) -> int:
        """An integer of ``bits``."""
        return int.from_bytes(self._take(bits // 8), "big")

    def signed(self, bits: int) -> int:
        """An integer in two's complement of ``bits``."""
        return int.from_bytes(self._take(bits // 8), "big", signed=True)

    def real(self) -> float:
        """A number in IEEE single precision."""
        return _real(self._take(4))

    def word(self, length: int) -> str:
        """A name of ``length`` bytes."""
        return _text(self._take(length))

    def string(self) -> str:
        """Text behind its length of 16 bits."""
        return _text(self._take(self.unsigned(16)))

    def short_string(self) -> str:
        """Text behind its length of 8 bits, or of 16: those begin with a zero, and a text follows."""
        length = self.unsigned(8)
        if length == 0 and self._data[self._place : self._place + 1] not in (b"", b"\0"):
            length = self.unsigned(8)
        return _text(self._take(length))

    def array(self, bits: int, count: int) -> Int64[np.ndarray, "values"]:
        """``count`` integers."""
        size = bits // 8
        there = (len(self._data) - self._place) // size
        if there < count:
            raise TelegramError(f"cut off after {there} of {count} values")
        return np.frombuffer(self._take(count * size), BINARY[bits]).astype(np.int64)

    def _take(self, size: int) -> bytes:
        taken = self._data[self._place : self._place + size]
        if len(taken) < size:
            raise TelegramError(f"cut off after {len(self._data)} bytes")
        self._place += size
        return taken


def reader_for(dialect: Dialect, data: bytes) -> FieldReader:
    """A reader of the values ``data``."""
    return TextReader(data) if dialect is Dialect.A else BinaryReader(data)


def _number(token: bytes) -> int:
    if _HEX.fullmatch(token):
        return int(token, 16)
    if _DECIMAL.fullmatch(token) and len(token) <= 12:
        return int(token)
    raise TelegramError(f"{_shown(token)} is no number")


def _real(data: bytes) -> float:
    (value,) = struct.unpack(">f", data)
    return float(value)


def _text(data: bytes) -> str:
    return data.decode("latin-1")


def _shown(token: bytes) -> str:
    return repr(_text(token[:20]))
