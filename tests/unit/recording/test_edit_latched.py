"""What topics of others said once, carried to the parts that begin later."""

from pathlib import Path

import pytest
from edit_samples import told
from mcap.writer import Writer
from recording_samples import PERIOD_NS, T0

from sdt_tools.clock import SECOND_NS
from sdt_tools.recording.editing.edit import edit_recordings
from sdt_tools.recording.editing.plan import plan_drop_interval, plan_drop_topics, plan_merge, plan_split, plan_trim

TRANSIENT = "- history: 1\n  depth: 1\n  reliability: 1\n  durability: {}\n  avoid_ros_namespace_conventions: false\n"
AFTER_NS = 400_000_000
"""When ``/late`` says its one word is a second and this much."""

Said = tuple[str, int, bytes]


def bag(path: Path, channels: dict[str, dict[str, str]], said: list[Said]) -> Path:
    """Three seconds of a robot's ``/scan`` with what else is ``said``: topic, seconds after the start in ns, data."""
    with path.open("wb") as stream:
        writer = Writer(stream, chunk_size=5000)
        writer.start("ros2", "theirs")
        schema = writer.register_schema("pkg/msg/Thing", "ros2msg", b"float64 x")
        numbers = {
            name: writer.register_channel(name, "cdr", schema, metadata)
            for name, metadata in {"/scan": {}, **channels}.items()
        }
        moving = [("/scan", n * PERIOD_NS, bytes([n])) for n in range(150)]
        for topic, after_ns, data in sorted([*said, *moving], key=lambda one: one[1]):
            writer.add_message(numbers[topic], T0 + after_ns, data, T0 + after_ns)
        writer.finish()
    return path


def carried(path: Path, begins_s: float) -> list[tuple[str, int, bytes]]:
    """Topic, publish time since the start and data of what stands at the beginning, but for scans."""
    begins_ns = T0 + round(begins_s * SECOND_NS)
    return [(t, publish - T0, data) for t, log, publish, data in told(path) if log == begins_ns and t != "/scan"]


def test_static_transforms_of_several_publishers_all_come_along(tmp_path: Path) -> None:
    said = [("/tf_static", 1, b"laser"), ("/tf_static", 2, b"camera"), ("/tf_static", SECOND_NS, b"laser")]
    path = bag(tmp_path / "r.mcap", {"/tf_static": {}}, said)
    parts = edit_recordings(plan_split(path, ["0.5", "2"], tmp_path))
    assert carried(parts[1].out, 0.5) == [("/tf_static", 1, b"laser"), ("/tf_static", 2, b"camera")]
    assert carried(parts[2].out, 2) == [("/tf_static", 2, b"camera"), ("/tf_static", SECOND_NS, b"laser")]
    assert len(parts[2].carried) == 2
    edit_recordings(plan_merge([part.out for part in parts], tmp_path / "whole.mcap"))
    assert told(tmp_path / "whole.mcap") == told(path)


@pytest.mark.parametrize(
    "metadata",
    [
        {"offered_qos_profiles": TRANSIENT.format(1)},
        {"offered_qos_profiles": TRANSIENT.format("transient_local")},
        {"latching": "1"},
    ],
)
def test_the_last_of_what_is_latched_comes_along(tmp_path: Path, metadata: dict[str, str]) -> None:
    said = [("/map", n * SECOND_NS // 2, bytes([n])) for n in range(4)]
    edit_recordings(plan_trim(bag(tmp_path / "r.mcap", {"/map": metadata}, said), "1.25", "2", tmp_path / "new.mcap"))
    assert carried(tmp_path / "new.mcap", 1.25) == [("/map", SECOND_NS, bytes([2]))]


def test_what_is_said_once_at_the_start_comes_along_and_what_is_said_later_does_not(tmp_path: Path) -> None:
    said = [
        ("/description", 5, b"robot"),
        ("/late", SECOND_NS + AFTER_NS, b"bump"),
        ("/twice", 6, b"a"),
        ("/twice", 7, b"b"),
    ]
    path = bag(tmp_path / "r.mcap", {"/description": {}, "/late": {}, "/twice": {}}, said)
    edit_recordings(plan_trim(path, "2", None, tmp_path / "new.mcap"))
    assert carried(tmp_path / "new.mcap", 2) == [("/description", 5, b"robot")]
    edit_recordings(plan_drop_topics(path, ["/description"], tmp_path / "dropped.mcap"))
    assert {topic for topic, *_ in told(tmp_path / "dropped.mcap")} == {"/scan", "/late", "/twice"}


def test_volatile_topics_do_not(tmp_path: Path) -> None:
    said = [("/pose", n * SECOND_NS // 2, bytes([n])) for n in range(4)]
    volatile = {"offered_qos_profiles": TRANSIENT.format(2)}
    edit_recordings(plan_trim(bag(tmp_path / "r.mcap", {"/pose": volatile}, said), "1.25", "2", tmp_path / "new.mcap"))
    assert carried(tmp_path / "new.mcap", 1.25) == []


def test_what_was_dropped_with_an_interval_comes_after_it(tmp_path: Path) -> None:
    said = [("/tf_static", 1, b"laser"), ("/tf_static", SECOND_NS, b"camera")]
    path = bag(tmp_path / "r.mcap", {"/tf_static": {}}, said)
    edit_recordings(plan_drop_interval(path, "0.5", "2", tmp_path / "new.mcap"))
    assert carried(tmp_path / "new.mcap", 2) == [("/tf_static", SECOND_NS, b"camera")]
