"""One seed, many streams: each part of a scene draws from its own, so that none disturbs another."""

from enum import IntEnum

import numpy as np


class Stream(IntEnum):
    """Who draws. The numbers are part of what a seed means: never change one, only add."""

    LAYOUT = 0
    WHEELS = 1
    SENSOR = 2
    CAMERA = 3
    TOO_CLOSE = 4
    COURSE = 5
    GESTURES = 6
    MANNERS = 7


def generator(seed: int, stream: Stream) -> np.random.Generator:
    """The random numbers of ``stream`` in the scene with ``seed``."""
    return np.random.Generator(np.random.SFC64(np.random.SeedSequence(entropy=seed, spawn_key=(int(stream),))))
