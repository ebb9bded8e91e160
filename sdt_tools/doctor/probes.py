"""Looking at everything: each part in a process of its own, so that none can hang, crash or hold up the rest."""

import json
import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryFile
from time import monotonic
from typing import IO, Any, Final

from sdt_tools.doctor import computer, devices, packages, rerun
from sdt_tools.doctor.finding import Finding, Level, finding_of, without_names

LIMIT_S: Final = 8.0
"""All parts run at once; none takes longer."""
_ENDS_S: Final = 1.0
_PROBES: Final[dict[str, Callable[..., Iterator[Finding]]]] = {
    "packages": packages.packages,
    "drivers": packages.drivers,
    "disk": lambda folder: computer.disk(Path(folder)),
    "clock": computer.clock,
    "lidar": devices.lidar,
    "base": devices.base,
    "serial": devices.serial_ports,
    "camera": devices.camera,
    "gamepads": devices.gamepads,
    "rerun": rerun.drawing,
}
_SECTIONS: Final = (
    "system",
    "packages",
    "disk",
    "clock",
    "lidar",
    "base",
    "serial",
    "camera",
    "gamepad",
    "rerun",
    "terminal",
)


@dataclass(frozen=True)
class Asked:
    """What is asked for by name: it fails where it is not there. Empty texts mean where such a device usually is."""

    lidar: str = ""
    base: str = ""
    baud: int = 9600
    camera: str = ""
    folder: str = "recordings"


@dataclass(frozen=True)
class _Part:
    """One process that looks at something. ``asked``: whether it fails where that gives no answer."""

    section: str
    probe: str
    arguments: tuple[Any, ...]
    asked: bool = False


def examine(asked: Asked, limit_s: float = LIMIT_S) -> list[Finding]:
    """Everything that was found, by section, without the names of users; within ``limit_s`` or a second more."""
    found = [*computer.machine(), *rerun.display(), *computer.terminal()]
    end_s = monotonic() + limit_s
    running = [_Running(part) for part in _parts(asked)]
    try:
        for one in running:
            found += one.findings(end_s)
    finally:  # interrupted, too
        for one in running:
            one.end()
    return [without_names(one) for one in sorted(found, key=lambda one: _SECTIONS.index(one.section))]


def failed(findings: Iterable[Finding], asked: Asked) -> bool:
    """Whether something that was asked for by name is not as it should be."""
    sections = {name for name in ("lidar", "base", "camera") if getattr(asked, name)}
    return any(one.level is Level.FAIL and one.section in sections for one in findings)


def _parts(asked: Asked) -> list[_Part]:
    sources = [asked.camera] if asked.camera else devices.cameras()
    return [
        _Part("rerun", "rerun", ()),
        _Part("packages", "packages", ()),
        _Part("packages", "drivers", ()),
        _Part("lidar", "lidar", (asked.lidar, bool(asked.lidar)), bool(asked.lidar)),
        _Part("base", "base", (asked.base, asked.baud, bool(asked.base)), bool(asked.base)),
        *(_Part("camera", "camera", (source, bool(asked.camera)), bool(asked.camera)) for source in sources),
        _Part("disk", "disk", (asked.folder,)),
        _Part("clock", "clock", ()),
        _Part("serial", "serial", ()),
        _Part("gamepad", "gamepads", ()),
    ]


@dataclass
class _Running:
    """A part at work."""

    part: _Part
    output: IO[bytes] = field(default_factory=TemporaryFile)
    errors: IO[bytes] = field(default_factory=TemporaryFile)

    def __post_init__(self) -> None:
        call = [sys.executable, "-m", "sdt_tools.doctor", self.part.probe, json.dumps(self.part.arguments)]
        self.process = subprocess.Popen(
            call, stdin=subprocess.DEVNULL, stdout=self.output, stderr=self.errors, start_new_session=True
        )

    def findings(self, end_s: float) -> list[Finding]:
        """What it has found, at ``end_s`` at the latest; it is ended then."""
        late = False
        try:
            self.process.wait(max(end_s - monotonic(), 0.01))
        except subprocess.TimeoutExpired:
            late = True
        self.end()
        return self._read(late)

    def end(self) -> None:
        """End it, with whatever it has started; may be called twice."""
        with suppress(ProcessLookupError, PermissionError):
            os.killpg(self.process.pid, signal.SIGKILL)
        with suppress(subprocess.TimeoutExpired):  # one that even this does not end hangs in the system
            self.process.wait(_ENDS_S)

    def _read(self, late: bool) -> list[Finding]:
        found = []
        with self.output as output, self.errors as errors:
            output.seek(0)
            for line in output.read().splitlines():
                with suppress(ValueError, TypeError, KeyError):  # what a library prints, or half a line
                    found.append(finding_of(json.loads(line)))
            errors.seek(0)
            said = errors.read().decode(errors="replace").strip().splitlines()
        level, section = (Level.FAIL if self.part.asked else Level.WARN), self.part.section
        if late:
            do = "it hangs, or this computer is too busy; try again when it is less so"
            found.append(Finding(section, self.part.probe, level, "no answer in time", do))
        elif self.process.returncode != 0:
            why = said[-1] if said else f"ended with {self.process.returncode}"
            found.append(Finding(section, self.part.probe, Level.FAIL, f"crashed: {why}", "please report this"))
        return found


def look(probe: str, arguments: Iterable[object]) -> None:
    """Run one probe in this process, and print each finding as a line of JSON as soon as it is there."""
    for finding in _PROBES[probe](*arguments):
        sys.stdout.write(f"{json.dumps(finding.document())}\n")
        sys.stdout.flush()
