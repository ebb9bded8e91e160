"""Errors to step through: which they are, and everything that is known at each, one after the other."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
import polars as pl
import rerun as rr
from jaxtyping import Float64, Int64

from sdt_tools.errors import UsageError
from sdt_tools.view import entities, palette
from sdt_tools.view.palette import CORRECT, STATUSES, UNLABELED
from sdt_tools.view.timeline import Both, Steps, send, when

ERROR_TAGS: Final = tuple(name for name in STATUSES if name not in {UNLABELED, CORRECT, palette.ERROR})
"""The tags that an error analysis gives to wrong frames."""


@dataclass(frozen=True)
class ErrorStep:
    """A tagged error: ``condition`` names the confirmed conditions that it lies in, neighbours are those within ε."""

    stamp_ns: int
    model: str
    tag: str
    label: str
    predicted: str
    condition: str
    neighbours: int | None
    right_neighbours: int | None


def check_tags(names: Collection[str]) -> None:
    """Raises UsageError for the name of no error tag."""
    unknown = sorted(set(names) - set(ERROR_TAGS))
    if unknown:
        raise UsageError(f"unknown error tag '{unknown[0]}'; it is one of {', '.join(ERROR_TAGS)}")


def error_steps(recording_id: str, tags: Sequence[pl.DataFrame], wanted: Collection[str]) -> tuple[ErrorStep, ...]:
    """The errors of a recording with one of the tags ``wanted``, in order of time, then of models.

    Of the frames of ``tags``, recording_id, stamp_ns, model and tag must be known; the rest may be missing.
    """
    columns: dict[str, pl.DataType] = {
        "stamp_ns": pl.Int64(),
        "model": pl.String(),
        "tag": pl.String(),
        "label": pl.String(),
        "predicted": pl.String(),
        "condition": pl.String(),
        "neighbours": pl.Int64(),
        "right_neighbours": pl.Int64(),
    }
    found = [
        frame.filter(pl.col("recording_id") == recording_id, pl.col("tag").is_in(list(wanted))).select(
            (pl.col(name) if name in frame.columns else pl.lit(None)).cast(dtype).alias(name)
            for name, dtype in columns.items()
        )
        for frame in tags
    ]
    rows = pl.concat([pl.DataFrame(schema=columns), *found]).unique(["stamp_ns", "model"], keep="last")
    named = rows.with_columns(pl.col("label", "predicted", "condition").fill_null(""))
    return tuple(ErrorStep(**row) for row in named.sort("stamp_ns", "model").iter_rows(named=True))


def errors_elsewhere(recording_id: str, tags: Sequence[pl.DataFrame], wanted: Collection[str]) -> Mapping[str, int]:
    """How many errors with one of the tags ``wanted`` other recordings have, most first."""
    named = [frame.select("recording", "recording_id", "tag") for frame in tags if "recording" in frame.columns]
    if not named:
        return {}
    others = pl.concat(named).filter(pl.col("recording_id") != recording_id, pl.col("tag").is_in(list(wanted)))
    counted = others.group_by("recording").len().sort(["len", "recording"], descending=[True, False])
    return dict(counted.iter_rows())


def stamps_of(steps: Sequence[ErrorStep]) -> Int64[np.ndarray, "steps"]:
    """The stamp of each step."""
    return np.array([step.stamp_ns for step in steps], np.int64)


def numbered(steps: Sequence[ErrorStep]) -> Steps:
    """The rows of all steps on their timeline."""
    return Steps(np.arange(len(steps), dtype=np.int64))


def draw_steps(
    stream: rr.RecordingStream, steps: Sequence[ErrorStep], scan_stamps_ns: Int64[np.ndarray, "scans"]
) -> None:
    """The list of all errors, whose lines lead to them, and each error in words."""
    rows = Both(when(stamps_of(steps), scan_stamps_ns), numbered(steps))
    began_ns = int(scan_stamps_ns[0]) if len(scan_stamps_ns) else 0
    colors = palette.packed(STATUSES[step.tag] for step in steps)
    several = len({step.model for step in steps}) > 1
    lines = [f"{_after(step, began_ns)}  {_in_short(step, several)}" for step in steps]
    levels = [rr.TextLogLevel.WARN] * len(steps)
    send(stream, entities.ERROR_LIST, rows, rr.TextLog.columns(text=lines, level=levels, color=colors))
    texts = [_in_words(number, len(steps), step, began_ns) for number, step in enumerate(steps)]
    media = [rr.MediaType.MARKDOWN] * len(steps)
    send(stream, entities.ERROR_WORDS, rows, rr.TextDocument.columns(text=texts, media_type=media))


def scans_at(
    batch_ns: Int64[np.ndarray, "scans"], ranges_m: Float64[np.ndarray, "scans rays"], steps_ns: Int64[np.ndarray, "_"]
) -> tuple[Int64[np.ndarray, "found"], Float64[np.ndarray, "found rays"]]:
    """The steps whose scans are in a batch, and those scans."""
    order = np.argsort(batch_ns, kind="stable")
    place = np.minimum(np.searchsorted(batch_ns[order], steps_ns), len(batch_ns) - 1)
    found = np.flatnonzero(batch_ns[order][place] == steps_ns)
    return found, ranges_m[order[place[found]]]


def _after(step: ErrorStep, began_ns: int) -> str:
    return f"{(step.stamp_ns - began_ns) / 1e9:8.2f} s"


def _in_short(step: ErrorStep, several: bool) -> str:
    """One line of the list; the model is named where there are several."""
    said = f"{step.tag}: {step.predicted or '?'}, not {step.label or '?'}"
    return f"{step.model} {said}" if several else said


def _in_words(number: int, count: int, step: ErrorStep, began_ns: int) -> str:
    words = [
        f"**Error {number} (0 to {count - 1}): {step.tag}.** {step.model} says **{step.predicted or '?'}**, "
        f"label **{step.label or '?'}**",
        f"`{step.stamp_ns}`, {_after(step, began_ns).strip()} after the first scan" + _neighbours(step),
    ]
    if step.condition:
        words.append(f"Inside: `{step.condition}`")
    return "\n\n".join(words)


def _neighbours(step: ErrorStep) -> str:
    return "" if step.neighbours is None else f"; within ε {step.neighbours}, {step.right_neighbours} of them right"
