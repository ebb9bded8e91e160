"""What a device's thread has received, until somebody reads it."""

import threading
from collections import deque

from sdt_tools.frames import RawPicture, Received


class Arrivals:
    """A queue from one thread to another that holds at most ``room`` and drops its oldest, counted in ``dropped``."""

    def __init__(self, room: int) -> None:
        self.dropped = 0
        self._room = room
        self._queue: deque[Received | RawPicture] = deque()
        self._lock = threading.Lock()

    def put(self, received: Received | RawPicture) -> None:
        """Keep ``received``."""
        with self._lock:
            self._queue.append(received)
            if len(self._queue) > self._room:
                self._queue.popleft()
                self.dropped += 1

    def take(self, until_ns: int) -> list[Received | RawPicture]:
        """What was received up to ``until_ns`` (inclusive) and not taken before, in order of arrival."""
        taken: list[Received | RawPicture] = []
        with self._lock:
            while self._queue and self._queue[0].received_ns <= until_ns:
                taken.append(self._queue.popleft())
        return taken
