"""What this computer is, its clock, its disk and its terminal."""

import ctypes
import os
import platform
import shutil
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from time import perf_counter
from typing import Final

from sdt_tools.doctor.finding import Finding, fail, ok, warn

_CORES: Final = 2
_MEMORY_GB: Final = 3.0
_STA_UNSYNC: Final = 0x40
_TIMEX_BYTES: Final = 256
"""struct timex is 208 bytes long; after ``modes`` come offset, freq, maxerror, esterror and status (adjtimex(2))."""
_BLOCK: Final = 1 << 20
_BLOCKS: Final = 8
_SESSION_MB_S: Final = 3.0
"""Scans at 50 Hz and pictures of 640 × 480 at 30 Hz, with room to spare."""
_SLOW_FSYNC_S: Final = 0.5
_LITTLE_HOURS: Final = 1.0


def machine() -> Iterator[Finding]:
    """System, cores, memory."""
    python = platform.python_version()
    yield ok("system", "python", f"{python} ({sys.executable})")
    yield ok("system", "platform", f"{platform.system()} {platform.release()}, {platform.machine()}")
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    load = os.getloadavg()[0]
    seen = f"{cores} to use, {load:.1f} busy in the last minute"
    if cores < _CORES:
        yield warn("system", "cores", seen, "camera and network share one; record without other work beside it")
    elif load > 1.5 * cores:
        yield warn("system", "cores", seen, "end other work before you record or drive")
    else:
        yield ok("system", "cores", seen)
    yield _memory()


def _memory() -> Finding:
    try:
        lines = Path("/proc/meminfo").read_text(encoding="ascii").splitlines()
        kilobytes = {line.split(":")[0]: int(line.split()[1]) for line in lines}
        total_gb, free_gb = (kilobytes[name] / 1e6 for name in ("MemTotal", "MemAvailable"))
    except (OSError, KeyError, ValueError, IndexError):
        return warn("system", "memory", "this system does not tell", "look that some gigabytes are free")
    seen = f"{free_gb:.1f} of {total_gb:.1f} GB free"
    return (
        ok("system", "memory", seen) if free_gb > _MEMORY_GB else warn("system", "memory", seen, "end other programs")
    )


def clock() -> Iterator[Finding]:
    """Whether the host's clock is kept in step with the world's."""
    try:
        buffer = ctypes.create_string_buffer(_TIMEX_BYTES)  # all zero: modes 0 asks, and sets nothing
        ctypes.CDLL(None, use_errno=True).adjtimex(buffer)
        max_error_us = ctypes.c_long.from_buffer(buffer, 3 * ctypes.sizeof(ctypes.c_long)).value
        status = ctypes.c_int.from_buffer(buffer, 5 * ctypes.sizeof(ctypes.c_long)).value
    except (OSError, AttributeError):
        yield warn("clock", "host", "this system does not tell whether it is synchronised", "look at its time settings")
        return
    if status & _STA_UNSYNC:
        yield warn(
            "clock",
            "host",
            "not synchronised with a time server",
            "stamps of two computers do not compare; switch NTP on (timedatectl set-ntp true)",
        )
    else:
        yield ok("clock", "host", f"synchronised, at most {max_error_us / 1e3:.0f} ms off")


def disk(folder: Path) -> Iterator[Finding]:
    """Room and speed where recordings land; what is written is removed again."""
    there = next(one for one in (folder, *folder.absolute().parents) if one.is_dir())
    what = str(folder)
    free_mb = shutil.disk_usage(there).free / 1e6
    hours = free_mb / _SESSION_MB_S / 3600
    seen = f"{free_mb / 1e3:.1f} GB free, {hours:.1f} h of recording"
    if hours < _LITTLE_HOURS:
        yield fail("disk", f"{what}, room", seen, "make room, or record to another disk (--out)")
    else:
        yield ok("disk", f"{what}, room", seen)
    try:
        speed_mb_s, longest_s = _write_speed(there)
    except OSError as error:
        yield fail(
            "disk", f"{what}, writing", f"{error.strerror}", "check rights and mount, or record elsewhere (--out)"
        )
        return
    seen = f"{speed_mb_s:.0f} MB/s with fsync, the longest {longest_s * 1e3:.0f} ms"
    if speed_mb_s < _SESSION_MB_S:
        yield fail("disk", f"{what}, writing", seen, f"a session needs {_SESSION_MB_S:g} MB/s; record to another disk")
    elif speed_mb_s < 3 * _SESSION_MB_S or longest_s > _SLOW_FSYNC_S:
        yield warn("disk", f"{what}, writing", seen, "record to another disk, or end what uses this one")
    else:
        yield ok("disk", f"{what}, writing", seen)


def _write_speed(folder: Path) -> tuple[float, float]:
    """Megabytes a second, each one fsync'ed, and the longest of these."""
    block, took_s = os.urandom(_BLOCK), []
    with tempfile.TemporaryFile(dir=folder, prefix=".sdt-doctor-") as file:
        for _ in range(_BLOCKS):
            began_s = perf_counter()
            file.write(block)
            file.flush()
            os.fsync(file.fileno())
            took_s.append(perf_counter() - began_s)
            if sum(took_s) > 2.0:
                break
    return len(took_s) * _BLOCK / 1e6 / sum(took_s), max(took_s)


def terminal() -> Iterator[Finding]:
    """Whether the cockpit and the labeling app find room and colours."""
    from rich.console import Console

    stream = sys.__stderr__ or sys.stderr  # a spinner may stand in for the other
    if not stream.isatty():
        yield ok(
            "terminal", "none", "this output goes to a file or a pipe; run it in a terminal to have that looked at"
        )
        return
    size = os.get_terminal_size(stream.fileno())
    seen = f"{size.columns} × {size.lines}, {os.environ.get('TERM', 'no TERM')}"
    if size.columns < 80 or size.lines < 24:
        yield warn("terminal", "size", seen, "cockpit and labeling need 80 × 24; enlarge it")
    else:
        yield ok("terminal", "size", seen)
    colors = Console(file=stream).color_system
    if colors in ("256", "truecolor"):
        yield ok("terminal", "colours", colors)
    else:
        yield warn("terminal", "colours", colors or "none", "set COLORTERM=truecolor, or use another terminal")
    encoding = stream.encoding.lower()
    if "utf" in encoding:
        yield ok("terminal", "characters", encoding)
    else:
        yield warn("terminal", "characters", encoding, "scans are drawn in Unicode; set LANG=C.UTF-8")
