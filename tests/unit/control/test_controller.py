"""The whole controller, asked by hand: what it reads when, when it drives, and when it does not though active."""

import numpy as np
import pytest

from sdt_tools.clock import SECOND_NS
from sdt_tools.config import RateConfig
from sdt_tools.control.controller import NOBODY, Controller, ControllerConfig, VisionDecision
from sdt_tools.control.eyes import PromptEyes
from sdt_tools.errors import ConfigError, RecordingError
from sdt_tools.frames import RAYS, CameraImage, Gesture, LidarScan, Mode, MotionClass
from sdt_tools.protocols import Choice, Chooser, Observation
from sdt_tools.recording.live.decide import STOP
from sdt_tools.recording.live.drivers import ConstantDriver

FORWARD = ConstantDriver(MotionClass.FORWARD)
IDLE, ENABLE, DISABLE = Gesture.IDLE, Gesture.ENABLE, Gesture.DISABLE


class Script:
    """Reads pictures as it is told: their bytes are the number of the answer. Beyond the script nothing is shown."""

    name = "script"

    def __init__(self, *answers: Gesture | None) -> None:
        self._answers = answers
        self.read: list[int] = []

    def decide(self, data: bytes) -> Gesture:
        number = int(data)
        self.read.append(number)
        answer = self._answers[len(self.read) - 1] if len(self.read) <= len(self._answers) else IDLE
        if answer is None:
            raise RecordingError(f"picture {number} breaks off")
        return answer


def scan(stamp_ns: int = 0, codes: int = 0) -> LidarScan:
    ranges_m = np.full(RAYS, 2.0)
    ranges_m[150 : 150 + codes] = 0.0
    return LidarScan(stamp_ns, ranges_m)


def ask(controller: Controller, decisions: int, codes: int = 0, images: int | None = None) -> list[Choice]:
    """Ten decisions a second, thirty pictures a second, of which the newest of each moment is seen."""
    choices = []
    for number in range(decisions):
        now_ns = number * SECOND_NS // 10
        shot = 3 * number if images is None else min(3 * number, images)
        image = CameraImage(shot * SECOND_NS // 30, str(shot).encode())
        choices.append(controller.choose(Observation(now_ns, scan(now_ns, codes), image_of(shot, image))))
    return choices


_SHOTS: dict[int, CameraImage] = {}


def image_of(shot: int, image: CameraImage) -> CameraImage:
    """The same picture is the same object, as in the loop."""
    return _SHOTS.setdefault(shot, image)


def test_pictures_are_read_at_the_vision_rate_and_motions_decided_at_the_follow_rate() -> None:
    network, told = Script(ENABLE), list[VisionDecision]()
    controller = Controller(FORWARD, PromptEyes(network), RateConfig(), told=told.append)
    choices = ask(controller, 20)

    assert isinstance(controller, Chooser)
    assert controller.name == "script+constant:forward"
    assert network.read == [6 * number for number in range(10)]
    assert {choice.motion for choice in choices} == {MotionClass.FORWARD}
    assert [one.switches for one in told] == [True] + [False] * 9


def test_it_stays_while_idle_and_says_that_nobody_drives() -> None:
    controller = Controller(FORWARD, PromptEyes(Script(IDLE, ENABLE, IDLE, DISABLE)), RateConfig())
    choices = ask(controller, 10)

    assert [choice.mode for choice in choices] == [Mode.IDLE] * 2 + [Mode.ACTIVE] * 4 + [Mode.IDLE] * 4
    assert [choice.driver for choice in choices] == [NOBODY] * 2 + [FORWARD.name] * 4 + [NOBODY] * 4
    assert {choice.motion for choice in choices if choice.mode is Mode.IDLE} == {MotionClass.STAY}


def test_with_a_debounce_it_waits_for_readings_in_a_row() -> None:
    script = Script(ENABLE, IDLE, ENABLE, ENABLE)
    controller = Controller(FORWARD, PromptEyes(script), RateConfig(), ControllerConfig(debounce=2))

    assert [choice.mode for choice in ask(controller, 8)] == [Mode.IDLE] * 6 + [Mode.ACTIVE] * 2


def test_without_eyes_it_is_active_throughout() -> None:
    controller = Controller(FORWARD, None, RateConfig())

    assert {(choice.mode, choice.motion) for choice in ask(controller, 15)} == {(Mode.ACTIVE, MotionClass.FORWARD)}


@pytest.mark.parametrize(("codes", "drives"), [(72, True), (73, False)])
def test_it_stays_where_more_than_three_tenths_of_the_front_rays_are_codes(codes: int, drives: bool) -> None:
    (choice,) = ask(Controller(FORWARD, None, RateConfig()), 1, codes)

    assert (choice.motion is MotionClass.FORWARD) is drives
    assert (choice.driver == STOP) is not drives
    assert choice.says.startswith("" if drives else "more than 30% of the front rays are invalid")
    assert bool(choice.says) is not drives


def test_it_stays_when_the_camera_is_silent_and_remains_active() -> None:
    controller = Controller(FORWARD, PromptEyes(Script(ENABLE)), RateConfig())
    choices = ask(controller, 20, images=12)

    drives = [choice.motion is MotionClass.FORWARD for choice in choices]
    assert drives == [True] * 15 + [False] * 5  # read last at 0.4 s
    assert {choice.mode for choice in choices} == {Mode.ACTIVE}
    assert "no picture was read for 1 s" in choices[-1].says


def test_a_picture_that_cannot_be_read_is_counted_named_and_changes_nothing() -> None:
    controller = Controller(FORWARD, PromptEyes(Script(ENABLE, None, DISABLE)), RateConfig())
    choices = ask(controller, 6)

    assert controller.unreadable == 1
    assert [choice.mode for choice in choices] == [Mode.ACTIVE] * 4 + [Mode.IDLE] * 2
    assert choices[2].says == "a picture was not read: picture 6 breaks off"


def test_pictures_cannot_be_read_more_often_than_motions_are_decided() -> None:
    with pytest.raises(ConfigError, match=r"rates.vision_hz = 20 is above rates.follow_hz = 10"):
        Controller(FORWARD, PromptEyes(Script()), RateConfig(vision_hz=20))
