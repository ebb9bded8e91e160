"""Moments as people write them, and the intervals between them."""

import re
from dataclasses import dataclass
from decimal import Decimal
from pathlib import Path
from typing import Final

from sdt_tools.clock import SECOND_NS
from sdt_tools.errors import RecordingError, UsageError
from sdt_tools.recording.container.reader import McapReader

_MOMENT: Final = re.compile(r"(?P<ns>\d+)ns|(?P<seconds>\d+(\.\d*)?|\.\d+)", re.ASCII)
_LATEST_NS: Final = 2**64 - 1
"""A stamp has 64 bits."""


@dataclass(frozen=True)
class Span:
    """An interval of log time, ``[start_ns, end_ns)``."""

    start_ns: int
    end_ns: int

    def touches(self, first_ns: int, last_ns: int) -> bool:
        """Whether it has a moment in common with an interval that takes in both its ends."""
        return first_ns < self.end_ns and last_ns >= self.start_ns


def parse_moment(text: str, start_ns: int) -> int:
    """The moment ``text``: seconds after ``start_ns``, as in ``2.5``, or nanoseconds since 1970, as in ``17…ns``.

    Seconds are exact to the nanosecond. Raises UsageError for anything else.
    """
    found = _MOMENT.fullmatch(text.strip())
    if found is None:
        raise UsageError(f"'{text}' is no moment; write seconds from the start, as 2.5, or nanoseconds, as 17…000ns")
    seconds = found["seconds"]
    moment_ns = int(found["ns"]) if seconds is None else start_ns + round(Decimal(seconds) * SECOND_NS)
    if moment_ns > _LATEST_NS:
        raise UsageError(f"'{text}' lies beyond what a stamp can hold")
    return moment_ns


def whole_span(source: McapReader) -> Span:
    """From the first message of any topic to just after the last. Raises RecordingError where there is none."""
    extents = list(source.extents.values())
    first_ns = min((extent.first_ns for extent in extents if extent.first_ns is not None), default=None)
    last_ns = max((extent.last_ns for extent in extents if extent.last_ns is not None), default=None)
    if first_ns is None or last_ns is None:
        raise RecordingError(f"{source.path}: holds no messages that can be read; there is nothing to edit")
    return Span(first_ns, last_ns + 1)


def chosen_span(path: Path, whole: Span, start: str | None, end: str | None) -> Span:
    """What ``start`` and ``end`` choose of the recording at ``path``; without one of them, from or to its own end.

    Raises UsageError where nothing lies between them, or all of it outside the recording.
    """
    start_ns = whole.start_ns if start is None else parse_moment(start, whole.start_ns)
    end_ns = whole.end_ns if end is None else parse_moment(end, whole.start_ns)
    lasts = f"it has messages from {whole.start_ns}ns to {whole.end_ns - 1}ns ({seconds_of(whole):.3f} s)"
    if start_ns >= whole.end_ns or end_ns <= whole.start_ns:
        between = f"from {start or 'the start'} to {end or 'the end'}"
        raise UsageError(f"{path}: the interval {between} lies outside the recording; {lasts}")
    if start_ns >= end_ns:
        raise UsageError(f"{path}: --from {start} is not before --to {end}; {lasts}")
    return Span(max(start_ns, whole.start_ns), min(end_ns, whole.end_ns))


def seconds_of(span: Span) -> float:
    """How long it lasts, from its first moment to its last."""
    return (span.end_ns - 1 - span.start_ns) / SECOND_NS
