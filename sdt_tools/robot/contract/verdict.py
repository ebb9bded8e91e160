"""What is said of a driver, rule by rule."""

from dataclasses import dataclass
from enum import Enum


class Outcome(Enum):
    """How a rule came out; OPEN where there was nothing to judge it by."""

    KEPT = "kept"
    BROKEN = "broken"
    OPEN = "not judged"


@dataclass(frozen=True)
class Verdict:
    """One rule, and what was seen: figures where it is kept, what is wrong and what to do where it is broken."""

    rule: str
    outcome: Outcome
    seen: str


def kept(rule: str, seen: str) -> Verdict:
    """The rule is kept."""
    return Verdict(rule, Outcome.KEPT, seen)


def broken(rule: str, seen: str) -> Verdict:
    """The rule is broken."""
    return Verdict(rule, Outcome.BROKEN, seen)


def not_judged(rule: str, why: str) -> Verdict:
    """Nothing came that the rule could be judged by."""
    return Verdict(rule, Outcome.OPEN, why)


def judged(rule: str, faults: list[str], seen: str) -> Verdict:
    """Kept as ``seen`` where there are no ``faults``; else broken, by the first of them."""
    return broken(rule, faults[0]) if faults else kept(rule, seen)
