"""Rules for whatever a device gives: kinds, order, stamps, and how often."""

from itertools import pairwise
from statistics import median
from typing import Final

import numpy as np

from sdt_tools.clock import SECOND_NS
from sdt_tools.frames import LogEntry
from sdt_tools.robot.contract.trial import Arrival, Trial, content
from sdt_tools.robot.contract.verdict import Verdict, broken, judged, kept, not_judged

_WAITS_S: Final = 0.004
"""A ``read`` that waits for the next scan at 50 Hz takes 20 ms; one that does not takes less than one."""
_OLDEST_NS: Final = SECOND_NS
_RATE_TOLERANCE: Final = 0.1


def arrival_rules(trial: Trial, kind: type, what: str, wanted_hz: float | None, longest_gap_s: float) -> list[Verdict]:
    """The verdicts on ``trial``, whose device gives ``kind``, called ``what``."""
    given = trial.of(kind)
    first = [_works(trial), _gives(trial, kind, what)]
    if len(given) < 2:
        return [*first, broken(f"{what} come", f"{len(given)} came; is the device switched on and set to send?")]
    return [*first, _order(trial), _stamps(given), _rate(given, what, wanted_hz, longest_gap_s)]


def _works(trial: Trial) -> Verdict:
    rule = "read does not raise and does not wait"
    if trial.failure:
        return broken(rule, f"it raised {trial.failure}; report what a device does wrong as a log entry")
    typical_s = median(trial.read_s)
    seen = f"{typical_s * 1e3:.2f} ms in the middle of {len(trial.read_s)}"
    if typical_s > _WAITS_S:
        return broken(rule, f"{seen}; receive in a thread of the driver's own, and hand over what is there")
    return kept(rule, seen)


def _gives(trial: Trial, kind: type, what: str) -> Verdict:
    rule = f"read gives {what} and log entries, nothing else"
    others = {type(content(one)).__name__ for one in trial.given if not isinstance(content(one), kind | LogEntry)}
    names = sorted(others | set(trial.strange))
    faults = [f"it gave {', '.join(names)}; wrap a message in Received, and give no others"] if names else []
    return judged(rule, faults, f"{len(trial.of(kind))} {what}, {len(trial.of(LogEntry))} log entries")


def _order(trial: Trial) -> Verdict:
    faults = []
    backward = sum(after.received_ns < before.received_ns for before, after in pairwise(trial.given))
    if backward:
        faults.append(f"{backward} times received_ns went back; give things in the order in which they came")
    if trial.early:
        faults.append(f"{trial.early} things were received after until_ns; keep them for the next read")
    if trial.late:
        faults.append(f"{trial.late} things were received before the last until_ns; they were to be given then")
    return judged("all up to until_ns, in order of receipt", faults, f"{len(trial.given)} arrivals")


def _stamps(given: list[Arrival]) -> Verdict:
    rule = "stamps ascend and lie within receipt"
    stamps = [getattr(content(one), "stamp_ns", 0) for one in given]
    faults = []
    if any(not isinstance(stamp, int | np.integer) for stamp in stamps):
        faults.append(f"a stamp is a {type(stamps[0]).__name__}; it is an integer of nanoseconds since 1970 (UTC)")
        return judged(rule, faults, "")
    delays_ns = [one.received_ns - stamp for one, stamp in zip(given, stamps, strict=True)]
    backward = sum(after <= before for before, after in pairwise(stamps))
    if backward:
        faults.append(f"{backward} of {len(stamps)} are not later than the one before")
    if min(delays_ns) < 0:
        faults.append(f"one is {-min(delays_ns) / 1e6:.1f} ms after its receipt; map the device's time to the host's")
    if max(delays_ns) > _OLDEST_NS:
        faults.append(
            f"one is {max(delays_ns) / 1e9:.3g} s before its receipt; are they nanoseconds since 1970 (UTC), of the "
            "clock that the driver was given?"
        )
    return judged(rule, faults, f"{min(delays_ns) / 1e6:.1f} to {max(delays_ns) / 1e6:.1f} ms before receipt")


def _rate(given: list[Arrival], what: str, wanted_hz: float | None, longest_gap_s: float) -> Verdict:
    stamps = [getattr(content(one), "stamp_ns", 0) for one in given]
    steps_s = [(after - before) / SECOND_NS for before, after in pairwise(stamps)]
    gap_s = max((after.received_ns - before.received_ns) / SECOND_NS for before, after in pairwise(given))
    rate_hz = 1.0 / max(median(steps_s), 1e-9)
    faults = []
    if wanted_hz is not None and abs(rate_hz / wanted_hz - 1.0) > _RATE_TOLERANCE:
        faults.append(f"{rate_hz:.3g} a second, not the {wanted_hz:g} that it is set to")
    if gap_s > longest_gap_s:
        faults.append(f"{gap_s:.2f} s without any, once; longer than {longest_gap_s:g} s stops the robot")
    rule = f"{what} come {f'at {wanted_hz:g} Hz' if wanted_hz else 'steadily'}, none {longest_gap_s:g} s late"
    return judged(rule, faults, f"{rate_hz:.3g} a second, at most {gap_s * 1e3:.0f} ms apart")


def silence_rule(trial: Trial, kind: type, within_s: float) -> Verdict:
    """Whether silence was told within ``within_s`` of the last thing that came before it, and that it has ended."""
    rule = f"silence is told within {within_s * 1e3:.0f} ms, and looked for"
    given = [one.received_ns for one in trial.of(kind)]
    gaps = [(before, after) for before, after in pairwise(given) if after - before > within_s * SECOND_NS]
    last = given[-1] if given else 0
    gap = max(gaps, key=lambda gap: gap[1] - gap[0], default=(last, 0))
    told = [(at - gap[0]) / SECOND_NS for at, _ in trial.warnings if at >= gap[0]]
    if not given or (not gaps and not told):
        return not_judged(rule, "it never fell silent; unplug it while it is asked for")
    faults = []
    if not told:
        faults.append("nothing was told; give a log entry of level warning")
    elif told[0] > within_s:
        faults.append(f"told after {told[0] * 1e3:.0f} ms")
    if gap[1] == 0:
        faults.append("nothing came any more; look for the device until it is back")
    came_back = f"silent for {(gap[1] - gap[0]) / SECOND_NS:.1f} s"
    return judged(rule, faults, f"told after {told[0] * 1e3:.0f} ms, {came_back}" if told else "")
