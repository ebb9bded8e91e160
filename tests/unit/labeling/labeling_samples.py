"""Recordings and journals to label, made in a moment."""

import io
from pathlib import Path

import numpy as np
import polars as pl
from PIL import Image

from sdt_tools.frames import CameraImage, LidarScan, MotionClass, MotionCommand, Received, Twist, ray_angles_rad
from sdt_tools.labeling.journal import Journal
from sdt_tools.labeling.vocabulary import LabelKind, LabelSource, journal_path
from sdt_tools.protocols import SourceInfo
from sdt_tools.recording.reader import Recording
from sdt_tools.recording.writer import RecordingWriter

START_NS = 1_735_689_600_000_000_000
STEP_NS = 20_000_000


def stamp_ns(row: int) -> int:
    return START_NS + row * STEP_NS


def room(row: int) -> np.ndarray:
    """A room of 6 m by 5 m, and somebody who walks about in it a metre ahead."""
    angles = ray_angles_rad()
    walls = np.minimum(3.0 / np.maximum(np.abs(np.cos(angles)), 1e-6), 2.5 / np.maximum(np.abs(np.sin(angles)), 1e-6))
    bearing = 0.6 * np.sin(row / 12)
    legs = np.minimum(np.abs(angles - bearing - 0.09), np.abs(angles - bearing + 0.09)) < 0.05
    return np.round(np.where(legs, 1.05, walls), 3)


def picture(row: int) -> bytes:
    pixels = np.zeros((48, 64, 3), np.uint8)
    pixels[:24], pixels[24:] = (150, 160, 180), (110, 60, 40)
    left = 28 + round(20 * -np.sin(row / 12))
    pixels[8:44, left : left + 8] = (40, 70, 40)
    stream = io.BytesIO()
    Image.fromarray(pixels).save(stream, "JPEG", quality=90)
    return stream.getvalue()


def record(path: Path, frames: int = 100, *, scans: bool = True, camera: bool = True, commands: bool = False) -> Path:
    """Scans at 50 Hz, pictures at 25 Hz, commands at 10 Hz."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with RecordingWriter(path, SourceInfo("scene", path.stem, 7), "") as writer:
        for row in range(frames):
            at_ns = stamp_ns(row)
            if scans:
                writer.write(Received(at_ns, LidarScan(at_ns, room(row))))
            if camera and row % 2 == 0:
                writer.write(Received(at_ns, CameraImage(at_ns, picture(row))))
            if commands and row % 5 == 0:
                motion = MotionClass.FORWARD if row < frames // 2 else MotionClass.STAY
                command = MotionCommand(at_ns, motion, Twist(0.0, 0.0), "expert", expert=motion)
                writer.write(Received(at_ns, command))
        return path


def say(
    labels_dir: Path,
    recording: Path,
    labeler: str,
    rows: range,
    label: str,
    source: LabelSource = LabelSource.HUMAN,
    kind: LabelKind = LabelKind.MOTION,
) -> None:
    """One row an act, as somebody at another desk writes them."""
    with Recording.open(recording) as opened:
        recording_id = opened.recording_id
    with Journal(journal_path(labels_dir, recording.stem, kind), recording_id) as journal:
        said = {
            "stamp_ns": [stamp_ns(row) for row in rows],
            "label": [label] * len(rows),
            "labeler": [labeler] * len(rows),
            "source": [str(source)] * len(rows),
            "created_ns": [START_NS + journal.last_act + number for number in range(len(rows))],
        }
        journal.append_table(pl.DataFrame(said))
