"""Pauses that somebody asked for: nothing is missing in them."""

from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np
from jaxtyping import Bool, Int64

PAUSES: Final = "pauses_ns"
"""The entry of ``sdt.stats``: ``start-end`` of each pause, half-open, in host time, parted by blanks."""

Pauses = Sequence[tuple[int, int]]


def pauses_of(stats: Mapping[str, str]) -> Pauses:
    """The pauses that ``sdt.stats`` tells of; none where that is not readable."""
    pauses = []
    for text in stats.get(PAUSES, "").split():
        start, _, end = text.partition("-")
        if start.isdecimal() and end.isdecimal():
            pauses.append((int(start), int(end)))
    return tuple(pauses)


def spans_pause(received_ns: Int64[np.ndarray, "messages"], pauses: Pauses) -> Bool[np.ndarray, "intervals"]:
    """Whether a pause lies, wholly or in part, between each message and the next one."""
    earlier = np.minimum(received_ns[:-1], received_ns[1:])
    later = np.maximum(received_ns[:-1], received_ns[1:])
    spans = np.zeros(len(earlier), bool)
    for start_ns, end_ns in pauses:
        spans |= (earlier < end_ns) & (later > start_ns)
    return spans
