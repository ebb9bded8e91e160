"""The stages of the follow study, each a function that fills a folder from what the stages before have made."""

import json
import shutil
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from sdt_tools.certify.certification import certify_checkpoint
from sdt_tools.certify.specification import specification_of
from sdt_tools.certify.verdicts import CertifyConfig
from sdt_tools.control.policy import PolicyDriver
from sdt_tools.dataset.build import build_dataset
from sdt_tools.dataset.config import DatasetConfig
from sdt_tools.dataset.load import load_dataset
from sdt_tools.evaluation.closed_loop import ClosedLoopConfig, drive_closed_loop
from sdt_tools.evaluation.outcome import Outcome
from sdt_tools.evaluation.policies import policy_for
from sdt_tools.evaluation.standing_checks import standing_checks
from sdt_tools.labeling.auto import label_automatically
from sdt_tools.labeling.vocabulary import LabelKind, LabelSource
from sdt_tools.models.checkpoint import load_checkpoint
from sdt_tools.protocols import Driver
from sdt_tools.recording.drivers import ExpertDriver
from sdt_tools.recording.scene_session import SceneRecordingConfig, record_scene
from sdt_tools.robustness.conflicts import conflict_check
from sdt_tools.scene.practice_courses import NAME as PRACTICE_COURSE
from sdt_tools.scene.scenario import layout_for
from sdt_tools.scene.source import SceneSource
from sdt_tools.training.follow import FollowTrainingConfig, Progress, train_follow

DATASET: Final = "data"
CERTIFICATE_FOLDER: Final = "certificate"
_NOTE: Final = "note.json"
_RECORDINGS: Final = "recordings"
_LABELS: Final = "labels"


def finished_courses_stage(out: Path, seeds: Sequence[int], config: ClosedLoopConfig) -> None:
    """Note which practice courses the expert finishes."""
    layouts = [layout_for(PRACTICE_COURSE, seed) for seed in seeds]
    runs = drive_closed_loop(layouts, policy_for("expert"), config)
    _note(out, {"seeds": [run.seed for run in runs if run.outcome is Outcome.OK]})


def record_stage(out: Path, configs: Sequence[SceneRecordingConfig], model: Path | None, prefix: str) -> None:
    """Record scenes with the expert, or a network, at the wheel, and label them with what the expert would do."""
    network = load_checkpoint(model) if model else None

    def driver(_name: str, source: SceneSource) -> Driver:
        return PolicyDriver(network) if network else ExpertDriver(source.expert)

    for config in configs:
        recording = out / _RECORDINGS / f"{prefix}{config.scenario}_{config.seed:04d}.mcap"
        recording.parent.mkdir(exist_ok=True)
        record_scene(config, recording, driver)
        label_automatically(recording, LabelKind.MOTION, LabelSource.TRUTH, out / _LABELS)


def dataset_stage(out: Path, recorded: Sequence[Path], config: DatasetConfig, level: int) -> None:
    """Draw a data set from the recordings of some stages; labels that domains of ``level`` forbid are refused."""
    labels = out / _LABELS
    labels.mkdir()
    for journal in (journal for folder in recorded for journal in (folder / _LABELS).iterdir()):
        shutil.copy(journal, labels)
    recordings = sorted(path for folder in recorded for path in (folder / _RECORDINGS).glob("*.mcap"))
    summary = build_dataset(recordings, labels, config, out / DATASET, conflict_check(level))
    shutil.rmtree(labels)
    _note(out, {"train_frames": summary.train_frames, "val_frames": summary.val_frames, "recordings": len(recordings)})


def train_stage(
    out: Path, dataset: Path, config: FollowTrainingConfig, name: str, progress: Progress | None = None
) -> None:
    """Train one network, the checkpoint called ``name``, and note how it came out."""
    summary = train_follow(dataset / DATASET, config, out / name, progress)
    _note(
        out,
        {
            "train_accuracy": summary.train.accuracy,
            "val_accuracy": summary.val.accuracy,
            "train_forward_recall": summary.train.forward_recall,
            "val_forward_recall": summary.val.forward_recall,
            "satisfied": summary.satisfied,
            "epochs": summary.last.epoch,
            "seconds": summary.seconds,
        },
    )


def certify_stage(out: Path, model: Path, level: int, config: CertifyConfig) -> None:
    """Judge every domain of a level."""
    certification = certify_checkpoint(model, specification_of(level, None), config, out / CERTIFICATE_FOLDER)
    _note(out, certification.certificate.model_dump(mode="json"))


def check_stage(out: Path, model: Path, dataset: Path) -> None:
    """Put a network to the standing checks, on the validation frames of a data set."""
    report = standing_checks(load_checkpoint(model), load_dataset(dataset / DATASET).val)
    _note(out, report.document())


def read_note(folder: Path) -> dict[str, Any]:
    """What a stage said of itself."""
    note: dict[str, Any] = json.loads((folder / _NOTE).read_text(encoding="utf-8"))
    return note


def _note(out: Path, document: Mapping[str, object]) -> None:
    (out / _NOTE).write_text(json.dumps(document, indent=2) + "\n", encoding="utf-8")
