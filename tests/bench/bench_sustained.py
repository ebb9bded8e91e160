"""Recording in real time for minutes: what is dropped, and how much of a core it takes.

``SDT_SUSTAINED_S`` sets the seconds; without it, one minute. Pictures are prepared, so that no rendering counts; they
come raw, as from a camera, and the recording encodes them.
"""

import math
import os
import resource
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from pytest_benchmark.fixture import BenchmarkFixture

from sdt_tools.clock import SECOND_NS, HostClock
from sdt_tools.config import MotionConfig, RateConfig
from sdt_tools.frames import CameraImage, Gesture, LidarScan, MotionClass, Pose2D, RawPicture, Received, Twist
from sdt_tools.protocols import Observation, SourceInfo
from sdt_tools.recording.live.encoder import encode_jpeg
from sdt_tools.recording.live.record import record
from sdt_tools.recording.messages.topics import CAMERA_IMAGE, LIDAR_SCAN
from sdt_tools.recording.reader import Recording
from sdt_tools.recording.writer import RecordingWriter
from sdt_tools.scene.camera import SceneCamera
from sdt_tools.scene.scenario import layout_for

SECONDS = float(os.environ.get("SDT_SUSTAINED_S", "60"))
PICTURES = 30
BURST_IMAGES = (30, 100, 300, 1000)
RATES = RateConfig()


class PreparedSource:
    """Scans at 50 Hz and raw pictures at 30, by the host's time; ``burst`` more come at once, raw or encoded."""

    def __init__(
        self, clock: HostClock, pictures: np.ndarray, scans_m: np.ndarray, burst: int = 0, raw_burst: bool = False
    ) -> None:
        self.info = SourceInfo("bench")
        self.start_ns = clock.now_ns()
        self.finished = False
        self._pictures, self._scans_m, self._burst, self._raw_burst = pictures, scans_m, burst, raw_burst
        self._scans = self._images = 0

    def read(self, until_ns: int) -> Iterator[Received | RawPicture]:
        while (stamp_ns := self.start_ns + round(self._scans * SECOND_NS / RATES.scan_hz)) <= until_ns:
            self._scans += 1
            yield Received(stamp_ns, LidarScan(stamp_ns, self._scans_m[self._scans % len(self._scans_m)]))
        while (stamp_ns := self.start_ns + round(self._images * SECOND_NS / RATES.image_hz)) <= until_ns:
            self._images += 1
            yield self._image(stamp_ns)
        if self._burst and until_ns > self.start_ns + SECOND_NS:
            at_once = encode_jpeg(self._pictures[0])
            for n in range(self._burst):
                if self._raw_burst:
                    yield RawPicture(until_ns, until_ns + n, self._pictures[n % PICTURES])
                else:
                    yield Received(until_ns, CameraImage(until_ns + n, at_once))
            self._burst = 0

    def _image(self, stamp_ns: int) -> RawPicture:
        return RawPicture(stamp_ns, stamp_ns, self._pictures[self._images % PICTURES])

    def close(self) -> None:
        """Nothing is held."""


class Standing:
    name = "constant:stay"

    def decide(self, observation: Observation) -> MotionClass:
        return MotionClass.STAY

    def command(self, twist: Twist) -> None:
        """Nothing moves."""


@pytest.fixture(scope="module")
def prepared() -> tuple[np.ndarray, np.ndarray]:
    """Pictures of a room, [pictures, 480, 640, 3] BGR, and scans."""
    camera, robot = SceneCamera(layout_for("around_boxes", 7)), Pose2D(0.0, 0.0, 0.0)
    pictures = np.stack(
        [
            camera.render(robot, Pose2D(1.4, 0.02 * i, math.pi), 0.3 * i, 0.0, Gesture.IDLE, 0.0, i / RATES.image_hz, i)
            for i in range(PICTURES)
        ]
    )
    return pictures, np.random.default_rng(0).uniform(0.3, 8.0, (50, 541)).round(3)


def cpu_s() -> float:
    usage = resource.getrusage(resource.RUSAGE_SELF)
    return usage.ru_utime + usage.ru_stime


def record_prepared(
    path: Path, prepared: tuple[np.ndarray, np.ndarray], seconds: float, burst: int = 0, raw: bool = False
) -> dict[str, int]:
    clock, standing = HostClock(), Standing()
    source = PreparedSource(clock, *prepared, burst, raw)
    with RecordingWriter(path, source.info, "", start_ns=source.start_ns, realtime=True) as writer:
        summary = record(
            source, standing, standing, None, writer, (), RATES, MotionConfig(), seconds, realtime=True, clock=clock
        )
    return dict(summary.dropped) | {"missed": summary.missed_deadlines}


def test_minutes_without_a_drop(
    benchmark: BenchmarkFixture, tmp_path: Path, prepared: tuple[np.ndarray, np.ndarray]
) -> None:
    seconds = SECONDS if benchmark.enabled else 1.0
    before_s = cpu_s()
    lost = benchmark.pedantic(record_prepared, (tmp_path / "r.mcap", prepared, seconds), rounds=1)
    share = (cpu_s() - before_s) / seconds
    with Recording.open(tmp_path / "r.mcap") as recording:
        counts = {name: topic.count for name, topic in recording.topics.items()}
        assert not recording.truncated
    assert abs(counts[LIDAR_SCAN] - seconds * RATES.scan_hz) <= 1
    assert abs(counts[CAMERA_IMAGE] - seconds * RATES.image_hz) <= 1
    benchmark.extra_info |= {"seconds": seconds, "share_of_a_core": round(share, 3), **lost}
    assert sum(lost.values()) - lost["missed"] == 0


@pytest.mark.parametrize("raw", [False, True], ids=["encoded", "raw"])
@pytest.mark.parametrize("burst", BURST_IMAGES)
def test_a_burst_of_pictures(
    benchmark: BenchmarkFixture, tmp_path: Path, prepared: tuple[np.ndarray, np.ndarray], burst: int, raw: bool
) -> None:
    lost = benchmark.pedantic(record_prepared, (tmp_path / "r.mcap", prepared, 3.0, burst, raw), rounds=1)
    benchmark.extra_info |= {"burst": burst, **lost}
