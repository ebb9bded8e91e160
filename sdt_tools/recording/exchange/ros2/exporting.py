"""Recordings into ROS 2 bags: MCAP with the profile, encoding and definitions that ``ros2 bag`` expects."""

from collections.abc import Iterator
from pathlib import Path
from typing import Final

from rosbags.interfaces import Connection, Qos, QosDurability, QosHistory, QosLiveliness, QosReliability, QosTime
from rosbags.rosbag2 import Reader, StoragePlugin, Writer

from sdt_tools.errors import RecordingError
from sdt_tools.recording.exchange.about import about_of
from sdt_tools.recording.exchange.carried import outgoing
from sdt_tools.recording.exchange.placing import placed
from sdt_tools.recording.exchange.ros2.outward import TRANSFORM, Sent, to_ros
from sdt_tools.recording.exchange.ros2.types import type_store
from sdt_tools.recording.exchange.summary import ExportSummary
from sdt_tools.recording.reader import Recording

_VERSION: Final = 8
"""Of the bag's metadata: what every distribution since Humble reads."""
_ZERO: Final = QosTime(0, 0)
_LATCHED: Final = Qos(
    QosHistory.KEEP_LAST,
    1,
    QosReliability.RELIABLE,
    QosDurability.TRANSIENT_LOCAL,
    _ZERO,
    _ZERO,
    QosLiveliness.SYSTEM_DEFAULT,
    _ZERO,
    False,
)
"""What listeners of ``/tf_static`` ask for: whoever comes late is told too."""


def export_ros2(path: Path, out: Path) -> ExportSummary:
    """Export the recording ``path`` to ``out``: one file where that ends in ``.mcap``, else a bag folder.

    The bag's custom data keep what the recording says about itself. ``out`` appears when the bag is whole and another
    reader has found all messages in it.

    Raises RecordingError for what is no recording or holds no messages, OutputExistsError, DiskRefusedError.
    """
    is_file = out.suffix == ".mcap"
    name = out.stem if is_file else out.name
    with (
        Recording.open(path) as recording,
        placed(out, f"{name}/{name}.mcap" if is_file else name) as made,
    ):
        bag = made.parent if is_file else made
        messages = _write(recording, bag)
        _check(bag, sum(messages.values()))
        return ExportSummary.of(recording, out, messages)


def _write(recording: Recording, bag: Path) -> dict[str, int]:
    writer = Writer(bag, version=_VERSION, storage_plugin=StoragePlugin.MCAP)
    for name, text in about_of(recording).texts().items():
        writer.set_custom_data(name, text)
    connections: dict[str, Connection] = {}
    counts: dict[str, int] = {}
    with writer:
        for received_ns, sent in _sent(recording):
            connection = connections.get(sent.topic)
            if connection is None:
                connection = connections[sent.topic] = writer.add_connection(
                    sent.topic,
                    sent.type_name,
                    typestore=type_store(),
                    offered_qos_profiles=[_LATCHED] if sent.topic == TRANSFORM else [],
                )
            writer.write(connection, received_ns, type_store().serialize_cdr(sent.message, sent.type_name))
            counts[sent.topic] = counts.get(sent.topic, 0) + 1
    return dict(sorted(counts.items()))


def _sent(recording: Recording) -> Iterator[tuple[int, Sent]]:
    for carried in outgoing(recording):
        for sent in to_ros(carried):
            yield carried.received_ns, sent


def _check(bag: Path, messages: int) -> None:
    with Reader(bag) as reader:
        found = sum(1 for _ in reader.messages())
    if found != messages:
        raise RecordingError(f"{bag}: {found} of {messages} messages read back; check the disk")
