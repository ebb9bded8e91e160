"""The figures of the demonstration."""

from dataclasses import dataclass


@dataclass(frozen=True)
class DemoSummary:
    """The figures of the demonstration, and where to look."""

    recordings: int
    frames: int
    dropped_frames: int
    train_frames: int
    val_frames: int
    train_accuracy: float
    val_accuracy: float
    val_forward_recall: float
    closed_loop: dict[str, dict[str, object]]
    baselines: dict[str, dict[str, dict[str, object]]]
    real_time_factor: float
    replay_frames_per_s: float
    tags: dict[str, int]
    conditions: list[dict[str, object]]
    rrd: str
    report: str
    seconds: float
