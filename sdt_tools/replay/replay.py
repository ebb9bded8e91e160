"""A model over recordings: every scan answered, what is known about it beside the answer, one Parquet file."""

import os
import time
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

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
from sdt_tools.recording.messages.topics import LIDAR_SCAN
from sdt_tools.recording.reader import Recording
from sdt_tools.replay.predictions import CLASSES_KEY, FORMAT_KEY, FORMAT_VERSION, SCHEMA
from sdt_tools.replay.rows import CLASSES, NO_LABELS, MotionModel, predict_recording
from sdt_tools.runs.code import code_version
from sdt_tools.runs.local import Progress
from sdt_tools.runs.unit import content_hash


class ReplayConfig(Config):
    """``frames``: all scans, or only those with a label. ``batch``: scans answered at once, on one thread."""

    frames: Literal["all", "labelled"] = "all"
    batch: int = Field(default=128, ge=1, le=4096)


@dataclass(frozen=True)
class ReplaySummary:
    """What a replay did; nothing is passed over silently.

    ``labels_without_scan`` counts labels at whose stamp there is no scan. ``without_journal`` names recordings;
    ``incomplete`` ones were read as far as they go.
    """

    out: Path
    model: str
    recordings: int
    frames: int
    labelled: int
    wrong: int
    labels_without_scan: int
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
    without_journal: list[str] = field(default_factory=list)
    incomplete: list[Incomplete] = field(default_factory=list)


def replay(
    model: MotionModel,
    recordings: Sequence[Path],
    labels_dir: Path | None,
    out: Path,
    config: ReplayConfig | None = None,
    model_folder: Path | None = None,
    progress: Progress | None = None,
) -> ReplaySummary:
    """Answer the scans of ``recordings`` with ``model`` into the predictions file ``out``, a row group a recording.

    Beside it, ``out`` with the ending .toml says what it was made from, ``model_folder`` included. Raises
    OutputExistsError, RecordingError naming a recording that cannot be read or has no scans, and LabelError for labels
    that are wrong, or missing for all recordings.
    """
    config = config or ReplayConfig()
    note = out.with_suffix(".toml")
    for path in (out, note):
        if path.exists():
            raise OutputExistsError(path)
    _check(recordings, labels_dir, config)
    tally = _Tally()
    started = time.perf_counter()
    out.parent.mkdir(parents=True, exist_ok=True)
    scratch = out.with_name(f".{out.name}.{os.getpid()}.part")
    try:
        with pq.ParquetWriter(scratch, _arrow_schema(), compression="zstd") as writer:
            for done, path in enumerate(recordings):
                if progress:
                    progress(done, len(recordings))
                writer.write_table(_to_arrow(_replay_one(model, path, labels_dir, config, tally)))
        seconds = time.perf_counter() - started
        note.write_text(tomli_w.dumps(_provenance(model, recordings, labels_dir, config, model_folder)), "utf-8")
        scratch.rename(out)
    finally:
        scratch.unlink(missing_ok=True)
    if progress:
        progress(len(recordings), len(recordings))
    return ReplaySummary(
        out=out,
        model=model.name,
        recordings=len(recordings),
        frames=tally.counts["frames"],
        labelled=tally.counts["labelled"],
        wrong=tally.counts["wrong"],
        labels_without_scan=tally.counts["labels_without_scan"],
        without_journal=tuple(tally.without_journal),
        incomplete=tuple(tally.incomplete),
        seconds=seconds,
    )


def _check(recordings: Sequence[Path], labels_dir: Path | None, config: ReplayConfig) -> None:
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
    if not any(journal_path(labels_dir, path.stem, LabelKind.MOTION).exists() for path in recordings):
        expected = journal_path(labels_dir, recordings[0].stem, LabelKind.MOTION).name
        raise LabelError(
            f"{labels_dir}: labels none of the {len(recordings)} recordings (as in {expected}); label them first"
        )


def _replay_one(
    model: MotionModel, path: Path, labels_dir: Path | None, config: ReplayConfig, tally: _Tally
) -> pl.DataFrame:
    with Recording.open(path) as recording:
        labels = NO_LABELS
        if labels_dir is not None:
            if journal_path(labels_dir, path.stem, LabelKind.MOTION).exists():
                labels = read_labels(labels_dir, path.stem, LabelKind.MOTION, recording.recording_id)
            else:
                tally.without_journal.append(path.stem)
        rows = predict_recording(model, recording, labels, config.frames, config.batch)
        if rows.is_empty() and (config.frames == "all" or not labels.is_empty()):
            raise RecordingError(f"{path}: has no scans on {LIDAR_SCAN} to replay; leave it out")
        missing = incomplete(recording)
        if missing is not None:
            tally.incomplete.append(missing)
    labelled = len(rows) - rows["label"].null_count()
    tally.counts.update(
        frames=len(rows),
        labelled=labelled,
        wrong=int(rows["loss_01"].sum()),
        labels_without_scan=len(labels.join(rows, on="stamp_ns", how="anti")),
    )
    return rows


def _arrow_schema() -> pa.Schema:
    schema = _to_arrow(pl.DataFrame(schema=SCHEMA)).schema
    return schema.with_metadata({FORMAT_KEY: FORMAT_VERSION, CLASSES_KEY: ",".join(CLASSES)})


def _to_arrow(rows: pl.DataFrame) -> pa.Table:
    """Rows in Arrow's plainest types, which every reader of Parquet knows."""
    return rows.to_arrow(compat_level=pl.CompatLevel.oldest())


def _provenance(
    model: MotionModel,
    recordings: Sequence[Path],
    labels_dir: Path | None,
    config: ReplayConfig,
    model_folder: Path | None,
) -> Mapping[str, object]:
    """What the predictions were made from, by content."""
    journals = (
        {}
        if labels_dir is None
        else {path: journal_path(labels_dir, path.stem, LabelKind.MOTION) for path in recordings}
    )
    return {
        "code_version": code_version(),
        "model": {"name": model.name, **({"sha256": content_hash(model_folder)} if model_folder else {})},
        "config": config.model_dump(mode="json"),
        "recordings": {path.stem: content_hash(path) for path in recordings},
        "labels": {path.stem: content_hash(journal) for path, journal in journals.items() if journal.exists()},
    }
