"""Whether a recording can be trusted, in one word and with reasons.

A recording is ``good`` until a rule says otherwise; the worst verdict of any rule stands. The rules look at the sensors
(scans, images, odometry). Each number of ``HealthRules`` is a bound that a good recording keeps, and the next one a
bound beyond which it is poor:

| rule | fair beyond | poor beyond |
|---|---|---|
| messages dropped or missing, of all that should be there | 0.1 % | 1 % |
| longest interval between two messages | 0.2 s | 1 s |
| jitter of the sensor's stamps (99th percentile), of the period | 20 % | 50 % |
| spread of the delay (1st to 99th percentile) | 50 ms | 200 ms |
| messages received before they were taken (median delay below zero) | 1 ms | 50 ms |
| drift between the sensor's clock and the host's, with 95 % confidence | 100 ppm | 1000 ppm |
| frames of the rarer of scans and images without a partner within 20 ms | 1 % | 10 % |

Beside them: a stamp that repeats makes a recording fair, as do an end that is cut off and a source that failed. Stamps
that run backwards, a stretch that is damaged, messages that the disk refused, stats that disagree with the messages,
and having neither scans nor images make it poor.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Final

from sdt_tools.recording.messages.topics import CAMERA_IMAGE, LIDAR_SCAN, SENSORS
from sdt_tools.recording.timing.summary import Timing
from sdt_tools.recording.timing.topic import TopicTiming

_MS_NS: Final = 1_000_000


class Health(StrEnum):
    """The verdict, from the best to the worst."""

    GOOD = "good"
    FAIR = "fair"
    POOR = "poor"


@dataclass(frozen=True)
class Bounds:
    """Beyond ``fair`` a recording is fair, beyond ``poor`` it is poor."""

    fair: float
    poor: float

    def verdict(self, value: float) -> Health:
        """Where ``value`` lies."""
        if value <= self.fair:
            return Health.GOOD
        return Health.FAIR if value <= self.poor else Health.POOR


@dataclass(frozen=True)
class HealthRules:
    """The numbers of the table above, and where they come from."""

    dropped_share: Bounds = Bounds(0.001, 0.01)
    """One scan in 20 s at 50 Hz goes unnoticed; one in two seconds does not."""
    longest_ms: Bounds = Bounds(200.0, 1000.0)
    """Two decisions at 10 Hz; half a metre of driving blind at 0.5 m/s."""
    jitter_share: Bounds = Bounds(0.2, 0.5)
    """Beyond half a period a message could as well be its neighbour."""
    delay_spread_ms: Bounds = Bounds(50.0, 200.0)
    """Half a decision at 10 Hz; two of them."""
    ahead_ms: Bounds = Bounds(1.0, 50.0)
    """A millisecond is how well clocks are mapped; more than a scan period changes what happened first."""
    drift_ppm: Bounds = Bounds(100.0, 1000.0)
    """Quartzes are within 100 ppm of each other (6 ms a minute); 1000 ppm is a clock that is not mapped."""
    unpaired_share: Bounds = Bounds(0.01, 0.1)


@dataclass(frozen=True)
class Reason:
    """A rule that is broken: how badly, and in words."""

    health: Health
    text: str


@dataclass(frozen=True)
class FileState:
    """What is known of the file beside its timing. ``dropped`` is what the recorder dropped itself, by topic."""

    truncated: bool = False
    damaged: int = 0
    lost: int = 0
    failed: bool = False
    disagreements: int = 0
    dropped: Mapping[str, int] | None = None


def drops_of(timing: TopicTiming, dropped: int) -> int:
    """Messages that are not there: what the recorder ``dropped`` leaves gaps too, so the larger of both counts."""
    return max(timing.missing, dropped)


def verdict(reasons: Sequence[Reason]) -> Health:
    """The worst of ``reasons``; good without any."""
    return max((reason.health for reason in reasons), key=list(Health).index, default=Health.GOOD)


def health_reasons(timing: Timing, state: FileState, rules: HealthRules | None = None) -> tuple[Reason, ...]:
    """Every rule that the recording breaks, the worst first."""
    rules = rules or HealthRules()
    reasons = [*_of_file(state, timing), *_of_pairs(timing, rules)]
    for name in SENSORS:
        if name in timing.topics:
            dropped = (state.dropped or {}).get(name, 0)
            reasons += (
                Reason(reason.health, f"{name}: {reason.text}") for reason in _of_topic(timing, name, dropped, rules)
            )
    broken = (reason for reason in reasons if reason.health is not Health.GOOD)
    return tuple(sorted(broken, key=lambda reason: -list(Health).index(reason.health)))


def _of_file(state: FileState, timing: Timing) -> Iterator[Reason]:
    if state.damaged:
        stretches = "a stretch is" if state.damaged == 1 else f"{state.damaged} stretches are"
        yield Reason(Health.POOR, f"{stretches} damaged and unreadable")
    if state.lost:
        yield Reason(Health.POOR, f"{state.lost} messages were recorded that the disk did not take")
    if state.disagreements:
        yield Reason(Health.POOR, "its stats disagree with its messages")
    if not {LIDAR_SCAN, CAMERA_IMAGE} & timing.topics.keys():
        yield Reason(Health.POOR, "it holds neither scans nor images")
    if state.truncated:
        yield Reason(Health.FAIR, "it was cut off; sdt repair finishes it")
    if state.failed:
        yield Reason(Health.FAIR, "it ended because its source or the disk failed")


def _of_pairs(timing: Timing, rules: HealthRules) -> Iterator[Reason]:
    pairs = timing.pairs
    if LIDAR_SCAN in timing.topics and CAMERA_IMAGE in timing.topics:
        rarer = "images" if pairs.unpaired_images <= pairs.unpaired_scans else "scans"
        text = f"{pairs.unpaired_share:.2%} of the {rarer} have no partner within {pairs.tolerance_ns / _MS_NS:g} ms"
        yield Reason(rules.unpaired_share.verdict(pairs.unpaired_share), text)


def _of_topic(timing: Timing, name: str, dropped: int, rules: HealthRules) -> Iterator[Reason]:
    topic = timing.topics[name]
    if topic.backward:
        yield Reason(Health.POOR, f"{topic.backward} stamps run backwards")
    if topic.repeated:
        yield Reason(Health.FAIR, f"{topic.repeated} stamps repeat")
    drops = drops_of(topic, dropped)
    share = drops / (topic.count + drops)
    yield Reason(rules.dropped_share.verdict(share), f"{drops} messages dropped or missing ({share:.2%})")
    if topic.max_gap_ns is not None:
        longest_ms = topic.max_gap_ns / _MS_NS
        yield Reason(rules.longest_ms.verdict(longest_ms), f"{longest_ms:.0f} ms without a message")
    if topic.period_ns is not None and topic.jitter is not None:
        jitter = topic.jitter.p99_ns / topic.period_ns
        yield Reason(rules.jitter_share.verdict(jitter), f"stamps jitter by {jitter:.0%} of the period")
    spread_ms = topic.delay.width_ns / _MS_NS
    yield Reason(rules.delay_spread_ms.verdict(spread_ms), f"the delay to the host varies by {spread_ms:.0f} ms")
    ahead_ms = -topic.delay.p50_ns / _MS_NS
    yield Reason(rules.ahead_ms.verdict(ahead_ms), f"received {ahead_ms:.1f} ms before they were taken")
    drift = topic.drift
    if drift is not None:
        surely_ppm = max(drift.low_ppm, -drift.high_ppm, 0.0)
        yield Reason(rules.drift_ppm.verdict(surely_ppm), f"the delay drifts by {drift.ppm:+.0f} ppm")
