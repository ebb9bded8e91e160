"""``sdt robot emulate lms1xx``: a LiDAR that is not there."""

import signal
from dataclasses import asdict
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from sdt_tools.cli.console import JsonFlag, console, emit
from sdt_tools.errors import UsageError

if TYPE_CHECKING:
    from sdt_tools.emulation.lms1xx.emulator import EmulatedLms1xx
    from sdt_tools.emulation.lms1xx.supply import ScanSupply
    from sdt_tools.emulation.lms1xx.troubles import Trouble


class Protocol(Enum):
    """CoLa-A or CoLa-B."""

    A = "a"
    B = "b"


class TroubleName(Enum):
    """What ``--trouble`` takes."""

    POWER = "power"
    CABLE = "cable"
    HANG_UP = "hang-up"
    SILENCE = "silence"


_FAULTS = "Faults of every scan"
_TROUBLE = "Faults that come and go"
_DEVICE = "The device"
_SHARE = "Share of the scans, 0 to 1,"


def lms1xx(
    scene: Annotated[
        str | None,
        typer.Option(help="Serve a scenario (name or TOML file), live; its expert drives. Default: plain."),
    ] = None,
    recording: Annotated[
        Path | None, typer.Option(help="Serve the scans of a recording instead, again and again.")
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Everything random comes from it: scene and faults.")] = 0,
    host: Annotated[str, typer.Option(help="Address to listen at; 0.0.0.0 lets other computers in.")] = "127.0.0.1",
    port: Annotated[int, typer.Option(min=0, max=65535, help="Port to listen at; 0 finds a free one.")] = 2111,
    protocol: Annotated[Protocol, typer.Option(help="CoLa-A, which is text, or CoLa-B.")] = Protocol.A,
    seconds: Annotated[float | None, typer.Option(min=0, help="How long to serve; without, until Ctrl-C.")] = None,
    hz: Annotated[int, typer.Option(help="Scans a second before it is set: 50 or 25.", rich_help_panel=_DEVICE)] = 50,
    resolution: Annotated[
        str, typer.Option(help="Degrees between rays before it is set: 0.5 or 0.25.", rich_help_panel=_DEVICE)
    ] = "0.5",
    kind: Annotated[str, typer.Option(help="What it says it is.", rich_help_panel=_DEVICE)] = "LMS10x_FieldEval",
    password: Annotated[
        str, typer.Option(help="Hash of the password that changes settings.", rich_help_panel=_DEVICE)
    ] = "F4724744",  # noqa: S107 - the one that devices are delivered with
    boot_s: Annotated[
        float, typer.Option(min=0, help="From power-on until it measures.", rich_help_panel=_DEVICE)
    ] = 0.0,
    start_s: Annotated[
        float,
        typer.Option(min=0, help="From new settings until it measures; real: 15.", rich_help_panel=_DEVICE),
    ] = 1.0,
    start_us: Annotated[
        int, typer.Option(min=0, help="What its clock shows first; it wraps at 4294967296.", rich_help_panel=_DEVICE)
    ] = 0,
    scale: Annotated[int, typer.Option(min=1, max=2, help="Millimetres a unit of range.", rich_help_panel=_DEVICE)] = 1,
    split_bytes: Annotated[
        int, typer.Option(min=0, help="Send in pieces of so many bytes.", rich_help_panel=_FAULTS)
    ] = 0,
    merge: Annotated[int, typer.Option(min=1, help="Send so many scans at once.", rich_help_panel=_FAULTS)] = 1,
    delay_ms: Annotated[float, typer.Option(min=0, help="Send everything late.", rich_help_panel=_FAULTS)] = 0.0,
    jitter_ms: Annotated[
        float, typer.Option(min=0, help="Send late by a random part of this.", rich_help_panel=_FAULTS)
    ] = 0.0,
    drop: Annotated[float, typer.Option(min=0, max=1, help=f"{_SHARE} not sent.", rich_help_panel=_FAULTS)] = 0.0,
    spoil: Annotated[
        float,
        typer.Option(min=0, max=1, help=f"{_SHARE} with a wrong checksum; in CoLa-A cut off.", rich_help_panel=_FAULTS),
    ] = 0.0,
    garbage: Annotated[
        float, typer.Option(min=0, max=1, help=f"{_SHARE} behind random bytes.", rich_help_panel=_FAULTS)
    ] = 0.0,
    drift_ppm: Annotated[float, typer.Option(help="Let its clock run too fast.", rich_help_panel=_FAULTS)] = 0.0,
    trouble: Annotated[
        TroubleName | None,
        typer.Option(help="Switch it off, pull its cable, hang up, or send no scans.", rich_help_panel=_TROUBLE),
    ] = None,
    every_s: Annotated[
        float, typer.Option(min=0.1, help="How long it goes well in between.", rich_help_panel=_TROUBLE)
    ] = 20.0,
    lasting_s: Annotated[float, typer.Option(min=0, help="How long it lasts.", rich_help_panel=_TROUBLE)] = 3.0,
    json_output: JsonFlag = False,
) -> None:
    """Be a SICK LMS1xx: a TCP server with its commands, states, counters and clock, that serves a scene or a recording.

    Ctrl-C ends it, and prints what was sent and which faults there were.
    """
    from sdt_tools.config import parse_config
    from sdt_tools.emulation.lms1xx.config import EmulatedConfig
    from sdt_tools.emulation.lms1xx.emulator import EmulatedLms1xx
    from sdt_tools.emulation.lms1xx.faults import Faults
    from sdt_tools.emulation.lms1xx.troubles import Trouble

    device = {
        "host": host,
        "port": port,
        "protocol": protocol.value,
        "kind": kind,
        "password": password,
        "scan_hz": hz,
        "resolution_deg": resolution,
        "boot_s": boot_s,
        "start_s": start_s,
        "start_us": start_us,
        "scale": scale,
    }
    faults = {
        "split_bytes": split_bytes,
        "merge": merge,
        "delay_ms": delay_ms,
        "jitter_ms": jitter_ms,
        "drop": drop,
        "spoil": spoil,
        "garbage": garbage,
        "drift_ppm": drift_ppm,
        "seed": seed,
    }
    named = {"scan_hz": "--hz", "resolution_deg": "--resolution"}
    options = {name: named.get(name, f"--{name.replace('_', '-')}") for name in (*device, *faults)}
    config = parse_config(EmulatedConfig, device, "robot emulate lms1xx", options)
    wrong = parse_config(Faults, faults, "robot emulate lms1xx", options)
    supply = _supply(scene, recording, seed)
    with EmulatedLms1xx(supply, config, wrong) as emulator:
        source = recording or f"scenario {scene or 'plain'}"
        served = f"{source} at {host}:{emulator.port}, {emulator.device.dialect.label}"
        console.print(f"LMS1xx with {served}; Ctrl-C ends it", soft_wrap=True)
        _serve(emulator, None if trouble is None else Trouble(trouble.value), every_s, lasting_s, seconds)
        counts = asdict(emulator.counts)
    if json_output:
        emit(counts)
    else:
        console.print(", ".join(f"{name.replace('_', ' ')} {count}" for name, count in counts.items()))


def _supply(scene: str | None, recording: Path | None, seed: int) -> "ScanSupply":
    from sdt_tools.emulation.lms1xx.supply import RecordedScans, SceneScans

    if scene is not None and recording is not None:
        raise UsageError("serve either --scene or --recording")
    return SceneScans(scene or "plain", seed) if recording is None else RecordedScans(recording)


def _serve(
    emulator: "EmulatedLms1xx", trouble: "Trouble | None", every_s: float, lasting_s: float, seconds: float | None
) -> None:
    """Let it serve until its time is up, or a signal comes."""
    from threading import Event
    from time import monotonic

    from sdt_tools.emulation.lms1xx.troubles import make_trouble

    ending = Event()
    end_s = float("inf") if seconds is None else monotonic() + seconds
    before = {number: signal.signal(number, lambda *_: ending.set()) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        while (left_s := end_s - monotonic()) > 0 and not ending.is_set():
            if trouble is None:
                ending.wait(min(left_s, 3600.0))
            elif not ending.wait(min(left_s, every_s)) and monotonic() < end_s:
                console.print(f"trouble: {trouble.value}")
                make_trouble(emulator, trouble, lasting_s, ending)
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
