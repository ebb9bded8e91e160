"""Recordings and their journals, made into a data set.

Labels decide first which frames are taken; then the scans or pictures of those are read, recording by recording, so
that memory holds stamps and one row group of frames, never a whole recording.
"""

import os
import shutil
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Final

import numpy as np
from jaxtyping import Bool, Float64, Int64

from sdt_tools.dataset.candidates import SCANS_A_BATCH, LabelledRecording, read_labelled
from sdt_tools.dataset.config import DatasetConfig
from sdt_tools.dataset.frames_file import (
    FRAMES_FILE,
    PICTURE_SCHEMA,
    SCHEMA,
    FrameBlock,
    FramesWriter,
    Pictures,
    Ranges,
)
from sdt_tools.dataset.manifest import MANIFEST_FILE, Conflict, Used, manifest_toml
from sdt_tools.dataset.pictures import picture_bytes
from sdt_tools.dataset.select import TRAIN, VAL, Selection, select_frames
from sdt_tools.errors import DatasetError, OutputExistsError
from sdt_tools.labeling.vocabulary import LabelKind
from sdt_tools.recording.incomplete import Incomplete
from sdt_tools.recording.reader import Recording
from sdt_tools.runs.local import Progress

CONFLICTS_SHOWN: Final = 3

ConflictCheck = Callable[[Float64[np.ndarray, "frames rays"], Int64[np.ndarray, "frames"]], Bool[np.ndarray, "frames"]]
"""Given ranges as the sensor gave them and labels, which frames carry a label that a safety domain forbids."""


@dataclass(frozen=True)
class DatasetSummary:
    """What was built. ``counts`` is by split and class name."""

    folder: Path
    hash: str
    recordings: int
    train_frames: int
    val_frames: int
    counts: dict[str, dict[str, int]]
    conflicts: int | None
    """Frames in a safety domain with a forbidden label; None where they were not looked for."""
    interventions: int
    """Motions that people drove after taking over, among the labels; 0 where they are not asked for."""
    unmatched_labels: int
    """Labels without a scan or a readable picture near enough."""
    unreadable: dict[str, tuple[int, ...]]
    """Stamps of the pictures that no decoder reads, by recording; they are left out."""
    disputed_stamps: int
    """Stamps left out because humans disagree about them."""
    broken_lines: int
    """Journal lines that crashes broke off."""
    incomplete: tuple[Incomplete, ...]
    """Recordings that were cut off or damaged, and read as far as they go."""


def build_dataset(
    recordings: Sequence[Path],
    labels_dir: Path,
    config: DatasetConfig,
    out: Path,
    conflict_check: ConflictCheck | None = None,
    progress: Progress | None = None,
    validation: Sequence[Path] = (),
) -> DatasetSummary:
    """Build the folder ``out`` with frames.parquet and manifest.toml; the same inputs give the same content.

    The recordings ``validation`` alone validate, and all ``recordings`` train; without any, the configuration's share
    of ``recordings`` validates. ``progress`` counts recordings read, each once for its labels and once for its frames.
    Scans alone go through ``conflict_check``.

    Raises OutputExistsError; RecordingError or LabelError for an input that cannot be read; DatasetError where no
    recording is given, one is given twice, a class cannot fill its quota (naming class, have and need), or, unless the
    config allows it, labels contradict safety domains.
    """
    if out.exists():
        raise OutputExistsError(out)
    report = progress or _no_progress
    paths = [*recordings, *validation]
    total = 2 * len(paths)
    labelled: list[LabelledRecording] = []
    for path in paths:
        report(len(labelled), total)
        labelled.append(read_labelled(path, labels_dir, config))
    named = frozenset(recording.recording_id for recording in labelled[len(recordings) :])
    labelled.sort(key=lambda recording: recording.recording_id)
    _refuse_repeated(labelled)
    if config.interventions == "only" and not any(recording.interventions for recording in labelled):
        raise DatasetError(
            "nobody took over in these recordings, so there are no interventions; "
            "record with --cockpit and a policy, and drive where it errs"
        )
    selections = select_frames(labelled, config, named)
    kind = LabelKind(config.kind)
    classes = kind.classes
    scans = kind is LabelKind.MOTION
    check = conflict_check if scans else None
    with _folder_when_whole(out) as scratch:
        conflicts: list[Conflict] = []
        with FramesWriter(scratch / FRAMES_FILE, classes, SCHEMA if scans else PICTURE_SCHEMA) as writer:
            for place, selection in enumerate(selections):
                report(len(labelled) + place, total)
                for block in _scan_blocks(selection) if scans else _picture_blocks(selection):
                    writer.write(block)
                    if check is not None:
                        conflicts += _conflicts(block, check, classes)
            frames_hash = writer.close()
        if conflicts and not config.allow_conflicts:
            raise DatasetError(_refusal(conflicts, config))
        counts = _counts(selections, classes)
        used = [Used(entry.recording, entry.split, len(entry.frames)) for entry in selections]
        found = None if check is None else conflicts
        manifest = manifest_toml(config, classes, counts, used, found, frames_hash)
        (scratch / MANIFEST_FILE).write_text(manifest, encoding="utf-8")
    report(total, total)
    return DatasetSummary(
        folder=out,
        hash=frames_hash,
        recordings=len(labelled),
        train_frames=sum(counts[TRAIN].values()),
        val_frames=sum(counts[VAL].values()),
        counts=counts,
        conflicts=None if found is None else len(found),
        interventions=sum(recording.interventions for recording in labelled),
        unmatched_labels=sum(recording.unmatched for recording in labelled),
        unreadable={entry.path.stem: entry.unreadable_ns for entry in labelled if entry.unreadable_ns},
        disputed_stamps=sum(recording.disputed for recording in labelled),
        broken_lines=sum(recording.broken_lines for recording in labelled),
        incomplete=tuple(entry.incomplete for entry in labelled if entry.incomplete is not None),
    )


def _no_progress(_done: int, _total: int) -> None:
    """Nobody is watching."""


def _refuse_repeated(labelled: Sequence[LabelledRecording]) -> None:
    if not labelled:
        raise DatasetError("no recordings given; name at least two, one to train and one to validate")
    for one, other in pairwise(labelled):
        if one.recording_id == other.recording_id:
            raise DatasetError(f"{one.path} and {other.path} are the same recording ({one.recording_id}); give it once")


def _scan_blocks(selection: Selection) -> Iterator[FrameBlock]:
    """The chosen frames of a recording with their ranges, in order of time within each block of its scans."""
    recording = selection.recording
    chosen = recording.positions[selection.frames]
    start = 0
    if not len(chosen):
        return
    with Recording.open(recording.path) as opened:
        for batch in opened.scan_batches(SCANS_A_BATCH):
            here = np.flatnonzero((chosen >= start) & (chosen < start + len(batch)))
            frames, rows = selection.frames[here], chosen[here] - start
            start += len(batch)
            if len(here):
                yield _block(selection, frames, batch.ranges_m[rows])


def _picture_blocks(selection: Selection) -> Iterator[FrameBlock]:
    """The chosen frames of a recording with their pictures, in order of time."""
    recording = selection.recording
    chosen = recording.positions[selection.frames]
    if len(chosen):
        with Recording.open(recording.path) as opened:
            pictures = dict(picture_bytes(opened, chosen))
        yield _block(selection, selection.frames, [pictures[place] for place in chosen.tolist()])


def _block(selection: Selection, frames: Int64[np.ndarray, "_"], content: Ranges | Pictures) -> FrameBlock:
    recording = selection.recording
    return FrameBlock(
        split=selection.split,
        recording_id=recording.recording_id,
        recording=recording.path.stem,
        stamps_ns=recording.pool.stamps_ns[frames],
        labels=recording.pool.labels[frames],
        content=content,
    )


def _conflicts(block: FrameBlock, check: ConflictCheck, classes: Sequence[str]) -> list[Conflict]:
    assert isinstance(block.content, np.ndarray)
    forbidden = np.flatnonzero(check(block.content, block.labels)).tolist()
    return [
        Conflict(block.recording, int(block.stamps_ns[place]), classes[int(block.labels[place])]) for place in forbidden
    ]


def _refusal(conflicts: Sequence[Conflict], config: DatasetConfig) -> str:
    shown = ", ".join(f"{one.recording} at {one.stamp_ns} ns ({one.label})" for one in conflicts[:CONFLICTS_SHOWN])
    more = f" and {len(conflicts) - CONFLICTS_SHOWN} more" if len(conflicts) > CONFLICTS_SHOWN else ""
    return (
        f"frames in a safety domain of level {config.conflict_level} that forbids their label: {len(conflicts)} "
        f"({shown}{more}); label them anew, or allow conflicts, and the manifest lists them all"
    )


def _counts(selections: Sequence[Selection], classes: Sequence[str]) -> dict[str, dict[str, int]]:
    counts = {split: dict.fromkeys(classes, 0) for split in (TRAIN, VAL)}
    for selection in selections:
        for label in selection.recording.pool.labels[selection.frames].tolist():
            counts[selection.split][classes[label]] += 1
    return counts


@contextmanager
def _folder_when_whole(out: Path) -> Iterator[Path]:
    """A scratch folder that takes the name ``out`` when the block ends well, and vanishes when it does not."""
    scratch = out.with_name(f".{out.name}.{os.getpid()}.part")
    shutil.rmtree(scratch, ignore_errors=True)
    scratch.mkdir(parents=True)
    try:
        yield scratch
        scratch.rename(out)
    except BaseException:
        shutil.rmtree(scratch, ignore_errors=True)
        raise
