"""How packets of the emulated base reach the client: whole and at once, or as the faults have it."""

import random
from collections import deque
from collections.abc import Iterator
from typing import Final

from sdt_tools.clock import SECOND_NS
from sdt_tools.emulation.p3at.faults import FaultKind, Faults

_PIECE_NS: Final = 2_000_000
"""Time between the pieces of a packet that is split: enough for each to be a read of its own."""

_MERGE_NS: Final = 250_000_000
"""What waits to be merged with later packets goes without them after so long."""


class FaultyWire:
    """Takes packets, gives pieces of bytes when they are due."""

    def __init__(self, faults: Faults, seed: int = 0) -> None:
        self._faults = faults
        self._random = random.Random(seed)
        self._held: list[bytes] = []
        self._held_ns = 0
        self._due: deque[tuple[int, bytes]] = deque()

    def put(self, packet: bytes, now_ns: int, at_s: float) -> None:
        """Send ``packet``, ``at_s`` after the start."""
        drop, corrupt, garbage = (self._chance(kind, at_s) for kind in _BY_CHANCE)
        if drop:
            return
        if corrupt:
            packet = _with_a_wrong_bit(packet, self._random)
        if garbage:
            packet = self._random.randbytes(self._random.randint(1, 20)) + packet
        if not self._held:
            self._held_ns = now_ns
        self._held.append(packet)
        if len(self._held) >= (self._faults.value(FaultKind.MERGE, at_s) or 1):
            self._send_held(now_ns, at_s)

    def _send_held(self, now_ns: int, at_s: float) -> None:
        merged, self._held = b"".join(self._held), []
        due_ns = now_ns + round((self._faults.value(FaultKind.DELAY, at_s) or 0.0) * SECOND_NS)
        size = int(self._faults.value(FaultKind.SPLIT, at_s) or len(merged))
        for number, place in enumerate(range(0, len(merged), size)):
            self._due.append((due_ns + number * _PIECE_NS, merged[place : place + size]))

    def take(self, now_ns: int, at_s: float) -> Iterator[bytes]:
        """What is due by ``now_ns``, in order."""
        if self._held and now_ns - self._held_ns >= _MERGE_NS:
            self._send_held(now_ns, at_s)
        while self._due and self._due[0][0] <= now_ns:
            yield self._due.popleft()[1]

    def clear(self) -> None:
        """Nothing is on its way any more."""
        self._held.clear()
        self._due.clear()

    def _chance(self, kind: FaultKind, at_s: float) -> bool:
        share = self._faults.value(kind, at_s)
        return share is not None and self._random.random() < share


_BY_CHANCE: Final = (FaultKind.DROP, FaultKind.CORRUPT, FaultKind.GARBAGE)


def _with_a_wrong_bit(packet: bytes, chance: random.Random) -> bytes:
    """``packet`` with one bit turned behind its count."""
    place = chance.randrange(3, len(packet))
    return packet[:place] + bytes([packet[place] ^ 1 << chance.randrange(8)]) + packet[place + 1 :]
