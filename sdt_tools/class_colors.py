"""The colour of each motion, gesture and mode, by its label: the same in Rerun and in terminals."""

from typing import Final

from sdt_tools.frames import Gesture, Mode, MotionClass

Rgb = tuple[int, int, int]

MOTIONS: Final[dict[str, Rgb]] = {
    MotionClass.STAY.label: (130, 138, 150),
    MotionClass.FORWARD.label: (76, 160, 92),
    MotionClass.LEFT_FORWARD.label: (32, 150, 160),
    MotionClass.RIGHT_FORWARD.label: (140, 170, 60),
    MotionClass.BACKWARD.label: (200, 84, 84),
    MotionClass.LEFT_BACKWARD.label: (150, 96, 190),
    MotionClass.RIGHT_BACKWARD.label: (214, 136, 60),
}

GESTURES: Final[dict[str, Rgb]] = {
    Gesture.IDLE.label: (132, 140, 154),
    Gesture.ENABLE.label: (76, 160, 92),
    Gesture.DISABLE.label: (200, 84, 84),
}

MODES: Final[dict[str, Rgb]] = {
    Mode.IDLE.label: (132, 140, 154),
    Mode.ACTIVE.label: (64, 132, 214),
}
