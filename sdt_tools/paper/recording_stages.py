"""Stages that record: scenes into labelled recordings. They depend on no training, and outlive a change to it."""

from collections.abc import Sequence
from pathlib import Path

from sdt_tools.control.policy import PolicyDriver
from sdt_tools.evaluation.closed_loop import ClosedLoopConfig, drive_closed_loop
from sdt_tools.evaluation.outcome import Outcome
from sdt_tools.evaluation.policies import policy_for
from sdt_tools.frames import MotionClass
from sdt_tools.labeling.auto import label_automatically
from sdt_tools.labeling.vocabulary import LabelKind, LabelSource
from sdt_tools.models.checkpoint import load_checkpoint
from sdt_tools.paper.stage_folders import LABELS, RECORDINGS, write_note
from sdt_tools.protocols import Driver
from sdt_tools.recording.live.drivers import ConstantDriver, ExpertDriver
from sdt_tools.recording.live.scene_session import SceneRecordingConfig, record_scene
from sdt_tools.scene.practice_courses import NAME as PRACTICE_COURSE
from sdt_tools.scene.scenario import layout_for
from sdt_tools.scene.source import SceneSource


def finished_courses_stage(out: Path, seeds: Sequence[int], config: ClosedLoopConfig) -> None:
    """Note which practice courses the expert finishes."""
    layouts = [layout_for(PRACTICE_COURSE, seed) for seed in seeds]
    runs = drive_closed_loop(layouts, policy_for("expert"), config)
    write_note(out, {"seeds": [run.seed for run in runs if run.outcome is Outcome.OK]})


def record_stage(out: Path, configs: Sequence[SceneRecordingConfig], model: Path | None, prefix: str) -> None:
    """Record scenes with the expert, or a network, at the wheel, and label them with what the expert would do."""
    network = load_checkpoint(model) if model else None

    def driver(_name: str, source: SceneSource) -> Driver:
        return PolicyDriver(network) if network else ExpertDriver(source.expert)

    for config in configs:
        recording = out / RECORDINGS / f"{prefix}{config.scenario}_{config.seed:04d}.mcap"
        recording.parent.mkdir(exist_ok=True)
        record_scene(config, recording, driver)
        label_automatically(recording, LabelKind.MOTION, LabelSource.TRUTH, out / LABELS)


def record_gestures_stage(out: Path, configs: Sequence[SceneRecordingConfig]) -> None:
    """Record operators before a robot that stands, and label the pictures with the gestures that they show."""
    for config in configs:
        recording = out / RECORDINGS / f"{config.scenario}_{config.seed:04d}.mcap"
        recording.parent.mkdir(exist_ok=True)
        record_scene(config, recording, lambda *_: ConstantDriver(MotionClass.STAY))
        label_automatically(recording, LabelKind.GESTURE, LabelSource.TRUTH, out / LABELS)
