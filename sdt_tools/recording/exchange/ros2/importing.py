"""ROS 2 bags into recordings."""

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w
from rosbags.serde import SerdeError

from sdt_tools.errors import OutputExistsError, RecordingError, UsageError
from sdt_tools.frames import RAYS
from sdt_tools.protocols import SourceInfo
from sdt_tools.recording.copying import new_file
from sdt_tools.recording.exchange.about import About
from sdt_tools.recording.exchange.carried import Carried, Incoming
from sdt_tools.recording.exchange.ros2 import types
from sdt_tools.recording.exchange.ros2.bag import Bag, open_bag
from sdt_tools.recording.exchange.ros2.geometry import CODE_BELOW_M
from sdt_tools.recording.exchange.ros2.inward import Taking, from_ros, is_stamped, rays_of
from sdt_tools.recording.exchange.ros2.routes import SAYS_LESS, BagTopic, Routes, Wanted, choose_topics
from sdt_tools.recording.messages.topics import LIDAR_SCAN
from sdt_tools.recording.session import derived_id, session_metadata


@dataclass(frozen=True)
class RosImportSummary:
    """What came over, by topic of the recording, and what did not.

    ``left_out`` says of each topic of the bag that was not taken why; ``unreadable`` counts by topic messages that do
    not parse or hold nothing that can be used, ``unstamped`` those that are stamped with their receipt because they
    carry no stamp of their own.
    ``scans`` says how rays were chosen; ``no_distance`` is the share of rays without one.
    """

    recording_id: str
    path: Path
    messages: Mapping[str, int]
    left_out: Mapping[BagTopic, str]
    unreadable: Mapping[str, int]
    unstamped: Mapping[str, int]
    scans: Mapping[str, int]
    no_distance: float

    def document(self) -> dict[str, object]:
        """The summary for machines."""
        return {
            "recording_id": self.recording_id,
            "path": str(self.path),
            "messages": dict(self.messages),
            "left_out": [{**topic._asdict(), "reason": reason} for topic, reason in self.left_out.items()],
            "unreadable": dict(self.unreadable),
            "unstamped": dict(self.unstamped),
            "scans": dict(self.scans),
            "no_distance": self.no_distance,
        }


def import_ros2(path: Path, out: Path, wanted: Wanted, taking: Taking) -> RosImportSummary:
    """Import the bag ``path`` into the recording ``out``, which appears when all of it is written and reads back.

    A stamp of the message's own (its header) becomes that of the recording, to the nanosecond, and the bag's time of
    receipt stays that. A bag that was exported from a recording becomes that recording again, its identity included.

    Raises RecordingError for what is no bag or is damaged, holds no scans, or scans of another geometry without
    ``taking.resample``; UsageError where topics have to be chosen; OutputExistsError.
    """
    if out.exists():
        raise OutputExistsError(out)
    with open_bag(path) as bag:
        routes = _routes(bag, wanted)
        about = bag.about() or _about(bag, wanted, taking)
        tally = _Tally()
        with new_file(out) as file:
            incoming = Incoming(file, about)
            for carried in _messages(bag, routes, taking, tally):
                incoming.take(carried)
            messages = incoming.close(tally.stats(routes))
            if not messages:
                raise RecordingError(f"{path}: none of its messages can be taken over; nothing was imported")
    rays = sum(tally.scans.values()) * RAYS
    return RosImportSummary(
        recording_id=about.session.get("recording_id", ""),
        path=out,
        messages=messages,
        left_out=routes.left_out,
        unreadable=dict(tally.unreadable),
        unstamped=dict(tally.unstamped),
        scans=dict(tally.scans),
        no_distance=tally.no_distance / rays if rays else 0.0,
    )


class _Tally:
    """What is counted while messages pass."""

    def __init__(self) -> None:
        self.unreadable: Counter[str] = Counter()
        self.unstamped: Counter[str] = Counter()
        self.scans: Counter[str] = Counter()
        self.no_distance = 0

    def took(self, carried: Carried) -> None:
        """A message became ``carried``."""
        if carried.topic.name == LIDAR_SCAN:
            self.no_distance += int(np.count_nonzero(np.array(carried.message.ranges) < CODE_BELOW_M))

    def stats(self, routes: Routes) -> dict[str, str]:
        """Entries of ``sdt.stats``: nothing is left behind without being counted."""
        left = {
            f"left_out.{topic.name}": f"{topic.messages}: {why}"
            for topic, why in routes.left_out.items()
            if topic.messages and why != SAYS_LESS
        }
        return left | {f"unreadable.{topic}": str(count) for topic, count in self.unreadable.items()}


def _routes(bag: Bag, wanted: Wanted) -> Routes:
    try:
        return choose_topics(bag.topics, wanted)
    except UsageError as error:
        raise RecordingError(f"{bag.path}: {error}") from None


def _messages(bag: Bag, routes: Routes, taking: Taking, tally: _Tally) -> Iterator[Carried]:
    for topic, type_name, received_ns, data in bag.messages(routes.taken):
        try:
            message: Any = types.decoded(data, type_name)
        except SerdeError:
            tally.unreadable[topic] += 1
            continue
        try:
            converted = list(from_ros(type_name, message, received_ns, taking))
        except RecordingError as error:
            raise RecordingError(f"{bag.path}: {topic} at {received_ns} ns: {error}") from None
        if not converted:
            tally.unreadable[topic] += 1
        if type_name == types.LASER_SCAN:
            tally.scans[rays_of(message, taking).how] += 1
        for carried in converted:
            tally.took(carried)
            yield carried
        if converted and not is_stamped(type_name, message):
            tally.unstamped[topic] += 1


def _about(bag: Bag, wanted: Wanted, taking: Taking) -> About:
    """What a recording made from a bag of others says about itself: where it comes from, and how it was taken over."""
    notes = {
        "import_file": bag.path.name,
        "import_sha256": bag.sha256(),
        "import_format": "ros2",
        "import_pictures": f"{taking.pictures.name} {taking.pictures.quality}",
        "import_resample": str(taking.resample).lower(),
    } | {f"import_{kind}": name for kind, name in vars(wanted).items() if name is not None}
    config_toml = tomli_w.dumps({"motions": taking.motions.model_dump(mode="json")})
    recording_id = derived_id(config_toml, *(f"{name}={value}" for name, value in notes.items()))
    return About(session_metadata(SourceInfo("import"), recording_id, "", notes), {}, config_toml)
