"""The stage that trains a network on a data set."""

from pathlib import Path

from sdt_tools.paper.stage_folders import DATASET, write_note
from sdt_tools.training.follow import FollowTrainingConfig, Progress, train_follow


def train_stage(
    out: Path, dataset: Path, config: FollowTrainingConfig, name: str, progress: Progress | None = None
) -> None:
    """Train one network, the checkpoint called ``name``, and note how it came out."""
    summary = train_follow(dataset / DATASET, config, out / name, progress)
    write_note(
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
