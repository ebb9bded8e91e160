"""The data of the vision study: recordings of operators who signal, and the images drawn from them."""

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Final

from sdt_tools.demo.demo import StageProgress
from sdt_tools.paper.dataset_stage import dataset_stage
from sdt_tools.paper.recording_stages import record_gestures_stage
from sdt_tools.paper.vision_config import GesturePracticeConfig, VisionStudyConfig
from sdt_tools.recording.live.scene_session import SceneRecordingConfig
from sdt_tools.runs.local import run_units
from sdt_tools.runs.unit import Unit
from sdt_tools.scene.practice_gestures import NAME as PRACTICE_GESTURES

_RECORDINGS_A_UNIT: Final = 20


def vision_data(out: Path, config: VisionStudyConfig, workers: int, progress: StageProgress) -> tuple[Path, ...]:
    """The stages of the data sets, one a training seed, each drawn anew from the same recordings."""
    recorded = _record(out, "gestures", config.practice, workers, progress)
    unseen = _record(out, "unseen_gestures", config.unseen, workers, progress)
    units = [
        Unit(
            f"data/gestures-{seed}",
            dataset_stage,
            {
                "recorded": tuple(recorded),
                "validating": tuple(unseen),
                "config": config.data.model_copy(update={"seed": seed}),
                "level": config.data.conflict_level,
            },
        )
        for seed in training_seeds(config)
    ]
    return tuple(run_units(units, out, workers, partial(progress, "data sets")))


def training_seeds(config: VisionStudyConfig) -> range:
    """The seeds of trainings and of the draws of their images."""
    return range(config.first_training_seed, config.first_training_seed + config.training_seeds)


def _record(
    out: Path, name: str, practice: GesturePracticeConfig, workers: int, progress: StageProgress
) -> Sequence[Path]:
    seeds = range(practice.first_seed, practice.first_seed + practice.worlds)
    configs = [
        SceneRecordingConfig(
            scenario=PRACTICE_GESTURES,
            seed=seed,
            seconds=practice.seconds,
            driver="constant:stay",
            scene=practice.scene,
        )
        for seed in seeds
    ]
    blocks = [configs[start : start + _RECORDINGS_A_UNIT] for start in range(0, len(configs), _RECORDINGS_A_UNIT)]
    units = [
        Unit(f"recordings/{name}/{number:03d}", record_gestures_stage, {"configs": tuple(block)})
        for number, block in enumerate(blocks)
    ]
    return run_units(units, out, workers, partial(progress, f"recordings: {name}"))
