"""Which topics of a bag are taken over, and what becomes of the others.

A bag of ours names its topics; of any other bag there is one LiDAR, one camera, one source of commands and one
odometry, found by type where only one topic has it, chosen by the user where there are more.
"""

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Final, NamedTuple

from sdt_tools.errors import RecordingError, UsageError
from sdt_tools.recording.exchange.ros2 import outward, types

NONE: Final = "none"
"""What an option says where nothing of its kind is wanted."""


class BagTopic(NamedTuple):
    """A topic of a bag: its name, its type, and how many messages it has."""

    name: str
    type_name: str
    messages: int


class _Kind(NamedTuple):
    """Something of which a recording has one: the option that chooses it, and its types."""

    option: str
    what: str
    type_names: tuple[str, ...]


_SCAN: Final = _Kind("--scan-topic", "scans", (types.LASER_SCAN,))
_IMAGE: Final = _Kind("--image-topic", "pictures", (types.IMAGE, types.COMPRESSED_IMAGE))
_COMMAND: Final = _Kind("--command-topic", "commands", (types.TWIST, types.TWIST_STAMPED))
_ODOMETRY: Final = _Kind("--odometry-topic", "odometry", (types.ODOMETRY,))
_BY_NAME: Final = {
    (outward.CAMERA_INFO, types.CAMERA_INFO),
    (outward.TRANSFORM, types.TF_MESSAGE),
    (outward.OPERATOR_POSE, types.POSE_STAMPED),
    (outward.OPERATOR_STATE, types.OPERATOR_STATE),
    (outward.SESSION_LOG, types.LOG),
}
_DECISION: Final = (outward.DECISION, types.MOTION_COMMAND)
SAYS_LESS: Final = f"{outward.DECISION} holds the same and more"
"""Why the twists of a bag of ours are left out."""
_DEPTH: Final = "/compressedDepth"  # image_transport's depth pictures share the type of the others


@dataclass(frozen=True)
class Wanted:
    """The topics that the user names; None chooses by type, ``none`` leaves out."""

    scans: str | None = None
    images: str | None = None
    commands: str | None = None
    odometry: str | None = None


@dataclass(frozen=True)
class Routes:
    """The topics that are taken over, by name and type, and why each of the others is not."""

    taken: frozenset[tuple[str, str]]
    left_out: Mapping[BagTopic, str]


def choose_topics(topics: Collection[BagTopic], wanted: Wanted) -> Routes:
    """What to take over of ``topics``.

    Raises UsageError, listing the candidates, where a kind has several or a name is none of them; RecordingError where
    there are no scans and they were not declined.
    """
    present = [topic for topic in topics if topic.messages]
    own_commands = wanted.commands is None and any((t.name, t.type_name) == _DECISION for t in present)
    taken = {(t.name, t.type_name) for t in present} & (_BY_NAME | ({_DECISION} if own_commands else set()))
    reasons: dict[str, str] = {}
    for kind, name in (
        (_SCAN, wanted.scans),
        (_IMAGE, wanted.images),
        (_COMMAND, NONE if own_commands else wanted.commands),
        (_ODOMETRY, wanted.odometry),
    ):
        candidates = [t for t in present if t.type_name in kind.type_names and not t.name.endswith(_DEPTH)]
        chosen = _choose(kind, candidates, name)
        taken |= {(t.name, t.type_name) for t in candidates if t.name == chosen}
        said = SAYS_LESS if kind is _COMMAND and own_commands else f"not the {kind.option} chosen"
        reasons |= {t.name: said for t in candidates if t.name != chosen}
        if kind is _SCAN and chosen is None and name != NONE:
            raise RecordingError(
                f"holds no scans ({types.LASER_SCAN}), but {_listed(present) or 'nothing at all'}; "
                f"{_SCAN.option} {NONE} imports the rest"
            )
    left_out = {
        topic: reasons.get(topic.name, "its type has no place in a recording") if topic.messages else "has no messages"
        for topic in topics
        if (topic.name, topic.type_name) not in taken
    }
    return Routes(frozenset(taken), left_out)


def _choose(kind: _Kind, candidates: list[BagTopic], name: str | None) -> str | None:
    names = sorted({topic.name for topic in candidates})
    if name == NONE:
        return None
    if name is not None:
        if name not in names:
            raise UsageError(
                f"{kind.option} {name}: no such topic of {kind.what}; there is {_listed(candidates) or 'none'}"
            )
        return name
    if len(names) > 1:
        raise UsageError(
            f"several topics hold {kind.what}: {_listed(candidates)}; choose one with {kind.option}, or {NONE}"
        )
    return names[0] if names else None


def _listed(topics: Collection[BagTopic]) -> str:
    return ", ".join(f"{t.name} ({t.type_name}, {t.messages})" for t in sorted(topics))
