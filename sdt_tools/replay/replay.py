"""A model over recordings: every frame answered, what is known about it beside the answer, one Parquet file.

The frames of a follow network are scans, those of a vision network pictures.
"""

import os
import time
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final, Literal

import polars as pl
import pyarrow as pa
import pyarrow.parquet as pq
import tomli_w
from pydantic import Field

from sdt_tools.config import Config
from sdt_tools.errors import LabelError, OutputExistsError, RecordingError, UsageError
from sdt_tools.labeling.resolve import read_labels
from sdt_tools.labeling.vocabulary import LabelKind, journal_path
from sdt_tools.recording.incomplete import Incomplete, incomplete
from sdt_tools.recording.messages.topics import CAMERA_IMAGE, LIDAR_SCAN
from sdt_tools.recording.reader import Recording
from sdt_tools.replay.picture_rows import GestureModel, predict_pictures
from sdt_tools.replay.predictions import CLASSES_KEY, FORMAT_KEY, FORMAT_VERSION, SCHEMAS, PredictionKind
from sdt_tools.replay.rows import NO_LABELS, MotionModel, predict_recording
from sdt_tools.runs.code import code_version
from sdt_tools.runs.local import Progress
from sdt_tools.runs.unit import content_hash

LABELLED_AS: Final = {PredictionKind.SCANS: LabelKind.MOTION, PredictionKind.PICTURES: LabelKind.GESTURE}
"""What labels say of each kind of frame."""


class ReplayConfig(Config):
    """``frames``: all frames, or only those with a label. ``batch``: frames answered at once, on one thread."""

    frames: Literal["all", "labelled"] = "all"
    batch: int = Field(default=128, ge=1, le=4096)


@dataclass(frozen=True)
class Unreadable:
    """Pictures of a recording that no decoder reads, by their stamps; they were passed over."""

    recording: str
    stamps_ns: tuple[int, ...]


@dataclass(frozen=True)
class ReplaySummary:
    """What a replay did; nothing is passed over silently.

    ``kind`` says what was answered. ``labels_without_frame`` counts labels at whose stamp there is no scan, or no
    picture. ``without_journal`` names recordings; ``incomplete`` ones were read as far as they go.
    """

    out: Path
    model: str
    kind: PredictionKind
    recordings: int
    frames: int
    labelled: int
    wrong: int
    labels_without_frame: int
    unreadable: tuple[Unreadable, ...]
    without_journal: tuple[str, ...]
    incomplete: tuple[Incomplete, ...]
    seconds: float

    @property
    def frames_per_s(self) -> float:
        """Frames a second, file to Parquet."""
        return self.frames / max(self.seconds, 1e-9)

    @property
    def truncated(self) -> bool:
        """Whether a recording was cut off."""
        return any(recording.truncated for recording in self.incomplete)

    @property
    def accuracy(self) -> float | None:
        """Share of labelled frames answered with the label; None without labels."""
        return 1.0 - self.wrong / self.labelled if self.labelled else None


@dataclass
class _Tally:
    counts: Counter[str] = field(default_factory=Counter)
    unreadable: list[Unreadable] = field(default_factory=list)
    without_journal: list[str] = field(default_factory=list)
    incomplete: list[Incomplete] = field(default_factory=list)


def replay(
    model: MotionModel | GestureModel,
    recordings: Sequence[Path],
    labels_dir: Path | None,
    out: Path,
    config: ReplayConfig | None = None,
    model_folder: Path | None = None,
    progress: Progress | None = None,
) -> ReplaySummary:
    """Answer the frames of ``recordings`` with ``model`` into the predictions file ``out``, a row group a recording.

    A follow network answers scans, and labels are motions; a vision network answers pictures, and labels are gestures.
    Beside it, ``out`` with the ending .toml says what it was made from, ``model_folder`` included. Raises
    OutputExistsError, RecordingError naming a recording that cannot be read or has none of the frames, and LabelError
    for labels that are wrong, or missing for all recordings.
    """
    config = config or ReplayConfig()
    note = out.with_suffix(".toml")
    for path in (out, note):
        if path.exists():
            raise OutputExistsError(path)
    kind = PredictionKind.PICTURES if isinstance(model, GestureModel) else PredictionKind.SCANS
    _check(recordings, labels_dir, LABELLED_AS[kind], config)
    tally = _Tally()
    started = time.perf_counter()
    out.parent.mkdir(parents=True, exist_ok=True)
    scratch = out.with_name(f".{out.name}.{os.getpid()}.part")
    try:
        with pq.ParquetWriter(scratch, _arrow_schema(kind), compression="zstd") as writer:
            for done, path in enumerate(recordings):
                if progress:
                    progress(done, len(recordings))
                writer.write_table(_to_arrow(_replay_one(model, path, labels_dir, config, tally)))
        seconds = time.perf_counter() - started
        note.write_text(tomli_w.dumps(_provenance(model, kind, recordings, labels_dir, config, model_folder)), "utf-8")
        scratch.rename(out)
    finally:
        scratch.unlink(missing_ok=True)
    if progress:
        progress(len(recordings), len(recordings))
    return ReplaySummary(
        out=out,
        model=model.name,
        kind=kind,
        recordings=len(recordings),
        frames=tally.counts["frames"],
        labelled=tally.counts["labelled"],
        wrong=tally.counts["wrong"],
        labels_without_frame=tally.counts["labels_without_frame"],
        unreadable=tuple(tally.unreadable),
        without_journal=tuple(tally.without_journal),
        incomplete=tuple(tally.incomplete),
        seconds=seconds,
    )


def _check(recordings: Sequence[Path], labels_dir: Path | None, kind: LabelKind, config: ReplayConfig) -> None:
    """Raise what can be known before the work begins."""
    if not recordings:
        raise UsageError("no recordings given; name the MCAP files to replay")
    for stem, count in Counter(path.stem for path in recordings).items():
        if count > 1:
            raise UsageError(
                f"{count} recordings are called '{stem}', but predictions tell them by name; rename all but one"
            )
    if labels_dir is None:
        if config.frames == "labelled":
            raise UsageError("only labelled frames are asked for, but no labels are given; add --labels")
        return
    if not labels_dir.is_dir():
        raise LabelError(f"{labels_dir}: no such folder of labels; check --labels")
    if not any(journal_path(labels_dir, path.stem, kind).exists() for path in recordings):
        expected = journal_path(labels_dir, recordings[0].stem, kind).name
        raise LabelError(
            f"{labels_dir}: labels none of the {len(recordings)} recordings (as in {expected}); label them first"
        )


def _replay_one(
    model: MotionModel | GestureModel, path: Path, labels_dir: Path | None, config: ReplayConfig, tally: _Tally
) -> pl.DataFrame:
    kind = PredictionKind.PICTURES if isinstance(model, GestureModel) else PredictionKind.SCANS
    unreadable_ns: tuple[int, ...] = ()
    with Recording.open(path) as recording:
        labels = NO_LABELS
        if labels_dir is not None:
            if journal_path(labels_dir, path.stem, LABELLED_AS[kind]).exists():
                labels = read_labels(labels_dir, path.stem, LABELLED_AS[kind], recording.recording_id)
            else:
                tally.without_journal.append(path.stem)
        if isinstance(model, GestureModel):
            answered = predict_pictures(model, recording, labels, config.frames, config.batch)
            rows, unreadable_ns = answered.rows, answered.unreadable_ns
        else:
            rows = predict_recording(model, recording, labels, config.frames, config.batch)
        if rows.is_empty() and (config.frames == "all" or not labels.is_empty()):
            raise RecordingError(_nothing_to_replay(path, kind, len(unreadable_ns)))
        missing = incomplete(recording)
        if missing is not None:
            tally.incomplete.append(missing)
    if unreadable_ns:
        tally.unreadable.append(Unreadable(path.stem, unreadable_ns))
    labelled = len(rows) - rows["label"].null_count()
    unanswered = labels.join(rows, on="stamp_ns", how="anti").filter(~pl.col("stamp_ns").is_in(list(unreadable_ns)))
    tally.counts.update(
        frames=len(rows),
        labelled=labelled,
        wrong=int(rows["loss_01"].sum()),
        labels_without_frame=len(unanswered),
    )
    return rows


def _nothing_to_replay(path: Path, kind: PredictionKind, unreadable: int) -> str:
    if unreadable:
        return f"{path}: none of its {unreadable} pictures on {CAMERA_IMAGE} can be decoded; leave it out"
    if kind is PredictionKind.PICTURES:
        return f"{path}: has no pictures on {CAMERA_IMAGE} to replay; leave it out, or record with a camera"
    return f"{path}: has no scans on {LIDAR_SCAN} to replay; leave it out"


def _arrow_schema(kind: PredictionKind) -> pa.Schema:
    schema = _to_arrow(pl.DataFrame(schema=SCHEMAS[kind])).schema
    return schema.with_metadata({FORMAT_KEY: FORMAT_VERSION, CLASSES_KEY: ",".join(LABELLED_AS[kind].classes)})


def _to_arrow(rows: pl.DataFrame) -> pa.Table:
    """Rows in Arrow's plainest types, which every reader of Parquet knows."""
    return rows.to_arrow(compat_level=pl.CompatLevel.oldest())


def _provenance(
    model: MotionModel | GestureModel,
    kind: PredictionKind,
    recordings: Sequence[Path],
    labels_dir: Path | None,
    config: ReplayConfig,
    model_folder: Path | None,
) -> Mapping[str, object]:
    """What the predictions were made from, by content."""
    journals = (
        {}
        if labels_dir is None
        else {path: journal_path(labels_dir, path.stem, LABELLED_AS[kind]) for path in recordings}
    )
    return {
        "code_version": code_version(),
        "model": {"name": model.name, **({"sha256": content_hash(model_folder)} if model_folder else {})},
        "config": config.model_dump(mode="json"),
        "recordings": {path.stem: content_hash(path) for path in recordings},
        "labels": {path.stem: content_hash(journal) for path, journal in journals.items() if journal.exists()},
    }
