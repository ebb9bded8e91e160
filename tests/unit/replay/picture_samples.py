"""Recordings of small pictures whose colour tells the gesture, and a model that reads it off."""

from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from replay_samples import OPERATOR, write

from sdt_tools.clock import FAST_EPOCH_NS
from sdt_tools.frames import CameraImage, Gesture, Message, Mode, Odometry, OperatorPose, OperatorState, Pose2D
from sdt_tools.labeling.auto import label_automatically
from sdt_tools.labeling.vocabulary import LabelKind, LabelSource

PICTURE_NS = 200_000_000
BROKEN = {3: b"no picture", 7: b"", 11: b"\xff\xd8 breaks off"}
"""Pictures of a damaged recording that no decoder reads."""


def gesture(number: int) -> Gesture:
    """The true gesture at picture ``number``: three of each in turn."""
    return Gesture(number // 3 % 3)


def behaviour(number: int) -> str:
    return "phone_call" if gesture(number) is Gesture.IDLE and number >= 18 else ""


def picture(number: int, seed: int = 0, size: tuple[int, int] = (64, 48)) -> np.ndarray:
    """Blue is 60 times the gesture; green rises with the picture's number, a little noise lies over it."""
    rng = np.random.default_rng([seed, number])
    image = rng.integers(0, 4, (size[1], size[0], 3)).astype(np.uint8)
    image[..., 0] += np.uint8(60 * gesture(number))
    image[..., 1] += np.uint8(number)
    return image


def coded(image: np.ndarray, ending: str = ".png") -> bytes:
    """Compressed without loss, or as JPEG."""
    return bytes(cv2.imencode(ending, image)[1].tobytes())


def stamp_ns(number: int) -> int:
    return FAST_EPOCH_NS + number * PICTURE_NS


def picture_messages(count: int, seed: int = 0, broken: bool = False) -> list[Message]:
    """A robot that turns left at 0.5 rad/s; the operator's back is to it."""
    told: list[Message] = []
    for number in range(count):
        at_ns = stamp_ns(number)
        data = BROKEN.get(number) if broken else None
        told += [
            CameraImage(at_ns, coded(picture(number, seed)) if data is None else data, "png"),
            Odometry(at_ns, Pose2D(0.0, 0.0, 0.1 * number)),
            OperatorPose(at_ns, OPERATOR),
            OperatorState(at_ns, gesture(number), Mode.IDLE, behaviour(number)),
        ]
    return told


def write_pictures(folder: Path, name: str, count: int = 30, seed: int = 0, broken: bool = False, **notes: str) -> Path:
    return write(folder / f"{name}.mcap", picture_messages(count, seed, broken), seed, **notes)


def label_gestures(path: Path, labels_dir: Path) -> None:
    """Label ``path`` with the truth."""
    label_automatically(path, LabelKind.GESTURE, LabelSource.TRUTH, labels_dir)


@dataclass(frozen=True)
class BlueTells:
    """Reads the gesture off the blue; takes disable for enable where green is at ``blind_from`` or above."""

    name: str = "blue"
    blind_from: int = 256

    def pixels(self, picture_bgr_u8: np.ndarray) -> np.ndarray:
        """One pixel, red, green, blue."""
        return np.ascontiguousarray(cv2.resize(picture_bgr_u8, (1, 1), interpolation=cv2.INTER_AREA)[..., ::-1])

    def answer(self, images_u8: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """A logit of 2 for the answer, 0 for the others; the features are the colours, halved."""
        colours = images_u8[:, 0, 0].astype(np.float32)
        gestures = np.rint(colours[:, 2] / 60).astype(int).clip(0, 2)
        gestures[(gestures == Gesture.DISABLE) & (colours[:, 1] >= self.blind_from)] = Gesture.ENABLE
        logits = np.zeros((len(colours), 3), np.float32)
        logits[np.arange(len(colours)), gestures] = 2.0
        return logits, colours / 2
