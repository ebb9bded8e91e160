"""The data of the follow study: practice recordings of the expert, then of networks that the expert corrects."""

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Final

from sdt_tools.demo.demo import StageProgress
from sdt_tools.paper.dataset_stage import dataset_stage
from sdt_tools.paper.follow_config import FollowStudyConfig
from sdt_tools.paper.recording_stages import finished_courses_stage, record_stage
from sdt_tools.paper.stage_folders import read_note
from sdt_tools.paper.training_stage import train_stage
from sdt_tools.recording.live.scene_session import SceneRecordingConfig
from sdt_tools.robustness.domains import SafetyLevel
from sdt_tools.runs.local import run_units
from sdt_tools.runs.unit import Unit, execute
from sdt_tools.scene.practice_courses import NAME as PRACTICE_COURSE
from sdt_tools.training.follow import FollowTrainingConfig
from sdt_tools.training.loop import LoopConfig

RECORDINGS_A_UNIT: Final = 25


def study_data(
    out: Path, config: FollowStudyConfig, workers: int, progress: StageProgress
) -> tuple[tuple[Path, ...], Path]:
    """Data sets of the paper's size, one a training seed, and the large one."""
    worlds = _record(out, "worlds", _worlds(config), None, workers, progress)
    courses = _courses(out, config, workers, progress)
    recorded = [*worlds, *_record(out, "courses", courses, None, workers, progress)]
    for number in range(1, config.aggregation.rounds + 1):
        pilot = _pilot(out, recorded, config, number, progress)
        worlds_again = _worlds(config)[:: config.aggregation.worlds_every]
        driven = _driven([*courses, *worlds_again], f"policy:{pilot.name}", config)
        recorded += _record(out, f"round{number}", driven, pilot, workers, progress)
    paper = run_units(
        [
            _dataset(f"data/paper-{seed}", worlds, config.paper_data.model_copy(update={"seed": seed}))
            for seed in range(config.training_seeds)
        ],
        out,
        workers,
        partial(progress, "data sets"),
    )
    return tuple(paper), execute(_dataset("data/large", recorded, config.large_data), out)


def _worlds(config: FollowStudyConfig) -> list[SceneRecordingConfig]:
    practice = config.practice
    names = [("practice", practice.worlds), ("practice_too_close", practice.too_close)]
    return [_recording(config, name, seed, practice.world_seconds) for name, count in names for seed in range(count)]


def _courses(out: Path, config: FollowStudyConfig, workers: int, progress: StageProgress) -> list[SceneRecordingConfig]:
    """Recordings of the courses that the expert finishes."""
    blocks = [
        range(first, min(first + RECORDINGS_A_UNIT, config.practice.courses))
        for first in range(0, config.practice.courses, RECORDINGS_A_UNIT)
    ]
    units = [
        Unit(
            f"data/finished/{block[0]:04d}",
            finished_courses_stage,
            {"seeds": tuple(block), "config": config.evaluation},
        )
        for block in blocks
    ]
    folders = run_units(units, out, workers, partial(progress, "courses"))
    seeds = [seed for folder in folders for seed in read_note(folder)["seeds"]]
    return [_recording(config, PRACTICE_COURSE, seed, config.practice.course_seconds) for seed in seeds]


def _recording(config: FollowStudyConfig, name: str, seed: int, seconds: float) -> SceneRecordingConfig:
    return SceneRecordingConfig(
        scenario=name,
        seed=seed,
        seconds=seconds,
        camera=False,
        perturb=config.practice.perturb,
        scene=config.practice.scene,
    )


def _driven(
    recordings: Sequence[SceneRecordingConfig], driver: str, config: FollowStudyConfig
) -> list[SceneRecordingConfig]:
    """The same worlds for a network, longer, and without forced motions: it makes mistakes of its own."""
    changed = {"driver": driver, "perturb": None, "seconds": config.aggregation.seconds}
    return [recording.model_copy(update=changed) for recording in recordings]


def _record(
    out: Path,
    name: str,
    recordings: Sequence[SceneRecordingConfig],
    model: Path | None,
    workers: int,
    progress: StageProgress,
) -> list[Path]:
    blocks = [recordings[start : start + RECORDINGS_A_UNIT] for start in range(0, len(recordings), RECORDINGS_A_UNIT)]
    prefix = f"{name}_" if model else ""
    units = [
        Unit(
            f"recordings/{name}/{number:03d}",
            record_stage,
            {"configs": tuple(block), "model": model, "prefix": prefix},
        )
        for number, block in enumerate(blocks)
    ]
    return run_units(units, out, workers, partial(progress, f"recordings: {name}"))


def _pilot(
    out: Path, recorded: Sequence[Path], config: FollowStudyConfig, number: int, progress: StageProgress
) -> Path:
    """The network that a round of aggregation puts at the wheel."""
    aggregation = config.aggregation
    drawn = config.large_data.model_copy(
        update={"train_frames": aggregation.frames, "val_frames": aggregation.frames // 5}
    )
    dataset = execute(_dataset(f"data/pilot{number}", recorded, drawn), out)
    training = FollowTrainingConfig(
        architecture=aggregation.architecture, loop=LoopConfig(epochs=aggregation.epochs, extra_epochs=0)
    )
    name = f"pilot{number}"
    unit = Unit(
        f"models/{name}",
        train_stage,
        {"dataset": dataset, "config": training, "name": name},
        {"progress": lambda record, epochs: progress(f"training {name}", record.epoch, epochs)},
    )
    return execute(unit, out) / name


def _dataset(name: str, recorded: Sequence[Path], config: object) -> Unit:
    arguments = {"recorded": tuple(recorded), "config": config, "level": int(SafetyLevel.FOUR)}
    return Unit(name, dataset_stage, arguments)
