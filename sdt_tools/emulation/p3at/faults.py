"""What goes wrong with the emulated base, and when."""

import re
import threading
from dataclasses import dataclass
from enum import StrEnum
from typing import Final

from sdt_tools.errors import UsageError


class FaultKind(StrEnum):
    """What can go wrong: first on the wire, then in the base."""

    SPLIT = "split"
    MERGE = "merge"
    DELAY = "delay"
    DROP = "drop"
    CORRUPT = "corrupt"
    GARBAGE = "garbage"
    POWER = "power"
    STALL = "stall"
    FRONT_BUMPER = "front-bumper"
    REAR_BUMPER = "rear-bumper"
    BUTTON = "button"
    BATTERY = "battery"


_DEFAULTS: Final = {
    FaultKind.SPLIT: 3.0,
    FaultKind.MERGE: 2.0,
    FaultKind.DELAY: 0.1,
    FaultKind.DROP: 0.1,
    FaultKind.CORRUPT: 0.1,
    FaultKind.GARBAGE: 0.1,
    FaultKind.BATTERY: 11.0,
}
_SHARES: Final = (FaultKind.DROP, FaultKind.CORRUPT, FaultKind.GARBAGE)
_COUNTS: Final = (FaultKind.SPLIT, FaultKind.MERGE)
_PATTERN: Final = re.compile(
    r"(?P<kind>[a-z-]+)(=(?P<value>\d+(\.\d+)?))?(@(?P<begin>\d+(\.\d+)?)(-(?P<end>\d+(\.\d+)?))?)?"
)

FAULT_HELP: Final = (
    "What goes wrong, as KIND[=VALUE][@FROM[-TO]] in seconds from the start; repeat for more. On the wire: split=BYTES "
    "(pieces of so many), merge=PACKETS, delay=SECONDS, drop=SHARE, corrupt=SHARE (bad checksums), garbage=SHARE, "
    "power (switched off). In the base: stall, front-bumper, rear-bumper, button (emergency stop), battery=VOLTS."
)


@dataclass(frozen=True)
class Fault:
    """One trouble, from ``begin_s`` up to ``end_s`` after the start."""

    kind: FaultKind
    value: float = 1.0
    begin_s: float = 0.0
    end_s: float = float("inf")


def parse_fault(text: str) -> Fault:
    """The fault that ``text`` writes as ``FAULT_HELP`` says. Raises UsageError where it writes none."""
    found = _PATTERN.fullmatch(text)
    if found is None or found["kind"] not in list(FaultKind):
        raise UsageError(f"fault '{text}': write KIND[=VALUE][@FROM[-TO]]; the kinds are {', '.join(FaultKind)}")
    kind = FaultKind(found["kind"])
    value = _DEFAULTS.get(kind, 1.0)
    if found["value"] is not None:
        value = float(found["value"])
        if kind not in _DEFAULTS:
            raise UsageError(f"fault '{text}': {kind} takes no value")
    if kind in _SHARES and value > 1.0:
        raise UsageError(f"fault '{text}': the value is a share, from 0 to 1")
    if kind in _COUNTS and (value < 1.0 or value != int(value)):
        raise UsageError(f"fault '{text}': the value is a count, from 1 on")
    begin_s = float(found["begin"] or 0.0)
    end_s = float(found["end"] or "inf")
    if end_s <= begin_s:
        raise UsageError(f"fault '{text}': it ends before it begins")
    return Fault(kind, value, begin_s, end_s)


class Faults:
    """Those that were planned, and those that are switched on and off while the base runs, from any thread."""

    def __init__(self, planned: tuple[Fault, ...] = ()) -> None:
        self._planned = planned
        self._switched: dict[FaultKind, float] = {}
        self._lock = threading.Lock()

    def begin(self, kind: FaultKind, value: float = 1.0) -> None:
        """Switch ``kind`` on."""
        with self._lock:
            self._switched[kind] = value

    def end(self, kind: FaultKind) -> None:
        """Switch ``kind`` off, where it was switched on."""
        with self._lock:
            self._switched.pop(kind, None)

    def value(self, kind: FaultKind, at_s: float) -> float | None:
        """How bad ``kind`` is at ``at_s``; None where all is well."""
        with self._lock:
            if kind in self._switched:
                return self._switched[kind]
        found = [fault.value for fault in self._planned if fault.kind is kind and fault.begin_s <= at_s < fault.end_s]
        return found[-1] if found else None
