"""The follow study, from recordings to tables: Tables II, III and IV of the paper with intervals, and level 4."""

import re
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from statistics import median
from typing import Final

import polars as pl

from sdt_tools.config import dump_config
from sdt_tools.demo.demo import StageProgress
from sdt_tools.evaluation.evaluate import evaluate_follow
from sdt_tools.paper.follow_config import FollowStudyConfig
from sdt_tools.paper.follow_data import study_data
from sdt_tools.paper.follow_models import MAIN, Family, Trained, settings, swept, train_models
from sdt_tools.paper.follow_report import write_follow_report
from sdt_tools.paper.follow_tables import FollowTables
from sdt_tools.paper.judging_stages import certify_stage, check_stage
from sdt_tools.paper.stage_folders import read_note
from sdt_tools.runs.local import run_units
from sdt_tools.runs.unit import Unit
from sdt_tools.scene.scenario import STANDARD_FOLLOW

_LOW_IS_GOOD: Final = re.compile("pasted|flipped|loss")


def run_follow_study(out: Path, config: FollowStudyConfig, workers: int, progress: StageProgress) -> Path:
    """Do all that is not done yet below ``out``, and write its report; return the report's path."""
    out.mkdir(parents=True, exist_ok=True)
    (out / "study.toml").write_text(dump_config(config), encoding="utf-8")
    paper_data, large_data = study_data(out, config, workers, progress)
    data = (paper_data, large_data)
    driven = train_models(out, dict.fromkeys(MAIN, config.training_seeds), *data, config, workers, progress)
    evaluation = evaluate_follow(
        [str(one.checkpoint) for one in driven],
        STANDARD_FOLLOW,
        range(config.first_reported_seed, config.first_reported_seed + config.runs),
        config.evaluation,
        out / "evaluation",
        workers=workers,
        progress=partial(progress, "closed loop"),
    )
    sweep = train_models(out, dict.fromkeys(swept(config), config.sweep_seeds), *data, config, workers, progress)
    trained = [*driven, *sweep]
    searched, *certificates = _certify(out, trained, config, workers, progress)
    checks = _check(out, driven, large_data, workers, progress)
    known = pl.DataFrame(
        {
            "policy": [f"policy:{one.checkpoint.name}" for one in driven],
            "network": [one.checkpoint.name for one in driven],
            "family": [one.family.name for one in driven],
            "training_seed": [one.seed for one in driven],
        }
    )
    tables = FollowTables(
        networks=pl.DataFrame([_row(*one, config) for one in zip(trained, certificates, strict=True)]),
        runs=pl.read_parquet(evaluation.runs).join(known, on="policy"),
        traces=pl.read_parquet(evaluation.traces).join(known, on="policy"),
        searched=read_note(searched),
        checks=_worst_checks(driven, checks),
        real_time_factor=evaluation.real_time_factor,
    )
    tables.networks.write_parquet(out / "networks.parquet")
    tables.runs.drop("model").write_parquet(out / "runs.parquet")  # a path of this machine; ``network`` names it
    return write_follow_report(tables, out)


def _certify(
    out: Path, trained: Sequence[Trained], config: FollowStudyConfig, workers: int, progress: StageProgress
) -> list[Path]:
    """First what is searched with many restarts: one network of level 4. Then each network.

    Networks are judged at their own level; those of level 0 at level 3, where violations are to be found.
    """
    hard = next(one for one in trained if one.family == Family("paper", "gate", 4))
    units = [
        Unit(
            f"searched/{hard.checkpoint.name}",
            certify_stage,
            {"model": hard.checkpoint, "level": 4, "config": config.searched_hard},
        )
    ]
    units += [
        Unit(
            f"certificates/{one.checkpoint.name}",
            certify_stage,
            {"model": one.checkpoint, "level": one.family.level or 3, "config": config.certify},
        )
        for one in trained
    ]
    return run_units(units, out, workers, partial(progress, "certificates"))


def _check(out: Path, trained: Sequence[Trained], data: Path, workers: int, progress: StageProgress) -> list[Path]:
    """The standing checks of each network, on the validation frames of the large data, which none has learnt from."""
    units = [
        Unit(f"checks/{one.checkpoint.name}", check_stage, {"model": one.checkpoint, "dataset": data})
        for one in trained
    ]
    return run_units(units, out, workers, partial(progress, "standing checks"))


def _row(one: Trained, certificate: Path, config: FollowStudyConfig) -> dict[str, object]:
    family, judged = one.family, read_note(certificate)
    return {
        "network": one.checkpoint.name,
        "family": family.name,
        "size": family.size,
        "arch": family.arch,
        "level": family.level,
        "weight": family.weight,
        "effective_weight": settings(family, one.seed, config).safety.weight,
        "seed": one.seed,
        **read_note(one.folder),
        **{name: judged[name] for name in ("domains", "certified", "violated", "unknown", "error", "min_margin")},
    }


def _worst_checks(trained: Sequence[Trained], checks: Sequence[Path]) -> dict[str, dict[str, dict[str, float]]]:
    """Median and worst share of each check over the networks of a family."""
    shares: dict[str, dict[str, list[float]]] = {}
    for one, folder in zip(trained, checks, strict=True):
        for name, rate in read_note(folder).items():
            shares.setdefault(one.family.name, {}).setdefault(name, []).append(rate["share"])
    return {
        family: {
            name: {"median": median(values), "worst": max(values) if _LOW_IS_GOOD.search(name) else min(values)}
            for name, values in of_family.items()
        }
        for family, of_family in shares.items()
    }
