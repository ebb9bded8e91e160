"""An attack on a follow network, whole: in its safety domains, near real scans, and the picture that tells it best."""

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Final

import numpy as np
import polars as pl
from jaxtyping import Float64

from sdt_tools.dataset.load import FrameSet
from sdt_tools.errors import DatasetError, OutputExistsError
from sdt_tools.frames import FORWARD_CLASSES, MotionClass
from sdt_tools.models.loaded import LoadedModel
from sdt_tools.models.preprocess import resolve_codes
from sdt_tools.robustness.attacks import AttackConfig, AttackResult, attack
from sdt_tools.robustness.boxes import DomainSet
from sdt_tools.robustness.near_scans import NearScanConfig, NearScanResult, attack_near_scans
from sdt_tools.statistics import wilson

DOMAINS_FILE = "domains.parquet"
NEAR_FILE = "near_scans.parquet"
SUMMARY_FILE = "attack.json"
_WIDER_M: Final = (0.2, 0.5, 1.0, 2.0, 4.0)
_TRIED_WIDER: Final = 20
"""Scans that are tried with wider radii, for the picture alone."""


@dataclass(frozen=True, eq=False)
class Exhibit:
    """The attack to be shown: a scan, what the attack made of it, and the logits of both."""

    original_m: Float64[np.ndarray, "rays"]
    attacked_m: Float64[np.ndarray, "rays"]
    logits: tuple[np.ndarray, np.ndarray]
    succeeded: bool
    title: str


@dataclass(frozen=True)
class AttackSummary:
    """Counts: domains and those violated; scans, those with an object answered with forward, before and after.

    ``near_scans`` is 0 where no data were given.
    """

    model: str
    domains: int
    violated: int
    violated_wilson: tuple[float, float]
    near_scans: int
    forward_before: int
    forward_after: int
    forward_after_wilson: tuple[float, float]


def attack_follow(
    model: LoadedModel,
    specification: Sequence[DomainSet],
    frames: FrameSet | None,
    near: NearScanConfig,
    near_count: int,
    config: AttackConfig,
    out: Path,
) -> tuple[AttackSummary, Exhibit]:
    """Attack every domain, and ``near_count`` forward scans of ``frames`` with an object in them; write it to ``out``.

    Raises OutputExistsError, and DatasetError for data without forward scans.
    """
    if out.exists():
        raise OutputExistsError(out)
    found = [attack(model.network, boxes, config) for boxes in specification]
    result: NearScanResult | None = None
    if frames:
        result = attack_near_scans(model, _forward_scans(model, frames, near_count, config.seed), near, config)
    domains, violated = sum(len(boxes) for boxes in specification), sum(int(one.violated.sum()) for one in found)
    scans = len(result.answers) if result else 0
    after = result.forward_after if result else 0
    summary = AttackSummary(
        model=model.name,
        domains=domains,
        violated=violated,
        violated_wilson=wilson(violated, domains),
        near_scans=scans,
        forward_before=result.forward_before if result else 0,
        forward_after=after,
        forward_after_wilson=wilson(after, scans),
    )
    out.mkdir(parents=True)
    tables = [_table(boxes, one) for boxes, one in zip(specification, found, strict=True)]
    pl.concat(tables).write_parquet(out / DOMAINS_FILE)
    if result:
        _table_near(result).write_parquet(out / NEAR_FILE)
    settings = {"attack": config.model_dump(), "near": near.model_dump()}
    (out / SUMMARY_FILE).write_text(json.dumps(asdict(summary) | settings, indent=2) + "\n", encoding="utf-8")
    if result:
        return summary, _exhibit_near(model, result, near, config)
    return summary, _exhibit_domain(model, specification[0], found[0].scans_m)


def _forward_scans(model: LoadedModel, frames: FrameSet, count: int, seed: int) -> Float64[np.ndarray, "scans rays"]:
    forward = np.flatnonzero(np.isin(frames.labels, [int(motion) for motion in FORWARD_CLASSES]))
    if len(forward) == 0:
        raise DatasetError("the data set's validation frames have no forward label, so there is no scan to attack")
    chosen = np.sort(np.random.default_rng(seed).permutation(forward)[:count])
    return resolve_codes(frames.ranges_m[chosen].astype(np.float64), model.network.preprocess)


def _exhibit_near(model: LoadedModel, result: NearScanResult, near: NearScanConfig, config: AttackConfig) -> Exhibit:
    """The attack that moves ranges least: where none succeeded, the first scans are tried again with wider radii."""
    radius_m = near.radius_m
    few_m = result.pasted_m[:_TRIED_WIDER]
    for wider_m in _WIDER_M:
        if result.attacked.violated.any():
            break
        if wider_m > radius_m:
            radius_m = wider_m
            wide = near.model_copy(update={"radius_m": wider_m})
            result = attack_near_scans(model, few_m, wide, config)
    well = ~np.isin(result.answers, [int(motion) for motion in FORWARD_CLASSES])
    strength = np.where(well, result.attacked.violation, -np.inf) if well.any() else result.attacked.violation
    best = int(np.argmax(strength))
    where = f"an object {near.object_m * 100:.0f} cm ahead, other ranges within {radius_m:g} m"
    return _exhibit(model, result.pasted_m[best], result.attacked.scans_m[best], where)


def _exhibit_domain(model: LoadedModel, boxes: DomainSet, scans_m: Float64[np.ndarray, "domains rays"]) -> Exhibit:
    middle = len(boxes) // 2
    return _exhibit(model, (boxes.lower_m[middle] + boxes.upper_m[middle]) / 2, scans_m[middle], f"in {boxes.name}")


def _exhibit(
    model: LoadedModel, original_m: Float64[np.ndarray, "rays"], attacked_m: Float64[np.ndarray, "rays"], where: str
) -> Exhibit:
    logits = model.predict_logits(np.stack([original_m, attacked_m]))
    before, after = (MotionClass(int(row.argmax())) for row in logits)
    succeeded = after.is_forward
    told = f"answered with {after.label}" if succeeded else f"still answered with {after.label}: the attack failed"
    title = f"{model.name}, {where}: {before.label}, attacked {told}"
    return Exhibit(original_m, attacked_m, (logits[0], logits[1]), succeeded, title)


def _table(boxes: DomainSet, found: AttackResult) -> pl.DataFrame:
    return pl.DataFrame(
        {
            "set": [boxes.name] * len(boxes),
            "ray": boxes.rays,
            "violation": found.violation,
            "violated": found.violated,
            "answer": [MotionClass(int(answer)).label for answer in found.answer],
            "ranges_m": found.scans_m.tolist(),
        }
    )


def _table_near(result: NearScanResult) -> pl.DataFrame:
    return pl.DataFrame(
        {
            "answer_before": [MotionClass(int(answer)).label for answer in result.answers],
            "answer": [MotionClass(int(answer)).label for answer in result.attacked.answer],
            "violation": result.attacked.violation,
            "violated": result.attacked.violated,
            "pasted_m": result.pasted_m.tolist(),
            "ranges_m": result.attacked.scans_m.tolist(),
        }
    )
