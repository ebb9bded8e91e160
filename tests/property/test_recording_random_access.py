"""Reading an interval is reading all and leaving out the rest, however the file is laid out."""

import sys
import tempfile
from pathlib import Path

from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.writer import CompressionType, IndexType, Writer

from sdt_tools.errors import RecordingError
from sdt_tools.frames import Gesture, Mode, OperatorPose, OperatorState, Pose2D, Received
from sdt_tools.recording.messages.codec import encode
from sdt_tools.recording.messages.schemas import schema_data
from sdt_tools.recording.messages.topics import OPERATOR_POSE, OPERATOR_STATE, topic_of
from sdt_tools.recording.reader import Recording

times = st.integers(0, 60)
entries = st.lists(st.tuples(times, times, st.booleans()), max_size=40)
bounds = st.none() | st.integers(-5, 70)
layouts = st.fixed_dictionaries(
    {
        "chunk_size": st.sampled_from([1, 60, 200, 1000, 1 << 20]),
        "compression": st.sampled_from(CompressionType),
        "index_types": st.sampled_from([IndexType.ALL, IndexType.NONE, IndexType.CHUNK, IndexType.MESSAGE]),
        "use_chunking": st.booleans(),
        "use_statistics": st.booleans(),
        "repeat_channels": st.booleans(),
        "enable_crcs": st.booleans(),
    }
)


def received(log_ns: int, stamp_ns: int, pose: bool) -> Received:
    if pose:
        return Received(log_ns, OperatorPose(stamp_ns, Pose2D(float(log_ns), 0.0, 0.0)))
    return Received(log_ns, OperatorState(stamp_ns, Gesture(0), Mode(0)))


def write(path: Path, messages: list[Received], layout: dict[str, object]) -> None:
    with path.open("wb") as file:
        writer = Writer(file, **layout)
        writer.start()
        channels = {}
        for entry in [received(0, 0, pose=True), received(0, 0, pose=False)]:
            topic = topic_of(entry.message)
            schema = writer.register_schema(topic.schema, "protobuf", schema_data(topic.schema))
            channels[topic.name] = writer.register_channel(topic.name, "protobuf", schema)
        for entry in messages:
            channel = channels[topic_of(entry.message).name]
            writer.add_message(channel, entry.received_ns, encode(entry.message), entry.message.stamp_ns)
        writer.finish()


@settings(max_examples=150, deadline=None)
@given(
    entries,
    layouts,
    st.lists(st.tuples(bounds, bounds), min_size=1, max_size=4),
    st.sampled_from([None, (OPERATOR_POSE,), (OPERATOR_STATE,), ()]),
    st.floats(0, 1) | st.just(1.0),
)
def test_an_interval_is_what_filtering_leaves(written, layout, intervals, topics, kept) -> None:
    messages = [received(*entry) for entry in written]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "r.mcap"
        write(path, messages, layout)
        data = path.read_bytes()
        path.write_bytes(data[: max(8, round(kept * len(data)))])
        try:
            recording = Recording.open(path)
        except RecordingError:
            assert kept < 1 or not written  # what nothing was written on need not be announced
            return
        with recording:
            everything = list(recording.messages(topics))
            if kept == 1 and topics is None:
                assert [entry.received_ns for entry in everything] == sorted(entry[0] for entry in written)
            for start_ns, end_ns in intervals:
                low = -sys.maxsize if start_ns is None else start_ns
                high = sys.maxsize if end_ns is None else end_ns
                filtered = [entry for entry in everything if low <= entry.received_ns < high]
                assert list(recording.messages(topics, start_ns, end_ns)) == filtered
