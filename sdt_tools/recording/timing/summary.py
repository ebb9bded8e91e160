"""The timing of a recording, and how it stands in the metadata ``sdt.stats``."""

import json
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from typing import Any, Final

import numpy as np
from pydantic import TypeAdapter, ValidationError

from sdt_tools.recording.messages.topics import CAMERA_IMAGE, LIDAR_SCAN, TOPIC_BY_NAME
from sdt_tools.recording.timing.pairs import PairTiming, pair_timing
from sdt_tools.recording.timing.pauses import Pauses
from sdt_tools.recording.timing.stamps import StampLog
from sdt_tools.recording.timing.topic import TopicTiming, topic_timing

ENTRY: Final = "timing."
"""Entries of ``sdt.stats`` that begin so: a JSON object each, one a topic and one of the pairs."""
_PAIRS: Final = f"{ENTRY}pairs"


@dataclass(frozen=True)
class Timing:
    """The timing of each topic that has messages, and of scans with images."""

    topics: Mapping[str, TopicTiming]
    pairs: PairTiming


def timing_of(log: StampLog, pauses: Pauses = ()) -> Timing:
    """The numbers of what ``log`` saw between ``pauses``: the same for the same messages, in whatever order."""
    stamps = dict(log.topics())
    none = np.empty(0, np.int64)
    scans, images = (stamps[name].stamps_ns if name in stamps else none for name in (LIDAR_SCAN, CAMERA_IMAGE))
    topics = {name: topic_timing(times, _is_periodic(name), pauses) for name, times in stamps.items()}
    return Timing(topics, pair_timing(scans, images))


def timing_entries(timing: Timing) -> dict[str, str]:
    """``timing`` as entries for ``sdt.stats``; nothing is rounded."""
    topics = {f"{ENTRY}{name}": _json(asdict(topic)) for name, topic in timing.topics.items()}
    return topics | {_PAIRS: _json(asdict(timing.pairs))}


def has_timing(stats: Mapping[str, str]) -> bool:
    """Whether ``sdt.stats`` says anything of timing."""
    return _PAIRS in stats


def noted_timing(stats: Mapping[str, str], counts: Mapping[str, int]) -> Timing | None:
    """What ``sdt.stats`` says; None where it does not say it, or not of a file with these ``counts`` by topic."""
    try:
        pairs = TypeAdapter(PairTiming).validate_json(stats[_PAIRS])
        topics = {
            name: TypeAdapter(TopicTiming).validate_json(stats[f"{ENTRY}{name}"])
            for name, count in counts.items()
            if count
        }
    except (KeyError, ValidationError):
        return None
    return Timing(topics, pairs) if all(topic.count == counts[name] for name, topic in topics.items()) else None


def disagreements(stats: Mapping[str, str], counted: Timing) -> tuple[str, ...]:
    """Where ``sdt.stats`` says other than what was ``counted`` from the messages, a line each."""
    entries = timing_entries(counted)
    noted = {name: text for name, text in stats.items() if name.startswith(ENTRY)}
    lines = list(_count_differences(stats, counted))
    for name in sorted(entries.keys() | noted.keys()):
        subject = name.removeprefix(ENTRY)
        if name not in noted:
            lines += [f"{subject}: the stats say nothing of its timing"] if noted else []
        elif name not in entries:
            lines.append(f"{subject}: the stats speak of messages, and the file holds none")
        else:
            lines += _differences(subject, noted[name], entries[name])
    return tuple(lines)


def _count_differences(stats: Mapping[str, str], counted: Timing) -> Iterator[str]:
    for name, said in sorted(stats.items()):
        topic = name.removeprefix("count.")
        found = counted.topics[topic].count if topic in counted.topics else 0
        if name.startswith("count.") and topic in TOPIC_BY_NAME and said != str(found):
            yield f"{topic}: the stats count {said} messages, the file holds {found}"


def _differences(subject: str, noted: str, counted: str) -> Iterator[str]:
    try:
        said = json.loads(noted)
    except ValueError:
        said = None
    if not isinstance(said, dict):
        yield f"{subject}: what the stats say of its timing is unreadable"
        return
    found: dict[str, Any] = json.loads(counted)
    for key in sorted(found.keys() | said.keys()):
        if said.get(key) != found.get(key):
            yield f"{subject}: {key} is {_json(said.get(key))} by the stats, {_json(found.get(key))} by the messages"


def _is_periodic(name: str) -> bool:
    topic = TOPIC_BY_NAME.get(name)
    return topic is not None and topic.periodic


def _json(value: object) -> str:
    return json.dumps(value, separators=(",", ":"))
