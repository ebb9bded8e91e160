"""Which recordings train and which validate."""

import hashlib
import math
from collections.abc import Sequence
from dataclasses import dataclass

from sdt_tools.errors import DatasetError


@dataclass(frozen=True)
class SplitEntry:
    """What the split knows of a recording."""

    recording_id: str
    scenario: str


def validation_ids(recordings: Sequence[SplitEntry], share: float, seed: int) -> frozenset[str]:
    """Ids of the recordings for validation: ``share`` of them, and of each scenario, to within one recording.

    Chosen by ``seed`` and the ids alone, whatever the order of ``recordings``; at least one is chosen and one is left.
    Raises DatasetError for fewer than two recordings.
    """
    if len(recordings) < 2:
        raise DatasetError("one recording given; training and validation need at least one each")
    shuffled = sorted(recordings, key=lambda entry: (entry.scenario, _draw(seed, entry.recording_id)))
    # Every 1/share-th recording is taken, walking through one scenario after the other: that holds the share in each.
    offset = int(_draw(seed, "offset")[:8], 16) / 16**8
    chosen = [
        entry
        for place, entry in enumerate(shuffled)
        if math.floor((place + 1) * share + offset) > math.floor(place * share + offset)
    ]
    if not chosen:
        chosen = shuffled[:1]
    if len(chosen) == len(shuffled):
        chosen = shuffled[1:]
    return frozenset(entry.recording_id for entry in chosen)


def _draw(seed: int, name: str) -> str:
    return hashlib.sha256(f"{seed}:{name}".encode()).hexdigest()
