"""The values in a telegram's body, written in both dialects."""

import struct
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Int64

from sdt_tools.robot.lms1xx.framing import Dialect
from sdt_tools.robot.lms1xx.reading import BINARY, SPACE


@runtime_checkable
class FieldWriter(Protocol):
    """Collects values one after the other."""

    def unsigned(self, value: int, bits: int) -> None:
        """An integer of ``bits``."""
        ...

    def signed(self, value: int, bits: int) -> None:
        """An integer in two's complement of ``bits``."""
        ...

    def real(self, value: float) -> None:
        """A number in IEEE single precision."""
        ...

    def word(self, name: str) -> None:
        """A name whose length both sides know."""
        ...

    def string(self, text: str, length_bits: int = 16) -> None:
        """Text behind its length."""
        ...

    def array(self, values: Int64[np.ndarray, "values"], bits: int) -> None:
        """Unsigned integers of ``bits``."""
        ...

    def body(self, head: str) -> bytes:
        """The body of a telegram that begins with ``head``, as ``sRA STlms``, and has these values."""
        ...


class TextWriter:
    """CoLa-A."""

    def __init__(self) -> None:
        self._tokens: list[bytes] = []

    def unsigned(self, value: int, bits: int) -> None:
        """An integer, in hexadecimal."""
        del bits
        self._tokens.append(b"%X" % value)

    def signed(self, value: int, bits: int) -> None:
        """An integer in two's complement of ``bits``, in hexadecimal."""
        self._tokens.append(b"%X" % (value & (1 << bits) - 1))

    def real(self, value: float) -> None:
        """The bits of IEEE single precision, in hexadecimal."""
        self._tokens.append(struct.pack(">f", value).hex().upper().encode())

    def word(self, name: str) -> None:
        """A name without blanks."""
        self._tokens.append(name.encode("latin-1"))

    def string(self, text: str, length_bits: int = 16) -> None:
        """Text behind its length."""
        self.unsigned(len(text), length_bits)
        if text:
            self._tokens.append(text.encode("latin-1"))

    def array(self, values: Int64[np.ndarray, "values"], bits: int) -> None:
        """Unsigned integers, in hexadecimal."""
        del bits
        self._tokens += [b"%X" % value for value in values.tolist()]

    def body(self, head: str) -> bytes:
        """The body of a telegram that begins with ``head``."""
        return SPACE.join([head.encode(), *self._tokens])


class BinaryWriter:
    """CoLa-B."""

    def __init__(self) -> None:
        self._data = bytearray()

    def unsigned(self, value: int, bits: int) -> None:
        """An integer of ``bits``."""
        self._data += value.to_bytes(bits // 8, "big")

    def signed(self, value: int, bits: int) -> None:
        """An integer in two's complement of ``bits``."""
        self._data += value.to_bytes(bits // 8, "big", signed=True)

    def real(self, value: float) -> None:
        """A number in IEEE single precision."""
        self._data += struct.pack(">f", value)

    def word(self, name: str) -> None:
        """The letters of a name."""
        self._data += name.encode("latin-1")

    def string(self, text: str, length_bits: int = 16) -> None:
        """Text behind its length."""
        self.unsigned(len(text), length_bits)
        self.word(text)

    def array(self, values: Int64[np.ndarray, "values"], bits: int) -> None:
        """Unsigned integers of ``bits``."""
        self._data += values.astype(BINARY[bits]).tobytes()

    def body(self, head: str) -> bytes:
        """The body of a telegram that begins with ``head``; an answer's ends with a blank where nothing follows."""
        asks = head[2:3] == "N"
        return head.encode() + (b"" if asks and not self._data else SPACE) + bytes(self._data)


def writer_for(dialect: Dialect) -> FieldWriter:
    """A writer without values yet."""
    return TextWriter() if dialect is Dialect.A else BinaryWriter()
