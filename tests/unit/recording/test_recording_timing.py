from random import Random

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from recording_samples import T0
from scipy.stats import theilslopes
from timing_samples import MS_NS, Stream

from sdt_tools.recording.timing.drift import drift_of
from sdt_tools.recording.timing.pairs import pair_timing
from sdt_tools.recording.timing.stamps import StampLog, TopicStamps
from sdt_tools.recording.timing.summary import disagreements, noted_timing, timing_entries, timing_of
from sdt_tools.recording.timing.topic import TopicTiming, spread_of, topic_timing

SCAN, IMAGE = "/lidar/scan", "/camera/image"


def log_of(times: list[tuple[int, int]], topic: str = SCAN) -> StampLog:
    log = StampLog()
    for received_ns, stamp_ns in times:
        log.see(topic, received_ns, stamp_ns)
    return log


def timing(stream: Stream, seconds: float = 20.0) -> TopicTiming:
    return timing_of(log_of(stream.times(seconds))).topics[SCAN]


def test_an_even_stream_has_nothing_to_report() -> None:
    found = timing(Stream(20e6, delay_ns=3 * MS_NS))
    assert (found.count, found.period_ns, found.gaps, found.missing) == (1000, 20 * MS_NS, 0, 0)
    assert (found.max_gap_ns, found.backward, found.repeated) == (20 * MS_NS, 0, 0)
    assert found.jitter is not None
    assert (found.jitter.max_ns, found.delay.p50_ns, found.delay.width_ns) == (0, 3 * MS_NS, 0)
    assert found.drift is not None
    assert found.drift.ppm == 0.0


@pytest.mark.parametrize("period_ns", [20e6, 40e6, 1e9 / 30])
def test_gaps_are_counted_at_any_rate(period_ns: float) -> None:
    found = timing(Stream(period_ns, jitter_ns=500_000, missing={50, 100, 101, 102, 300}))
    assert (found.gaps, found.missing) == (3, 5)
    assert found.max_gap_ns == pytest.approx(4 * period_ns, abs=3 * MS_NS)


def test_a_topic_that_speaks_now_and_then_has_no_gaps() -> None:
    stamps_ns = T0 + np.array([0, 1, 2, 5000]) * MS_NS
    found = topic_timing(TopicStamps(stamps_ns, stamps_ns), periodic=False)
    assert (found.period_ns, found.gaps, found.missing, found.jitter) == (None, 0, 0, None)
    assert found.max_gap_ns == 4998 * MS_NS


def test_jitter_leaves_gaps_out() -> None:
    found = timing(Stream(20e6, jitter_ns=MS_NS, missing=range(200, 300)))
    assert found.jitter is not None
    assert found.jitter.p50_ns == pytest.approx(0.6745 * np.sqrt(2) * MS_NS, rel=0.1)  # of a normal difference
    assert found.jitter.max_ns < 10 * MS_NS


def test_stamps_that_run_backwards_or_repeat_show() -> None:
    stamps_ms = [0, 20, 40, 30, 60, 60, 80]
    found = timing_of(log_of([(T0 + n, T0 + ms * MS_NS) for n, ms in enumerate(stamps_ms)])).topics[SCAN]
    assert (found.backward, found.repeated) == (1, 1)


@pytest.mark.parametrize("ppm", [-80.0, 0.0, 25.0, 400.0])
def test_drift_is_found_behind_late_messages(ppm: float) -> None:
    found = timing(Stream(20e6, delay_ns=5 * MS_NS, late_ns=1 * MS_NS, drift_ppm=ppm), seconds=120).drift
    assert found is not None
    assert found.low_ppm <= ppm + 1.0
    assert found.high_ppm >= ppm - 1.0
    assert found.ppm == pytest.approx(ppm, abs=3.0)


def test_a_burst_of_late_messages_is_no_drift() -> None:
    stamps_ns = T0 + np.arange(3000) * 20 * MS_NS
    delays_ns = np.full(3000, 2 * MS_NS)
    delays_ns[2400:] += 300 * MS_NS  # the last fifth hangs; least squares would see thousands of ppm
    found = drift_of(stamps_ns, delays_ns)
    assert found is not None
    assert found.ppm == 0.0
    assert np.polyfit(stamps_ns - T0, delays_ns, 1)[0] * 1e6 > 3000


def test_drift_is_the_slope_that_scipy_finds() -> None:
    rng = np.random.default_rng(3)
    stamps_ns = T0 + np.sort(rng.integers(0, 60_000, 150)) * MS_NS  # fewer than 200: each its own block
    delays_ns = rng.integers(0, 5 * MS_NS, 150)
    found = drift_of(stamps_ns, delays_ns)
    peer = theilslopes(delays_ns, stamps_ns - T0, alpha=0.95)
    assert found is not None
    assert found.ppm == pytest.approx(peer[0] * 1e6, rel=1e-6)
    assert (found.low_ppm, found.high_ppm) == pytest.approx((peer[2] * 1e6, peer[3] * 1e6), rel=0.02)


@pytest.mark.parametrize("seconds", [0.02, 5.0])
def test_a_short_recording_tells_no_drift(seconds: float) -> None:
    assert timing(Stream(20e6, late_ns=MS_NS), seconds).drift is None


def test_percentiles_are_times_that_occurred() -> None:
    spread = spread_of(np.arange(1, 201) * 7)
    assert spread is not None
    assert (spread.min_ns, spread.p1_ns, spread.p50_ns, spread.p99_ns, spread.max_ns) == (7, 14, 700, 1386, 1400)


def test_each_image_finds_its_scan() -> None:
    scans_ns = T0 + np.arange(100) * 20 * MS_NS
    images_ns = scans_ns[::2] + 3 * MS_NS
    found = pair_timing(scans_ns, np.append(images_ns, T0 + 9000 * MS_NS))
    assert (found.count, found.unpaired_images, found.unpaired_scans, found.unpaired) == (50, 1, 50, 1)
    assert found.skew is not None
    assert (found.skew.p50_ns, found.skew.max_ns) == (3 * MS_NS, 3 * MS_NS)


def test_without_images_there_are_no_pairs() -> None:
    found = pair_timing(T0 + np.arange(5) * MS_NS, np.empty(0, np.int64))
    assert (found.count, found.unpaired, found.skew) == (0, 0, None)


TIMES = st.lists(st.tuples(st.integers(0, 2**62), st.integers(0, 2**62)), min_size=1, max_size=40)


@given(TIMES, TIMES, st.randoms(use_true_random=False))
@settings(deadline=None, max_examples=50)
def test_numbers_do_not_depend_on_the_order_and_survive_the_file(
    scans: list[tuple[int, int]], images: list[tuple[int, int]], random: Random
) -> None:
    messages = [(SCAN, *times) for times in scans] + [(IMAGE, *times) for times in images]
    log, shuffled = StampLog(), StampLog()
    for message in messages:
        log.see(*message)
    random.shuffle(messages)
    for message in messages:
        shuffled.see(*message)
    found = timing_of(log)
    assert timing_of(shuffled) == found
    assert noted_timing(timing_entries(found), {SCAN: len(scans), IMAGE: len(images)}) == found
    assert disagreements(timing_entries(found), found) == ()


@pytest.mark.parametrize("broken", ["", "{", "[]", '{"count": 3}', '{"count": "many"}'])
def test_stats_that_are_unreadable_are_not_believed(broken: str) -> None:
    found = timing_of(log_of(Stream(20e6).times(1)))
    stats = timing_entries(found) | {"timing./lidar/scan": broken}
    assert noted_timing(stats, {SCAN: 50}) is None
    assert disagreements(stats, found)


def test_stats_of_another_file_are_not_believed() -> None:
    stats = timing_entries(timing_of(log_of(Stream(20e6).times(1))))
    assert noted_timing(stats, {SCAN: 50}) is not None
    assert noted_timing(stats, {SCAN: 49}) is None
    assert noted_timing(stats, {SCAN: 50, IMAGE: 1}) is None
