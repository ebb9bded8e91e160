"""ARCOS packets: FA FB, a count, a body and a checksum, cut out of a stream of bytes that may hold anything.

Sources: Pioneer 3 Operations Manual, "Client-server communication packet protocol".
"""

from collections.abc import Iterator
from typing import Final

HEADER: Final = b"\xfa\xfb"
MAX_BODY: Final = 202
"""Packets are at most 207 bytes long in all, with header, count and checksum; a longer count is no packet's."""
_CHECKSUM_BYTES: Final = 2
_SHORTEST: Final = len(HEADER) + 1 + 1 + _CHECKSUM_BYTES


def checksum(body: bytes) -> int:
    """The 16-bit sum of the body's big-endian byte pairs; a last odd byte is XORed with the sum."""
    even = len(body) - len(body) % 2
    total = sum(body[place] << 8 | body[place + 1] for place in range(0, even, 2)) & 0xFFFF
    return total ^ body[-1] if len(body) % 2 else total


def packet(body: bytes) -> bytes:
    """``body``, whose first byte is the command or the type, as it goes over the wire."""
    if not 1 <= len(body) <= MAX_BODY:
        raise ValueError(f"a packet's body has 1 to {MAX_BODY} bytes, not {len(body)}")
    return HEADER + bytes([len(body) + _CHECKSUM_BYTES]) + body + checksum(body).to_bytes(_CHECKSUM_BYTES, "big")


class PacketSplitter:
    """Cuts a stream into packets, wherever the transport split or merged it, and finds the next one after garbage.

    ``bad_checksums`` counts what looked like a packet and was none; ``skipped_bytes`` what belonged to no packet.
    """

    def __init__(self) -> None:
        self.bad_checksums = 0
        self.skipped_bytes = 0
        self._pending = bytearray()

    def feed(self, data: bytes) -> Iterator[bytes]:
        """The bodies of the packets that ``data`` completes, in order."""
        self._pending += data
        while (body := self._next()) is not None:
            yield body

    def _next(self) -> bytes | None:
        pending = self._pending
        while True:
            start = pending.find(HEADER)
            if start < 0:
                self._skip(len(pending) - pending.endswith(HEADER[:1]))  # half a header may be completed
                return None
            self._skip(start)
            if len(pending) < _SHORTEST:
                return None
            size = pending[len(HEADER)]
            end = len(HEADER) + 1 + size
            if not 1 <= size - _CHECKSUM_BYTES <= MAX_BODY:
                self._skip(len(HEADER))
                continue
            if len(pending) < end:
                return None
            body = bytes(pending[len(HEADER) + 1 : end - _CHECKSUM_BYTES])
            if checksum(body) == int.from_bytes(pending[end - _CHECKSUM_BYTES : end], "big"):
                del pending[:end]
                return body
            self.bad_checksums += 1
            self._skip(len(HEADER))  # a packet may begin within what was taken for one

    def _skip(self, count: int) -> None:
        self.skipped_bytes += count
        del self._pending[:count]
