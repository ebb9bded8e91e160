"""The features of pictures: what conditions of a vision network's errors are later made from."""

from typing import Final

import cv2
import numpy as np
import polars as pl
from jaxtyping import Int64, UInt8

from sdt_tools.replay.features import known, track_features
from sdt_tools.replay.signals import Signals
from sdt_tools.replay.tracks import Tracks

BLOWN: Final = 250
"""A pixel as bright has lost what it showed, whatever JPEG made of it."""
SHARP_SIZE: Final = (320, 240)
"""Width and height at which sharpness is measured, so that cameras of any size compare."""


def picture_measures(picture_bgr_u8: UInt8[np.ndarray, "height width 3"]) -> tuple[float, float, float, float]:
    """Brightness, contrast, share of blown pixels, and sharpness, as predictions name them.

    Sharpness is the spread of the Laplacian (Pech-Pacheco et al. 2000, there its square).
    """
    grey = cv2.cvtColor(picture_bgr_u8, cv2.COLOR_BGR2GRAY)
    mean, deviation = cv2.meanStdDev(grey)
    small = cv2.resize(grey, SHARP_SIZE, interpolation=cv2.INTER_AREA)
    _, edges = cv2.meanStdDev(cv2.Laplacian(small, cv2.CV_16S))
    return float(mean[0, 0]), float(deviation[0, 0]), float(np.mean(grey >= BLOWN)), float(edges[0, 0])


def picture_features(tracks: Tracks, signals: Signals, stamps_ns: Int64[np.ndarray, "frames"]) -> pl.DataFrame:
    """What else the recording knows at the stamps of pictures; ``true_gesture`` is null on a real robot."""
    told = signals.at(stamps_ns)
    around = track_features(tracks, stamps_ns).select(
        "operator_range_m", "operator_bearing_rad", "speed_mps", "command", "mode"
    )
    arms = pl.DataFrame(
        {
            "true_gesture": [None if signal is None else signal.gesture.label for signal in told],
            "behaviour": [None if signal is None else signal.behaviour or "none" for signal in told],
            "arms_changed_s": known(signals.arms_changed_s(stamps_ns)),
            "operator_turned_rad": known(tracks.operator_turned_rad(stamps_ns)),
            "turn_radps": known(tracks.robot.turn_radps(stamps_ns)),
        },
        schema_overrides={"true_gesture": pl.String, "behaviour": pl.String},
    )
    return pl.concat([around, arms], how="horizontal")
