"""Errors of each kind, planted into frames in such a way that it is known what each should be called.

Conditional: as in ``planted_conditions``. Systematic: everything, a scenario or two recordings. Transient: single
frames that can be told to be so: outside conditions, with neighbours within ε, and farther than ε from every other
error. Isolated: single frames without a neighbour. Bursts: 2 to 12 frames in a row, which none of the definitions
explains. None but those of bursts and conditions has an error just before or after it.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Final

import numpy as np
from jaxtyping import Bool, Float32, Int64, Shaped

from sdt_tools.error_analysis.conditions.predicates import Features, features_of
from sdt_tools.error_analysis.definitions import ErrorOptions, Tag
from sdt_tools.error_analysis.epsilon import estimate_epsilon
from sdt_tools.error_analysis.labelled import LabelledFrames
from sdt_tools.error_analysis.selftest.chance import sticky_uniforms
from sdt_tools.error_analysis.selftest.planted_conditions import PlantedCondition, choose_conditions, error_rate
from sdt_tools.error_analysis.spaces import VectorSpace, scan_space


class Kind(StrEnum):
    """What is planted."""

    CONDITIONAL = "conditional"
    TRANSIENT = "transient"
    BURST = "burst"
    ISOLATED = "isolated"
    SYSTEMATIC = "systematic"


EXPECTED_TAG: Final[Mapping[Kind, Tag]] = {
    Kind.CONDITIONAL: Tag.CONDITIONAL,
    Kind.TRANSIENT: Tag.TRANSIENT,
    Kind.BURST: Tag.UNEXPLAINED,
    Kind.ISOLATED: Tag.ISOLATED,
    Kind.SYSTEMATIC: Tag.SYSTEMATIC,
}
BACKGROUND: Final = "background"
"""Errors outside a condition planted alone: real, but of no kind that is judged."""
NOTHING: Final = ""

TRANSIENT_SHARE: Final = 0.03
"""Share of the frames that are tried as transient errors."""
BURST_SHARE: Final = 0.02
"""Share of the frames that lie in bursts."""
BURST_LENGTHS: Final = (2, 12)
ISOLATED_SHARE: Final = 0.01
"""Isolated errors are at most this share of the frames."""
SEARCHED_FRAMES: Final = 8000
"""Frames among which those without neighbours are looked for."""
HOLD_FRAMES: Final = (1.0, 5.0)
"""Errors of a condition are drawn afresh in each frame, or hold for five on average."""


@dataclass(frozen=True, eq=False)
class Ground:
    """Frames without errors, and their neighbourhoods, to plant into."""

    frames: LabelledFrames
    space: VectorSpace
    features: Features
    epsilon_m: float
    options: ErrorOptions


def ground_of(frames: LabelledFrames, scans: Float32[np.ndarray, "frames rays"], options: ErrorOptions) -> Ground:
    """Prepare ``frames`` (all right), whose situations are ``scans``."""
    space = scan_space(scans)
    epsilon = estimate_epsilon(space, frames.recording, frames.stamp_ns, options)
    features = features_of(frames.table, options.conditions.features)
    return Ground(frames, space, features, epsilon.value, options)


@dataclass(frozen=True, eq=False)
class Planted:
    """The kind of each frame's error (a Kind, BACKGROUND or NOTHING), and the conditions behind conditional ones."""

    kind: Shaped[np.ndarray, "frames"]
    conditions: tuple[PlantedCondition, ...] = ()

    @property
    def wrong(self) -> Bool[np.ndarray, "frames"]:
        """The frames with errors."""
        wrong: Bool[np.ndarray, "frames"] = self.kind != NOTHING
        return wrong


def plant_alone(ground: Ground, kind: Kind, rng: np.random.Generator) -> Planted:
    """Errors of one kind; around conditional ones, others at the rate outside conditions."""
    planted = Planted(np.full(len(ground.frames.loss), NOTHING, dtype=object))
    if kind is Kind.CONDITIONAL:
        return plant_conditional(ground.features, ground.frames.recording, 1, True, rng)
    if kind is Kind.SYSTEMATIC:
        planted.kind[_systematic(ground, rng)] = Kind.SYSTEMATIC
        return planted
    return {Kind.BURST: _with_bursts, Kind.ISOLATED: _with_isolated, Kind.TRANSIENT: _with_transient}[kind](
        ground, planted, rng
    )


def plant_mixed(ground: Ground, rng: np.random.Generator) -> Planted:
    """All kinds but systematic together, in place of the errors at random outside the condition."""
    conditional = plant_conditional(ground.features, ground.frames.recording, 1, True, rng)
    kind = np.where(conditional.kind == Kind.CONDITIONAL, conditional.kind, NOTHING)
    planted = Planted(kind, conditional.conditions)
    for step in (_with_bursts, _with_isolated, _with_transient):
        planted = step(ground, planted, rng)
    return planted


def plant_conditional(
    features: Features, recording: Int64[np.ndarray, "frames"], count: int, sharp: bool, rng: np.random.Generator
) -> Planted:
    """Errors under ``count`` conditions (fewer where no more can be had), and at a low rate outside them."""
    conditions = choose_conditions(features, recording, count, sharp, rng)
    chance = sticky_uniforms(recording, float(rng.choice(HOLD_FRAMES)), rng)
    wrong = chance < error_rate(conditions, features.frames)
    inside = np.any([condition.inside for condition in conditions], axis=0) if conditions else np.zeros_like(wrong)
    kind = np.full(features.frames, NOTHING, dtype=object)
    kind[wrong & inside] = Kind.CONDITIONAL
    kind[wrong & ~inside] = BACKGROUND
    return Planted(kind, conditions)


def _systematic(ground: Ground, rng: np.random.Generator) -> Bool[np.ndarray, "frames"]:
    """All frames, or those of a scenario, or those of two recordings."""
    table, recording = ground.frames.table, ground.frames.recording
    of_recordings = np.isin(recording, rng.choice(ground.frames.recordings, 2, replace=ground.frames.recordings < 2))
    choices = [np.ones(len(recording), bool), of_recordings]
    scenarios = table["scenario"].drop_nulls().unique().sort().to_list()
    if len(scenarios) > 1:
        choices.append((table["scenario"] == str(rng.choice(scenarios))).fill_null(False).to_numpy())
    return choices[int(rng.integers(len(choices)))]


def _with_bursts(ground: Ground, planted: Planted, rng: np.random.Generator) -> Planted:
    """Runs of 2 to 12 frames within a recording, outside conditions."""
    kind, frames = planted.kind.copy(), ground.frames
    inside = _inside(planted)
    shortest, longest = BURST_LENGTHS
    bursts = round(len(kind) * BURST_SHARE / ((shortest + longest) / 2))
    for start in rng.choice(len(kind), min(bursts, len(kind)), replace=False):
        run = np.arange(start, min(start + int(rng.integers(shortest, longest + 1)), len(kind)))
        ends = inside[run] | (frames.recording[run] != frames.recording[start])
        run = run[: int(np.argmax(ends))] if ends.any() else run
        if len(run) >= shortest:
            kind[run] = Kind.BURST
    return Planted(kind, planted.conditions)


def _with_isolated(ground: Ground, planted: Planted, rng: np.random.Generator) -> Planted:
    """Lone frames without a neighbour, outside conditions."""
    kind = planted.kind.copy()
    rows = rng.permutation(len(kind))[:SEARCHED_FRAMES]
    everything = np.ones((1, len(kind)), bool)
    lonely = rows[ground.space.count(rows, ground.epsilon_m, everything)[0] == 0]
    chosen = _lone(ground, planted, lonely)[: max(1, round(ISOLATED_SHARE * len(kind)))]
    kind[chosen] = Kind.ISOLATED
    return Planted(kind, planted.conditions)


def _with_transient(ground: Ground, planted: Planted, rng: np.random.Generator) -> Planted:
    """Lone frames with neighbours, none of them within ε of any other error."""
    kind = planted.kind.copy()
    chosen = _lone(ground, planted, rng.permutation(len(kind))[: round(TRANSIENT_SHARE * len(kind))])
    errors = planted.wrong
    errors[chosen] = True
    groups = np.vstack([np.ones(len(kind), bool), errors])
    neighbours, wrong_neighbours = ground.space.count(chosen, ground.epsilon_m, groups)
    kind[chosen[(neighbours > 0) & (wrong_neighbours == 0)]] = Kind.TRANSIENT
    return Planted(kind, planted.conditions)


def _lone(ground: Ground, planted: Planted, rows: Int64[np.ndarray, "rows"]) -> Int64[np.ndarray, "some"]:
    """Those of ``rows``, in order, that lie outside conditions and have no error on them or beside them."""
    wrong, inside = planted.wrong.copy(), _inside(planted)
    frames, chosen = ground.frames, []
    for row in rows.tolist():
        around = np.arange(max(row - 1, 0), min(row + 2, len(wrong)))
        around = around[frames.recording[around] == frames.recording[row]]
        if not inside[row] and not wrong[around].any():
            wrong[row] = True
            chosen.append(row)
    return np.array(chosen, dtype=np.int64)


def _inside(planted: Planted) -> Bool[np.ndarray, "frames"]:
    """Frames inside any planted condition."""
    inside = np.zeros(len(planted.kind), bool)
    for condition in planted.conditions:
        inside |= condition.inside
    return inside
