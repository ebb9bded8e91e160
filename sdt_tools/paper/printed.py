"""What the paper prints, to stand beside what is measured."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from sdt_tools.scene.scenario import STANDARD_FOLLOW, STANDARD_VISION

TRAINING_FRAMES: Final = 2705
VALIDATION_FRAMES: Final = 570
TRAINING_IMAGES: Final = 1825


@dataclass(frozen=True)
class PrintedLevel:
    """One safety level: Table III's accuracies in percent, and the scenarios of Table IV that were passed."""

    train_percent: float
    val_percent: float
    passed: frozenset[str]


_FAILED_AT_ONE: Final = frozenset({"around_boxes", "narrow_hallway"})
LEVELS: Final[Mapping[int, PrintedLevel]] = {
    0: PrintedLevel(98.8, 84.7, frozenset(STANDARD_FOLLOW)),
    1: PrintedLevel(99.7, 76.8, frozenset(STANDARD_FOLLOW) - _FAILED_AT_ONE),
    2: PrintedLevel(97.1, 73.4, frozenset(STANDARD_FOLLOW) - _FAILED_AT_ONE - {"through_gate"}),
    3: PrintedLevel(57.3, 53.2, frozenset()),
}


@dataclass(frozen=True)
class PrintedEpsilon:
    """One ε of Table I: accuracy on attacked training images and on clean validation images, in percent."""

    attacked_train_percent: float
    val_percent: float


EPSILONS: Final[Mapping[int, PrintedEpsilon]] = {
    0: PrintedEpsilon(99.7, 98.4),
    1: PrintedEpsilon(52.0, 92.8),
    2: PrintedEpsilon(32.5, 71.9),
}

MODE_ERRORS: Final[Mapping[int, Mapping[str, int]]] = {
    epsilon: dict(zip(STANDARD_VISION, counts, strict=True))
    for epsilon, counts in {0: (1, 0, 0, 1, 0, 0, 0), 1: (0, 1, 0, 0, 1, 0, 0), 2: (5, 3, 1, 4, 1, 3, 1)}.items()
}
"""Table V: mode errors by adversarial training radius and scenario, of one run each."""
