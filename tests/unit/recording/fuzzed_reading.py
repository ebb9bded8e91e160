"""Reads files that are named on its standard input, in little memory: what each gives, or the error, one line each.

A process of its own, so that its address space can be bounded, and that a crash or a hang of it is seen.
"""

import json
import logging
import resource
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

from sdt_tools.errors import SdtError
from sdt_tools.recording.inspect import inspect_recording
from sdt_tools.recording.reader import Recording
from sdt_tools.recording.repair import repair_recording


def inspect(path: Path) -> int:
    return inspect_recording(path).messages


def scans(path: Path) -> int:
    with Recording.open(path) as recording:
        return len(recording.scans())


def messages(path: Path) -> int:
    with Recording.open(path) as recording:
        return sum(1 for _ in recording.messages())


def interval(path: Path) -> int:
    with Recording.open(path) as recording:
        return sum(1 for _ in recording.messages(None, 0, 1 << 61))


def repair(path: Path) -> int:
    with tempfile.TemporaryDirectory(dir=path.parent) as folder:
        return sum(repair_recording(path, Path(folder) / "new.mcap").messages.values())


def outcome(read: Callable[[Path], int], path: Path) -> int | str:
    try:
        return read(path)
    except SdtError as error:
        return str(error)


def address_space_bytes() -> int:
    return int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()


def say(line: str) -> None:
    sys.stdout.write(f"{line}\n")
    sys.stdout.flush()


def main(room_bytes: int) -> None:
    logging.disable(logging.CRITICAL)
    warm, *_ = sys.stdin.readline().split("\n")
    for read in (inspect, scans, messages, interval, repair):  # what is imported and compiled is not the reader's
        outcome(read, Path(warm))
    limit = address_space_bytes() + room_bytes
    resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
    say("ready")
    for line in sys.stdin:
        path = Path(line.rstrip("\n"))
        say(json.dumps([outcome(read, path) for read in (inspect, scans, messages, interval, repair)]))


if __name__ == "__main__":
    main(int(sys.argv[1]))
