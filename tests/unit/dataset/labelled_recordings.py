"""Small recordings with labels, written for tests."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import polars as pl

from sdt_tools.frames import RAYS, LidarScan, Received
from sdt_tools.labeling.journal import Journal
from sdt_tools.labeling.vocabulary import LabelKind, journal_path
from sdt_tools.protocols import SourceInfo
from sdt_tools.recording.writer import RecordingWriter

START_NS = 1_735_689_600_000_000_000
MS = 1_000_000
SCAN_PERIOD_NS = 20 * MS
CLASSES = LabelKind.MOTION.classes


def ranges_m(seed: int, scan: int) -> np.ndarray:
    """What scan number ``scan`` of the recording ``seed`` reads: two to nine metres in millimetres, some codes."""
    rng = np.random.default_rng([seed, scan])
    ranges = rng.integers(2000, 9000, RAYS) / 1000
    ranges[rng.integers(0, RAYS, 20)] = rng.choice([0.0, 0.002, 0.003], 20)
    return ranges


def make_recording(path: Path, seed: int, scans: int, scenario: str = "plain") -> Path:
    """A recording of ``scans`` scans at 50 Hz; its id follows from scenario and seed."""
    with RecordingWriter(path, SourceInfo("scene", scenario, seed), "") as writer:
        for scan in range(scans):
            stamp_ns = START_NS + scan * SCAN_PERIOD_NS
            writer.write(Received(stamp_ns, LidarScan(stamp_ns, ranges_m(seed, scan))))
    return path


def make_labels(recording: Path, recording_id: str, labels: Sequence[tuple[int, str]], source: str = "truth") -> Path:
    """A journal beside the recording, in ``labels``; ``labels`` are (stamp, label text)."""
    path = journal_path(recording.parent / "labels", recording.stem, LabelKind.MOTION)
    table = pl.DataFrame(labels, schema={"stamp_ns": pl.Int64, "label": pl.String}, orient="row")
    with Journal(path, recording_id) as journal:
        extra = {"labeler": "scene", "source": source}
        journal.append_table(table.with_columns(created_ns=0, **{name: pl.lit(text) for name, text in extra.items()}))
    return path


def make_labelled(folder: Path, seed: int, seconds: float = 6.0, scenario: str = "plain") -> Path:
    """A recording whose classes take turns of 0.6 s, labelled at 10 Hz."""
    scans = round(seconds * 50)
    path = make_recording(folder / f"r{seed}.mcap", seed, scans, scenario)
    every_fifth = range(0, scans, 5)
    labels = [(START_NS + scan * SCAN_PERIOD_NS, CLASSES[(seed + scan // 30) % 7]) for scan in every_fifth]
    make_labels(path, recording_id(path), labels)
    return path


def recording_id(path: Path) -> str:
    from sdt_tools.recording.reader import Recording

    with Recording.open(path) as recording:
        return recording.recording_id
