"""Pictures go in, readings come out: at once, or from a thread."""

import threading
import time

import pytest

from sdt_tools.control.eyes import BackgroundEyes, Eyes, PromptEyes, Reading
from sdt_tools.errors import RecordingError
from sdt_tools.frames import CameraImage, Gesture


class ByLength:
    """Reads as many bytes as the gesture's number; none cannot be read."""

    name = "by length"

    def decide(self, data: bytes) -> Gesture:
        if not data:
            raise RecordingError("nothing there")
        return Gesture(len(data) - 1)


class Held:
    """Does not answer before it is let go."""

    name = "held"

    def __init__(self, failure: Exception | None = None) -> None:
        self.go, self.begun = threading.Event(), threading.Event()
        self._failure = failure

    def decide(self, data: bytes) -> Gesture:
        self.begun.set()
        assert self.go.wait(5.0)
        if self._failure is not None:
            raise self._failure
        return Gesture(len(data) - 1)


def image(stamp_ns: int, gesture: Gesture) -> CameraImage:
    return CameraImage(stamp_ns, b"x" * (gesture + 1))


def wait_for(eyes: Eyes, count: int) -> list[Reading]:
    found: list[Reading] = []
    deadline_s = time.monotonic() + 5.0
    while len(found) < count and time.monotonic() < deadline_s:
        found += eyes.readings()
        time.sleep(0.001)
    return found


def test_prompt_eyes_have_read_when_they_have_looked() -> None:
    eyes = PromptEyes(ByLength())
    eyes.look(image(7, Gesture.DISABLE))

    (reading,) = eyes.readings()
    assert (reading.stamp_ns, reading.gesture) == (7, Gesture.DISABLE)
    assert eyes.readings() == []


def test_a_picture_that_cannot_be_decoded_is_read_as_none_and_says_why() -> None:
    eyes = PromptEyes(ByLength())
    eyes.look(CameraImage(1, b""))

    (reading,) = eyes.readings()
    assert (reading.gesture, reading.why) == (None, "nothing there")


def test_background_eyes_do_not_hold_up_and_read_the_newest_that_waits() -> None:
    network = Held()
    eyes = BackgroundEyes(network)
    eyes.look(image(1, Gesture.ENABLE))
    assert network.begun.wait(5.0)
    eyes.look(image(2, Gesture.IDLE))
    eyes.look(image(3, Gesture.DISABLE))
    assert eyes.readings() == []
    network.go.set()

    assert [(one.stamp_ns, one.gesture) for one in wait_for(eyes, 2)] == [(1, Gesture.ENABLE), (3, Gesture.DISABLE)]
    eyes.close()
    eyes.close()


def test_what_reading_raises_is_raised_where_readings_are_asked_for() -> None:
    network = Held(ValueError("broken"))
    network.go.set()
    eyes = BackgroundEyes(network)
    eyes.look(image(1, Gesture.ENABLE))

    with pytest.raises(ValueError, match="broken"):
        wait_for(eyes, 1)
    eyes.close()
