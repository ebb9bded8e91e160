"""Which labels are suspect: confident learning (Northcutt et al. 2021) over out-of-fold probabilities."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import polars as pl
from cleanlab.filter import find_label_issues
from cleanlab.rank import get_label_quality_scores

from sdt_tools.error_analysis.suspects.options import SuspectOptions
from sdt_tools.error_analysis.suspects.sources import Judged
from sdt_tools.errors import OutputExistsError, UsageError
from sdt_tools.frames import MotionClass
from sdt_tools.labeling.suspects import write_suspects
from sdt_tools.runs.code import code_version


@dataclass(frozen=True, eq=False)
class SuspectReport:
    """What was found: ``suspects`` has the columns of a file of suspects (``labeling.suspects``), worst first.

    ``agreement`` is the share of all frames on which label and out-of-fold answer agree: where it is low, much that is
    suspect is merely hard.
    """

    suspects: pl.DataFrame
    frames: int
    recordings: int
    agreement: float
    options: SuspectOptions

    def document(self) -> dict[str, object]:
        """The report as JSON-ready values; suspects are counted by label and suggestion."""
        pairs = self.suspects.group_by("label", "suggested").len().sort(["len", "label"], descending=[True, False])
        return {
            "frames": self.frames,
            "recordings": self.recordings,
            "suspects": len(self.suspects),
            "agreement": self.agreement,
            "confusions": [{"label": a, "suggested": b, "frames": n} for a, b, n in pairs.iter_rows()],
            "options": self.options.model_dump(mode="json"),
            "code_version": code_version(),
        }


def find_suspects(judged: Judged, options: SuspectOptions) -> SuspectReport:
    """The frames whose label is probably wrong. Raises UsageError where all labels are the same."""
    present = np.unique(judged.labels)
    if len(present) < 2:
        raise UsageError("all frames have the same label: nothing tells a wrong one; give frames of several classes")
    # Classes that no label names cannot be judged; the others share out their probability.
    shares = judged.probabilities[:, present]
    shares = shares / shares.sum(axis=1, keepdims=True)
    labels = np.searchsorted(present, judged.labels)
    found = find_label_issues(labels, shares, filter_by=options.method, n_jobs=1)
    quality = get_label_quality_scores(labels, shares)
    others = shares.copy()
    others[np.arange(len(labels)), labels] = -1.0
    names = np.array([motion.label for motion in MotionClass])[present]
    table = judged.keys.with_columns(
        label=pl.Series(names[labels], dtype=pl.String),
        suggested=pl.Series(names[others.argmax(axis=1)], dtype=pl.String),
        score=pl.Series(1.0 - quality, dtype=pl.Float64),
    )
    suspects = table.filter(pl.Series(np.asarray(found, bool)))
    return SuspectReport(
        suspects=suspects.sort(["score", "recording", "stamp_ns"], descending=[True, False, False]),
        frames=len(labels),
        recordings=judged.keys["recording_id"].n_unique(),
        agreement=float(np.mean(shares.argmax(axis=1) == labels)),
        options=options,
    )


def check_out(out: Path) -> Path:
    """Where the account of ``out`` goes, beside it. Raises UsageError for another ending, OutputExistsError."""
    if out.suffix not in {".csv", ".parquet"}:
        raise UsageError(f"{out}: a file of suspects ends in .csv or .parquet; name it so")
    account = out.with_suffix(".json")
    for path in (out, account):
        if path.exists():
            raise OutputExistsError(path)
    return account


def save_suspects(report: SuspectReport, out: Path, inputs: Mapping[str, str]) -> None:
    """Write the file of suspects ``out``, and beside it (ending .json) what it was made from."""
    account = check_out(out)
    write_suspects(report.suspects, out)
    document = {**report.document(), "inputs": dict(inputs)}
    account.write_text(json.dumps(document, indent=2, ensure_ascii=False) + "\n", "utf-8")
