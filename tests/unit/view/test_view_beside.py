"""A viewer beside a terminal app, itself, without a window."""

from collections.abc import Iterator
from contextlib import contextmanager

import cv2
import numpy as np
import pytest
from rerun.experimental import ViewerClient
from view_samples import scan_ns

from sdt_tools.errors import RunError
from sdt_tools.frames import RAYS, CameraImage, LidarScan, Received
from sdt_tools.view.beside import RerunBeside
from sdt_tools.view.viewer import ViewerError, headless_viewer


def frame(number: int) -> tuple[Received, ...]:
    pixels = np.full((48, 64, 3), (number, 0, 0), np.uint8)
    picture = cv2.imencode(".jpg", pixels)[1].tobytes()
    at_ns = scan_ns(number)
    return (
        Received(at_ns, LidarScan(at_ns, np.full(RAYS, 1.0 + number / 100))),
        Received(at_ns, CameraImage(at_ns, picture)),
    )


def port_of(client: ViewerClient) -> int:
    return int(client.url.split(":")[2].split("/")[0])


@contextmanager
def a_viewer() -> Iterator[ViewerClient]:
    try:
        with headless_viewer(800, 600) as client:
            yield client
    except ViewerError as error:
        if "graphics driver" not in str(error):
            raise
        pytest.skip(str(error))


def test_the_viewer_stands_at_the_stamp_of_the_frame_in_whatever_order_they_come() -> None:
    with a_viewer() as client:
        beside = RerunBeside(port_of(client))
        for number in (5, 30, 6, 30, 5):
            beside.show(frame(number), scan_ns(number))
            (recording,) = client.get_state().recordings
            assert recording.current_timeline == "time"
            assert recording.current_time == scan_ns(number)
        (time,) = [timeline for timeline in recording.timelines if timeline.name == "time"]
        assert (time.start, time.end) == (scan_ns(5), scan_ns(30))
        beside.close()


def test_a_viewer_that_is_closed_is_told_in_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sdt_tools.view.beside.ARRIVAL_S", 0.1)
    monkeypatch.setattr("sdt_tools.view.observer.CLOSE_S", 0.1)
    with a_viewer() as client:
        beside = RerunBeside(port_of(client))
        beside.show(frame(1), scan_ns(1))
    with pytest.raises(RunError, match="does not answer; labeling goes on"):
        beside.show(frame(2), scan_ns(2))
    beside.close()
