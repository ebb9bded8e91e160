"""From predictions of several models to a folder that says what changed between them."""

import json
import os
import shutil
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
import polars as pl
from jaxtyping import Bool

from sdt_tools.error_analysis.compare.changed import conditions_of_change
from sdt_tools.error_analysis.compare.figure import draw_comparison
from sdt_tools.error_analysis.compare.options import CompareOptions
from sdt_tools.error_analysis.compare.paired import Change, Measure, changes, measures, worsened
from sdt_tools.error_analysis.conditions.search import ConditionSearch
from sdt_tools.error_analysis.resampling import draw_units
from sdt_tools.error_analysis.side_by_side import SideBySide, load_side_by_side
from sdt_tools.errors import OutputExistsError, UsageError
from sdt_tools.runs.code import code_version
from sdt_tools.runs.unit import content_hash

REPORT: Final = "compare.json"
FRAMES: Final = "changed_frames.parquet"


@dataclass(frozen=True)
class Comparison:
    """One model against the base: paired differences, changes, and the conditions on which it got worse and better."""

    base: str
    other: str
    measures: dict[str, Measure]
    changes: tuple[Change, ...]
    worse: ConditionSearch
    better: ConditionSearch
    picture: str

    def document(self) -> dict[str, Any]:
        """As a part of the report."""
        return {
            "base": self.base,
            "other": self.other,
            "measures": {name: measure.document() for name, measure in self.measures.items()},
            "changes": [change.document() for change in self.changes],
            "worse_conditions": _conditions(self.worse),
            "better_conditions": _conditions(self.better),
            "condition_note": self.worse.note or self.better.note,
            "picture": self.picture,
        }


@dataclass(frozen=True)
class CompareReport:
    """All comparisons, what they rest on, and the options."""

    frames: SideBySide
    comparisons: tuple[Comparison, ...]
    options: CompareOptions

    def document(self) -> dict[str, Any]:
        """As JSON-ready values."""
        return {
            "models": list(self.frames.models),
            "frames": len(self.frames.recording),
            "recordings": self.frames.recordings,
            "left_out": [vars(one) for one in self.frames.mismatches],
            "comparisons": [comparison.document() for comparison in self.comparisons],
            "options": self.options.model_dump(mode="json"),
        }


def compare_models(
    predictions: Sequence[Path], models: Sequence[str], options: CompareOptions, out: Path
) -> CompareReport:
    """Compare the first of ``models`` (all that the files hold, by name, where none is named) with each other one.

    Writes the folder ``out``: compare.json, a table of the frames that changed, a picture a comparison. Raises
    UsageError for fewer than two models and what loading them side by side raises, OutputExistsError.
    """
    if out.exists():
        raise OutputExistsError(out)
    if len(models) == 1 or len(set(models)) < len(models):
        raise UsageError(f"--model {', '.join(models)}: name two models or more, each once")
    frames = load_side_by_side(predictions, models)
    if len(frames.models) < 2:
        raise UsageError(
            f"only predictions of '{frames.models[0]}' were given; replay another model over the same recordings"
        )
    draws = draw_units(frames.recordings, options.resamples, options.seed)
    comparisons = []
    for other in range(1, len(frames.models)):
        worse, better = worsened(frames, 0, other), worsened(frames, other, 0)
        comparisons.append(
            Comparison(
                base=frames.models[0],
                other=frames.models[other],
                measures=dict(measures(frames, 0, other, draws)),
                changes=changes(frames, 0, other, draws),
                worse=conditions_of_change(frames, worse, "got worse", options),
                better=conditions_of_change(frames, better, "got better", options),
                picture=f"compare_{other}.png",
            )
        )
    report = CompareReport(frames, tuple(comparisons), options)
    _write(report, predictions, out)
    return report


def changed_frames(frames: SideBySide) -> pl.DataFrame:
    """One row a frame that some model answers otherwise rightly or wrongly than the base, with both answers."""
    names = np.array(frames.classes, dtype=object)
    tables = []
    for other in range(1, len(frames.models)):
        worse, better = worsened(frames, 0, other), worsened(frames, other, 0)
        rows: Bool[np.ndarray, "frames"] = worse | better
        known = frames.table.filter(pl.Series(rows)).select(
            "recording", "recording_id", "stamp_ns", "label", "scenario"
        )
        answers = pl.DataFrame(
            {
                "base": [frames.models[0]] * int(rows.sum()),
                "other": [frames.models[other]] * int(rows.sum()),
                "change": np.where(worse[rows], "worse", "better").tolist(),
                "base_predicted": names[frames.predicted[0][rows]].tolist(),
                "other_predicted": names[frames.predicted[other][rows]].tolist(),
            },
            schema=dict.fromkeys(("base", "other", "change", "base_predicted", "other_predicted"), pl.String),
        )
        tables.append(pl.concat([known, answers], how="horizontal"))
    return pl.concat(tables)


def _conditions(search: ConditionSearch) -> list[dict[str, Any]]:
    """The confirmed conditions of a change."""
    return [
        {
            "text": verdict.condition.text,
            "frames": int(inside.sum()),
            "support": verdict.support,
            "share_in": verdict.mean_loss_in,
            "share_out": verdict.mean_loss_out,
            "effect": verdict.effect,
            "effect_interval": verdict.effect_interval,
            "p_adjusted": verdict.p_adjusted,
            "recordings": verdict.recordings,
        }
        for verdict, inside in zip(search.confirmed, search.inside, strict=True)
    ]


def _write(report: CompareReport, predictions: Sequence[Path], out: Path) -> None:
    """Write the folder whole, or not at all."""
    inputs = {"predictions": [content_hash(path) for path in predictions]}
    document = {**report.document(), "code_version": code_version(), "inputs": inputs}
    scratch = out.with_name(f".{out.name}.{os.getpid()}.part")
    shutil.rmtree(scratch, ignore_errors=True)
    scratch.mkdir(parents=True)
    try:
        (scratch / REPORT).write_text(json.dumps(document, indent=2, ensure_ascii=False) + "\n", "utf-8")
        changed_frames(report.frames).write_parquet(scratch / FRAMES)
        for one in report.comparisons:
            draw_comparison(one.base, one.other, one.measures, one.changes, scratch / one.picture)
        scratch.rename(out)
    finally:
        shutil.rmtree(scratch, ignore_errors=True)
