"""A recording on a real filesystem that fills up: said in one line, the file whole, nothing else touched."""

import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from killed_recordings import by_the_package

from sdt_tools.clock import FAST_EPOCH_NS
from sdt_tools.errors import DiskRefusedError
from sdt_tools.frames import CameraImage, Received
from sdt_tools.protocols import SourceInfo
from sdt_tools.recording.reader import Recording
from sdt_tools.recording.repair import repair_recording
from sdt_tools.recording.writer import RecordingWriter

SDT = Path(sys.executable).with_name("sdt")
ROOM_KB = 12 << 10


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    """A filesystem of twelve megabytes with another's file on it; only root can make one."""
    disk = tmp_path / "disk"
    disk.mkdir()
    command = ["mount", "-t", "tmpfs", "-o", f"size={ROOM_KB}k", "tmpfs", disk]
    if os.geteuid() != 0 or subprocess.run(command, capture_output=True, check=False).returncode:
        pytest.skip("no filesystem can be mounted here; the limit on a file's size is tested with the writer")
    (disk / "mine.txt").write_text("mine")
    yield disk
    subprocess.run(["umount", disk], check=True)


def record_beside(disk: Path, filler_kb: int, *options: str) -> subprocess.CompletedProcess[str]:
    """Record to a disk that somebody else's file has nearly filled; nothing but the recording may change there."""
    (disk / "filler").write_bytes(bytes(filler_kb << 10))
    command = [SDT, "record", "scene", "--scenario", "practice", *options, "--out", disk / "r.mcap"]
    ran = subprocess.run(command, capture_output=True, text=True, check=False, timeout=300)
    assert "Traceback" not in ran.stderr
    assert sorted(path.name for path in disk.iterdir()) == ["filler", "mine.txt", "r.mcap"]
    assert (disk / "mine.txt").read_text() == "mine"
    return ran


def assert_whole(path: Path) -> None:
    with Recording.open(path) as recording:
        assert not recording.truncated
        assert recording.damage == ()
        counts = {topic: summary.count for topic, summary in recording.topics.items()}
    read = by_the_package(path)
    assert read.total() > 0
    assert {topic: count for topic, count in counts.items() if count} == dict(read)


def test_a_recording_that_fills_the_disk(small_disk: Path) -> None:
    ran = record_beside(small_disk, (10 << 10) + 1400, "--no-camera", "--seconds", "60")
    assert ran.returncode == 2
    said = [line for line in ran.stderr.splitlines() if "r.mcap" in line and "cannot be written after" in line]
    assert len(said) == 1
    assert "No space left on device; make room on that disk or record elsewhere" in " ".join(ran.stderr.split())
    assert_whole(small_disk / "r.mcap")


def test_in_real_time_a_recording_ends_before_the_disk_is_full(small_disk: Path) -> None:
    ran = record_beside(small_disk, 6 << 10, "--realtime", "--seconds", "30")
    assert ran.returncode == 1
    assert "its disk is nearly full" in " ".join(ran.stderr.split())
    assert_whole(small_disk / "r.mcap")


def test_a_repair_that_fills_the_disk_leaves_nothing(small_disk: Path, tmp_path: Path) -> None:
    path, out = tmp_path / "r.mcap", small_disk / "new.mcap"
    picture = np.random.default_rng(0).bytes(100_000)
    with RecordingWriter(path, SourceInfo("scene", "plain", 0), "") as writer:
        for number in range(160):
            stamp_ns = FAST_EPOCH_NS + number
            writer.write(Received(stamp_ns, CameraImage(stamp_ns, picture)))
    with pytest.raises(DiskRefusedError, match="No space left on device"):
        repair_recording(path, out)
    assert [entry.name for entry in small_disk.iterdir()] == ["mine.txt"]
