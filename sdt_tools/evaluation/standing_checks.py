"""Checks that every follow network has to stand beside its accuracy, on frames with labels.

They look where a certificate does not: outside the domains (a near object in a real scan), into the gap between a
specification's far range and the sensor's (clipped ranges), and at what sensors do (codes).
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np
from jaxtyping import Bool, Float64, Int64

from sdt_tools.dataset.load import FrameSet
from sdt_tools.frames import FORWARD_CLASSES, MotionClass
from sdt_tools.models.loaded import LoadedModel
from sdt_tools.models.preprocess import FIRST_FRONT_RAY, LAST_FRONT_RAY, invalid_rays
from sdt_tools.statistics import wilson

PASTED_M: Final = 0.10
PASTED_WIDTHS: Final = (1, 3, 20)
PASTED_EVERY: Final = 30
"""Rays between the places at which objects are pasted."""
CLEAR_M: Final = 0.6
CLIPS_M: Final = (4.0, 3.0)
CODE_SHARES: Final = (0.01, 0.05, 0.11, 0.25)
DROPOUT_RAYS: Final = 20

_FORWARD: Final = [int(motion) for motion in sorted(FORWARD_CLASSES)]
_MIRRORED: Final = np.array([int(motion.mirrored) for motion in MotionClass])


@dataclass(frozen=True)
class CheckRate:
    """``count`` of ``trials``, with its Wilson interval."""

    count: int
    trials: int
    wilson: tuple[float, float]

    @property
    def share(self) -> float:
        """The rate; NaN without trials."""
        return self.count / self.trials if self.trials else float("nan")


@dataclass(frozen=True)
class ChecksReport:
    """All rates of one network by name.

    ``accuracy`` and ``forward_recall`` (any forward class where one is due). ``pasted_forward_<width>`` and
    ``pasted_forward``: a forward answer though an object stands 10 cm ahead. ``clear_forward`` and
    ``clear_forward_clipped_<m>``: forward recall where the front is clear, as it is and with ranges clipped.
    ``mirror_consistent``: the mirrored scan gets the mirrored answer. ``codes_<percent>_flipped`` and
    ``codes_<percent>_accuracy``: answers that change, and accuracy, when so many rays turn into codes, and
    ``dropout_flipped``, ``dropout_accuracy`` when a run of 20 rays does.
    """

    model: str
    rates: Mapping[str, CheckRate]

    def clip_loss(self, clip_m: float = 4.0) -> float:
        """What clear-front forward recall loses when ranges are clipped."""
        return self.rates["clear_forward"].share - self.rates[f"clear_forward_clipped_{clip_m:g}m"].share

    def document(self) -> dict[str, dict[str, object]]:
        """For JSON."""
        return {name: {**vars(rate), "share": rate.share} for name, rate in self.rates.items()}


def standing_checks(model: LoadedModel, frames: FrameSet, seed: int = 0) -> ChecksReport:
    """Put ``model`` to all checks on labelled frames; codes drawn by chance depend on ``seed`` alone."""
    ranges_m, labels = frames.ranges_m.astype(np.float64), frames.labels
    answers = _answers(model, ranges_m)
    forward = np.isin(labels, _FORWARD)
    rates = {
        "accuracy": _rate(answers == labels),
        "forward_recall": _rate(np.isin(answers[forward], _FORWARD)),
        "mirror_consistent": _rate(_answers(model, ranges_m[:, ::-1]) == _MIRRORED[answers]),
    }
    clear = forward & _front_is_clear(ranges_m, model)
    rates |= _clipped(model, ranges_m[clear], answers[clear])
    rates |= _pasted(model, ranges_m[clear])
    rates |= _with_codes(model, ranges_m, labels, answers, np.random.default_rng(seed))
    return ChecksReport(model.name, rates)


def with_object(
    ranges_m: Float64[np.ndarray, "scans rays"], first_ray: int, width: int, range_m: float = PASTED_M
) -> Float64[np.ndarray, "scans rays"]:
    """Scans with an object pasted in: ``width`` rays from ``first_ray`` on read ``range_m``."""
    pasted = ranges_m.copy()
    pasted[:, first_ray : first_ray + width] = range_m
    return pasted


def _pasted(model: LoadedModel, ranges_m: Float64[np.ndarray, "scans rays"]) -> dict[str, CheckRate]:
    rates, every = {}, []
    for width in PASTED_WIDTHS:
        places = range(FIRST_FRONT_RAY, LAST_FRONT_RAY + 2 - width, PASTED_EVERY)
        found = [np.isin(_answers(model, with_object(ranges_m, place, width)), _FORWARD) for place in places]
        rates[f"pasted_forward_{width}"] = _rate(np.concatenate(found))
        every += found
    return rates | {"pasted_forward": _rate(np.concatenate(every))}


def _clipped(
    model: LoadedModel, ranges_m: Float64[np.ndarray, "scans rays"], answers: Int64[np.ndarray, "scans"]
) -> dict[str, CheckRate]:
    rates = {"clear_forward": _rate(np.isin(answers, _FORWARD))}
    for clip_m in CLIPS_M:
        clipped = _answers(model, np.minimum(ranges_m, clip_m))
        rates[f"clear_forward_clipped_{clip_m:g}m"] = _rate(np.isin(clipped, _FORWARD))
    return rates


def _with_codes(
    model: LoadedModel,
    ranges_m: Float64[np.ndarray, "scans rays"],
    labels: Int64[np.ndarray, "scans"],
    answers: Int64[np.ndarray, "scans"],
    rng: np.random.Generator,
) -> dict[str, CheckRate]:
    rates = {}
    for share in CODE_SHARES:
        found = _answers(model, np.where(rng.random(ranges_m.shape) < share, 0.0, ranges_m))
        rates[f"codes_{share:.0%}_flipped"] = _rate(found != answers)
        rates[f"codes_{share:.0%}_accuracy"] = _rate(found == labels)
    dropped = ranges_m.copy()
    first = rng.integers(0, ranges_m.shape[1] - DROPOUT_RAYS, len(dropped))
    dropped[np.arange(len(dropped))[:, None], first[:, None] + np.arange(DROPOUT_RAYS)] = 0.0
    found = _answers(model, dropped)
    return rates | {"dropout_flipped": _rate(found != answers), "dropout_accuracy": _rate(found == labels)}


def _front_is_clear(ranges_m: Float64[np.ndarray, "scans rays"], model: LoadedModel) -> Bool[np.ndarray, "scans"]:
    front = ranges_m[:, FIRST_FRONT_RAY : LAST_FRONT_RAY + 1]
    readings = np.where(invalid_rays(front, model.network.preprocess), np.inf, front)
    clear: Bool[np.ndarray, "scans"] = readings.min(axis=1) > CLEAR_M
    return clear


def _answers(model: LoadedModel, ranges_m: Float64[np.ndarray, "scans rays"]) -> Int64[np.ndarray, "scans"]:
    answers: Int64[np.ndarray, "scans"] = model.predict_logits(np.ascontiguousarray(ranges_m)).argmax(axis=1)
    return answers


def _rate(hits: Bool[np.ndarray, "trials"]) -> CheckRate:
    count, trials = int(hits.sum()), len(hits)
    return CheckRate(count, trials, wilson(count, trials))
