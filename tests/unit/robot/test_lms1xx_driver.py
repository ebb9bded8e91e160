"""The driver at an emulated device over real sockets: what it delivers, and every fault on the list."""

import numpy as np
import pytest
from lidar_rig import SLOPE_M, rig

from sdt_tools.emulation.lms1xx.config import EmulatedConfig
from sdt_tools.emulation.lms1xx.faults import Faults
from sdt_tools.frames import FIRST_RAY_RAD, RAYS
from sdt_tools.robot.lms1xx.driver import LinkState

PROTOCOLS = ("a", "b")


def device(protocol: str = "a", **settings: object) -> EmulatedConfig:
    return EmulatedConfig(port=0, protocol=protocol, start_s=0.1, **settings)


@pytest.mark.parametrize("protocol", PROTOCOLS)
def test_scans_come_in_order_with_their_ranges_codes_and_stamps(protocol: str) -> None:
    with rig(device(protocol), Faults(jitter_ms=5, drift_ppm=50)) as robot:
        robot.more_scans(40)
    for scan in robot.scans:
        assert scan.ranges_m.tolist() == [*SLOPE_M[:-3].round(3).tolist(), 0.0, 0.002, 0.003]
        assert (scan.start_angle_rad, scan.end_angle_rad) == (FIRST_RAY_RAD, -FIRST_RAY_RAD)
    received_ns = [one.received_ns for one in robot.received]
    assert received_ns == sorted(received_ns)
    assert np.diff([scan.stamp_ns for scan in robot.scans]).min() > 0
    assert robot.errors_ms().max() < 10  # a machine that is busy delays both; the clock's own tests are exact
    assert robot.log == []
    assert robot.lidar.status.missing == 0


@pytest.mark.parametrize(
    ("protocol", "faults"), [("a", Faults(split_bytes=37)), ("b", Faults(split_bytes=700, merge=3))]
)
def test_split_and_merged_telegrams_lose_nothing(protocol: str, faults: Faults) -> None:
    with rig(device(protocol), faults) as robot:
        robot.more_scans(15)
    assert (robot.lidar.status.missing, robot.lidar.status.damaged) == (0, 0)


def test_dropped_scans_are_counted_by_their_counter_and_logged() -> None:
    with rig(device(), Faults(drop=0.3, seed=3)) as robot:
        robot.more_scans(30)
        counts, status = robot.emulator.counts, robot.lidar.status
        assert status.missing > 0
        assert abs(status.missing - counts.dropped) <= 3  # those just before and just behind
    assert any("missing before number" in line for line in robot.log)


@pytest.mark.parametrize("protocol", PROTOCOLS)
def test_spoilt_telegrams_are_counted_and_never_become_scans(protocol: str) -> None:
    with rig(device(protocol), Faults(spoil=0.3, garbage=0.3, seed=5)) as robot:
        robot.more_scans(30)
        assert robot.lidar.status.damaged > 0
        assert robot.lidar.status.missing > 0
    assert all(scan.ranges_m[0] == 1.0 and scan.ranges_m[100] == 1.1 for scan in robot.scans)


def test_a_connection_that_is_closed_comes_back_and_the_gap_is_logged() -> None:
    with rig(device()) as robot:
        robot.more_scans(5)
        robot.emulator.hang_up()
        robot.logged("the device closed the connection")
        robot.logged("reconnected")
        robot.more_scans(3)
        assert robot.lidar.status.reconnects == 1
        assert any("missing before number" in line for line in robot.log)
        assert robot.errors_ms().max() < 10


def test_silence_is_reported_and_its_end() -> None:
    with rig(device()) as robot:
        robot.more_scans(5)
        robot.emulator.silent = True
        robot.logged("no scan for 0.16 s")
        assert robot.lidar.status.state in (LinkState.SILENT, LinkState.AWAY)
        assert robot.lidar.age_s > 0.15
        robot.emulator.silent = False
        robot.more_scans(3)
    assert any("scans again, after" in line or "reconnected" in line for line in robot.log)


def test_a_cut_cable_is_noticed_and_what_comes_behind_it_is_stamped_right() -> None:
    with rig(device("b")) as robot:
        robot.more_scans(5)
        robot.emulator.unplug()
        robot.logged("lost: no scan for 0.6 s")
        robot.emulator.unplug(False)
        robot.logged("reconnected")
        robot.more_scans(5)
        assert robot.errors_ms().max() < 10


def test_a_power_cycle_is_survived_with_a_new_clock_and_settings_made_again() -> None:
    with rig(device(scan_hz=25, start_us=4_000_000_000)) as robot:
        robot.more_scans(5)
        robot.emulator.switch_off()
        robot.logged("lost")
        robot.emulator.switch_on()
        robot.logged("reconnected")
        robot.logged("its clock started anew")
        robot.more_scans(5)
        assert robot.emulator.device.settings.scan.frequency == 5000
        assert robot.emulator.device.stored_writes == 0
        assert robot.errors_ms().max() < 10


def test_the_microseconds_may_wrap_while_it_streams() -> None:
    with rig(device(start_us=(1 << 32) - 1_200_000)) as robot:
        robot.more_scans(60)
        assert robot.emulator.device.time.us_at(robot.clock.now_ns()) > 1 << 32
    assert robot.lidar.status.missing == 0
    assert robot.log == []
    assert robot.errors_ms().max() < 10


def test_nothing_is_written_that_stands_already() -> None:
    with rig(device()) as robot:
        assert robot.emulator.device.writes == 0
    with rig(device(scan_hz=25)) as robot:
        assert robot.emulator.device.writes == 1
        assert robot.emulator.device.stored_writes == 0


def test_settings_are_stored_for_good_when_that_is_asked() -> None:
    with rig(device(scan_hz=25), permanent=True) as robot:
        assert robot.emulator.device.stored_writes == 1


@pytest.mark.parametrize(("resolution", "all_rays", "rays"), [(0.25, False, RAYS), (0.25, True, 1081)])
def test_25_hz_at_both_resolutions(resolution: float, all_rays: bool, rays: int) -> None:
    with rig(device("b"), scan_hz=25, resolution_deg=resolution, all_rays=all_rays) as robot:
        robot.more_scans(3)
    assert {len(scan.ranges_m) for scan in robot.scans} == {rays}
    assert robot.scans[0].ranges_m[-541 if rays == RAYS else 0] == 1.0
    periods_ms = np.diff([scan.stamp_ns for scan in robot.scans]) / 1e6
    assert periods_ms == pytest.approx(40.0, abs=5.0)


def test_a_scale_of_two_gives_the_same_metres_to_its_step() -> None:
    with rig(device("b", scale=2)) as robot:
        robot.more_scans(1)
    assert robot.scans[0].ranges_m[:-3] == pytest.approx(SLOPE_M[:-3], abs=0.00101)
    assert robot.scans[0].ranges_m[-3:].tolist() == [0.0, 0.002, 0.003]
