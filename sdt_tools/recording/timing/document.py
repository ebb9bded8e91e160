"""Timing for machines: milliseconds, and null where there is nothing to say."""

from sdt_tools.recording.timing.health import drops_of
from sdt_tools.recording.timing.pairs import PairTiming
from sdt_tools.recording.timing.topic import TopicTiming

MS_NS = 1_000_000


def topic_document(timing: TopicTiming | None, dropped: int) -> dict[str, object]:
    """One topic; None for one without messages. ``dropped`` of it are the recorder's own.

    ``drops`` are messages that are not there: dropped by the recorder, or ``missing`` by the gaps in the stamps.
    ``max_gap_ms`` is the longest interval between two stamps.
    """
    if timing is None:
        return {"gaps": 0, "max_gap_ms": None, "drops": dropped, "missing": 0, "dropped": dropped}
    jitter, delay, drift = timing.jitter, timing.delay, timing.drift
    return {
        "gaps": timing.gaps,
        "max_gap_ms": in_ms(timing.max_gap_ns),
        "drops": drops_of(timing, dropped),
        "missing": timing.missing,
        "dropped": dropped,
        "period_ms": in_ms(timing.period_ns),
        "jitter_ms_p50": None if jitter is None else in_ms(jitter.p50_ns),
        "jitter_ms_p99": None if jitter is None else in_ms(jitter.p99_ns),
        "delay_ms_p50": in_ms(delay.p50_ns),
        "delay_ms_p99": in_ms(delay.p99_ns),
        "delay_ms_min": in_ms(delay.min_ns),
        "delay_ms_max": in_ms(delay.max_ns),
        "delay_spread_ms": in_ms(delay.width_ns),
        "drift_ppm": None if drift is None else drift.ppm,
        "drift_ppm_interval": None if drift is None else [drift.low_ppm, drift.high_ppm],
        "backward_stamps": timing.backward,
        "repeated_stamps": timing.repeated,
    }


def pairs_document(pairs: PairTiming) -> dict[str, object]:
    """Scans with images. ``unpaired`` are those of the rarer one."""
    return {
        "count": pairs.count,
        "skew_ms_p50": None if pairs.skew is None else in_ms(pairs.skew.p50_ns),
        "skew_ms_p99": None if pairs.skew is None else in_ms(pairs.skew.p99_ns),
        "skew_ms_max": None if pairs.skew is None else in_ms(pairs.skew.max_ns),
        "unpaired": pairs.unpaired,
        "unpaired_scans": pairs.unpaired_scans,
        "unpaired_images": pairs.unpaired_images,
        "tolerance_ms": in_ms(pairs.tolerance_ns),
    }


def in_ms(time_ns: int | None) -> float | None:
    """Milliseconds, exact to the nanosecond; None of None."""
    return None if time_ns is None else time_ns / MS_NS
