"""Asking an LMS1xx who it is, how it is set and how it does, without changing anything or logging in."""

from dataclasses import dataclass
from time import monotonic, time_ns
from typing import Final

from sdt_tools.errors import DeviceError
from sdt_tools.robot.lms1xx.config import Lms1xxConfig
from sdt_tools.robot.lms1xx.handshake import needed_changes, open_link
from sdt_tools.robot.lms1xx.link import Link, NoAnswerError, RefusedError
from sdt_tools.robot.lms1xx.reading import TelegramError
from sdt_tools.robot.lms1xx.scan_telegram import read_scan
from sdt_tools.robot.lms1xx.settings import MEASURING, Identity, state_words
from sdt_tools.robot.lms1xx.telegram import SCAN_DATA

_CONNECT_S: Final = 1.0
_ANSWER_S: Final = 0.8
_LISTEN_S: Final = 1.2
_TURN_US: Final = 1 << 32


@dataclass(frozen=True)
class LidarProbe:
    """What it says. ``clock_ratio`` is how many of its seconds pass in one of the host's, known where scans came."""

    identity: Identity
    dialect: str
    state: str
    measures: bool
    would_be_set: bool
    scans_hz: float | None
    clock_ratio: float | None
    running_s: float | None
    """What its counter of microseconds shows; it begins at power-on, and again every 72 minutes."""


def probe(config: Lms1xxConfig) -> LidarProbe:
    """Ask the LiDAR that ``config`` names. Other clients of it are not disturbed.

    Scans are asked for over this connection alone, which ends with it. Raises DeviceError where it cannot be reached,
    or something else answers.
    """
    link, identity = open_link(config, _CONNECT_S, _ANSWER_S)
    try:
        state = link.ask("sRN STlms", wait_s=_ANSWER_S).fields.unsigned(16)
        would_be_set = bool(needed_changes(link, config, set()))
        times = _listened(link) if state == MEASURING else []
    except TelegramError as error:
        raise DeviceError(f"{config.place}: its answer makes no sense: {error}") from None
    finally:
        link.close()
    rate_hz, ratio, running_s = _clock(times)
    return LidarProbe(
        identity, link.dialect.label, state_words(state), state == MEASURING, would_be_set, rate_hz, ratio, running_s
    )


def _listened(link: Link) -> list[tuple[int, int]]:
    """Of each scan within a second or so: when it left by the device's clock, in µs, and when it came, in ns."""
    times: list[tuple[int, int]] = []
    for wanted in (1, 0):
        fields = link.writer()
        fields.unsigned(wanted, 8)
        try:
            link.ask(f"sEN {SCAN_DATA}", fields, _ANSWER_S)
        except (RefusedError, NoAnswerError):
            return times
        until_s = monotonic() + _LISTEN_S * wanted
        while monotonic() < until_s:
            scans = [one for one in link.receive(until_s) if one.name == SCAN_DATA and one.is_scan]
            times.extend((read_scan(one.fields).transmission_us, time_ns()) for one in scans)
    return times


def _clock(times: list[tuple[int, int]]) -> tuple[float | None, float | None, float | None]:
    """Scans a second, the device's seconds in one of the host's, and what its clock shows in seconds."""
    if len(times) < 10:
        return None, None, times[-1][0] / 1e6 if times else None
    (first_us, first_ns), (last_us, last_ns) = times[0], times[-1]
    device_s, host_s = (last_us - first_us) % _TURN_US / 1e6, (last_ns - first_ns) / 1e9
    return (len(times) - 1) / max(device_s, 1e-6), device_s / max(host_s, 1e-6), last_us / 1e6
