"""The stage that draws a data set from recordings."""

import shutil
from collections.abc import Sequence
from pathlib import Path

from sdt_tools.dataset.build import build_dataset
from sdt_tools.dataset.config import DatasetConfig
from sdt_tools.paper.stage_folders import DATASET, LABELS, RECORDINGS, write_note
from sdt_tools.robustness.conflicts import conflict_check


def dataset_stage(
    out: Path, recorded: Sequence[Path], validating: Sequence[Path], config: DatasetConfig, level: int
) -> None:
    """Draw a data set from the recordings of some stages, to learn from and to validate with.

    Labels that domains of ``level`` forbid are refused.
    """
    labels = out / LABELS
    labels.mkdir()
    for journal in (journal for folder in [*recorded, *validating] for journal in (folder / LABELS).iterdir()):
        shutil.copy(journal, labels)
    check = conflict_check(level)
    summary = build_dataset(
        _recordings(recorded), labels, config, out / DATASET, check, validation=_recordings(validating)
    )
    shutil.rmtree(labels)
    write_note(
        out,
        {
            "train_frames": summary.train_frames,
            "val_frames": summary.val_frames,
            "recordings": summary.recordings,
        },
    )


def _recordings(stages: Sequence[Path]) -> list[Path]:
    return sorted(path for folder in stages for path in (folder / RECORDINGS).glob("*.mcap"))
