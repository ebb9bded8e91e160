"""Each rule, kept and broken, by what a device could have given."""

from dataclasses import replace

import numpy as np
import pytest

from sdt_tools.clock import HostClock
from sdt_tools.frames import FIRST_RAY_RAD, RAYS, LidarScan, LogEntry, LogLevel, Odometry, Pose2D, RawPicture, Received
from sdt_tools.robot.contract.arrival_rules import arrival_rules, silence_rule
from sdt_tools.robot.contract.base_rules import pose_rules, stands
from sdt_tools.robot.contract.camera_rules import camera_rules
from sdt_tools.robot.contract.lidar_rules import lidar_rules
from sdt_tools.robot.contract.trial import Trial
from sdt_tools.robot.contract.verdict import Outcome, Verdict

START_NS = 1_700_000_000_000_000_000
PERIOD_NS = 20_000_000
MS = 1_000_000
CODES = "rays without echo keep the sensor's code"


def ranges_m(number: int) -> np.ndarray:
    ranges = 2.0 + np.random.default_rng(number).normal(0.0, 0.01, RAYS)
    ranges[[3, 5]] = (0.0, 0.003)
    return ranges


def scan(number: int) -> LidarScan:
    return LidarScan(START_NS + number * PERIOD_NS, ranges_m(number))


def trial(*messages: object) -> Trial:
    """A device that gave these, each 5 ms after its stamp."""
    given = [
        one if isinstance(one, Received | RawPicture) else Received(one.stamp_ns + 5 * MS, one) for one in messages
    ]
    found = Trial(HostClock(), given=given, read_s=[0.0001] * 9)
    found.first_ranges_m = [one.ranges_m.copy() for one in found.scans[:5]]
    return found


def scans(**changes: object) -> Trial:
    return trial(*(replace(scan(number), **changes) for number in range(10)))


def broken(verdicts: list[Verdict]) -> dict[str, str]:
    return {one.rule: one.seen for one in verdicts if one.outcome is Outcome.BROKEN}


def arrivals(of: Trial, hz: float | None = None) -> dict[str, str]:
    return broken(arrival_rules(of, LidarScan, "scans", hz, 0.2))


def test_good_scans_break_nothing() -> None:
    assert broken(lidar_rules(scans())) == {}
    assert arrivals(scans(), 50.0) == {}


@pytest.mark.parametrize(
    ("changes", "rule", "seen"),
    [
        ({"ranges_m": np.full(1081, 2.0)}, "a scan has 541 rays", "scans have 1081 rays"),
        ({"frame_id": "laser"}, "a scan has 541 rays", "the frame is laser, not lidar"),
        ({"start_angle_rad": -135.0}, "rays run from -135° (right) to 135° (left)", "are these degrees?"),
        ({"start_angle_rad": -FIRST_RAY_RAD}, "rays run from -135° (right) to 135° (left)", "from 2.356"),
        ({"ranges_m": np.full(RAYS, 2000.0)}, "ranges are finite metres", "are these millimetres?"),
        ({"ranges_m": np.where(np.arange(RAYS) < 9, np.inf, 2.0)}, "ranges are finite metres", "1.66% are nan or"),
        ({"ranges_m": np.full(RAYS, -1.0)}, "ranges are finite metres", "the least is -1"),
        ({"ranges_m": np.where(np.arange(RAYS) < 9, 20.0, 2.0)}, CODES, "just 20"),
        (
            {"ranges_m": np.where(np.arange(RAYS) < 9, 0.0015, 2.0)},
            "rays without echo keep the sensor's code",
            "no whole",
        ),
    ],
)
def test_scans_that_break_a_rule(changes: dict[str, object], rule: str, seen: str) -> None:
    assert seen in broken(lidar_rules(scans(**changes)))[rule]


def test_a_scan_that_changes_after_it_was_read() -> None:
    reused = scans()
    reused.scans[0].ranges_m[7] += 1.0
    assert "changed after it was read" in broken(lidar_rules(reused))["each scan's array is its own"]
    shared = ranges_m(0)
    assert "share an array" in broken(lidar_rules(scans(ranges_m=shared)))["each scan's array is its own"]


def test_stamps_that_go_back_lie_ahead_or_are_of_another_clock() -> None:
    rule = "stamps ascend and lie within receipt"
    back = trial(scan(0), scan(1), Received(START_NS + 45 * MS, scan(1)))
    assert "1 of 3 are not later" in arrivals(back)[rule]
    ahead = trial(Received(START_NS - 3 * MS, scan(0)), scan(1))
    assert "one is 3.0 ms after its receipt" in arrivals(ahead)[rule]
    other = trial(*(replace(scan(number), stamp_ns=number) for number in range(3)))
    other.given = [Received(START_NS + number, one.message) for number, one in enumerate(other.given)]
    assert "nanoseconds since 1970" in arrivals(other)[rule]


def test_rates_and_gaps() -> None:
    assert "50 a second, not the 25" in arrivals(scans(), 25.0)["scans come at 25 Hz, none 0.2 s late"]
    gap = trial(*(scan(number) for number in (0, 1, 2, 20, 21)))
    assert "0.36 s without any" in arrivals(gap)["scans come steadily, none 0.2 s late"]
    assert arrivals(trial(scan(0)))["scans come"].startswith("1 came")


def test_reading_that_raises_waits_or_gives_too_early() -> None:
    raising = scans()
    raising.failure = "KeyError: 3"
    assert "it raised KeyError: 3" in arrivals(raising)["read does not raise and does not wait"]
    waiting = scans()
    waiting.read_s = [0.02] * 9
    assert "20.00 ms" in arrivals(waiting)["read does not raise and does not wait"]
    early = scans()
    early.early = 3
    assert "3 things were received after until_ns" in arrivals(early)["all up to until_ns, in order of receipt"]
    strange = trial(scan(0), scan(1), Odometry(START_NS + 30 * MS, Pose2D(0.0, 0.0, 0.0)))
    assert "it gave Odometry" in arrivals(strange)["read gives scans and log entries, nothing else"]


def warning(at_ms: float) -> Received:
    at_ns = START_NS + round(at_ms * MS)
    return Received(at_ns, LogEntry(at_ns, LogLevel.WARNING, "no scan"))


@pytest.mark.parametrize(
    ("given", "outcome", "seen"),
    [
        ((scan(0), warning(165), scan(100)), Outcome.KEPT, "told after 160 ms, silent for 2.0 s"),
        ((scan(0), warning(305), scan(100)), Outcome.BROKEN, "told after 300 ms"),
        ((scan(0), scan(100)), Outcome.BROKEN, "nothing was told"),
        ((scan(0), warning(165)), Outcome.BROKEN, "nothing came any more"),
        ((scan(0), scan(1)), Outcome.OPEN, "it never fell silent"),
    ],
)
def test_silence(given: tuple[object, ...], outcome: Outcome, seen: str) -> None:
    verdict = silence_rule(trial(*given), LidarScan, 0.2)
    assert (verdict.outcome, seen in verdict.seen) == (outcome, True), verdict


def pose(number: int, x_m: float = 0.0, yaw_rad: float = 0.0, frame: str = "odom") -> Odometry:
    return Odometry(START_NS + number * 100 * MS, Pose2D(x_m, 0.0, yaw_rad), frame)


def test_poses() -> None:
    assert broken(pose_rules(trial(pose(0), pose(1)))) == {}
    assert "not finite" in broken(pose_rules(trial(pose(0, float("nan")))))["poses are finite"]
    assert "the frame is map" in broken(pose_rules(trial(pose(0, frame="map"))))["poses are finite"]


def test_whether_a_base_stands_is_seen_in_its_newest_poses() -> None:
    driven = trial(*(pose(number, min(number, 5) * 0.1) for number in range(12)))
    driven.asked_ns = START_NS + 1100 * MS
    assert stands("it stands", driven).outcome is Outcome.KEPT
    driven.asked_ns = START_NS + 700 * MS
    assert stands("it stands", driven).outcome is Outcome.BROKEN
    turning = trial(*(pose(number, 0.0, number * 0.05) for number in range(12)))
    turning.asked_ns = START_NS + 1100 * MS
    assert stands("it stands", turning).outcome is Outcome.BROKEN
    assert stands("it stands", trial()).outcome is Outcome.OPEN


def test_pictures() -> None:
    def pictures(image: np.ndarray | None = None) -> Trial:
        made = [np.zeros((4, 6, 3), np.uint8) if image is None else image for _ in range(3)]
        return trial(*(RawPicture(START_NS + n * 40 * MS, START_NS + n * 40 * MS, one) for n, one in enumerate(made)))

    assert broken(camera_rules(pictures())) == {}
    shared = np.zeros((4, 6, 3), np.uint8)
    assert broken(camera_rules(pictures(shared))) == {
        "each picture's array is its own": "two pictures share an array; give each one of its own"
    }
