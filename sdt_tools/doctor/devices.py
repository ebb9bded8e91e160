"""The robot's devices: which are there, and what they say."""

import os
import stat
from collections.abc import Iterator
from pathlib import Path
from typing import Final

from sdt_tools.doctor.finding import Finding, fail, ok, warn
from sdt_tools.errors import SdtError

_CLOCK_OFF: Final = 0.01
"""In the second that is listened to, a telegram that is late by 10 ms looks like a clock that is off by so much."""
_LOW_V: Final = 11.5


def lidar(address: str, asked: bool) -> Iterator[Finding]:
    """An LMS1xx at HOST or HOST:PORT."""
    from sdt_tools.config import parse_config
    from sdt_tools.robot.lms1xx.config import Lms1xxConfig
    from sdt_tools.robot.lms1xx.probe import probe

    host, colon, port = address.rpartition(":")
    where = {"host": host, "port": port} if colon else {"host": address}
    try:
        config = parse_config(Lms1xxConfig, where if address else {}, "--lidar")
        found = probe(config)
    except SdtError as error:
        yield _unreachable("lidar", address or "LMS1xx", error, asked, "--lidar HOST looks elsewhere")
        return
    what = f"{config.host}:{config.port}"
    yield ok("lidar", what, f"{found.identity}, {found.dialect}")
    if found.measures:
        yield ok("lidar", "state", found.state)
    else:
        yield warn("lidar", "state", found.state, "wait until it has started, and ask again")
        return
    if found.would_be_set:
        yield ok("lidar", "settings", "others than 50 Hz and 0.5°: a session will set them")
    if found.scans_hz is None or found.clock_ratio is None:
        yield warn("lidar", "scans", "none came within a second", "power it off and on")
        return
    yield ok("lidar", "scans", f"{found.scans_hz:.1f} a second")
    seen = f"{(found.clock_ratio - 1) * 100:+.1f} % against the host's over a second, shows {found.running_s:.0f} s"
    if abs(found.clock_ratio - 1) < _CLOCK_OFF:
        yield ok("clock", "LiDAR", seen)
    else:
        yield warn(
            "clock", "LiDAR", seen, "the network delays telegrams, or the computer is busy; use a cable of its own"
        )


def base(address: str, baud: int, asked: bool) -> Iterator[Finding]:
    """A P3-AT at a serial port or ``socket://HOST:PORT``. Its motors are not switched on."""
    from sdt_tools.config import parse_config
    from sdt_tools.robot.p3at.config import P3atConfig
    from sdt_tools.robot.p3at.probe import CONNECT_S, probe

    settings = {"baud": baud, "connect_s": CONNECT_S} | ({"address": address} if address else {})
    try:
        config = parse_config(P3atConfig, settings, "--base", {"baud": "--baud"})
        found = probe(config)
    except SdtError as error:
        yield _unreachable("base", address or "P3-AT", error, asked, "--base PORT looks elsewhere")
        return
    if found.busy:
        do = "end the program that uses it; if none does, switch the base off and on"
        yield warn("base", config.address, "in a session already, and was only listened to", do)
    else:
        yield ok("base", config.address, f"{found.kind} {found.model} '{found.name}'")
        watchdog_ms = found.settings.watchdog_ms if found.settings else None
        if watchdog_ms:
            yield ok("base", "watchdog", f"stops it after {watchdog_ms} ms")
        else:
            seen = "off" if watchdog_ms == 0 else "the base does not tell"
            yield warn(
                "base", "watchdog", seen, "set it (ARCOS configuration): else a program that dies leaves it moving"
            )
    if found.status is None:
        yield warn("base", "status", "it tells nothing", "switch it off and on")
        return
    volts = f"{found.status.battery_v:.1f} V"
    yield (
        ok("base", "battery", volts) if found.status.battery_v > _LOW_V else warn("base", "battery", volts, "charge it")
    )
    if found.status.button_pressed:
        yield warn("base", "emergency button", "pressed", "release it before you drive")


def serial_ports() -> Iterator[Finding]:
    """Ports that a base may be at, and whether this user may use them."""
    from serial.tools.list_ports import comports

    ports = [port for port in comports() if not port.device.startswith("/dev/ttyS")]
    if not ports:
        yield ok("serial", "ports", "no adapter is plugged in")
    for port in ports:
        yield _with_rights("serial", port.device, port.description or "an adapter", "dialout")


def cameras() -> list[str]:
    """The video devices of this computer."""
    found = Path("/dev").glob("video*")
    return [str(path) for path in sorted(found) if path.name[5:].isdigit() and stat.S_ISCHR(path.stat().st_mode)]


def camera(source: str, asked: bool) -> Iterator[Finding]:
    """One camera: what it gives when it is opened as it is for a session."""
    from sdt_tools.robot.camera.capture import open_capture
    from sdt_tools.robot.camera.config import CameraConfig

    config = CameraConfig(source=source)
    try:
        opened = open_capture(config)
    except SdtError as error:
        yield _unreachable("camera", source, error, asked, "many cameras have a second device that gives no pictures")
        return
    try:
        is_there, image = opened.capture.read()
    finally:
        opened.capture.release()
    if not is_there or image is None:
        what = "opens, but gives no picture"
        yield (fail if asked else warn)("camera", source, what, "is another program using it? unplug it and plug it in")
    elif opened.differs(config):
        do = "it works; set width, height and rate_hz to what it can do"
        yield warn("camera", source, opened.text(config).removeprefix(f"{source}: "), do)
    else:
        yield ok("camera", source, opened.text(config).removeprefix(f"{source}: "))


def gamepads() -> Iterator[Finding]:
    """Gamepads that could drive."""
    from sdt_tools.teleop.gamepad import connected_gamepads

    try:
        pads = list(connected_gamepads())
    except ImportError:
        yield ok("gamepad", "none", "not looked for: evdev is not installed")
        return
    for pad in pads:
        yield ok("gamepad", pad.name, "can drive")
        pad.close()
    unreadable = [path for path in Path("/dev/input").glob("event*") if not os.access(path, os.R_OK)]
    if not pads and unreadable:
        seen = f"none that may be read; {len(unreadable)} input devices may not"
        yield warn("gamepad", "none", seen, "where one is plugged in: join the group 'input' and log in again")
    elif not pads:
        yield ok("gamepad", "none", "none is plugged in")


def _with_rights(section: str, path: str, seen: str, group: str) -> Finding:
    if os.access(path, os.R_OK | os.W_OK):
        return ok(section, path, seen)
    return warn(section, path, f"{seen}; no rights", f"join the group that owns it (often {group}) and log in again")


def _unreachable(section: str, what: str, error: SdtError, asked: bool, hint: str) -> Finding:
    """A failure where it was asked for, and else no more than a remark."""
    seen, semicolon, do = str(error).partition("; ")
    return (
        fail(section, what, seen, do)
        if asked
        else warn(section, what, seen, hint if not semicolon else f"{do}; {hint}")
    )
