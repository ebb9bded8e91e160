"""What goes out to one client, with the faults of the way."""

import socket
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from random import Random
from threading import Condition, Event, Thread
from time import monotonic, sleep
from typing import Final

from sdt_tools.emulation.lms1xx.faults import Faults

_MOST_WAITING: Final = 200
"""A client that does not read loses scans, as with the device, whose memory is small."""
_PIECE_PAUSE_S: Final = 0.0002
"""So that the pieces of a telegram are not put together again on their way."""


@dataclass(frozen=True)
class _Frame:
    due_s: float
    data: bytes
    is_scan: bool


class Wire:
    """Sends frames to one client in their order, late, in pieces or together as ``faults`` says at the time."""

    def __init__(self, client: socket.socket, faults: Callable[[], Faults], unplugged: Event, seed: int) -> None:
        self.lost = 0
        """Scans that a client who did not read has lost."""
        self._client = client
        self._faults = faults
        self._unplugged = unplugged
        self._random = Random(seed)
        self._waiting: deque[_Frame] = deque()
        self._changed = Condition()
        self._closed = False
        self._last_due_s = 0.0
        self._thread = Thread(target=self._run, name="lms1xx-wire", daemon=True)
        self._thread.start()

    def put(self, data: bytes, is_scan: bool) -> None:
        """Send ``data``, a frame or what is to look like one, when its time has come."""
        faults = self._faults()
        late_s = (faults.delay_ms + faults.jitter_ms * self._random.random()) / 1e3
        with self._changed:
            if len(self._waiting) >= _MOST_WAITING:
                self.lost += 1
                return
            self._last_due_s = max(monotonic() + late_s, self._last_due_s)
            self._waiting.append(_Frame(self._last_due_s, data, is_scan))
            self._changed.notify()

    def close(self) -> None:
        """Send nothing more."""
        with self._changed:
            self._closed = True
            self._changed.notify()
        with suppress(OSError):
            self._client.shutdown(socket.SHUT_RDWR)
        self._thread.join()

    def _run(self) -> None:
        with suppress(OSError):
            while (data := self._next()) is not None:
                self._send(data)

    def _next(self) -> bytes | None:
        """What is to be sent at once, when that may be; None when all is over."""
        with self._changed:
            while not self._closed:
                wait_s = self._wait_s()
                if wait_s is not None and wait_s <= 0 and not self._unplugged.is_set():
                    return self._take()
                self._changed.wait(0.05 if self._unplugged.is_set() else wait_s)
        return None

    def _wait_s(self) -> float | None:
        """How long until something is due; None where nothing is waiting, or too few to be merged."""
        scans = 0
        for frame in self._waiting:
            scans += frame.is_scan
            if not frame.is_scan or scans >= self._faults().merge:
                return frame.due_s - monotonic()
        return None

    def _take(self) -> bytes:
        scans, taken = 0, bytearray()
        while self._waiting:
            frame = self._waiting.popleft()
            taken += frame.data
            scans += frame.is_scan
            if not frame.is_scan or scans >= self._faults().merge:
                break
        return bytes(taken)

    def _send(self, data: bytes) -> None:
        size = self._faults().split_bytes or len(data)
        for start in range(0, len(data), size):
            if start:
                sleep(_PIECE_PAUSE_S)
            self._client.sendall(data[start : start + size])
