"""What a data set was made from and what is in it, written beside its frames."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import tomli_w

from sdt_tools import __version__
from sdt_tools.dataset.candidates import LabelledRecording
from sdt_tools.dataset.config import DatasetConfig
from sdt_tools.frames import RAYS

MANIFEST_FILE: Final = "manifest.toml"
FORMAT: Final = 1


@dataclass(frozen=True)
class Conflict:
    """A frame whose label a safety domain forbids."""

    recording: str
    stamp_ns: int
    label: str


@dataclass(frozen=True)
class Used:
    """A recording, the split it went to, and how many of its frames were taken."""

    recording: LabelledRecording
    split: str
    frames: int


def manifest_toml(
    config: DatasetConfig,
    classes: Sequence[str],
    counts: dict[str, dict[str, int]],
    used: Sequence[Used],
    conflicts: Sequence[Conflict] | None,
    frames_hash: str,
) -> str:
    """The manifest; ``counts`` by split and class, ``conflicts`` None where they were not looked for."""
    document: dict[str, Any] = {
        "format": FORMAT,
        "hash": frames_hash,
        "code_version": __version__,
        **({"rays": RAYS} if config.kind == "motion" else {}),
        "classes": list(classes),
        "config": config.model_dump(mode="json", exclude_none=True),
        "frames": {split: sum(by_class.values()) for split, by_class in counts.items()},
        "counts": counts,
        "conflicts": {
            "checked": conflicts is not None,
            "frames": [
                {"recording": conflict.recording, "stamp_ns": conflict.stamp_ns, "label": conflict.label}
                for conflict in conflicts or ()
            ],
        },
        "recordings": [_entry(entry, "scans" if config.kind == "motion" else "pictures") for entry in used],
    }
    return tomli_w.dumps(document)


def _entry(used: Used, frames: str) -> dict[str, Any]:
    recording = used.recording
    return {
        "recording": recording.path.stem,
        "recording_id": recording.recording_id,
        "scenario": recording.scenario,
        "split": used.split,
        "sha256": recording.sha256,
        "journal": "" if recording.journal is None else recording.journal.name,
        "journal_sha256": recording.journal_sha256,
        "truncated": recording.incomplete is not None and recording.incomplete.truncated,
        "damaged_chunks": 0 if recording.incomplete is None else len(recording.incomplete.damage),
        frames: recording.recorded,
        **({"unreadable_pictures_ns": list(recording.unreadable_ns)} if recording.unreadable_ns else {}),
        "labels": recording.labels,
        "interventions": recording.interventions,
        "unmatched_labels": recording.unmatched,
        "disputed_stamps": recording.disputed,
        "broken_lines": recording.broken_lines,
        "frames": used.frames,
    }
