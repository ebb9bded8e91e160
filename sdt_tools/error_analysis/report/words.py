"""Conditions as people say them."""

from typing import Final

from sdt_tools.error_analysis.conditions.confirmation import Verdict
from sdt_tools.error_analysis.conditions.predicates import Condition, Predicate

_NUMBERS: Final = {
    "front_range_m": ("the nearest thing ahead is", "m", "away", 1.0),
    "operator_range_m": ("the operator is", "m", "away", 1.0),
    "operator_bearing_rad": ("the operator's bearing (left positive) is", "°", "", 57.29577951308232),
    "|operator_bearing_rad|": ("the operator is", "°", "off straight ahead", 57.29577951308232),
    "speed_mps": ("the robot's speed is", "m/s", "", 1.0),
    "distance_level_3_m": ("the scan is", "m", "from the nearest safety domain of level 3", 1.0),
    "domain_distance_m": ("the scan is", "m", "from the nearest safety domain", 1.0),
    "operator_turned_rad": ("the operator is turned", "°", "away from the robot", 57.29577951308232),
    "arms_changed_s": ("the nearest change of what the arms do is", "s", "away", 1.0),
    "brightness": ("the picture's mean grey is", "of 255", "", 1.0),
    "contrast": ("the spread of the picture's grey is", "of 255", "", 1.0),
    "blown_share": ("of the picture's pixels", "%", "are blown out", 100.0),
    "sharpness": ("the picture's sharpness is", "", "", 1.0),
    "|turn_radps|": ("the robot turns by", "°/s", "", 57.29577951308232),
    "invalid_share": ("of the rays", "%", "have no distance", 100.0),
}
"""Feature: what stands before the bound, its unit, what stands after it, and what the value is multiplied by."""
_SHARES: Final = ("invalid_share", "blown_share")
"""Of these the bound is said first."""
_NAMES: Final = {
    "motion": "the right answer is {}",
    "gesture": "the right answer is {}",
    "surroundings": "the surroundings are {}",
    "mode": "the robot is {}",
    "scenario": "the scenario is {}",
    "light": "the light is {}",
}


def condition_in_words(condition: Condition) -> str:
    """As in ``the nearest thing ahead is less than 0.62 m away and the right answer is forward``."""
    return " and ".join(_predicate_in_words(predicate) for predicate in condition.predicates)


def verdict_in_words(verdict: Verdict) -> str:
    """What the confirming recordings say of a condition, in a sentence; a mean 0-1 loss is a share of errors."""
    if verdict.mean_loss_in is None or verdict.mean_loss_out is None:
        return ""
    text = f"Mean loss {verdict.mean_loss_in:.2f} inside against {verdict.mean_loss_out:.2f} outside"
    if verdict.effect is not None and verdict.effect_interval is not None:
        low, high = verdict.effect_interval
        text += f", {verdict.effect:+.2f} (95 % interval {low:+.2f} to {high:+.2f})"
    return f"{text}, in {verdict.frames:,} frames of {verdict.recordings} recordings on which it was not found."


def _predicate_in_words(predicate: Predicate) -> str:
    feature = predicate.feature
    if not predicate.is_bound:
        if feature.startswith("in_level_"):
            where = "inside a" if predicate.names == ("true",) else "outside every"
            return f"the scan lies {where} safety domain of level {feature.removeprefix('in_level_')}"
        if feature == "mask":
            return f"the operator wears {'a' if predicate.names == ('true',) else 'no'} mask"
        if feature == "behaviour":
            return f"the hands do {_behaviours(predicate.names)}"
        names = " or ".join(name.replace("_", " ") for name in predicate.names)
        return _NAMES[feature].format(names) if feature in _NAMES else predicate.text
    if feature not in _NUMBERS:
        return predicate.text
    before, unit, after, scale = _NUMBERS[feature]
    than = "less than" if predicate.operator == "<" else "at least"
    bound = f"{than} {predicate.bound * scale:.3g}{'' if unit.startswith('°') else ' '}{unit}"
    words = (bound, before, after) if feature in _SHARES else (before, bound, after)
    return " ".join(word for word in words if word)


def _behaviours(names: tuple[str, ...]) -> str:
    """As in ``phone call or nothing else``."""
    return " or ".join("nothing else" if name == "none" else name.replace("_", " ") for name in names)
