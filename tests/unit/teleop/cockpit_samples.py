"""A cockpit before a robot that stands still for its picture."""

import io
from dataclasses import dataclass, field

import numpy as np
from PIL import Image

from sdt_tools.config import MotionConfig
from sdt_tools.frames import (
    CameraImage,
    Gesture,
    LidarScan,
    LogEntry,
    LogLevel,
    Mode,
    MotionClass,
    MotionCommand,
    Odometry,
    OperatorState,
    Pose2D,
    Received,
)
from sdt_tools.recording.live.control import Act
from sdt_tools.recording.live.interrupt import Interrupt
from sdt_tools.recording.live.outcome import RecordingProgress
from sdt_tools.scene.scenario import layout_for
from sdt_tools.scene.source import SceneSource
from sdt_tools.teleop.cockpit import Cockpit, Recording
from sdt_tools.teleop.hand import Hand
from sdt_tools.teleop.watch import Watch

SECOND_NS = 1_000_000_000
PROGRESS = RecordingProgress(
    12.34, None, 12.4, {"/lidar/scan": 617}, 3_400_000, 0, 0, disk_left_s=11_700.0, state="take_003"
)


@dataclass
class Clock:
    now_ns: int = 0

    def __call__(self) -> int:
        return self.now_ns


@dataclass
class Operator:
    shown: list[Gesture] = field(default_factory=list)

    def show(self, gesture: Gesture) -> None:
        self.shown.append(gesture)


def picture() -> CameraImage:
    """Sky, wall and floor, and somebody in red."""
    pixels = np.zeros((120, 160, 3), np.uint8)
    pixels[:40], pixels[40:80], pixels[80:] = (90, 120, 170), (150, 140, 120), (70, 66, 60)
    pixels[24:96, 70:92] = (190, 40, 50)
    stream = io.BytesIO()
    Image.fromarray(pixels).save(stream, "PNG")
    return CameraImage(0, stream.getvalue(), "png")


def first_scan() -> LidarScan:
    source = SceneSource(layout_for("through_gate", 3))
    for sensed in source.read(source.start_ns):
        if isinstance(sensed, Received) and isinstance(sensed.message, LidarScan):
            return sensed.message
    raise AssertionError("a scene begins with a scan")


def command(motion: MotionClass, driver: str, intervention: bool = False) -> MotionCommand:
    return MotionCommand(0, motion, MotionConfig().twist(motion), driver, intervention=intervention)


def cockpit(driver: str = "keyboard", *, takes: bool = True, clock: Clock | None = None) -> Cockpit:
    """One that nothing has come to yet."""
    clock = clock or Clock()
    by_hand = driver in ("keyboard", "gamepad")
    made = Cockpit("monday", driver, Hand(0.6, clock), takes, by_hand, watch=Watch(clock))
    made.operator = Operator()
    return made


def seen(
    made: Cockpit, clock: Clock, *, motion: MotionClass = MotionClass.LEFT_FORWARD, intervention: bool = False
) -> None:
    """Two seconds of everything."""
    scan, image = first_scan(), picture()
    driver = "keyboard" if intervention else made.driver
    for tick in range(100):
        clock.now_ns = tick * SECOND_NS // 50
        made.watch.observe(Received(0, scan))
        made.watch.observe(Received(0, Odometry(0, Pose2D(0.0, 0.0, 0.0))))
        if tick * 3 % 5 < 3:
            made.watch.observe(Received(0, image))
        if tick % 5 == 0:
            made.watch.observe(Received(0, command(motion, driver, intervention)))
    made.watch.observe(Received(0, OperatorState(0, Gesture.ENABLE, Mode.ACTIVE)))
    made.watch.observe(Received(0, LogEntry(0, LogLevel.INFO, "mark 1: the door", "mark")))
    made.watch.observe(Received(0, LogEntry(0, LogLevel.WARNING, "/camera/image: 2 messages missing before 5 ns")))
    made.watch.tell(PROGRESS)


def recording() -> Recording[None]:
    """One that goes on until its interrupt says otherwise, but was not begun."""
    return Recording(lambda _interrupt: None, Interrupt())


def wanted(made: Cockpit) -> list[Act]:
    return made.control.heard()
