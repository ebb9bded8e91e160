"""A disk or encoder that is too slow, and a disk that fills up, while the robot drives."""

import threading
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from recording_samples import CONFIG, INFO, T0, image, one_of_each, scan

from sdt_tools.clock import SECOND_NS
from sdt_tools.errors import DiskRefusedError
from sdt_tools.frames import CameraImage, LidarScan, LogEntry, LogLevel, MotionClass, MotionCommand, Received, Twist
from sdt_tools.recording.live.disk import DiskWatch
from sdt_tools.recording.live.drops import DropLog
from sdt_tools.recording.live.pressure import QueueLimits, StreamLimit, StreamQueues
from sdt_tools.recording.live.sink import QueuedSink
from sdt_tools.recording.reader import Recording
from sdt_tools.recording.writer import RecordingWriter

FEW = QueueLimits(StreamLimit(3, 1 << 20), StreamLimit(4, 1 << 20))


def command(number: int) -> Received:
    stamp_ns = T0 + number
    return Received(stamp_ns, MotionCommand(stamp_ns, MotionClass.STAY, Twist(0.0, 0.0), "expert"))


def drained(queues: StreamQueues) -> list[Received]:
    taken = []
    while (received := queues.take()) is not None:
        taken.append(received)
    return taken


def test_messages_leave_in_the_order_in_which_they_came() -> None:
    queues = StreamQueues()
    messages = [*one_of_each(), scan(1), image(1), scan(2), command(3)]
    assert [queues.put(message) for message in messages] == [None] * len(messages)
    assert drained(queues) == messages


def test_a_picture_too_many_is_dropped_and_those_that_wait_stay() -> None:
    queues = StreamQueues(FEW)
    pictures = [image(number) for number in range(5)]
    assert [queues.put(picture) for picture in pictures] == [None, None, None, pictures[3], pictures[4]]
    assert drained(queues) == pictures[:3]


def test_pictures_give_way_to_scans_and_then_scans_are_dropped() -> None:
    queues = StreamQueues(FEW)
    pictures, scans = [image(number) for number in range(3)], [scan(number) for number in range(8)]
    for message in [*pictures, *scans[:4]]:
        assert queues.put(message) is None
    assert [queues.put(one) for one in scans[4:]] == [*pictures, scans[7]]
    assert drained(queues) == scans[:7]


def test_commands_and_log_entries_are_never_dropped() -> None:
    queues = StreamQueues(FEW)
    entry = Received(T0, LogEntry(T0, LogLevel.INFO, "a mark"))
    messages = [message for number in range(1000) for message in (command(number), entry)]
    assert {queues.put(message) for message in messages} == {None}
    assert drained(queues) == messages


def test_a_queue_is_bounded_in_bytes_too_but_takes_one_message_of_any_size() -> None:
    queues = StreamQueues(QueueLimits(StreamLimit(100, 10_000), StreamLimit(100, 1 << 20)))
    large = image(0, 50_000)
    assert queues.put(large) is None
    small = image(1, 100)
    assert queues.put(small) is small
    assert drained(queues) == [large]
    assert queues.size_bytes == 0


@given(st.lists(st.sampled_from("iisssct"), max_size=150))
def test_whatever_comes_is_kept_or_named_as_dropped_and_bounds_hold(kinds: list[str]) -> None:
    queues = StreamQueues(FEW)
    put, out, dropped = [], [], []
    for number, kind in enumerate(kinds):
        if kind == "t":
            out.extend(filter(None, [queues.take()]))
            continue
        message = {"i": image, "s": scan, "c": command}[kind](number)
        put.append(message)
        dropped.extend(filter(None, [queues.put(message)]))
        waiting = queues.messages
        commands = sum(isinstance(one.message, MotionCommand) for one in put)
        assert waiting <= 3 + 4 + commands
    out += drained(queues)
    assert [message for message in put if message not in dropped] == out
    assert all(isinstance(one.message, CameraImage | LidarScan) for one in dropped)


def test_a_burst_of_drops_is_one_entry_with_its_count_and_interval() -> None:
    drops = DropLog()
    for number in range(30):
        drops.drop("/camera/image", T0 + number)
    assert drops.due(T0 + 1000) == []
    (entry,) = drops.due(T0 + 2 * SECOND_NS)
    assert entry.text == (
        f"/camera/image: 30 messages dropped, received from {T0} to {T0 + 29} ns: "
        "they came faster than they could be encoded or written"
    )
    assert drops.due(T0 + 3 * SECOND_NS) == []
    assert drops.counts == {"/camera/image": 30}


def test_drops_that_do_not_end_are_told_every_ten_seconds() -> None:
    drops, told = DropLog(), 0
    for tick in range(1500):  # half a minute
        drops.drop("/lidar/scan", T0 + tick * 20_000_000)
        told += len(drops.due(T0 + tick * 20_000_000))
    assert told == 2


class Stuck:
    """A writer's disk that can be held up."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.free = threading.Event()
        self.reached = threading.Event()
        write = RecordingWriter.write

        def slow(writer: RecordingWriter, received: Received) -> None:
            self.reached.set()
            assert self.free.wait(30)
            write(writer, received)

        monkeypatch.setattr(RecordingWriter, "write", slow)


def test_a_disk_that_hangs_delays_nobody_and_what_is_lost_is_counted(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    disk = Stuck(monkeypatch)
    with RecordingWriter(tmp_path / "r.mcap", INFO, CONFIG, realtime=True) as writer:
        sink = QueuedSink(writer, FEW)
        sink.write(command(0))
        assert disk.reached.wait(30)  # the thread holds the command
        for message in [*map(image, range(5)), *map(scan, range(10)), *map(command, range(1, 50))]:
            sink.write(message)
        assert sink.dropped == {"/camera/image": 5, "/lidar/scan": 3}
        assert [entry.name for entry in sink.bursts(T0, at_end=True)] == ["drops", "drops"]
        disk.free.set()
        sink.finish()
    with Recording.open(tmp_path / "r.mcap") as recording:
        counts = Counter(type(received.message).__name__ for received in recording.messages())
    assert counts == {"LidarScan": 7, "MotionCommand": 50}


def test_a_disk_that_refuses_in_the_thread_is_heard_by_who_writes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(_writer: RecordingWriter, _received: Received) -> None:
        raise DiskRefusedError("the disk is full")

    monkeypatch.setattr(RecordingWriter, "write", refuse)
    with RecordingWriter(tmp_path / "r.mcap", INFO, CONFIG, realtime=True) as writer:
        sink = QueuedSink(writer)
        sink.write(scan(0))
        sink.finish()
        with pytest.raises(DiskRefusedError, match="the disk is full"):
            sink.write(scan(1))
        with pytest.raises(DiskRefusedError, match="the disk is full"):
            sink.keep_safe()
        assert sink.dropped == {"/lidar/scan": 1}


def test_nothing_is_dropped_while_the_disk_keeps_up(tmp_path: Path) -> None:
    messages = [message for number in range(200) for message in (scan(number), command(number))]
    with RecordingWriter(tmp_path / "r.mcap", INFO, CONFIG, realtime=True) as writer:
        sink = QueuedSink(writer)
        for message in messages:
            sink.write(message)
        sink.finish()
    assert sink.dropped == {}
    with Recording.open(tmp_path / "r.mcap") as recording:
        assert sorted(m.received_ns for m in recording.messages()) == sorted(m.received_ns for m in messages)


def watch(free: Callable[[int], int]) -> tuple[DiskWatch, list[int]]:
    """A watch over a disk that has ``free(second)`` bytes left, and the clock to move."""
    now_ns = [0]
    return DiskWatch(Path("r.mcap"), lambda _: free(now_ns[0] // SECOND_NS), lambda: now_ns[0]), now_ns


def test_room_is_shown_as_time_at_the_rate_of_the_file() -> None:
    disk, now_ns = watch(lambda _: 1_000_000_000)
    for second in range(12):
        now_ns[0] = second * SECOND_NS
        disk.look(second * 1_000_000, owed_bytes=0)
    assert disk.space is not None
    assert disk.space.left_s == pytest.approx(1000 - 4.2 - 3, abs=0.1)  # less what is kept for the end
    assert not disk.space.low


def test_others_who_fill_the_disk_count_too() -> None:
    disk, now_ns = watch(lambda second: 1_000_000_000 - second * 50_000_000)
    for second in range(8):
        now_ns[0] = second * SECOND_NS
        disk.look(second * 1000, owed_bytes=0)
    assert disk.space is not None
    assert disk.space.left_s == pytest.approx(13 - 3, abs=0.2)
    assert disk.space.low
    assert not disk.space.full


def test_the_end_comes_while_there_is_room_for_the_end_of_the_file() -> None:
    disk, now_ns = watch(lambda second: 20_000_000 - second * 1_000_000)
    seen = []
    for second in range(20):
        now_ns[0] = second * SECOND_NS
        disk.look(second * 1_000_000, owed_bytes=5_000_000)
        assert disk.space is not None
        seen.append(disk.space)
    first = next(space for space in seen if space.full)
    assert 11_000_000 <= first.free_bytes < 5_000_000 + (4 << 20) + 3_000_000


def test_a_disk_that_cannot_be_asked_is_not_watched() -> None:
    def gone(_path: Path) -> int:
        raise FileNotFoundError

    disk = DiskWatch(Path("r.mcap"), gone)
    disk.look(0, 0)
    assert disk.space is None
