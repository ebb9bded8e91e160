"""What the paper calls an error, in its own numbering, and every choice that it leaves open as an option.

Let L be the loss of a frame, η a threshold, ε a distance between scans.

- Definition 1, transient: L > η at x′, and L < η at every other frame x̃ with 0 < ‖x̃ - x′‖ ≤ ε.
- Definition 2, systematic: L > η at every frame of the data.
- Definition 3, conditional: the mean loss is > η inside a domain and < η outside it.

Read literally, Definition 1 holds wherever no frame lies within ε, Definition 2 needs to be told which data, and any
set of wrong frames fulfils Definition 3. So here a transient error has at least one neighbour, a systematic one belongs
to a stated selection of frames, and a condition is one that can be said in words and was confirmed on recordings on
which it was not found. By Proposition 2 a transient error is a condition of one point: the confirmed, wider condition
goes first.
"""

from collections.abc import Mapping
from enum import StrEnum
from typing import Final, Literal

import numpy as np
from jaxtyping import Bool, Float, Int
from pydantic import Field, model_validator

from sdt_tools.config import Config

Selection = Literal["all", "scenario", "recording"]
Neighbourhood = Literal["scan", "feature", "time"]
EPSILON_OPTIONS: Final[Mapping[Neighbourhood, str]] = {
    "scan": "epsilon_m",
    "feature": "epsilon_feature",
    "time": "epsilon_ms",
}
"""The option that sets ε in each neighbourhood."""


class Tag(StrEnum):
    """What is said of a labelled frame, in order of precedence; ``correct`` frames have no error to explain."""

    SYSTEMATIC = "systematic"
    CONDITIONAL = "conditional"
    TRANSIENT = "transient"
    ISOLATED = "isolated"
    UNEXPLAINED = "unexplained"
    CORRECT = "correct"


ERROR_TAGS: Final = tuple(tag for tag in Tag if tag is not Tag.CORRECT)

DEFAULT_FEATURES: Final = (
    "front_range_m",
    "operator_range_m",
    "operator_bearing_rad",
    "|operator_bearing_rad|",
    "speed_mps",
    "distance_level_3_m",
    "invalid_share",
    "motion",
    "mode",
    "scenario",
    "light",
    "in_level_1",
    "in_level_2",
    "in_level_3",
    "in_level_4",
)
"""Columns of predictions of scans that conditions are made of; ``|x|`` is the magnitude of ``x``.

What the model answered is not among them, nor the command that it may have given: errors explained by the wrong answer
itself say nothing. Neither is the recording, which cannot be confirmed on another one.
"""

PICTURE_FEATURES: Final = (
    "operator_range_m",
    "operator_bearing_rad",
    "|operator_bearing_rad|",
    "operator_turned_rad",
    "gesture",
    "behaviour",
    "arms_changed_s",
    "brightness",
    "contrast",
    "blown_share",
    "sharpness",
    "speed_mps",
    "|turn_radps|",
    "mode",
    "scenario",
    "light",
    "surroundings",
    "mask",
)
"""The same for predictions of pictures."""


class ConditionOptions(Config):
    """How conditions are searched and confirmed.

    ``min_support``: smallest share of frames inside. ``min_recordings``: fewest recordings with frames (and errors)
    inside, in each half. ``min_recordings_total``: with fewer recordings nothing is confirmed. ``min_score``: smallest
    log-likelihood ratio of a candidate. ``simplify``: share of its score that a condition may lose by dropping a
    predicate. ``alpha``: level of the whole family of candidates, after Holm. ``implausible``: a lone error inside a
    condition is called transient when so many right neighbours had at most this probability under the condition.
    """

    features: tuple[str, ...] = DEFAULT_FEATURES
    cuts: int = Field(default=16, ge=2, le=64)
    max_conditions: int = Field(default=5, ge=0, le=20)
    min_support: float = Field(default=0.01, gt=0.0, lt=1.0)
    min_recordings: int = Field(default=3, ge=1)
    min_recordings_total: int = Field(default=8, ge=2)
    min_score: float = Field(default=12.0, ge=0.0)
    simplify: float = Field(default=0.05, ge=0.0, lt=1.0)
    permutations: int = Field(default=999, ge=99)
    alpha: float = Field(default=0.01, gt=0.0, lt=1.0)
    implausible: float = Field(default=0.002, ge=0.0, lt=1.0)


class ErrorOptions(Config):
    """Every choice behind a tag; saved with every result.

    ``loss``: ``zero_one``, or ``cross_entropy``, for which ``eta`` must be chosen. ``fill_codes`` and ``clip_m`` shape
    the scans before distances are taken. ``neighbourhood``: where frames are near each other, in ``scan`` (root mean
    square per ray), in ``feature`` (of a vision network: root mean square per feature) or in ``time``; without it, scan
    for a follow network and feature for a vision network. ε, in it ``epsilon_m``, ``epsilon_feature`` or
    ``epsilon_ms``, is estimated where it is not given: the percentile ``epsilon_percentile`` of the distances between
    successive frames. ``tau``: share of right frames
    that a systematic error bears. ``selections``: the data over which Definition 2 is asked, each at least
    ``min_selection_frames`` large. ``guard``: a transient error also needs the frames just before and after (within
    ``max_gap_s``) to be right; fast turns carry them beyond ε.
    """

    loss: Literal["zero_one", "cross_entropy"] = "zero_one"
    eta: float = Field(default=0.5, gt=0.0)
    fill_codes: bool = True
    clip_m: float = Field(default=2.5, gt=0.0, le=20.0)
    neighbourhood: Neighbourhood | None = None
    epsilon_m: float | None = Field(default=None, gt=0.0)
    epsilon_feature: float | None = Field(default=None, gt=0.0)
    epsilon_ms: float | None = Field(default=None, gt=0.0)
    epsilon_percentile: float = Field(default=90.0, gt=0.0, lt=100.0)
    tau: float = Field(default=0.0, ge=0.0, lt=1.0)
    selections: tuple[Selection, ...] = ("all", "scenario", "recording")
    min_selection_frames: int = Field(default=20, ge=1)
    guard: bool = True
    max_gap_s: float = Field(default=0.5, gt=0.0)
    seed: int = 0
    conditions: ConditionOptions = ConditionOptions()

    @model_validator(mode="after")
    def _eta_is_chosen(self) -> "ErrorOptions":
        if self.loss == "cross_entropy" and "eta" not in self.model_fields_set:
            raise ValueError("the loss cross_entropy needs a chosen eta (nats); add eta")
        return self

    def epsilon_of(self, neighbourhood: Neighbourhood) -> float | None:
        """ε as it is given for a neighbourhood."""
        given: float | None = getattr(self, EPSILON_OPTIONS[neighbourhood])
        return given


def is_wrong(loss: Float[np.ndarray, "frames"], eta: float) -> Bool[np.ndarray, "frames"]:
    """The error frames: L > η."""
    return loss > eta


def is_right(loss: Float[np.ndarray, "frames"], eta: float) -> Bool[np.ndarray, "frames"]:
    """The frames that Definition 1 asks for around a transient error: L < η. A loss of exactly η is neither."""
    return loss < eta


def is_transient(
    wrong: Bool[np.ndarray, "frames"],
    neighbours: Int[np.ndarray, "frames"],
    right_neighbours: Int[np.ndarray, "frames"],
) -> Bool[np.ndarray, "frames"]:
    """Definition 1: a wrong frame whose neighbours within ε, at least one, are all right."""
    transient: Bool[np.ndarray, "frames"] = wrong & (neighbours > 0) & (right_neighbours == neighbours)
    return transient


def is_systematic(loss: Float[np.ndarray, "frames"], eta: float, tau: float = 0.0) -> bool:
    """Definition 2 over the frames of a selection: all of them, but for a share ``tau``, have L > η."""
    return loss.size > 0 and bool(np.mean(~is_wrong(loss, eta)) <= tau)


def is_conditional(loss: Float[np.ndarray, "frames"], inside: Bool[np.ndarray, "frames"], eta: float) -> bool:
    """Definition 3: mean loss > η inside and < η outside, neither of them empty."""
    within, without = loss[inside], loss[~inside]
    return within.size > 0 and without.size > 0 and bool(within.mean() > eta > without.mean())
