"""A driver at work, held against the contract of its kind."""

import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from time import monotonic
from typing import Any, Final, TypeVar

from sdt_tools.clock import HostClock
from sdt_tools.config import Config
from sdt_tools.emergency import EmergencyStop
from sdt_tools.errors import SdtError
from sdt_tools.frames import LidarScan, Odometry, RawPicture
from sdt_tools.robot.contract.arrival_rules import arrival_rules, silence_rule
from sdt_tools.robot.contract.base_rules import DrivingTest, pose_rules, stands, unmoved_rules
from sdt_tools.robot.contract.camera_rules import camera_rules
from sdt_tools.robot.contract.lidar_rules import lidar_rules
from sdt_tools.robot.contract.trial import Trial, watch
from sdt_tools.robot.contract.verdict import Verdict, broken, judged, kept
from sdt_tools.robot.devices import Device
from sdt_tools.robot.plugins import Kind, Plugin

_GIVES: Final = {
    Kind.LIDAR: (LidarScan, "scans"),
    Kind.BASE: (Odometry, "poses"),
    Kind.CAMERA: (RawPicture, "pictures"),
}
_LONGEST_GAP_S: Final = {Kind.LIDAR: 0.2, Kind.BASE: 0.5, Kind.CAMERA: 0.5}
_SILENCE_S: Final = {Kind.LIDAR: 0.2, Kind.BASE: 0.5, Kind.CAMERA: 1.0}
_RATES: Final = {Kind.LIDAR: "scan_hz", Kind.BASE: "pose_hz", Kind.CAMERA: "rate_hz"}
"""What a driver's settings call how often it gives something, where they have that."""
_OPENS_S: Final = 90.0
_CLOSES_S: Final = 3.0
_SETTLES_S: Final = 0.5
_AGAIN_S: Final = 3.0
_PERSON_S: Final = 30.0

Ask = Callable[[str], None]
"""Shows a person a line, what to do next."""
ValueT = TypeVar("ValueT")


@dataclass(frozen=True)
class Plan:
    """How to check. ``unplug`` asks a person to unplug the device; ``move`` allows a base to move."""

    seconds: float = 4.0
    wanted_hz: float | None = None
    move: bool = False
    unplug: Ask | None = None


def check(plugin: Plugin[Any], config: Config, plan: Plan) -> Iterator[Verdict]:
    """The verdicts on ``plugin``'s driver with ``config``, each as soon as it is there.

    Raises SdtError where the driver says in words that its device cannot be opened.
    """
    threads = set(threading.enumerate())
    emergency, clock = EmergencyStop(), HostClock()
    opened, device = _opened(plugin, config, emergency, clock)
    yield opened
    if device is None:
        return
    kind, what = _GIVES[plugin.kind]
    trial = Trial(clock)
    try:
        watch(device, trial, plan.seconds, lambda: not getattr(device, "finished", False))
        wanted_hz = plan.wanted_hz or _set_hz(config, plugin.kind)
        yield from arrival_rules(trial, kind, what, wanted_hz, _LONGEST_GAP_S[plugin.kind])
        yield from {Kind.LIDAR: lidar_rules, Kind.BASE: pose_rules, Kind.CAMERA: camera_rules}[plugin.kind](trial)
        if plan.unplug is not None:
            yield _unplugged(device, trial, kind, _SILENCE_S[plugin.kind], plan.unplug)
        if plugin.kind is Kind.BASE:
            yield from DrivingTest(device, emergency, trial).verdicts() if plan.move else unmoved_rules()
    finally:
        closing = list(_closed(device, threads))
    yield from closing
    yield from _opens_again(plugin, config, kind, what, plan.move)


def _opened(plugin: Plugin[Any], config: Config, emergency: EmergencyStop, clock: HostClock) -> tuple[Verdict, Any]:
    rule = "it opens, or says in one line why not"
    more = {"emergency": emergency} if plugin.kind is Kind.BASE else {}
    began_s = monotonic()
    try:
        device = _in_time(lambda: plugin.device(config, clock=clock, **more), _OPENS_S)
    except SdtError:
        raise
    except TimeoutError:
        return broken(rule, f"its constructor has not returned after {_OPENS_S:g} s"), None
    except Exception as error:  # whatever a driver raises is what is to be told
        return broken(rule, f"it raised {type(error).__name__}: {error}; raise DeviceError, and say what to try"), None
    return kept(rule, f"in {monotonic() - began_s:.1f} s"), device


def _set_hz(config: Config, kind: Kind) -> float | None:
    found = getattr(config, _RATES[kind], None)
    return float(found) if isinstance(found, int | float) else None


def _unplugged(device: Device, trial: Trial, kind: type, within_s: float, ask: Ask) -> Verdict:
    silence = Trial(trial.clock, asked_ns=trial.asked_ns)
    ask("unplug the device now (its power or its cable)")
    watch(device, silence, _PERSON_S, lambda: not _is_silent(silence, kind, within_s))
    ask("plug it in again")
    count = len(silence.of(kind))
    watch(device, silence, _PERSON_S, lambda: len(silence.of(kind)) <= count)
    return silence_rule(silence, kind, within_s)


def _is_silent(trial: Trial, kind: type, within_s: float) -> bool:
    """Whether it has been silent for so long that it must have been told."""
    given = trial.of(kind)
    return bool(given) and trial.clock.now_ns() - given[-1].received_ns > 2 * within_s * 1e9


def _closed(device: Device, threads: set[threading.Thread]) -> Iterator[Verdict]:
    rule = "close lets it go, and may be called twice"
    faults = []
    began_s = monotonic()
    try:
        for _ in range(2):
            _in_time(device.close, _CLOSES_S)
    except TimeoutError:
        faults.append(f"it has not returned after {_CLOSES_S:g} s")
    except Exception as error:  # whatever a driver raises is what is to be told
        faults.append(f"it raised {type(error).__name__}: {error}")
    closed_s = monotonic() - began_s
    for thread in set(threading.enumerate()) - threads:
        thread.join(_SETTLES_S)
        if thread.is_alive():
            faults.append(f"its thread {thread.name} goes on")
    yield judged(rule, faults, f"in {closed_s:.2f} s")


def _opens_again(plugin: Plugin[Any], config: Config, kind: type, what: str, moved: bool) -> Iterator[Verdict]:
    """Open it a second time; a base that was moving when it was closed must stand."""
    rule = "closed, it can be opened again"
    threads, trial = set(threading.enumerate()), Trial(HostClock())
    try:
        opened, device = _opened(plugin, config, EmergencyStop(), trial.clock)
    except SdtError as error:
        yield broken(rule, str(error))
        return
    if device is None:
        yield broken(rule, opened.seen)
        return
    try:
        watch(device, trial, _AGAIN_S, lambda: moved or not trial.of(kind))
    finally:
        again = list(_closed(device, threads))
    came = len(trial.of(kind))
    yield judged(rule, [] if came else [trial.failure or f"no {what} within {_AGAIN_S:g} s"], opened.seen)
    if moved:
        yield stands("closed while it moved, it stands", trial)
    yield from (one for one in again if one.outcome is one.outcome.BROKEN)


def _in_time(call: Callable[[], ValueT], limit_s: float) -> ValueT:
    """What ``call`` returns or raises. Raises TimeoutError where it does neither within ``limit_s``."""
    results: list[ValueT] = []
    errors: list[Exception] = []

    def run() -> None:
        try:
            results.append(call())
        except Exception as error:  # raised again in the thread that waits
            errors.append(error)

    thread = threading.Thread(target=run, name="checked", daemon=True)
    thread.start()
    thread.join(limit_s)
    if errors:
        raise errors[0]
    if not results:
        raise TimeoutError
    return results[0]
