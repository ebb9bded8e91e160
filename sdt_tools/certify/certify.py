"""A verdict on each domain: bounds first, then a search for a counterexample in what they leave open.

Only bounds certify, only a scan in hand violates. A domain that fails says so itself and leaves the others alone.
"""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import torch
from jaxtyping import Float64

from sdt_tools.certify.judges import Judgement, Judges, judge, judges_of, numerical_error, representable
from sdt_tools.certify.verdicts import CertifyConfig, DomainVerdict, Ledger, Verdict
from sdt_tools.errors import CheckpointError, UsageError
from sdt_tools.frames import MotionClass
from sdt_tools.models.follow_net import FollowNet
from sdt_tools.models.loaded import LoadedModel
from sdt_tools.robustness.attacks import AttackConfig, attack
from sdt_tools.robustness.boxes import DomainSet
from sdt_tools.robustness.intervals import domain_differences, split_classes, worst_case_loss, worst_margins

Progress = Callable[[int, int], None]
"""Called with (domains judged, domains in all)."""


def certify(
    model: LoadedModel, specification: Sequence[DomainSet], config: CertifyConfig, progress: Progress | None = None
) -> Ledger:
    """A verdict on every domain of every set.

    A domain is certified when the margin of its bounds, in float64, exceeds the required one: that of ``config``, or
    twice the measured numerical error where that is more (two logits are compared, and each may be off by it).

    Raises UsageError where there are no domains, CheckpointError for a network with layers that bounds or export do
    not know.
    """
    total = sum(len(boxes) for boxes in specification)
    if total == 0:
        raise UsageError("there are no domains to certify; choose a specification that has some")
    started = time.monotonic()
    judges = judges_of(model)
    error = numerical_error(judges, specification, config.error_scans, config.seed)
    finite_error = error if np.isfinite(error) else None
    required = None if finite_error is None else max(config.margin, 2.0 * finite_error)
    verdicts: list[DomainVerdict] = []
    for boxes in specification:
        report = _Report(progress, len(verdicts), total)
        verdicts += _verdicts(_Work(model.network, judges, config, required), boxes, report)
    return Ledger(model.name, tuple(verdicts), finite_error, required, time.monotonic() - started)


@dataclass(frozen=True, eq=False)
class _Work:
    network: FollowNet
    judges: Judges
    config: CertifyConfig
    required_margin: float | None


@dataclass(frozen=True, eq=False)
class _Report:
    """Progress within a set that ``before`` domains of others went before."""

    progress: Progress | None
    before: int
    total: int

    def judged(self, domains: int) -> None:
        if self.progress is not None:
            self.progress(self.before + domains, self.total)


@dataclass(frozen=True)
class _Bound:
    """What bounds say of a domain, or why they say nothing."""

    margin: float = 0.0
    loss: float = 0.0
    winner: MotionClass | None = None
    error: str = ""


@dataclass(frozen=True, eq=False)
class _Found:
    """The worst scan that a search found in a domain, or why there is none."""

    scan_m: Float64[np.ndarray, "rays"]
    judgement: Judgement | None = None
    error: str = ""


def _verdicts(work: _Work, boxes: DomainSet, report: _Report) -> list[DomainVerdict]:
    """Bounds for all domains at once; then searches, in batches, where they are asked for."""
    started = time.monotonic()
    bounds = _bounds(work.network, boxes)
    share_s = (time.monotonic() - started) / max(len(boxes), 1)
    verdicts = [_by_bounds(work, boxes, domain, bound, share_s) for domain, bound in enumerate(bounds)]
    searched = work.config.attack
    wanted = [one.domain for one in verdicts if searched is not None and _is_searched(one, work.config)]
    report.judged(len(boxes) - len(wanted))
    if searched is None:
        return verdicts
    at_once = max(1, searched.batch // searched.restarts)
    for first in range(0, len(wanted), at_once):
        part = wanted[first : first + at_once]
        started = time.monotonic()
        found = _search(work, _part(boxes, part), searched)
        share_s = (time.monotonic() - started) / len(part)
        for domain, one in zip(part, found, strict=True):
            verdicts[domain] = _by_search(verdicts[domain], one, searched.restarts, share_s)
        report.judged(len(boxes) - len(wanted) + first + len(part))
    return verdicts


def _is_searched(verdict: DomainVerdict, config: CertifyConfig) -> bool:
    return verdict.verdict is Verdict.UNKNOWN or (verdict.verdict is Verdict.CERTIFIED and config.attack_certified)


def _part(boxes: DomainSet, domains: Sequence[int]) -> DomainSet:
    chosen = np.array(domains, np.int64)
    return DomainSet(boxes.name, boxes.lower_m[chosen], boxes.upper_m[chosen], boxes.rays[chosen], boxes.allowed)


def _bounds(network: FollowNet, boxes: DomainSet) -> list[_Bound]:
    """Bounds of all domains; where computing them at once fails, of one after the other."""
    kept, forbidden = split_classes(boxes.allowed)
    if not kept or not forbidden:
        return [_Bound(error=f"the domain {'forbids' if forbidden else 'allows'} every class")] * len(boxes)
    try:
        differences = torch.from_numpy(domain_differences(network, boxes))
    except CheckpointError:
        raise
    except Exception as error:  # whatever it is: a domain's failure is told as that domain's, and stops no other
        if len(boxes) == 1:
            return [_Bound(error=f"{type(error).__name__}: {error}")]
        return [_bounds(network, _part(boxes, [domain]))[0] for domain in range(len(boxes))]
    alone, winners = differences.amin(dim=2).max(dim=1)
    certain = [kept[winner] if margin > 0.0 else None for margin, winner in zip(alone.tolist(), winners, strict=True)]
    numbers = zip(worst_margins(differences).tolist(), worst_case_loss(differences).tolist(), certain, strict=True)
    finite = differences.isfinite().flatten(1).all(dim=1).tolist()
    ordered = np.all(boxes.lower_m <= boxes.upper_m, axis=1).tolist()
    return [
        _checked(_Bound(margin, loss, None if winner is None else MotionClass(winner)), finite[domain], ordered[domain])
        for domain, (margin, loss, winner) in enumerate(numbers)
    ]


def _checked(bound: _Bound, finite: bool, ordered: bool) -> _Bound:
    if not ordered:
        return _Bound(error="the domain is no box: a lower bound is not at most its upper one")
    return bound if finite else _Bound(error=f"the bounds are not finite (margin {bound.margin})")


def _by_bounds(work: _Work, boxes: DomainSet, domain: int, bound: _Bound, seconds: float) -> DomainVerdict:
    required = work.required_margin
    blank = DomainVerdict(
        boxes.name, domain, int(boxes.rays[domain]), Verdict.ERROR, required, seconds, error=bound.error
    )
    if bound.error:
        return blank
    if required is None:
        return replace(blank, error="the network's answers in the domains are not finite")
    verdict = Verdict.CERTIFIED if bound.margin > required else Verdict.UNKNOWN
    return replace(blank, verdict=verdict, margin=bound.margin, bound_loss=bound.loss, winner=bound.winner)


def _search(work: _Work, boxes: DomainSet, config: AttackConfig) -> list[_Found]:
    """The worst scan of each domain; where searching all at once fails, of one after the other.

    The two extreme scans are tried too: slopes lead nowhere near them in a network that takes a maximum over rays, for
    a step moves the one ray that is the maximum.
    """
    try:
        result = attack(work.network, boxes, config)
        found = []
        for scan_m, lower_m, upper_m in zip(result.scans_m, boxes.lower_m, boxes.upper_m, strict=True):
            tried_m = [representable(one, lower_m, upper_m) for one in (scan_m, upper_m, lower_m)]
            found.append(_worst([_Found(one, judge(work.judges, one, boxes.allowed)) for one in tried_m]))
    except Exception as error:  # as with bounds
        if len(boxes) == 1:
            return [_Found(boxes.lower_m[0], error=f"{type(error).__name__}: {error}")]
        return [_search(work, _part(boxes, [domain]), config)[0] for domain in range(len(boxes))]
    return found


def _worst(tried: Sequence[_Found]) -> _Found:
    """The scan of the largest violation; the first that is not finite, where there is one."""
    violations = [found.judgement.violation if found.judgement else np.nan for found in tried]
    broken = [found for found, violation in zip(tried, violations, strict=True) if not np.isfinite(violation)]
    return broken[0] if broken else tried[int(np.argmax(violations))]


def _by_search(verdict: DomainVerdict, found: _Found, restarts: int, seconds: float) -> DomainVerdict:
    """The verdict after a search; one that finds nothing changes none."""
    verdict = replace(verdict, restarts=restarts, seconds=verdict.seconds + seconds)
    judgement = found.judgement
    if judgement is None or not np.isfinite(judgement.violation):
        reason = found.error or "the network's answer to a scan of the domain is not finite"
        return replace(verdict, verdict=Verdict.ERROR, method="pgd", error=reason)
    verdict = replace(verdict, violation=judgement.violation, answer=judgement.answer)
    assert verdict.margin is not None
    assert verdict.required_margin is not None
    if judgement.violation > verdict.required_margin - verdict.margin:  # bounds promise: never above -margin
        reason = (
            f"SOUNDNESS BUG: bounds prove a margin of {verdict.margin:.6g}, but a scan of the domain has "
            f"{-judgement.violation:.6g} and is answered '{judgement.answer.label}'; trust no verdict, and report it"
        )
        return replace(verdict, verdict=Verdict.ERROR, method="ibp+pgd", scan_m=found.scan_m, error=reason)
    if verdict.verdict is Verdict.UNKNOWN and judgement.unanimous:
        return replace(verdict, verdict=Verdict.VIOLATED, method="pgd", scan_m=found.scan_m)
    return replace(verdict, method="ibp" if verdict.verdict is Verdict.CERTIFIED else "ibp+pgd")
