"""The numbers of the follow study's report, from its tables of networks, runs and traces."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import polars as pl

from sdt_tools.frames import FORWARD_CLASSES
from sdt_tools.scene.scenario import STANDARD_FOLLOW

_FORWARD = [motion.label for motion in FORWARD_CLASSES]
_LOOK_BACK_S = 1.0
_OK = "ok"


@dataclass(frozen=True, eq=False)
class FollowTables:
    """All tables of the study.

    ``networks``: one row a trained network, its accuracies, certificate and training. ``runs`` and ``traces``:
    closed-loop runs of the main families, with ``family`` and ``network``. ``searched``: the certificate of the network
    in which violations were searched for hardest. ``checks``: median and worst of each standing check by family.
    """

    networks: pl.DataFrame
    runs: pl.DataFrame
    traces: pl.DataFrame
    searched: Mapping[str, Any]
    checks: Mapping[str, Mapping[str, Mapping[str, float]]]
    real_time_factor: float


def level_rows(tables: FollowTables, families: Sequence[str]) -> list[dict[str, Any]]:
    """For each family the least, median and largest of what its networks reached."""
    rows = []
    for family in families:
        group = tables.networks.filter(pl.col("family") == family)
        if group.is_empty():
            continue
        row: dict[str, Any] = {
            "family": family,
            "size": group["size"][0],
            "level": group["level"][0],
            "networks": len(group),
            "domains": group["domains"][0],
            "least_certified": group["certified"].min(),
            "least_margin": group["min_margin"].min(),
        }
        spread = ("train_accuracy", "val_accuracy", "train_forward_recall", "val_forward_recall", "seconds")
        row |= {name: [group[name].min(), group[name].median(), group[name].max()] for name in spread}
        rows.append(row)
    return rows


def scenario_counts(tables: FollowTables, families: Sequence[str]) -> dict[str, dict[str, dict[str, int]]]:
    """Runs that ended well, and all, by family and scenario, and their ``total``."""
    counts: dict[str, dict[str, dict[str, int]]] = {}
    for family in families:
        runs = tables.runs.filter(pl.col("family") == family)
        parts = {name: runs.filter(pl.col("scenario") == name) for name in STANDARD_FOLLOW} | {"total": runs}
        counts[family] = {
            name: {"ok": int((part["outcome"] == _OK).sum()), "runs": len(part)} for name, part in parts.items()
        }
    return counts


def nesting_rows(tables: FollowTables) -> list[dict[str, Any]]:
    """Of the runs that a network of one level fails, those that the same seed's network of the next level fails too.

    By chance so many would be expected as the next level's failure rate in the same scenarios says.
    """
    runs = tables.runs.filter(pl.col("family").str.starts_with("paper-plain"))
    rows = []
    for level in (0, 1, 2):
        first, second = (_failed(runs, f"paper-plain-level{which}") for which in (level, level + 1))
        paired = first.join(second, on=["training_seed", "scenario", "seed"], suffix="_next")
        failed = paired.filter(pl.col("failed"))
        rate = paired.group_by("scenario").agg(pl.col("failed_next").mean().alias("rate"))
        expected = failed.join(rate, on="scenario")["rate"].mean()
        rows.append(
            {
                "first": f"level {level}",
                "second": f"level {level + 1}",
                "failed_first": len(failed),
                "both": int(failed["failed_next"].sum()),
                "expected_share": float(expected) if isinstance(expected, float) else 0.0,
            }
        )
    return rows


def failures_by_motion(tables: FollowTables, families: Sequence[str]) -> list[dict[str, Any]]:
    """For each family, how many failed runs moved forward in their last second, and how near the way ahead was."""
    ends = (
        tables.traces.join(
            tables.traces.group_by("network", "scenario", "seed").agg(pl.col("time_s").max().alias("end_s")),
            on=["network", "scenario", "seed"],
        )
        .filter(pl.col("time_s") > pl.col("end_s") - _LOOK_BACK_S)
        .group_by("network", "scenario", "seed")
        .agg(pl.col("motion").is_in(_FORWARD).any().alias("forward"), pl.col("front_range_m").min())
    )
    failed = tables.runs.filter(pl.col("outcome") != _OK).join(ends, on=["network", "scenario", "seed"])
    rows = []
    for family in families:
        group = failed.filter(pl.col("family") == family)
        rows.append(
            {
                "family": family,
                "failures": len(group),
                "forward": int(group["forward"].sum()),
                "median_front_range_m": group["front_range_m"].median(),
                "outcomes": dict(group["outcome"].value_counts().iter_rows()),
            }
        )
    return rows


def cost_rows(tables: FollowTables) -> list[dict[str, Any]]:
    """What level 4 costs the gate against level 0 of the plain network, on each size of data, in shares.

    Losses are level 0's median less level 4's; ``pasted_forward`` is the worst network's, ``clip_loss`` what the median
    forward recall on clear fronts loses when ranges are clipped at 4 m.
    """
    rows = []
    for size in ("paper", "large"):
        families = [f"{size}-plain-level0", f"{size}-gate-level4"]
        pair = level_rows(tables, families)
        checks = tables.checks.get(families[1])
        if len(pair) < len(families) or checks is None:
            continue
        zero, four = pair
        rows.append(
            {
                "size": size,
                "accuracy_loss": zero["val_accuracy"][1] - four["val_accuracy"][1],
                "forward_recall_loss": zero["val_forward_recall"][1] - four["val_forward_recall"][1],
                "pasted_forward": checks["pasted_forward"]["worst"],
                "clip_loss": checks["clear_forward"]["median"] - checks["clear_forward_clipped_4m"]["median"],
            }
        )
    return rows


def sweep_rows(tables: FollowTables) -> list[dict[str, Any]]:
    """Accuracies of plain networks of the paper's size by level and λ."""
    plain = tables.networks.filter((pl.col("arch") == "plain") & (pl.col("size") == "paper") & (pl.col("level") > 0))
    rows = []
    for (level, weight), group in plain.group_by("level", "effective_weight", maintain_order=True):
        row: dict[str, Any] = {
            "level": level,
            "weight": weight,
            "networks": len(group),
            "least_certified": group["certified"].min(),
            "most_certified": group["certified"].max(),
        }
        for name in ("val_accuracy", "val_forward_recall"):
            row[name] = [group[name].min(), group[name].median(), group[name].max()]
        rows.append(row)
    return sorted(rows, key=lambda row: (row["level"], row["weight"]))


def _failed(runs: pl.DataFrame, family: str) -> pl.DataFrame:
    return runs.filter(pl.col("family") == family).select(
        "training_seed", "scenario", "seed", (pl.col("outcome") != _OK).alias("failed")
    )
