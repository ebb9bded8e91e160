"""A camera on a file and on a network stream that goes away and comes back."""

import time
from collections.abc import Callable, Iterator
from itertools import pairwise
from pathlib import Path

import cv2
import numpy as np
import pytest
from mjpeg_server import MjpegServer

from sdt_tools.clock import HostClock
from sdt_tools.errors import DeviceError
from sdt_tools.frames import LogEntry, LogLevel, RawPicture, Received
from sdt_tools.robot.camera import capture
from sdt_tools.robot.camera.camera import Camera
from sdt_tools.robot.camera.capture import Opened, SourceKind, kind_of
from sdt_tools.robot.camera.config import CameraConfig

PICTURES = 12


@pytest.fixture(scope="module")
def video(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Twelve pictures at 50 Hz, brighter and brighter."""
    path = tmp_path_factory.mktemp("video") / "drive.avi"
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"MJPG"), 50.0, (64, 48))
    for number in range(PICTURES):
        writer.write(np.full((48, 64, 3), number * 20, np.uint8))
    writer.release()
    return path


@pytest.fixture
def server() -> Iterator[MjpegServer]:
    server = MjpegServer()
    server.start()
    yield server
    server.stop()


def config(source: object, **more: object) -> CameraConfig:
    return CameraConfig.model_validate({"source": str(source), "width": 64, "height": 48, "try_again_s": 0.05} | more)


def read_until(
    camera: Camera, enough: Callable[[list[RawPicture], list[LogEntry]], bool]
) -> tuple[list[RawPicture], list[LogEntry]]:
    """Read as whoever records does, until it is enough."""
    clock, pictures, entries, until_s = HostClock(), [], [], time.monotonic() + 8.0
    while not enough(pictures, entries):
        assert time.monotonic() < until_s, [entry.text for entry in entries]
        for one in camera.read(clock.now_ns()):
            if isinstance(one, RawPicture):
                pictures.append(one)
            elif isinstance(one, Received) and isinstance(one.message, LogEntry):
                entries.append(one.message)
        time.sleep(0.005)
    return pictures, entries


def brightness(picture: RawPicture) -> int:
    return round(float(picture.image_bgr_u8.mean()))


def test_a_file_plays_whole_at_its_own_rate_and_ends(video: Path) -> None:
    with Camera(config(video, rate_hz=50)) as camera:
        pictures, entries = read_until(camera, lambda pictures, _: camera.finished and len(pictures) == PICTURES)
    assert [brightness(picture) for picture in pictures] == pytest.approx([20 * n for n in range(PICTURES)], abs=2)
    stamps = [picture.stamp_ns for picture in pictures]
    assert all(before < after for before, after in pairwise(stamps))
    assert (stamps[-1] - stamps[0]) / 1e9 >= (PICTURES - 2) / 50
    assert all(picture.stamp_ns <= picture.received_ns for picture in pictures)
    assert [entry.level for entry in entries] == [LogLevel.INFO]
    assert "asked for 64×48 at 50 Hz, got 64×48 at 50 Hz" in entries[0].text


def test_what_differs_from_what_was_asked_for_is_a_warning(video: Path) -> None:
    with Camera(config(video, width=640, height=480, rate_hz=30)) as camera:
        _, (entry,) = read_until(camera, lambda _, entries: bool(entries))
    assert entry.level is LogLevel.WARNING
    assert "asked for 640×480 at 30 Hz, got 64×48 at 50 Hz" in entry.text


def test_pictures_that_nobody_reads_in_time_are_dropped_and_counted(video: Path) -> None:
    with Camera(config(video, rate_hz=50)) as camera:
        until_s = time.monotonic() + 8.0
        while not camera.finished and time.monotonic() < until_s:
            time.sleep(0.01)
        pictures, entries = read_until(camera, lambda _, entries: len(entries) == 2)
    assert [brightness(picture) for picture in pictures] == pytest.approx([160, 180, 200, 220], abs=2), "the newest"
    texts = {f"{PICTURES - 4 - late} pictures dropped: not read in time" for late in (0, 1)}
    assert entries[1].text in texts, "a busy machine may pass over a picture"


def test_the_newest_picture_of_a_stream_is_new(server: MjpegServer) -> None:
    with Camera(config(server.url)) as camera:
        read_until(camera, lambda pictures, _: len(pictures) > 20)
        ages = []
        for _ in range(10):
            time.sleep(0.02)
            assert camera.newest is not None
            ages.append((server.brightness - brightness(camera.newest)) % 256 / 2)
    assert sorted(ages)[5] <= 3, f"pictures behind: {ages}"


def test_a_stream_that_is_lost_is_told_and_comes_back(server: MjpegServer) -> None:
    with Camera(config(server.url, silent_s=0.1)) as camera:
        read_until(camera, lambda pictures, _: bool(pictures))
        server.stop()
        _, entries = read_until(camera, lambda _, entries: any("no picture" in entry.text for entry in entries))
        _, more = (None, entries) if _told(entries, "lost") else read_until(camera, lambda _, new: _told(new, "lost"))
        assert _told([*entries, *more], "lost; trying to open it again")
        server.start()
        _, entries = read_until(camera, lambda pictures, entries: bool(pictures) and _told(entries, "back after"))


def _told(entries: list[LogEntry], words: str) -> bool:
    return any(words in entry.text for entry in entries)


def test_closing_twice_is_no_fault(server: MjpegServer) -> None:
    camera = Camera(config(server.url))
    camera.close()
    camera.close()


@pytest.mark.parametrize(
    ("source", "kind"),
    [
        ("0", SourceKind.DEVICE),
        ("/dev/video2", SourceKind.DEVICE),
        ("drives/one.mp4", SourceKind.FILE),
        ("rtsp://robot/stream", SourceKind.URL),
    ],
)
def test_what_a_source_is(source: str, kind: SourceKind) -> None:
    assert kind_of(source) is kind


def refusal(source: object) -> str:
    with pytest.raises(DeviceError) as refused:
        Camera(config(source))
    return str(refused.value)


def test_a_camera_that_is_not_there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(capture, "_DEVICES", tmp_path)
    assert "there is none on this machine; is it plugged in?" in refusal("7")
    (tmp_path / "video2").touch()
    assert f"there are {tmp_path}/video2" in refusal("7")


def test_a_device_that_is_no_camera_or_busy() -> None:
    assert "/dev/null: does not open; is another program using it, or is it no camera?" in refusal("/dev/null")


def test_a_camera_without_rights(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(capture.os, "access", lambda *_: False)
    assert "no rights on /dev/null; join the group that owns it (often video)" in refusal("/dev/null")


def test_a_file_that_is_not_there(tmp_path: Path) -> None:
    assert "no such video file" in refusal(tmp_path / "none.mp4")


def test_a_file_that_is_no_video(tmp_path: Path) -> None:
    (tmp_path / "text.mp4").write_text("no video")
    assert "is no video that can be read" in refusal(tmp_path / "text.mp4")


def test_a_stream_that_nobody_serves(server: MjpegServer) -> None:
    url = server.url
    server.stop()
    try:
        assert "gives no video; is the address right" in refusal(url)
    finally:
        server.start()


def test_an_exposure_that_was_not_taken_is_said() -> None:
    opened = Opened(cv2.VideoCapture(), SourceKind.DEVICE, 64, 48, None, 156.0, "V4L2")
    asked = config("0", exposure=80)
    assert opened.differs(asked)
    assert opened.text(asked).endswith("at unknown rate, through V4L2; exposure asked 80, got 156")
