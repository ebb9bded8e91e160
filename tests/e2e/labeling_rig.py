"""Recordings to label, what a journal holds, and which frame the labeling app shows."""

import re
from pathlib import Path

import numpy as np
from terminal_rig import Terminal

from sdt_tools.frames import RAYS, CameraImage, LidarScan, Received
from sdt_tools.labeling.journal import read_journal
from sdt_tools.protocols import SourceInfo
from sdt_tools.recording.writer import RecordingWriter

START_NS = 1_735_689_600_000_000_000
STEP_NS = 20_000_000


def record(path: Path, frames: int) -> Path:
    with RecordingWriter(path, SourceInfo("scene", path.stem, 7), "") as writer:
        for row in range(frames):
            at_ns = START_NS + row * STEP_NS
            writer.write(Received(at_ns, LidarScan(at_ns, np.full(RAYS, 1.0 + row % 7 / 10))))
            if row % 2:
                writer.write(Received(at_ns, CameraImage(at_ns, b"no jpeg")))
    return path


def rows_labelled(journal: Path, labeler: str) -> list[int]:
    """The frames that somebody has acted on, in the order of the acts."""
    if not journal.exists():
        return []
    table = read_journal(journal).table
    mine = table.filter(table["labeler"] == labeler)
    return [(stamp_ns - START_NS) // STEP_NS for stamp_ns in mine["stamp_ns"].to_list()]


def frame_shown(terminal: Terminal, frames: int) -> int:
    """The number, from 1, of the frame that the heading named last."""
    found = re.findall(rf"([\d,]+)/{frames:,}\b", terminal.look())
    return int(found[-1].replace(",", "")) if found else 0
