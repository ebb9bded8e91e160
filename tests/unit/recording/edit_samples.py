"""A drive to edit, and what is in files, told in a way that can be compared."""

from pathlib import Path

from mcap.writer import CompressionType, Writer
from recording_samples import PERIOD_NS, T0, image, read_by_mcap, scan, write

from sdt_tools.clock import SECOND_NS
from sdt_tools.frames import CameraCalibration, FrameTransform, Received
from sdt_tools.recording.container.reader import McapReader

Told = tuple[str, int, int, bytes]
"""Topic, log time, publish time and data of a message."""


def tf(log_ns: int, child: str, x: float) -> Received:
    """Where ``child`` stands; the sensor's stamp is 7 ns before the log's."""
    return Received(log_ns, FrameTransform(log_ns - 7, "base", child, (x, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0)))


def calibration(log_ns: int, fx: float) -> Received:
    return Received(log_ns, CameraCalibration(log_ns - 3, 640, 480, fx, fx, 320.0, 240.0))


def drive() -> list[Received]:
    """Two seconds, 100 scans, 60 images; the calibration changes at 1 s, the lidar's place at 0.5 and 1.5 s."""
    latched = [tf(T0, "lidar", 0.1), tf(T0, "camera", 9.0), calibration(T0, 500.0)]
    changes = [tf(T0 + SECOND_NS // 2, "lidar", 0.2), calibration(T0 + SECOND_NS, 510.0)]
    late = [tf(T0 + SECOND_NS * 3 // 2, "lidar", 0.3)]
    frames = [scan(number, delay_ns=2_000_000) for number in range(100)] + [image(number, 500) for number in range(60)]
    return [*latched, *sorted([*frames, *changes, *late], key=lambda received: received.received_ns)]


def recorded(folder: Path, name: str = "drive.mcap") -> Path:
    return write(folder / name, drive(), chunk_bytes=20_000)


def told(path: Path) -> list[Told]:
    """Everything in ``path`` as the mcap package reads it, in an order that its chunks do not decide."""
    return sorted((channel.topic, m.log_time, m.publish_time, m.data) for _, channel, m in read_by_mcap(path))


def within(messages: list[Told], start_s: float, end_s: float) -> list[Told]:
    """Those logged from ``start_s`` to ``end_s``, the end excluded."""
    return [m for m in messages if T0 + start_s * SECOND_NS <= m[1] < T0 + end_s * SECOND_NS]


def metadata(path: Path, name: str) -> dict[str, str]:
    """The last metadata called ``name``."""
    with McapReader(path) as source:
        return dict([record.metadata for record in source.metadata if record.name == name][-1])


def foreign(path: Path) -> Path:
    """A file of others: two topics of theirs, one without a schema, metadata and an attachment."""
    with path.open("wb") as stream:
        writer = Writer(stream, chunk_size=1000, compression=CompressionType.ZSTD)
        writer.start("ros2", "other")
        schema = writer.register_schema("pkg/msg/Thing", "ros2msg", b"float64 x")
        channel = writer.register_channel("/thing", "cdr", schema, {"offered_qos": "best"})
        bare = writer.register_channel("/bare", "json", 0)
        for n in range(100):
            writer.add_message(channel, T0 + n * PERIOD_NS, bytes([n] * 60), T0 + n * PERIOD_NS - 5)
            writer.add_message(bare, T0 + n * PERIOD_NS, b"{}", T0 + n)
        writer.add_metadata("theirs", {"a": "b"})
        writer.add_attachment(1, 2, "notes.txt", "text/plain", b"hello")
        writer.finish()
    return path
