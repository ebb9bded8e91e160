"""The vision study, from recordings to tables: Tables I and V of the paper with intervals, and attacks."""

import shutil
from functools import partial
from pathlib import Path

import polars as pl

from sdt_tools.config import dump_config
from sdt_tools.demo.demo import StageProgress
from sdt_tools.evaluation.vision.evaluate import VisionSummary, evaluate_vision
from sdt_tools.paper.stage_folders import read_note
from sdt_tools.paper.vision_config import VisionStudyConfig
from sdt_tools.paper.vision_data import vision_data
from sdt_tools.paper.vision_models import CONTROL, TrainedVision, attack_models, train_vision_models
from sdt_tools.paper.vision_report import EXHIBIT, VisionTables, write_vision_report
from sdt_tools.paper.vision_stages import ATTACK_FIGURE, baseline_stage
from sdt_tools.runs.local import run_units
from sdt_tools.runs.unit import Unit
from sdt_tools.scene.scenario import STANDARD_VISION


def run_vision_study(out: Path, config: VisionStudyConfig, workers: int, progress: StageProgress) -> Path:
    """Do all that is not done yet below ``out``, and write its report; return the report's path.

    The networks of the first training seed come first, and drive before the others are trained.
    """
    out.mkdir(parents=True, exist_ok=True)
    (out / "study.toml").write_text(dump_config(config), encoding="utf-8")
    data = vision_data(out, config, workers, progress)
    baselines = [Unit(f"baselines/{folder.name}", baseline_stage, {"dataset": folder}) for folder in data]
    guesses = run_units(baselines, out, workers, partial(progress, "baselines"))
    first = config.model_copy(update={"training_seeds": 1})
    driven = [one for one in train_vision_models(out, data[:1], first, workers, progress) if one.family != CONTROL]
    evaluation = _drive(out, driven, config, workers, progress)
    trained = train_vision_models(out, data, config, workers, progress)
    attacks = attack_models(out, trained, config, workers, progress)
    tables = VisionTables(
        networks=pl.DataFrame([_row(one) for one in trained]),
        rates=pl.concat([_rates(one, folder) for one, folder in zip(trained, attacks, strict=True)]),
        baseline=[read_note(folder)["val_accuracy"] for folder in guesses],
        modes={one.epsilon: evaluation.models[str(one.checkpoint)] for one in driven},
        totals={one.epsilon: evaluation.total[str(one.checkpoint)] for one in driven},
        spread={one.epsilon: evaluation.spread[str(one.checkpoint)] for one in driven},
        errors_while={one.epsilon: evaluation.errors_while[str(one.checkpoint)] for one in driven},
        follow=Path(config.follow).name,
    )
    tables.networks.write_parquet(out / "networks.parquet")
    tables.rates.write_parquet(out / "attacks.parquet")
    pl.read_parquet(evaluation.runs).drop("model", "recording").write_parquet(out / "runs.parquet")
    shutil.copy(attacks[trained.index(driven[0])] / ATTACK_FIGURE, out / EXHIBIT)
    return write_vision_report(tables, config, out)


def _drive(
    out: Path, driven: list[TrainedVision], config: VisionStudyConfig, workers: int, progress: StageProgress
) -> VisionSummary:
    return evaluate_vision(
        [str(one.checkpoint) for one in driven],
        config.follow,
        STANDARD_VISION,
        range(config.first_reported_seed, config.first_reported_seed + config.runs),
        config.evaluation,
        out / "evaluation",
        workers=workers,
        progress=partial(progress, "closed loop"),
    )


def _row(one: TrainedVision) -> dict[str, object]:
    note = read_note(one.folder)
    recall = note.pop("val_recall")
    recalls = {f"val_recall_{gesture}": share for gesture, share in recall.items()}
    return {"network": one.folder.name, "family": one.family, "seed": one.seed, **note, **recalls}


def _rates(one: TrainedVision, attack: Path) -> pl.DataFrame:
    rates = pl.DataFrame(
        [{name: value for name, value in rate.items() if name != "wilson"} for rate in read_note(attack)["rates"]]
    )
    return rates.select(pl.lit(one.family).alias("family"), pl.lit(one.seed).alias("seed"), pl.all())
