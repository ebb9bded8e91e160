"""The labeling app: how soon a recording of a gigabyte is open, and how long a key takes until the screen is drawn."""

import os
import select
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from labeling_rig import frame_shown
from pytest_benchmark.fixture import BenchmarkFixture
from terminal_rig import QUIT, RIGHT, start_sdt

from sdt_tools.clock import FAST_EPOCH_NS
from sdt_tools.frames import RAYS, CameraImage, LidarScan, Received
from sdt_tools.labeling.app.desk import Desk, Task
from sdt_tools.labeling.vocabulary import LabelKind
from sdt_tools.protocols import SourceInfo
from sdt_tools.recording.messages.topics import LIDAR_SCAN
from sdt_tools.recording.reader import Recording
from sdt_tools.recording.writer import RecordingWriter

PERIOD_NS = 20_000_000
SMALL_BYTES = 2_000_000
JPEG = Path(__file__).parents[2] / "recordings" / "sample_plain.mcap"
SCREEN_BYTES = 60_000_000
KEYS = 200


def drive(size_bytes: int, path: Path) -> Path:
    """Scans at 50 Hz and real pictures at 25 Hz."""
    rng = np.random.default_rng(0)
    with Recording.open(JPEG) as sample:
        pictures = [received.message for received in sample.messages(["/camera/image"])]
    with RecordingWriter(path, SourceInfo("scene", "bench", 0), "") as writer:
        row = 0
        while writer.size < size_bytes:
            stamp_ns = FAST_EPOCH_NS + row * PERIOD_NS
            ranges_m = np.round(np.clip(2.0 + np.cumsum(rng.normal(0.0, 0.01, RAYS)), 0.05, 20.0), 3)
            writer.write(Received(stamp_ns, LidarScan(stamp_ns, ranges_m)))
            picture = pictures[row % len(pictures)]
            if row % 2 and isinstance(picture, CameraImage):
                writer.write(Received(stamp_ns, CameraImage(stamp_ns, picture.data, picture.format)))
            row += 1
    return path


@pytest.fixture
def large(tmp_path: Path, benchmark: BenchmarkFixture) -> Iterator[Path]:
    yield drive((1 << 30) if benchmark.enabled else SMALL_BYTES, tmp_path / "large.mcap")
    (tmp_path / "large.mcap").unlink()


def test_opening_a_recording_of_a_gigabyte(benchmark: BenchmarkFixture, large: Path, tmp_path: Path) -> None:
    task = Task(large, LabelKind.MOTION, tmp_path / "labels", "anna")

    def opened() -> int:
        with Desk(task) as desk:
            middle_ns = int(desk.opened.labels.stamps_ns[len(desk.opened.labels) // 2])
            assert desk.scan_at(middle_ns) is not None
            assert desk.image_at(middle_ns) is not None
            return len(desk.opened.labels)

    frames = benchmark.pedantic(opened, rounds=5, warmup_rounds=1)
    started = time.perf_counter()
    with Recording.open(large) as recording:
        streamed = sum(1 for _ in recording.messages([LIDAR_SCAN]))
    assert streamed == frames
    if benchmark.stats is not None:
        scans_s = time.perf_counter() - started
        benchmark.extra_info |= {
            "frames": frames,
            "times_faster_than_reading_scans": round(scans_s / benchmark.stats["median"], 1),
        }


@pytest.mark.parametrize(("columns", "lines"), [(80, 24), (120, 40), (160, 50)])
def test_a_key_until_the_terminal_shows_it(
    benchmark: BenchmarkFixture, tmp_path: Path, columns: int, lines: int
) -> None:
    """A step that carries a label forward, from the key's byte to the byte that shows the new frame's number.

    In between it is written and synced, and every view is drawn anew. Beside it the processor time that the app takes
    a key, which other programs on the machine do not lengthen.
    """
    path = drive(SCREEN_BYTES if benchmark.enabled else SMALL_BYTES, tmp_path / "drive.mcap")
    keys = KEYS if benchmark.enabled else 3
    with Recording.open(path) as recording:
        frames = len(recording.frames(LIDAR_SCAN))
    terminal = start_sdt("label", "edit", path, "--labels", tmp_path, "--labeler", "anna", columns=columns, lines=lines)
    terminal.wait_for("? keys")
    terminal.press("f2")
    terminal.wait_for("CARRY")

    def processor_s() -> float:
        fields = Path(f"/proc/{terminal.process.pid}/stat").read_text().rpartition(")")[2].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")

    def step_through() -> list[float]:
        took_s = []
        for row in range(2, 2 + keys):
            terminal.shown = b""
            begin_s = time.perf_counter()
            terminal.press(RIGHT)
            while frame_shown(terminal, frames) != row:
                select.select([terminal.master], [], [], 1.0)
            took_s.append(time.perf_counter() - begin_s)
        return took_s

    before_s = processor_s()
    took_s = benchmark.pedantic(step_through, rounds=1)
    used_s = processor_s() - before_s
    terminal.press(QUIT)
    assert terminal.end() == 0
    if benchmark.stats is not None:
        low, middle, high = (round(1000 * float(np.quantile(took_s, share)), 1) for share in (0.05, 0.5, 0.95))
        benchmark.extra_info |= {"ms_a_key": middle, "ms_5_percent": low, "ms_95_percent": high}
        benchmark.extra_info |= {"processor_ms_a_key": round(1000 * used_s / keys, 1)}
