"""No two gestures are alike: how a person's gestures and behaviours differ, drawn from a seed."""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Final, TypeVar

import numpy as np

from sdt_tools.scene.layout import BehaviourEvent, GestureEvent, Manner

_MOVES_S: Final = (0.3, 0.7)
"""How long arms take from rest to a gesture."""

EventT = TypeVar("EventT", GestureEvent, BehaviourEvent)


def with_manners(events: Sequence[EventT], rng: np.random.Generator) -> tuple[EventT, ...]:
    """``events`` with arms that move at their own pace, half way when the event begins and ends, each in its manner."""
    varied = []
    for event in events:
        moves_s = float(rng.uniform(*_MOVES_S))
        varied.append(replace(event, moves_s=moves_s, lead_s=moves_s / 2, manner=_draw_manner(rng)))
    return tuple(varied)


def _draw_manner(rng: np.random.Generator) -> Manner:
    up, elbow, forward, spread, uneven = (rng.standard_normal(5) * (0.13, 0.11, 0.10, 0.07, 0.06)).tolist()
    return Manner(up, elbow, forward, spread, uneven, float(rng.uniform(0, 2 * math.pi)), bool(rng.random() < 0.15))
