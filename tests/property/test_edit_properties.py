"""Edits undo each other, whatever is in a file: messages of one moment, out of order, alike, of anyone's topics."""

import tempfile
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.reader import make_reader

from sdt_tools.frames import CameraCalibration, FrameTransform
from sdt_tools.recording.container.file import McapFile
from sdt_tools.recording.editing.edit import edit_recordings
from sdt_tools.recording.editing.plan import (
    plan_drop_interval,
    plan_drop_topics,
    plan_merge,
    plan_split,
    plan_trim,
)
from sdt_tools.recording.messages.codec import encode
from sdt_tools.recording.messages.schemas import schema_data

T0 = 1_735_689_600_000_000_000
LENGTH = 20
Entry = tuple[str, int, int, bytes]
"""Topic, log time, publish time, data."""

moments = st.integers(0, LENGTH)
stamps = st.integers(0, 3)


def transform(stamp_ns: int, child: str, x: float) -> tuple[str, bytes]:
    return "/tf", encode(FrameTransform(stamp_ns, "base", child, (x, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0)))


def calibration(stamp_ns: int, fx: float) -> tuple[str, bytes]:
    return "/camera/calibration", encode(CameraCalibration(stamp_ns, 64, 48, fx, fx, 32.0, 24.0))


contents = st.one_of(
    st.tuples(st.sampled_from(["/thing", "/camera/image", "/lidar/scan"]), st.binary(max_size=3)),
    st.builds(transform, stamps, st.sampled_from(["lidar", "camera"]), st.sampled_from([1.0, 2.0])),
    st.builds(calibration, stamps, st.sampled_from([1.0, 2.0])),
    st.just(("/tf", b"\xff\xff")),
)
drives = st.lists(st.tuples(moments, stamps, contents), min_size=2, max_size=30).map(
    lambda entries: [
        ("/lidar/scan", T0, T0, b"first"),
        *((topic, T0 + log, T0 + stamp, data) for log, stamp, (topic, data) in entries),
        ("/lidar/scan", T0 + LENGTH, T0, b"last"),
    ]
)
SCHEMAS = {
    "/tf": "foxglove.FrameTransform",
    "/camera/calibration": "foxglove.CameraCalibration",
    "/camera/image": "foxglove.CompressedImage",
    "/lidar/scan": "foxglove.LaserScan",
}


def write(path: Path, entries: Sequence[Entry]) -> Path:
    file = McapFile(path, "test", chunk_bytes=200)
    numbers = {}
    for topic in sorted({topic for topic, *_ in entries}):
        schema = SCHEMAS.get(topic, "")
        numbers[topic] = file.add_channel(topic, schema, schema_data(schema) if schema else b"")
    for topic, log_ns, publish_ns, data in entries:
        file.add_message(numbers[topic], log_ns, publish_ns, data, compress=topic != "/camera/image")
    file.finish()
    file.close()
    return path


def told(path: Path) -> Counter[Entry]:
    """What is in ``path`` as the mcap package reads it."""
    with path.open("rb") as stream:
        messages = make_reader(stream, validate_crcs=True).iter_messages()
        return Counter((channel.topic, m.log_time, m.publish_time, m.data) for _, channel, m in messages)


def at(moment: int) -> str:
    return f"{T0 + moment}ns"


def within(entries: Sequence[Entry], start: int, end: int) -> Counter[Entry]:
    return Counter(entry for entry in entries if T0 + start <= entry[1] < T0 + end)


some = settings(max_examples=30, deadline=None)


@some
@given(drives, st.sets(st.integers(1, LENGTH), min_size=1, max_size=4), st.randoms())
def test_a_split_that_is_merged_is_the_whole(entries: list[Entry], points: set[int], chance) -> None:
    with tempfile.TemporaryDirectory() as folder:
        path = write(Path(folder) / "drive.mcap", entries)
        parts = edit_recordings(plan_split(path, [at(point) for point in sorted(points)], Path(folder) / "parts"))
        outs = [part.out for part in parts]
        chance.shuffle(outs)
        edit_recordings(plan_merge(outs, Path(folder) / "new.mcap"))
        assert told(Path(folder) / "new.mcap") == Counter(entries)


@some
@given(drives, st.lists(moments, min_size=2, max_size=2, unique=True).map(sorted))
def test_parts_that_overlap_merge_to_the_whole(entries: list[Entry], bounds: list[int]) -> None:
    start, end = bounds
    with tempfile.TemporaryDirectory() as folder:
        path = write(Path(folder) / "drive.mcap", entries)
        for name, plan_from, plan_to in (("a", 0, end), ("b", start, LENGTH + 1)):
            edit_recordings(plan_trim(path, at(plan_from), at(plan_to), Path(folder) / name))
        edit_recordings(plan_merge([Path(folder) / "b", Path(folder) / "a"], Path(folder) / "new.mcap"))
        assert told(Path(folder) / "new.mcap") == Counter(entries)


@some
@given(drives, st.lists(st.integers(0, LENGTH + 1), min_size=4, max_size=4, unique=True).map(sorted))
def test_a_part_of_a_part_is_a_part(entries: list[Entry], bounds: list[int]) -> None:
    entries = [*entries, *(("/lidar/scan", T0 + moment, T0, b"") for moment in range(LENGTH))]  # no part is empty
    with tempfile.TemporaryDirectory() as folder:
        path = write(Path(folder) / "drive.mcap", entries)
        outer, inner, direct = (Path(folder) / name for name in ("outer", "inner", "direct"))
        edit_recordings(plan_trim(path, at(bounds[0]), at(bounds[3]), outer))
        edit_recordings(plan_trim(outer, at(bounds[1]), at(bounds[2]), inner))
        edit_recordings(plan_trim(path, at(bounds[1]), at(bounds[2]), direct))
        assert told(inner) == told(direct)
        own = Counter(dict(within(entries, bounds[1], bounds[2])))
        assert own <= told(inner)
        carried = told(inner) - own
        holds = {"/tf", "/camera/calibration"}
        if sum(topic == "/thing" for topic, *_ in entries) == 1:
            holds.add("/thing")  # said once, at the beginning
        assert {(topic, log_ns) for topic, log_ns, *_ in carried} <= {(topic, T0 + bounds[1]) for topic in holds}


@some
@given(drives, st.lists(st.integers(1, LENGTH), min_size=2, max_size=2, unique=True).map(sorted))
def test_what_is_left_of_a_dropped_interval_is_the_merge_of_its_sides(entries: list[Entry], bounds: list[int]) -> None:
    start, end = map(at, bounds)
    with tempfile.TemporaryDirectory() as folder:
        path = write(Path(folder) / "drive.mcap", entries)
        before, after, merged, dropped = (Path(folder) / name for name in ("before", "after", "merged", "dropped"))
        edit_recordings(plan_trim(path, None, start, before))
        edit_recordings(plan_trim(path, end, None, after))
        edit_recordings(plan_merge([before, after], merged))
        edit_recordings(plan_drop_interval(path, start, end, dropped))
        assert told(merged) == told(dropped)
        assert within(entries, 0, bounds[0]) + within(entries, bounds[1], LENGTH + 1) <= told(dropped)


@some
@given(drives, st.sets(st.sampled_from(["/thing", "/tf", "/camera/image"]), min_size=1))
def test_dropping_topics_leaves_the_others_untouched(entries: list[Entry], topics: set[str]) -> None:
    topics &= {topic for topic, *_ in entries}
    with tempfile.TemporaryDirectory() as folder:
        path = write(Path(folder) / "drive.mcap", entries)
        if topics:
            edit_recordings(plan_drop_topics(path, sorted(topics), Path(folder) / "new.mcap"))
            assert told(Path(folder) / "new.mcap") == Counter(e for e in entries if e[0] not in topics)
