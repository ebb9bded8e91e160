"""Labels as a table of CSV, for spreadsheets and other tools: out of journals, and back into them.

Out goes one row a frame: ``stamp_ns``, ``time_s`` since the first frame, ``label``, ``source``, ``labeler``; or one row
for every word that stands. In comes any table with ``label`` and ``stamp_ns`` or ``time_s``; other columns are passed
over. What comes in has the source ``import``: no person vouches for it here.
"""

import time
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
import polars as pl
from jaxtyping import Int64

from sdt_tools.clock import SECOND_NS
from sdt_tools.errors import LabelError, OutputExistsError
from sdt_tools.labeling.frame_labels import rows_of
from sdt_tools.labeling.journal import Journal, read_journal
from sdt_tools.labeling.labelled_frames import labelled_frames
from sdt_tools.labeling.resolve import resolve, standing
from sdt_tools.labeling.vocabulary import LabelKind, LabelSource, check_labeler, journal_path
from sdt_tools.recording.reader import Recording

EXPORTED: Final = ("stamp_ns", "time_s", "label", "source", "labeler")


@dataclass(frozen=True)
class Exchanged:
    """What was written: ``labels`` rows, of which ``new`` were not in the journal yet (all, going out)."""

    recording: Path
    path: Path
    labels: int
    new: int


def export_labels(recording: Path, kind: LabelKind, labels_dir: Path, out: Path, *, every_word: bool) -> Exchanged:
    """Write the resolved labels of a recording to ``out``; with ``every_word`` all that stands, whoever said it.

    Raises LabelError where the recording has no journal, OutputExistsError where ``out`` exists.
    """
    if out.exists():
        raise OutputExistsError(out)
    with Recording.open(recording) as opened:
        start_ns = int(labelled_frames(opened, kind).stamps_ns[0])
        acts = read_journal(journal_path(labels_dir, opened.stem, kind), opened.recording_id)
    said = standing(acts).sort("stamp_ns", "act_id") if every_word else resolve(acts)
    table = said.with_columns(((pl.col("stamp_ns") - start_ns) / SECOND_NS).round(9).alias("time_s")).select(EXPORTED)
    out.parent.mkdir(parents=True, exist_ok=True)
    part = out.with_name(f".{out.name}.part")
    table.write_csv(part)
    part.rename(out)
    return Exchanged(recording, out, len(table), len(table))


def import_labels(recording: Path, kind: LabelKind, labels_dir: Path, table: Path, labeler: str) -> Exchanged:
    """Append the labels of a CSV table to the recording's journal, as the import of ``labeler``.

    ``stamp_ns`` must be a frame's; ``time_s``, seconds since the first frame, means the nearest frame. What ``labeler``
    has imported already is not repeated. Raises LabelError, naming the line, and writes nothing, for a table that lacks
    a column, a label that is no class, a time or stamp without a frame, or a frame with two labels.
    """
    check_labeler(labeler)
    with Recording.open(recording) as opened:
        stamps_ns, recording_id = labelled_frames(opened, kind).stamps_ns, opened.recording_id
    given = _read(table, kind)
    rows = _rows(given, table, stamps_ns)
    _check_unique(rows, table)
    found = pl.DataFrame({"stamp_ns": stamps_ns[rows], "label": given["label"]}).sort("stamp_ns")
    path = journal_path(labels_dir, recording.stem, kind)
    with Journal(path, recording_id) as journal:
        fresh = found.with_columns(
            pl.lit(labeler).alias("labeler"),
            pl.lit(str(LabelSource.IMPORT)).alias("source"),
            pl.lit(time.time_ns(), dtype=pl.Int64).alias("created_ns"),
        )
        known = standing(journal.opened)
        fresh = fresh.join(known, on=["stamp_ns", "label", "labeler", "source"], how="anti", maintain_order="left")
        return Exchanged(recording, path, len(found), journal.append_table(fresh))


def _read(path: Path, kind: LabelKind) -> pl.DataFrame:
    try:
        table = pl.read_csv(path, infer_schema=False)
    except FileNotFoundError:
        raise LabelError(f"{path}: no such table; name a CSV file") from None
    except (pl.exceptions.PolarsError, OSError) as error:
        raise LabelError(f"{path}: cannot be read as CSV: {str(error).splitlines()[0]}") from None
    if "label" not in table.columns or not {"stamp_ns", "time_s"} & set(table.columns):
        raise LabelError(f"{path}:1: needs the columns label and stamp_ns (or time_s); has {', '.join(table.columns)}")
    if table.is_empty():
        raise LabelError(f"{path}: holds no labels")
    strange = np.flatnonzero(~table["label"].is_in(kind.classes).fill_null(value=False).to_numpy())
    if len(strange):
        line = int(strange[0])
        label = table["label"][line] or ""
        raise LabelError(f"{path}:{line + 2}: unknown label '{label}'; a {kind} is one of {', '.join(kind.classes)}")
    return table


def _rows(given: pl.DataFrame, path: Path, stamps_ns: Int64[np.ndarray, "frames"]) -> Int64[np.ndarray, "labels"]:
    """The frame that each line is about."""
    name = "stamp_ns" if "stamp_ns" in given.columns else "time_s"
    values = given[name].cast(pl.Int64 if name == "stamp_ns" else pl.Float64, strict=False)
    if values.null_count() or not values.is_finite().all():
        line = int(
            np.flatnonzero(values.is_null().to_numpy() | ~values.is_finite().fill_null(value=False).to_numpy())[0]
        )
        raise LabelError(f"{path}:{line + 2}: {name} '{given[name][line] or ''}' is not a number")
    asked = values.to_numpy()
    rows = rows_of(stamps_ns, asked) if name == "stamp_ns" else _nearest(stamps_ns, asked)
    missing = np.flatnonzero(rows < 0)
    if len(missing):
        line = int(missing[0])
        raise LabelError(
            f"{path}:{line + 2}: the recording has no frame at {name} {given[name][line]}; "
            "check that the table belongs to it"
        )
    return rows


def _nearest(stamps_ns: Int64[np.ndarray, "frames"], times_s: np.ndarray) -> Int64[np.ndarray, "labels"]:
    """The frame nearest to each time since the first; -1 beyond the first and the last by more than their distance."""
    usual_ns = float(np.median(np.diff(stamps_ns))) if len(stamps_ns) > 1 else float(SECOND_NS)
    since_ns = (stamps_ns - stamps_ns[0]).astype(np.float64)
    asked_ns = times_s * SECOND_NS
    after = np.clip(np.searchsorted(since_ns, asked_ns), 0, len(stamps_ns) - 1)
    before = np.maximum(after - 1, 0)
    nearest = np.where(asked_ns - since_ns[before] <= since_ns[after] - asked_ns, before, after)
    outside = (asked_ns < -usual_ns) | (asked_ns > since_ns[-1] + usual_ns)
    return np.where(outside, -1, nearest).astype(np.int64)


def _check_unique(rows: Int64[np.ndarray, "labels"], path: Path) -> None:
    _, first = np.unique(rows, return_index=True)
    again = np.setdiff1d(np.arange(len(rows)), first)
    if len(again):
        line = int(again[0])
        raise LabelError(f"{path}:{line + 2}: the frame has a label on another line already; keep one of them")
