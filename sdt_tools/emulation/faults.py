"""What goes wrong with an emulated device, and when: one way to write it for all of them."""

import re
import threading
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from sdt_tools.errors import UsageError

FORM: Final = "KIND[=VALUE][@FROM[-TO[/EVERY]]]"
FORM_IN_HELP: Final = FORM.replace("[", "\\[")
"""For where brackets would be markup."""
HOW: Final = f"What goes wrong, as {FORM_IN_HELP} in seconds from the start; repeat for more."
_NUMBER: Final = r"\d+(?:\.\d+)?"
_PATTERN: Final = re.compile(
    rf"(?P<kind>[a-z-]+)(=(?P<value>-?{_NUMBER}))?"
    rf"(@(?P<begin>{_NUMBER})(-(?P<end>{_NUMBER})(/(?P<every>{_NUMBER}))?)?)?"
)


@dataclass(frozen=True)
class Value:
    """What the value of a kind of fault is when none is written, and which ones may be."""

    default: float
    is_share: bool = False
    is_count: bool = False
    is_signed: bool = False

    def wrong(self, value: float) -> str:
        """Why ``value`` is none; empty where it is one."""
        if self.is_share and not 0.0 <= value <= 1.0:
            return "the value is a share, from 0 to 1"
        if self.is_count and (value < 1.0 or value != int(value)):
            return "the value is a count, from 1 on"
        return "" if value >= 0.0 or self.is_signed else "the value is not below 0"


Kinds = Mapping[str, Value | None]
"""What can go wrong with a device; None for what takes no value."""


@dataclass(frozen=True)
class Fault:
    """One trouble, from ``begin_s`` up to ``end_s`` after the start, and again ``every_s`` after it began."""

    kind: str
    value: float = 1.0
    begin_s: float = 0.0
    end_s: float = float("inf")
    every_s: float = float("inf")

    def holds(self, at_s: float) -> bool:
        """Whether it is there at ``at_s``."""
        since_s = at_s - self.begin_s
        return since_s >= 0.0 and since_s % self.every_s < self.end_s - self.begin_s


def parse_fault(text: str, kinds: Kinds) -> Fault:
    """The fault that ``text`` writes, one of ``kinds``. Raises UsageError where it writes none."""
    found = _PATTERN.fullmatch(text)
    if found is None or found["kind"] not in kinds:
        raise UsageError(f"fault '{text}': write {FORM}; the kinds are {', '.join(kinds)}")
    kind, rule = str(found["kind"]), kinds[found["kind"]]
    value = 1.0 if rule is None else rule.default
    if found["value"] is not None:
        value = float(found["value"])
        wrong = f"{kind} takes no value" if rule is None else rule.wrong(value)
        if wrong:
            raise UsageError(f"fault '{text}': {wrong}")
    begin_s, end_s = float(found["begin"] or 0.0), float(found["end"] or "inf")
    if end_s <= begin_s:
        raise UsageError(f"fault '{text}': it ends before it begins")
    every_s = float(found["every"] or "inf")
    if every_s <= end_s - begin_s and found["every"]:
        raise UsageError(f"fault '{text}': it comes again before it has ended")
    return Fault(kind, value, begin_s, end_s, every_s)


class Faults:
    """Those that were planned, and those that are switched on and off meanwhile, from any thread."""

    def __init__(self, planned: tuple[Fault, ...] = ()) -> None:
        self._planned = planned
        self._switched: dict[str, float] = {}
        self._lock = threading.Lock()

    def begin(self, kind: str, value: float = 1.0) -> None:
        """Switch ``kind`` on."""
        with self._lock:
            self._switched[kind] = value

    def end(self, kind: str) -> None:
        """Switch ``kind`` off, where it was switched on."""
        with self._lock:
            self._switched.pop(kind, None)

    def value(self, kind: str, at_s: float) -> float | None:
        """How bad ``kind`` is at ``at_s``; None where all is well."""
        with self._lock:
            if kind in self._switched:
                return self._switched[kind]
        found = [fault.value for fault in self._planned if fault.kind == kind and fault.holds(at_s)]
        return found[-1] if found else None
