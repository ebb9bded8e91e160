"""What each colour means: one place, so that points, lanes, curves and the legend agree."""

from collections.abc import Iterable
from typing import Final

import numpy as np
from jaxtyping import UInt32

from sdt_tools import class_colors
from sdt_tools.class_colors import Rgb
from sdt_tools.frames import LogLevel

__all__ = ["Rgb"]

BACKGROUND: Final[Rgb] = (16, 18, 24)
FAINT: Final[Rgb] = (62, 68, 80)
QUIET: Final[Rgb] = (120, 128, 142)
WALLS: Final[Rgb] = (88, 98, 116)
ROBOT: Final[Rgb] = (225, 230, 238)
ZONE: Final[Rgb] = (255, 82, 82)
OPERATOR: Final[Rgb] = (228, 190, 140)
LABEL: Final[Rgb] = (245, 245, 245)
CODE: Final[Rgb] = (96, 102, 112)
"""Rays on which the sensor gave a code in place of a distance."""

UNLABELED: Final = "unlabeled"
CORRECT: Final = "correct"
ERROR: Final = "error"

STATUSES: Final[dict[str, Rgb]] = {
    UNLABELED: (150, 176, 205),
    CORRECT: (88, 196, 110),
    ERROR: (244, 67, 54),
    "systematic": (233, 30, 140),
    "conditional": (255, 152, 0),
    "transient": (255, 235, 59),
    "isolated": (38, 198, 218),
    "unexplained": (171, 96, 230),
}
"""What is known of a frame: nothing, right, wrong, or wrong for a reason (the error tags)."""

MODELS: Final[tuple[Rgb, ...]] = (
    (64, 169, 255),
    (255, 196, 61),
    (230, 120, 210),
    (120, 220, 180),
    (200, 160, 120),
    (150, 150, 255),
)
"""Models, in the order given; they repeat after the last."""

MOTIONS: Final = class_colors.MOTIONS
GESTURES: Final = class_colors.GESTURES
MODES: Final = class_colors.MODES

ANSWERS: Final = MOTIONS | GESTURES
"""All that a model can answer."""

LOG_LEVELS: Final[dict[LogLevel, str]] = {
    LogLevel.DEBUG: "DEBUG",
    LogLevel.INFO: "INFO",
    LogLevel.WARNING: "WARN",
    LogLevel.ERROR: "ERROR",
}
"""Severities by the names that Rerun has for them."""


def model_color(index: int) -> Rgb:
    """The colour of the model that was given as number ``index``."""
    return MODELS[index % len(MODELS)]


def packed(colors: Iterable[Rgb]) -> UInt32[np.ndarray, "colors"]:
    """Colours as Rerun stores them: 0xRRGGBBAA."""
    return np.array([red << 24 | green << 16 | blue << 8 | 0xFF for red, green, blue in colors], np.uint32)
