"""Small drives with known geometry, and a model whose answers are known."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from sdt_tools.clock import FAST_EPOCH_NS
from sdt_tools.frames import (
    RAYS,
    LidarScan,
    Message,
    Mode,
    MotionClass,
    MotionCommand,
    Odometry,
    OperatorPose,
    Pose2D,
    Received,
    Twist,
)
from sdt_tools.labeling.auto import label_automatically
from sdt_tools.labeling.vocabulary import LabelKind, LabelSource
from sdt_tools.protocols import SourceInfo
from sdt_tools.recording.writer import RecordingWriter

PERIOD_NS = 20_000_000
SPEED_MPS = 0.5
YAW_RAD = 0.3
OPERATOR = Pose2D(4.0, 2.0, 0.0)
TURN_AT_M = 1.0


def nearest_m(number: int) -> float:
    """Distance of the object straight ahead at scan ``number``."""
    return round(1.6 - 0.01 * number, 3)


def expert(number: int) -> MotionClass:
    """The right motion at scan ``number``."""
    return MotionClass.FORWARD if nearest_m(number) >= TURN_AT_M else MotionClass.STAY


def messages(scans: int, seed: int) -> list[Message]:
    """A straight drive towards an object, with everything that the scene knows."""
    rng = np.random.default_rng(seed)
    everything: list[Message] = []
    for number in range(scans):
        stamp_ns = FAST_EPOCH_NS + number * PERIOD_NS
        ranges_m = np.full(RAYS, 3.0) + 0.001 * rng.integers(-20, 20, RAYS)
        ranges_m[260:281] = nearest_m(number)
        ranges_m[265] = 0.0  # a code among the nearest
        ranges_m[:2] = 0.002
        way_m = SPEED_MPS * number * PERIOD_NS * 1e-9
        pose = Pose2D(way_m * np.cos(YAW_RAD), way_m * np.sin(YAW_RAD), YAW_RAD)
        everything += [LidarScan(stamp_ns, ranges_m), Odometry(stamp_ns, pose), OperatorPose(stamp_ns, OPERATOR)]
        if number % 5 == 0:
            motion = expert(number)
            everything.append(MotionCommand(stamp_ns, motion, Twist(0.5, 0.0), "expert", Mode.ACTIVE, expert=motion))
    return everything


def write_drive(folder: Path, name: str, scans: int = 100, seed: int = 0, **notes: str) -> Path:
    """A drive of ``scans`` scans at 50 Hz, a command at every fifth."""
    return write(folder / f"{name}.mcap", messages(scans, seed), seed, **notes)


def write(path: Path, content: list[Message], seed: int = 0, **notes: str) -> Path:
    """``content`` as a recording."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with RecordingWriter(path, SourceInfo("scene", "plain", seed), "", notes=notes) as writer:
        for message in content:
            writer.write(Received(message.stamp_ns, message))
    return path


def label(path: Path, labels_dir: Path) -> None:
    """Label ``path`` with what the expert said."""
    label_automatically(path, LabelKind.MOTION, LabelSource.TRUTH, labels_dir)


@dataclass(frozen=True)
class NearestAhead:
    """Drives forward while nothing ahead is nearer than ``stops_at_m``; right on all drives with 1 m."""

    stops_at_m: float = TURN_AT_M
    name: str = "nearest"

    def predict_logits(self, ranges_m: np.ndarray) -> np.ndarray:
        """A logit of 2 for the answer, 0 for the others."""
        ahead = ranges_m[:, 270]
        logits = np.zeros((len(ranges_m), 7), np.float32)
        answer = np.where(ahead >= self.stops_at_m, MotionClass.FORWARD, MotionClass.STAY)
        logits[np.arange(len(ranges_m)), answer] = 2.0
        return logits
