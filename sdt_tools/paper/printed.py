"""What the paper prints, to stand beside what is measured."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

TRAINING_FRAMES: Final = 2705
VALIDATION_FRAMES: Final = 570


@dataclass(frozen=True)
class PrintedLevel:
    """One safety level: Table III's accuracies in percent, and the scenarios of Table IV that were passed."""

    train_percent: float
    val_percent: float
    passed: frozenset[str]


_FAILED_AT_ONE: Final = frozenset({"around_boxes", "narrow_hallway"})
SCENARIOS: Final = (
    "plain",
    "around_boxes",
    "out_of_corner",
    "through_gate",
    "around_table",
    "garage_parking",
    "narrow_hallway",
)
"""The follow scenarios in the order of Table IV."""

LEVELS: Final[Mapping[int, PrintedLevel]] = {
    0: PrintedLevel(98.8, 84.7, frozenset(SCENARIOS)),
    1: PrintedLevel(99.7, 76.8, frozenset(SCENARIOS) - _FAILED_AT_ONE),
    2: PrintedLevel(97.1, 73.4, frozenset(SCENARIOS) - _FAILED_AT_ONE - {"through_gate"}),
    3: PrintedLevel(57.3, 53.2, frozenset()),
}
