"""The demonstration: its stages in order, resumed where an earlier run stopped."""

import json
import os
import shutil
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Final

import numpy as np
import polars as pl

from sdt_tools.config import dump_config
from sdt_tools.demo import stages
from sdt_tools.demo.config import DemoConfig
from sdt_tools.demo.report import write_report
from sdt_tools.demo.summary import DemoSummary
from sdt_tools.error_analysis.analyse import PAGE
from sdt_tools.evaluation.evaluate import EvaluationSummary, evaluate_follow
from sdt_tools.evaluation.figure import runs_figure
from sdt_tools.evaluation.saving import SaveRuns
from sdt_tools.frames import MotionClass
from sdt_tools.recording.live.perturb import PerturbConfig
from sdt_tools.recording.live.scene_session import SceneRecordingConfig
from sdt_tools.runs.local import run_units
from sdt_tools.runs.unit import Unit, execute

RECORDINGS_A_UNIT: Final = 10
PRACTICE_SEEDS: Final = 1000
"""Practice worlds have the seeds below this one; what is reported never uses them."""

StageProgress = Callable[[str, int, int], None]
"""Called with the stage, and what of it is done and in all."""


def run_demo(out: Path, config: DemoConfig, workers: int, progress: StageProgress) -> DemoSummary:
    """Record, label, build, train, drive, replay, tag and show, below ``out``; finished stages are not done again.

    Raises what the stages raise; what was finished before a failure or an interruption is kept.
    """
    started_s = time.monotonic()
    out.mkdir(parents=True, exist_ok=True)
    practice, camera = _record(out, config, workers, progress)
    progress("labels", 0, 1)
    labels = execute(Unit("labels", stages.label_stage, {"recordings": (*practice, *camera)}), out)
    progress("data set", 0, 1)
    dataset = execute(
        Unit("dataset", stages.dataset_stage, {"recordings": practice, "labels": labels, "config": config.dataset}), out
    )
    model = _train(out, dataset, config, progress)
    network, baselines = _evaluate(out, model, config, workers, progress)
    progress("replay", 0, 1)
    replayed = {"model": model, "dataset": dataset, "practice": practice, "others": camera, "labels": labels}
    predictions = execute(Unit("replay", stages.replay_stage, replayed), out)
    progress("error tags", 0, 1)
    analysed = {"predictions": predictions, "recordings": (*practice, *camera), "options": config.errors}
    errors = execute(Unit("errors", stages.errors_stage, analysed, {"found_at": out / "errors"}), out)
    progress("Rerun view", 0, 1)
    shown = {"recording": camera[0], "labels": labels, "predictions": predictions, "errors": errors}
    view = execute(Unit("view", stages.view_stage, shown), out)
    _replace(view / stages.RRD, out / stages.RRD)
    figures = _figures(out, model, errors, network, config)
    summary = _summary(out, (*practice, *camera), dataset, model, (network, baselines), predictions, errors, started_s)
    write_report(out / "report.md", config, summary, figures, stages.read_note(model), stages.read_note(errors))
    (out / "demo.toml").write_text(dump_config(config), encoding="utf-8")
    (out / "summary.json").write_text(json.dumps(asdict(summary), indent=2) + "\n", encoding="utf-8")
    return summary


def practice_configs(config: DemoConfig) -> list[SceneRecordingConfig]:
    """The practice recordings: LiDAR only, now and then a motion forced on the expert."""
    order = np.random.default_rng(config.seed).permutation(PRACTICE_SEEDS)[: config.practice_recordings]
    return [
        SceneRecordingConfig(
            scenario="practice_too_close" if number % config.too_close_every == 0 else "practice",
            seed=int(seed),
            seconds=config.practice_seconds,
            camera=False,
            perturb=PerturbConfig(),
            scene=config.evaluation.scene,
        )
        for number, seed in enumerate(order)
    ]


def camera_configs(config: DemoConfig) -> list[SceneRecordingConfig]:
    """The recordings with a camera, in the scenario that is reported."""
    return [
        SceneRecordingConfig(
            scenario=config.scenario,
            seed=config.first_reported_seed + number,
            seconds=config.camera_seconds,
            perturb=PerturbConfig(),
            scene=config.evaluation.scene,
        )
        for number in range(config.camera_recordings)
    ]


def _record(
    out: Path, config: DemoConfig, workers: int, progress: StageProgress
) -> tuple[tuple[Path, ...], tuple[Path, ...]]:
    practice, camera = practice_configs(config), camera_configs(config)
    blocks = [practice[start : start + RECORDINGS_A_UNIT] for start in range(0, len(practice), RECORDINGS_A_UNIT)]
    units = [Unit(f"camera_{c.seed}", stages.record_stage, {"configs": (c,)}) for c in camera]
    units += [Unit(f"practice_{i:02d}", stages.record_stage, {"configs": tuple(b)}) for i, b in enumerate(blocks)]
    folders = run_units(units, out / "recordings", workers, lambda done, total: progress("recordings", done, total))
    return tuple(folders[len(camera) :]), tuple(folders[: len(camera)])


def _train(out: Path, dataset: Path, config: DemoConfig, progress: StageProgress) -> Path:
    progress("training", 0, config.training.loop.epochs)
    unit = Unit(
        "model",
        stages.train_stage,
        {"dataset": dataset, "config": config.training},
        {"progress": lambda record, epochs: progress("training", record.epoch, epochs)},
    )
    return execute(unit, out)


def _evaluate(
    out: Path, model: Path, config: DemoConfig, workers: int, progress: StageProgress
) -> tuple[EvaluationSummary, EvaluationSummary]:
    """The network, its failures kept as recordings; then the constant answers as baselines."""
    first = config.first_reported_seed
    seeds = range(first, first + config.closed_loop_runs)
    constants = [f"constant:{motion.label}" for motion in MotionClass]
    network, baselines = (
        evaluate_follow(
            policies,
            [config.scenario],
            seeds,
            config.evaluation,
            out / folder,
            save,
            workers,
            partial(progress, stage),
        )
        for policies, folder, save, stage in (
            ([str(model / stages.MODEL)], "evaluation", SaveRuns.FAILED, "closed loop"),
            (constants, "baselines", SaveRuns.NONE, "baselines"),
        )
    )
    return network, baselines


def _figures(
    out: Path, model: Path, errors: Path, evaluation: EvaluationSummary, config: DemoConfig
) -> dict[str, Path]:
    folder = out / "figures"
    folder.mkdir(exist_ok=True)
    figures = {
        "curve": (model / stages.MODEL / "curve.png", folder / "learning_curve.png"),
        "epsilon": (errors / stages.ERRORS / "epsilon.png", folder / "epsilon.png"),
        "tags": (errors / stages.ERRORS / "tags.png", folder / "tags.png"),
    }
    for source, target in figures.values():
        _replace(source, target)
    driven = folder / f"{config.scenario}_runs.png"
    name = f"policy:{stages.MODEL}"
    runs, traces = (
        pl.read_parquet(table).filter(pl.col("policy") == name) for table in (evaluation.runs, evaluation.traces)
    )
    runs_figure(runs, traces, config.scenario, f"{stages.MODEL} in {config.scenario}", driven)
    page = errors / stages.ERRORS / PAGE
    return {**{name: target for name, (_, target) in figures.items()}, "runs": driven, "page": page}


def _summary(
    out: Path,
    recordings: Sequence[Path],
    dataset: Path,
    model: Path,
    evaluations: tuple[EvaluationSummary, EvaluationSummary],
    predictions: Path,
    errors: Path,
    started_s: float,
) -> DemoSummary:
    recorded = [stages.read_note(folder) for folder in recordings]
    drawn, trained, replayed, tagged = (stages.read_note(f) for f in (dataset, model, predictions, errors))
    network, baselines = evaluations
    return DemoSummary(
        recordings=len(stages.recordings_in(recordings)),
        frames=sum(note["frames"] for note in recorded),
        dropped_frames=sum(note["dropped"] for note in recorded),
        train_frames=drawn["train_frames"],
        val_frames=drawn["val_frames"],
        train_accuracy=trained["train_accuracy"],
        val_accuracy=trained["val_accuracy"],
        val_forward_recall=trained["val_forward_recall"],
        closed_loop=_driven(network)[str(model / stages.MODEL)],
        baselines=_driven(baselines),
        real_time_factor=round(network.real_time_factor, 1),
        replay_frames_per_s=round(replayed["frames_per_s"], 1),
        tags=tagged["tags"],
        conditions=tagged["conditions"],
        rrd=str(out / stages.RRD),
        report=str(out / "report.md"),
        seconds=round(time.monotonic() - started_s, 1),
    )


def _driven(evaluation: EvaluationSummary) -> dict[str, dict[str, dict[str, object]]]:
    return {
        name: {scenario: {"ok": t.ok, "runs": t.runs, "wilson": list(t.wilson)} for scenario, t in tallies.items()}
        for name, tallies in evaluation.models.items()
    }


def _replace(source: Path, target: Path) -> None:
    """Copy ``source`` over ``target`` at once."""
    scratch = target.with_name(f".{target.name}.{os.getpid()}.part")
    shutil.copyfile(source, scratch)
    scratch.replace(target)
