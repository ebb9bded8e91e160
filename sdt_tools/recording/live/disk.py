"""How long the disk has room for a recording."""

import shutil
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from sdt_tools.clock import SECOND_NS

WARNING_S: Final = 300.0
_LOOK_NS: Final = SECOND_NS
_WINDOW_NS: Final = 10 * SECOND_NS
_KNOWN_NS: Final = 2 * SECOND_NS
"""A rate over less is no rate yet."""
_RESERVE_BYTES: Final = 4 << 20
_RESERVE_S: Final = 3.0
"""What comes while a recording is being stopped."""


def free_bytes(path: Path) -> int:
    """What is free for this user on the disk that holds ``path``."""
    return shutil.disk_usage(path.parent).free


@dataclass(frozen=True)
class DiskSpace:
    """What was seen: bytes free, how long they last at the rate of the last seconds, and whether to stop now."""

    free_bytes: int
    left_s: float | None
    full: bool

    @property
    def low(self) -> bool:
        """Whether a warning is due."""
        return self.full or (self.left_s is not None and self.left_s < WARNING_S)


def disk_words(left_s: float) -> str:
    """How long the disk lasts, as in ``disk 3.2 h``; loud where that is not long."""
    if left_s >= 24 * 3600:
        return "disk > 1 day"
    if left_s < WARNING_S:
        return f"DISK FULL IN {left_s / 60:.1f} min"
    return f"disk {left_s / 3600:.1f} h" if left_s >= 3600 else f"disk {left_s / 60:.0f} min"


@dataclass(frozen=True)
class _Look:
    at_ns: int
    size_bytes: int
    free_bytes: int


class DiskWatch:
    """Looks once a second at the disk that ``path`` lies on.

    The rate is that of the file, or that at which free space goes down where this is faster: others write too. Room is
    kept for the end of the file, for what waits in memory, for three seconds at the rate, and 4 MiB.
    """

    def __init__(
        self,
        path: Path,
        free: Callable[[Path], int] = free_bytes,
        monotonic_ns: Callable[[], int] = time.monotonic_ns,
    ) -> None:
        self.space: DiskSpace | None = None
        self._path = path
        self._free = free
        self._monotonic_ns = monotonic_ns
        self._looks: deque[_Look] = deque()

    def look(self, size_bytes: int, owed_bytes: int) -> None:
        """Renew ``space`` where a second has passed: the file has ``size_bytes``, its end needs ``owed_bytes``."""
        now_ns = self._monotonic_ns()
        looks = self._looks
        if looks and now_ns - looks[-1].at_ns < _LOOK_NS:
            return
        try:
            now = _Look(now_ns, size_bytes, self._free(self._path))
        except OSError:
            return  # a disk that cannot be asked will say no to what is written, and that is heard
        looks.append(now)
        while now_ns - looks[0].at_ns > _WINDOW_NS:
            looks.popleft()
        rate = _bytes_a_second(looks[0], now)
        reserve = owed_bytes + _RESERVE_BYTES + round(_RESERVE_S * (rate or 0.0))
        left_s = max(now.free_bytes - reserve, 0) / rate if rate else None
        self.space = DiskSpace(now.free_bytes, left_s, now.free_bytes < reserve)


def _bytes_a_second(first: _Look, last: _Look) -> float | None:
    """The faster of the file's growth and the disk's shrinking; None where neither is known or goes on."""
    if last.at_ns - first.at_ns < _KNOWN_NS:
        return None
    gone = max(last.size_bytes - first.size_bytes, first.free_bytes - last.free_bytes)
    return gone * SECOND_NS / (last.at_ns - first.at_ns) if gone > 0 else None
