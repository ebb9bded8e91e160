"""Recordings whose process was killed, and what others read of them once they are repaired."""

import contextlib
import subprocess
import sys
import time
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from mcap.reader import make_reader
from rerun.chunk import McapReader as RerunReader

from sdt_tools.recording.container.reader import McapReader
from sdt_tools.recording.inspect import inspect_recording
from sdt_tools.recording.repair import repair_recording

SDT = Path(sys.executable).with_name("sdt")
COMMAND = [SDT, "record", "scene", "--scenario", "practice", "--realtime", "--no-camera", "--seconds", "600"]
START_S = 120.0
"""So long a process may take until its file grows, on a machine that does much else."""


@dataclass(frozen=True)
class Killed:
    """A recording that was killed: when, and the last log time that its file keeps."""

    path: Path
    killed_ns: int
    last_ns: int

    @property
    def lost_s(self) -> float:
        """What is lost before the kill, at most."""
        return (self.killed_ns - self.last_ns) / 1e9


def kill_a_recording(path: Path, seed: int) -> Killed:
    """Start a recording and kill it, with no chance to do anything, up to three seconds after its first scans."""
    after_s = np.random.default_rng(seed).uniform(0.0, 3.0)
    process = subprocess.Popen(
        [*COMMAND, "--seed", str(seed), "--out", path], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    try:
        _wait_for_scans(path, process)
        with contextlib.suppress(subprocess.TimeoutExpired):  # the moment is the point: any will do
            process.wait(after_s)
        killed_ns = time.time_ns()
    finally:
        process.kill()
        process.wait()
    with McapReader(path) as reader:
        last_ns = max(extent.last_ns for extent in reader.extents.values() if extent.last_ns is not None)
    return Killed(path, killed_ns, last_ns)


def _wait_for_scans(path: Path, process: "subprocess.Popen[bytes]") -> None:
    """Until the file has grown so far that a first message is in it."""
    deadline_s = time.monotonic() + START_S
    looked_at = 0
    while True:
        assert process.poll() is None, "the recording ended by itself"
        assert time.monotonic() < deadline_s, "nothing was recorded"
        size = path.stat().st_size if path.exists() else 0
        if size > looked_at:
            looked_at = size
            with McapReader(path) as reader:
                if reader.segments():
                    return
        time.sleep(0.005)


def check_that_it_is_saved(killed: Killed) -> int:
    """The file as it lies says what it holds, and once repaired others read the same; the number of messages."""
    report = inspect_recording(killed.path)
    assert report.truncated
    assert report.damage == ()
    before = killed.path.read_bytes()
    repaired = killed.path.with_suffix(".repaired.mcap")
    repair = repair_recording(killed.path, repaired)
    assert killed.path.read_bytes() == before
    assert repair.truncated
    assert {topic: summary.count for topic, summary in report.topics.items()} == dict(repair.messages)
    assert by_the_package(repaired) == Counter(repair.messages)
    assert by_rerun(repaired) == Counter(repair.messages)
    return report.messages


def by_the_package(path: Path) -> Counter[str]:
    with path.open("rb") as stream:
        return Counter(channel.topic for _, channel, _ in make_reader(stream, validate_crcs=True).iter_messages())


def by_rerun(path: Path) -> Counter[str]:
    rows: Counter[str] = Counter()
    for chunk in RerunReader(str(path), decoders=["raw"]).stream():
        if not chunk.is_static and not chunk.entity_path.startswith("/__"):
            rows[chunk.entity_path] += chunk.num_rows
    return rows
