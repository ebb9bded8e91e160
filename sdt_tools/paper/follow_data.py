"""The data of the follow study: practice recordings of the expert, then of networks that the expert corrects."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Final

from sdt_tools.dataset.config import DatasetConfig
from sdt_tools.demo.demo import StageProgress
from sdt_tools.paper.dataset_stage import dataset_stage
from sdt_tools.paper.follow_config import FollowStudyConfig, PracticeConfig
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


@dataclass(frozen=True)
class _Practice:
    """Practice recordings of the expert, by their settings, and the stages that hold them."""

    worlds: tuple[SceneRecordingConfig, ...]
    courses: tuple[SceneRecordingConfig, ...]
    recorded_worlds: tuple[Path, ...]
    recorded_courses: tuple[Path, ...]

    @property
    def recorded(self) -> list[Path]:
        return [*self.recorded_worlds, *self.recorded_courses]


def study_data(
    out: Path, config: FollowStudyConfig, workers: int, progress: StageProgress
) -> tuple[tuple[Path, ...], Path]:
    """Data sets of the paper's size, one a training seed, and the large one.

    Those of the paper's size share no recording: each has its part of the practice worlds, of which it takes most of
    what is not too near in time. Validation frames come from worlds of their own, which no choice of data, network or
    schedule has seen.
    """
    practice = _practise(out, "", config.practice, config, workers, progress)
    unseen = _practise(out, "unseen_", config.unseen, config, workers, progress)
    recorded, validating = practice.recorded, unseen.recorded
    for number in range(1, config.aggregation.rounds + 1):
        pilot = _pilot(out, recorded, config, number, progress)
        for whose, sink, prefix in ((practice, recorded, ""), (unseen, validating, "unseen_")):
            again = [*whose.courses, *whose.worlds[:: config.aggregation.worlds_every]]
            driven = _driven(again, f"policy:{pilot.name}", config)
            sink += _record(out, f"{prefix}round{number}", driven, pilot, workers, progress)
    seeds = config.training_seeds
    paper = run_units(
        [
            _dataset(
                f"data/paper-{seed}",
                practice.recorded_worlds[seed::seeds],
                unseen.recorded_worlds[seed::seeds],
                config.paper_data.model_copy(update={"seed": seed}),
            )
            for seed in range(seeds)
        ],
        out,
        workers,
        partial(progress, "data sets"),
    )
    return tuple(paper), execute(_dataset("data/large", recorded, validating, config.large_data), out)


def _practise(
    out: Path, prefix: str, practice: PracticeConfig, config: FollowStudyConfig, workers: int, progress: StageProgress
) -> _Practice:
    """Record the expert in practice worlds, and in those courses that it finishes."""
    worlds = tuple(
        _recording(practice, name, practice.first_seed + number, practice.world_seconds)
        for name, number in _interleaved({"practice": practice.worlds, "practice_too_close": practice.too_close})
    )
    courses = tuple(
        _recording(practice, PRACTICE_COURSE, seed, practice.course_seconds)
        for seed in _finished_courses(out, prefix, practice, config, workers, progress)
    )
    return _Practice(
        worlds,
        courses,
        tuple(_record(out, f"{prefix}worlds", worlds, None, workers, progress)),
        tuple(_record(out, f"{prefix}courses", courses, None, workers, progress)),
    )


def _interleaved(counts: Mapping[str, int]) -> list[tuple[str, int]]:
    """Each name with the numbers below its count, evenly mixed: every stretch of the list holds all in proportion."""
    numbered = [(name, number) for name, count in counts.items() for number in range(count)]
    return sorted(numbered, key=lambda one: (one[1] + 0.5) / counts[one[0]])


def _finished_courses(
    out: Path, prefix: str, practice: PracticeConfig, config: FollowStudyConfig, workers: int, progress: StageProgress
) -> list[int]:
    """Seeds of the courses that the expert finishes."""
    end = practice.first_seed + practice.courses
    units = [
        Unit(
            f"data/{prefix}finished/{first:04d}",
            finished_courses_stage,
            {"seeds": tuple(range(first, min(first + RECORDINGS_A_UNIT, end))), "config": config.evaluation},
        )
        for first in range(practice.first_seed, end, RECORDINGS_A_UNIT)
    ]
    folders = run_units(units, out, workers, partial(progress, f"{prefix}courses"))
    return [seed for folder in folders for seed in read_note(folder)["seeds"]]


def _recording(practice: PracticeConfig, name: str, seed: int, seconds: float) -> SceneRecordingConfig:
    return SceneRecordingConfig(
        scenario=name,
        seed=seed,
        seconds=seconds,
        camera=False,
        perturb=practice.perturb,
        scene=practice.scene,
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
    dataset = execute(_dataset(f"data/pilot{number}", recorded, (), drawn), out)
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


def _dataset(name: str, recorded: Sequence[Path], validating: Sequence[Path], config: DatasetConfig) -> Unit:
    """Without any ``validating``, a share of what is ``recorded`` validates."""
    arguments = {
        "recorded": tuple(recorded),
        "validating": tuple(validating),
        "config": config,
        "level": int(SafetyLevel.FOUR),
    }
    return Unit(name, dataset_stage, arguments)
