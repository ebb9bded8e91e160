"""The emulated device behaves as the device does, towards clients that nobody here wrote too."""

import socket
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from sick_scan_tcp import SickScan

from sdt_tools.emulation.lms1xx.config import EmulatedConfig
from sdt_tools.emulation.lms1xx.device_time import DeviceTime
from sdt_tools.emulation.lms1xx.emulator import EmulatedLms1xx
from sdt_tools.emulation.lms1xx.making import make_scan, raw_values
from sdt_tools.emulation.lms1xx.supply import RecordedScans, SceneScans
from sdt_tools.errors import DeviceError, RecordingError
from sdt_tools.frames import RAYS
from sdt_tools.recording.reader import Recording
from sdt_tools.robot.lms1xx.framing import Dialect
from sdt_tools.robot.lms1xx.link import Link, RefusedError
from sdt_tools.robot.lms1xx.settings import DataSettings, OutputRange, ScanSettings, read_scan_settings

SAMPLE = next((Path(__file__).parents[3] / "recordings").glob("*.mcap"))


class Slope:
    def ranges_at(self, host_ns: int) -> np.ndarray:
        return 1.0 + np.arange(RAYS) / 1000


@pytest.fixture(params=[Dialect.A, Dialect.B], ids=lambda dialect: dialect.label)
def dialect(request: pytest.FixtureRequest) -> Dialect:
    return request.param


@pytest.fixture
def emulator(dialect: Dialect) -> Iterator[EmulatedLms1xx]:
    with EmulatedLms1xx(Slope(), EmulatedConfig(port=0, protocol=dialect.value, start_s=0.05)) as running:
        yield running


@pytest.fixture
def link(emulator: EmulatedLms1xx, dialect: Dialect) -> Iterator[Link]:
    opened = Link("127.0.0.1", emulator.port, dialect, "LiDAR")
    yield opened
    opened.close()


def log_in(link: Link, password: int = 0xF4724744, level: int = 3) -> int:
    fields = link.writer()
    fields.signed(level, 8)
    fields.unsigned(password, 32)
    return link.ask("sMN SetAccessMode", fields).fields.unsigned(8)


def set_scan(link: Link, frequency: int, resolution: int) -> tuple[int, ScanSettings]:
    fields = link.writer()
    for value, bits in ((frequency, 32), (1, 16), (resolution, 32)):
        fields.unsigned(value, bits)
    for angle in (-450_000, 2_250_000):
        fields.signed(angle, 32)
    answer = link.ask("sMN mLMPsetscancfg", fields).fields
    return answer.unsigned(8), read_scan_settings(answer)


def state(link: Link) -> int:
    return link.ask("sRN STlms").fields.unsigned(16)


def test_nobody_changes_anything_without_a_log_in(link: Link) -> None:
    with pytest.raises(RefusedError, match="sFA 1"):
        set_scan(link, 2500, 2500)
    with pytest.raises(RefusedError, match="sFA A"):
        link.ask("sWN LMDscandatacfg")
    assert log_in(link, 0x12345678) == 0
    with pytest.raises(RefusedError, match="sFA 1"):
        link.ask("sMN LMCstartmeas")
    assert log_in(link) == 1
    link.ask("sMN LMCstartmeas")
    link.ask("sMN Run")
    with pytest.raises(RefusedError, match="sFA 1"):
        link.ask("sMN LMCstartmeas")


def test_new_rates_stop_it_until_it_is_told_to_measure(link: Link) -> None:
    assert state(link) == 7
    log_in(link)
    assert set_scan(link, 2500, 2500) == (0, ScanSettings(2500, 2500))
    assert state(link) == 2
    link.ask("sMN LMCstartmeas")
    assert state(link) == 5
    for _ in range(200):
        if state(link) == 7:
            return
    raise AssertionError("never ready")


@pytest.mark.parametrize(("frequency", "resolution", "code"), [(5000, 2500, 2), (3000, 5000, 1), (2500, 1000, 2)])
def test_rates_that_the_device_does_not_have_change_nothing(
    link: Link, frequency: int, resolution: int, code: int
) -> None:
    log_in(link)
    assert set_scan(link, frequency, resolution) == (code, ScanSettings(5000, 5000))
    assert state(link) == 7


def test_only_what_was_stored_outlives_the_power(emulator: EmulatedLms1xx, link: Link) -> None:
    log_in(link)
    set_scan(link, 2500, 5000)
    link.ask("sMN mEEwriteall")
    set_scan(link, 2500, 2500)
    emulator.power_cycle(0.0)
    assert emulator.device.settings.scan == ScanSettings(2500, 5000)
    again = Link("127.0.0.1", emulator.port, emulator.device.dialect, "LiDAR")
    assert state(again) == 7
    again.close()


def test_commands_that_it_does_not_know_are_refused_by_kind(link: Link) -> None:
    for head, code in (("sRN nothing", "3"), ("sWN nothing", "3"), ("sMN nothing", "2")):
        with pytest.raises(RefusedError, match=f"sFA {code}"):
            link.ask(head)


def test_a_port_that_is_taken_is_said() -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        with pytest.raises(DeviceError, match=f"127.0.0.1:{port}: cannot listen there"):
            EmulatedLms1xx(Slope(), EmulatedConfig(port=port))


def test_a_client_from_the_package_index_reads_the_scan_and_sets_the_angles(
    capsys: pytest.CaptureFixture[str],
) -> None:
    with EmulatedLms1xx(Slope(), EmulatedConfig(port=0, protocol="a")) as emulator:
        client = SickScan("127.0.0.1", emulator.port)
        angles, metres = client.extract_telegram(client.scan())
        assert (len(angles), angles[0], angles[-1]) == (541, -45.0, 225.0)
        client.set_start_stop_angle(20, 135)
        angles, metres = client.extract_telegram(client.scan())
        client.release()
    assert (len(angles), angles[0], angles[-1]) == (231, 20.0, 135.0)
    assert metres == pytest.approx((1.13 + np.arange(231) / 1000).tolist())
    assert "sAN SetAccessMode 1" in capsys.readouterr().out


def test_a_recording_is_served_at_its_own_pace_and_again() -> None:
    supply = RecordedScans(SAMPLE)
    with Recording.open(SAMPLE) as recording:
        scans = recording.scans()
    offsets_ns = scans.stamps_ns - scans.stamps_ns[0]
    for row in (0, 1, 2, len(scans) // 2, len(scans) - 1):
        assert supply.ranges_at(5_000 + int(offsets_ns[row])) is not None
        assert np.array_equal(supply.ranges_at(5_000 + int(offsets_ns[row])), scans.ranges_m[row])
    behind_ns = 5_000 + int(offsets_ns[-1]) + int(offsets_ns[-1]) // (len(scans) - 1)
    assert np.array_equal(supply.ranges_at(behind_ns), scans.ranges_m[0])


def test_a_recording_without_scans_is_refused(tmp_path: Path) -> None:
    empty = tmp_path / "none.mcap"
    with pytest.raises(RecordingError):
        RecordedScans(empty)


def test_a_scene_goes_on_as_time_does() -> None:
    supply = SceneScans("plain", 1000)
    first = supply.ranges_at(10**18)
    later = supply.ranges_at(10**18 + 3 * 10**9)
    assert first.shape == (RAYS,)
    assert not np.array_equal(first, later)
    again = SceneScans("plain", 1000)
    assert np.array_equal(again.ranges_at(5), first)


@pytest.mark.parametrize(("remission_16bit", "wide", "narrow"), [(True, 2, 0), (False, 1, 1)])
def test_strengths_come_in_the_width_that_is_set(remission_16bit: bool, wide: int, narrow: int) -> None:
    data = DataSettings(remission=True, remission_16bit=remission_16bit, time=True, device_name=True)
    scan = make_scan(Slope().ranges_at(0), ScanSettings(5000, 5000), data, OutputRange(5000), (1, 2), (3, 4), 1, "Left")
    assert (len(scan.channels_16bit), len(scan.channels_8bit)) == (wide, narrow)
    strengths = scan.channel("RSSI1")
    assert strengths is not None
    assert np.all(np.diff(strengths.values) <= 0)
    assert (scan.device_name, scan.time is not None) == ("Left", True)


def test_codes_survive_every_scale() -> None:
    ranges_m = np.array([0.0, 0.002, 0.003, 0.02, 20.0, np.inf])
    assert raw_values(ranges_m, 1).tolist() == [0, 2, 3, 20, 20_000, 0]
    assert raw_values(ranges_m, 2).tolist() == [0, 2, 3, 16, 10_000, 0]


def test_the_device_clock_drifts_without_a_jump() -> None:
    clock = DeviceTime(0, 1_000, 100.0)
    assert clock.us_at(10**10) == pytest.approx(1_000 + 10**7 * 1.0001)
    clock.drift(10**10, -100.0)
    assert clock.us_at(10**10) == pytest.approx(1_000 + 10**7 * 1.0001)
    assert clock.host_at(clock.us_at(2 * 10**10)) == pytest.approx(2 * 10**10, abs=2)
