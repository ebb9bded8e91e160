"""Verdicts as a table and as a page."""

from collections.abc import Mapping, Sequence
from typing import Any

import polars as pl

from sdt_tools.error_analysis.claims.verdict import ClaimVerdict


def claims_table(verdicts: Sequence[ClaimVerdict]) -> pl.DataFrame:
    """One row a verdict."""
    return pl.DataFrame(
        [
            {
                "claim": verdict.claim,
                "about": verdict.about,
                "statement": verdict.statement,
                "verdict": str(verdict.finding),
                "reason": verdict.reason,
                "measure": verdict.measure,
                **verdict.estimate.document(),
                "frames": verdict.frames,
                "recordings": verdict.recordings,
                "premises_held": [premise.name for premise in verdict.premises if premise.holds],
                "premises_broken": [premise.name for premise in verdict.premises if premise.holds is False],
                "premises_unknown": [premise.name for premise in verdict.premises if premise.holds is None],
            }
            for verdict in verdicts
        ],
        schema_overrides={
            "value": pl.Float64,
            "low": pl.Float64,
            "high": pl.Float64,
            "premises_held": pl.List(pl.String),
            "premises_broken": pl.List(pl.String),
            "premises_unknown": pl.List(pl.String),
        },
    )


def claims_markdown(verdicts: Sequence[ClaimVerdict], summary: Mapping[str, Any], pictures: Sequence[str]) -> str:
    """A page: what was judged, the table of verdicts, the premises, the pictures."""
    scenarios = ", ".join(f"{name} ({count:,})" for name, count in summary["scenarios"].items())
    lines = [
        "# The paper's claims, held against predictions",
        "",
        f"{summary['frames']:,} labelled frames of {summary['recordings']} recordings, answered by "
        f"{len(summary['networks'])} networks. Frames by scenario: {scenarios}. Losses are averaged over the "
        "networks of a level; intervals are 95 % over resampled recordings, and speak of these networks.",
        "",
        "| claim | about | verdict | why | what decides | value (95 %) | frames, recordings |",
        "|---|---|---|---|---|---|---:|",
    ]
    for one in verdicts:
        support = f"{one.frames:,}, {one.recordings:,}"
        value = one.estimate.text()
        cells = (one.statement, one.about, f"**{one.finding}**", one.reason, one.measure, value, support)
        lines.append(f"| {' | '.join(cell.replace('|', '/') for cell in cells)} |")
    if any(one.premises for one in verdicts):
        lines += ["", "## Premises", "", "| claim | about | premise | holds | measured |", "|---|---|---|---|---|"]
    for one in verdicts:
        for premise in one.premises:
            holds = {True: "yes", False: "**no**", None: "not known"}[premise.holds]
            lines.append(f"| {one.claim.replace('_', ' ')} | {one.about} | {premise.name} | {holds} | {premise.text} |")
    lines += ["", "## Pictures", ""]
    lines += [f"![{name.removesuffix('.png').replace('_', ' ')}]({name})\n" for name in pictures]
    return "\n".join(lines).rstrip("\n") + "\n"
