"""Raw pictures on their way into a recording: encoded at once or beside it, in order, dropped where it is too slow."""

import threading
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from recording_rig import HandClock, Rig, TapeSource
from recording_samples import PERIOD_NS, T0, scan

from sdt_tools.errors import RunError
from sdt_tools.frames import CameraImage, LidarScan, RawPicture, Received
from sdt_tools.recording.live.encoder import PictureEncoder, encode_jpeg
from sdt_tools.recording.live.pressure import QueueLimits, StreamLimit

FEW = replace(QueueLimits(), raw_pictures=StreamLimit(3, 1 << 30))


def picture(number: int) -> RawPicture:
    """A picture of its own, received a millisecond after it was taken."""
    stamp_ns = T0 + number * 33_333_333
    pixels = np.full((12, 16, 3), number * 10 % 256, np.uint8)
    return RawPicture(stamp_ns + 1_000_000, stamp_ns, pixels)


def encoded(raw: RawPicture) -> Received:
    return Received(raw.received_ns, CameraImage(raw.stamp_ns, encode_jpeg(raw.image_bgr_u8)))


def tape(scans: int, raw: bool = True) -> list[Received | RawPicture]:
    pictures = [picture(n) for n in range(scans) if picture(n).received_ns < T0 + scans * PERIOD_NS]
    items = [*map(scan, range(scans)), *(pictures if raw else map(encoded, pictures))]
    return sorted(items, key=lambda item: item.received_ns)


def rig(folder: Path, items: list[Received | RawPicture], name: str = "r") -> Rig:
    return Rig(folder / f"{name}.mcap", TapeSource(items))  # type: ignore[arg-type]


class Held:
    """An encoder that waits until it is told to go on."""

    def __init__(self) -> None:
        self.free = threading.Event()
        self.reached = threading.Event()

    def __call__(self, image_bgr_u8: np.ndarray) -> bytes:
        self.reached.set()
        assert self.free.wait(30)
        return encode_jpeg(image_bgr_u8)


def out_of(encoder: PictureEncoder) -> list[Received | RawPicture]:
    out = []
    while (item := encoder.take()) is not None:
        out.append(item)
    return out


def test_as_fast_as_it_can_raw_pictures_give_the_bytes_of_encoded_ones(tmp_path: Path) -> None:
    recorded = [rig(tmp_path, tape(60, raw), name) for name, raw in (("a", True), ("b", True), ("c", False))]
    for one in recorded:
        one.run()
    first, again, by_source = (one.path.read_bytes() for one in recorded)
    assert first == again == by_source
    assert [m.received_ns for m in recorded[0].watcher.seen] == [m.received_ns for m in recorded[2].watcher.seen]


def test_in_real_time_every_picture_is_recorded_with_both_its_times(tmp_path: Path) -> None:
    clock = HandClock()
    one = rig(tmp_path, tape(60))
    summary = one.run(1.0, realtime=True, clock=clock, sleep_s=clock.sleep)
    images = [m for m in one.read() if isinstance(m.message, CameraImage)]
    assert images == [encoded(picture(n)) for n in range(30)]
    assert summary.frames["/camera/image"] == 30
    assert (summary.dropped["/camera/image"], summary.missing["/camera/image"]) == (0, 0)
    assert {m.message.stamp_ns for m in one.watcher.seen if isinstance(m.message, CameraImage)} == {
        m.message.stamp_ns for m in images
    }


def test_an_encoder_that_hangs_delays_no_scan_and_its_drops_are_counted_and_told(tmp_path: Path) -> None:
    clock, held = HandClock(), Held()
    one = rig(tmp_path, tape(101))
    scans_seen = []

    def observe(received: Received) -> None:
        if isinstance(received.message, LidarScan):
            scans_seen.append(received.message.stamp_ns)
            if len(scans_seen) == 100:
                held.free.set()

    one.watcher.observe = observe  # type: ignore[method-assign]
    summary = one.run(2.0, realtime=True, clock=clock, sleep_s=clock.sleep, limits=FEW, encode=held)
    assert len(scans_seen) == summary.frames["/lidar/scan"] == 100
    kept = summary.frames["/camera/image"]
    assert 3 <= kept < 60
    assert summary.dropped == {"/lidar/scan": 0, "/camera/image": 60 - kept}
    assert summary.missing == {"/lidar/scan": 0, "/camera/image": 0}
    told = [text for text in one.log() if "messages dropped" in text]
    assert sum(int(text.split()[1]) for text in told) == 60 - kept
    assert all("faster than they could be encoded or written" in text for text in told)
    assert one.stats()["dropped./camera/image"] == str(60 - kept)


def test_pictures_come_out_in_order_those_that_were_dropped_in_their_place() -> None:
    held, pictures = Held(), [picture(n) for n in range(8)]
    encoder = PictureEncoder(True, FEW, held)
    encoder.put(pictures[0])
    assert held.reached.wait(30)
    for one in pictures[1:6]:  # three wait, two find no room
        encoder.put(one)
    assert encoder.take() is None
    held.free.set()
    encoder.wait()
    encoder.put(pictures[6])
    encoder.wait()
    assert out_of(encoder) == [*map(encoded, pictures[:4]), pictures[4], pictures[5], encoded(pictures[6])]
    encoder.close()


def test_the_queue_is_bounded_in_bytes_too_but_takes_one_of_any_size() -> None:
    held, pictures = Held(), [picture(n) for n in range(4)]
    encoder = PictureEncoder(True, QueueLimits(raw_pictures=StreamLimit(90, 600)), held)
    encoder.put(pictures[0])
    assert held.reached.wait(30)
    for one in pictures[1:]:
        encoder.put(one)
    held.free.set()
    encoder.wait()
    assert out_of(encoder) == [encoded(pictures[0]), encoded(pictures[1]), pictures[2], pictures[3]]
    encoder.close()


def test_who_does_not_want_to_wait_loses_what_is_not_encoded_and_it_is_counted(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    held = Held()
    encoder = PictureEncoder(True, FEW, held)
    encoder.put(picture(0))
    assert held.reached.wait(30)
    encoder.put(picture(1))

    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(encoder._changed, "wait_for", interrupted)
    with pytest.raises(KeyboardInterrupt):
        encoder.wait()
    monkeypatch.undo()
    assert [type(item) for item in out_of(encoder)] == [RawPicture, RawPicture]
    held.free.set()
    encoder.close()


def test_what_is_no_picture_ends_the_recording_with_the_reason(tmp_path: Path) -> None:
    empty = RawPicture(T0 + 5, T0 + 5, np.zeros((0, 16, 3), np.uint8))
    one = rig(tmp_path, [scan(0), empty, *map(scan, range(1, 50))])
    reason = "a picture of 0×16×3 values of uint8 cannot be encoded"
    with pytest.raises(RunError, match=rf"r\.mcap: {reason} .* a camera gives height × width × 3 bytes"):
        one.run()
    assert any(f"the recording stopped: RunError: {reason}" in text for text in one.log())


def slow(image_bgr_u8: np.ndarray) -> bytes:
    time.sleep(0.01)
    return encode_jpeg(image_bgr_u8)


def test_closing_does_not_wait_for_what_is_left() -> None:
    encoder = PictureEncoder(True, FEW, slow)
    for number in range(4):
        encoder.put(picture(number))
    encoder.close()
    encoder.close()
    assert all(thread.name != "recording-encoder" for thread in threading.enumerate())
