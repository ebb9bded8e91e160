"""The labelled frames of a recording, known by stamp and label alone; the rest is read once the frames are chosen."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import polars as pl
from jaxtyping import Int64

from sdt_tools.dataset.choice import Pool
from sdt_tools.dataset.config import DatasetConfig
from sdt_tools.dataset.interventions import read_interventions, with_interventions
from sdt_tools.dataset.pictures import picture_stamps
from sdt_tools.labeling.acts import Acts
from sdt_tools.labeling.journal import read_journal
from sdt_tools.labeling.resolve import disagreements, resolve
from sdt_tools.labeling.vocabulary import LabelKind, journal_path
from sdt_tools.recording.incomplete import Incomplete, incomplete
from sdt_tools.recording.pairing import nearest_pairs
from sdt_tools.recording.reader import Recording
from sdt_tools.runs.unit import content_hash

SCANS_A_BATCH = 2048
MS_NS = 1_000_000


@dataclass(frozen=True, eq=False)
class LabelledRecording:
    """A recording, its journal, and its frames that have a label.

    ``pool`` holds the frames in order of time, ``positions`` where each stands among the recording's scans or pictures.
    """

    path: Path
    recording_id: str
    scenario: str
    sha256: str
    journal: Path | None
    """None where interventions alone label it."""
    journal_sha256: str
    pool: Pool
    positions: Int64[np.ndarray, "frames"]
    recorded: int
    """Its scans, or the pictures that can be read."""
    unreadable_ns: tuple[int, ...]
    """Stamps of pictures that no decoder reads: they are left out."""
    labels: int
    interventions: int
    """Motions that a person drove after taking over; 0 where they are not asked for."""
    disputed: int
    """Stamps without a label because humans disagree."""
    broken_lines: int
    """Journal lines that a crash broke off."""
    incomplete: Incomplete | None
    """What is missing of the recording, where it was cut off or is damaged."""

    @property
    def unmatched(self) -> int:
        """Labels without a scan or a readable picture near enough."""
        return self.labels - len(self.pool.stamps_ns)


def read_labelled(path: Path, labels_dir: Path, config: DatasetConfig) -> LabelledRecording:
    """Join the frames of the recording at ``path`` with its labels; only their stamps stay in memory.

    Raises RecordingError or LabelError where either cannot be read.
    """
    kind = LabelKind(config.kind)
    journal = None if config.interventions == "only" else journal_path(labels_dir, path.stem, kind)
    with Recording.open(path) as recording:
        recording_id = recording.recording_id
        scenario = recording.session.get("scenario", "")
        acts = None if journal is None else read_journal(journal, recording_id)
        interventions = read_interventions(recording) if config.interventions != "none" else None
        frame_stamps_ns, unreadable_ns = _stamps(recording, kind)
        missing = incomplete(recording)
    disputed = None if acts is None else disagreements(acts)
    labels = _labels(acts, interventions, disputed)
    by_time = np.argsort(frame_stamps_ns, kind="stable")
    pairs = nearest_pairs(labels["stamp_ns"].to_numpy(), frame_stamps_ns[by_time], round(config.tolerance_ms * MS_NS))
    in_time = pairs[np.argsort(pairs[:, 1])]
    index = {name: place for place, name in enumerate(kind.classes)}
    codes = labels["label"].replace_strict(index, return_dtype=pl.Int64).to_numpy()
    positions = by_time[in_time[:, 1]]
    return LabelledRecording(
        path=path,
        recording_id=recording_id,
        scenario=scenario,
        sha256=content_hash(path),
        journal=journal,
        journal_sha256="" if journal is None else content_hash(journal),
        pool=Pool(frame_stamps_ns[positions], codes[in_time[:, 0]]),
        positions=positions,
        recorded=len(frame_stamps_ns),
        unreadable_ns=unreadable_ns,
        labels=len(labels),
        interventions=0 if interventions is None else len(interventions),
        disputed=0 if disputed is None else disputed["stamp_ns"].n_unique(),
        broken_lines=0 if acts is None else len(acts.broken_lines),
        incomplete=missing,
    )


def _stamps(recording: Recording, kind: LabelKind) -> tuple[Int64[np.ndarray, "frames"], tuple[int, ...]]:
    """When each frame of that kind was taken, as they follow in the file, and the stamps of unreadable ones."""
    if kind is LabelKind.GESTURE:
        return picture_stamps(recording)
    batches = [batch.stamps_ns.copy() for batch in recording.scan_batches(SCANS_A_BATCH)]
    return np.concatenate(batches) if batches else np.empty(0, dtype=np.int64), ()


def _labels(acts: Acts | None, interventions: pl.DataFrame | None, disputed: pl.DataFrame | None) -> pl.DataFrame:
    """Columns stamp_ns, ascending, and label: from the journal, the interventions, or both."""
    if acts is None or disputed is None:
        assert interventions is not None
        return interventions
    labels = resolve(acts)
    return labels if interventions is None else with_interventions(labels, interventions, disputed)
