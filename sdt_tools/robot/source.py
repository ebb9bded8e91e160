"""The robot as a source of messages: LiDAR, camera and base on one clock, in the order in which the host had them."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from dataclasses import replace

from sdt_tools.clock import HostClock
from sdt_tools.emergency import EmergencyStop
from sdt_tools.frames import LogEntry, Message, RawPicture, Received
from sdt_tools.protocols import SourceInfo
from sdt_tools.robot.camera.camera import Camera
from sdt_tools.robot.config import RobotConfig
from sdt_tools.robot.lms1xx.driver import Lms1xx
from sdt_tools.robot.mounting import camera_calibration, camera_transform, lidar_transform
from sdt_tools.robot.p3at.base import OnSent, P3atBase

Voice = Callable[[], Sequence[LogEntry]]
"""Says what is new for the session log."""


class RobotSource:
    """The devices of ``config``, open until ``close``. Implements Source; ``base`` is what to command, if there is one.

    ``emergency`` is shared with the base; ``on_sent`` is told when a command is on its wire. The calibration follows
    the first picture, whose size it depends on, and every change of size. Raises DeviceError where a device that the
    configuration names cannot be had; then none is left open.
    """

    def __init__(
        self,
        config: RobotConfig,
        clock: HostClock | None = None,
        emergency: EmergencyStop | None = None,
        on_sent: OnSent | None = None,
    ) -> None:
        self._config = config
        self._clock = HostClock() if clock is None else clock
        self._voices: list[Voice] = []
        with ExitStack() as opened:  # the LiDAR, whose clock is to be learnt, last: nobody waits for it with old data
            self.base = None
            if config.base is not None:
                self.base = opened.enter_context(P3atBase(config.base, emergency, self._clock, on_sent))
            self._camera = None
            if config.camera is not None:
                self._camera = opened.enter_context(Camera(config.camera, self._clock))
            self.lidar = Lms1xx(config.lidar, self._clock)
            opened.callback(self.lidar.close)
            self._opened = opened.pop_all()
        self._info = SourceInfo("robot", devices=self._devices())
        self._start_ns = self._clock.now_ns()
        self._picture_shape: tuple[int, ...] = ()
        self._early: list[Received | RawPicture] = []
        self._last_ns = self._start_ns

    @property
    def info(self) -> SourceInfo:
        """A robot, and its devices as they name themselves."""
        return self._info

    @property
    def start_ns(self) -> int:
        """When it was begun; before that, when all devices were there."""
        return self._start_ns

    @property
    def finished(self) -> bool:
        """Never."""
        return False

    def begin(self) -> None:
        """Start now: what devices have said before is said now, and what they have sensed before is forgotten."""
        self._start_ns = self._clock.now_ns()
        if self._camera is not None:
            self._camera.forget()
        self._early = self._introduction()

    def hear(self, voice: Voice) -> None:
        """Have what ``voice`` says among the messages."""
        self._voices.append(voice)

    def read(self, until_ns: int) -> Iterator[Received | RawPicture]:
        """What came up to ``until_ns``. Raises RunError where a device's thread has failed."""
        sensed, self._early = self._early, []
        sensed += self.lidar.read(until_ns)
        if self._camera is not None:
            sensed += self._camera.read(until_ns)
        if self.base is not None:
            sensed += self.base.read(until_ns)
        sensed += [Received(min(entry.stamp_ns, until_ns), entry) for voice in self._voices for entry in voice()]
        for one in sorted(sensed, key=lambda one: one.received_ns):
            self._last_ns = max(self._last_ns, one.received_ns)
            if isinstance(one, RawPicture):
                yield from self._calibration(one)
            # what a thread has stamped and handed over a moment later still comes in order
            yield one if one.received_ns == self._last_ns else replace(one, received_ns=self._last_ns)

    def close(self) -> None:
        """The base first: it stands. May be called twice."""
        if self.base is not None:
            self.base.close()
        self._opened.close()

    def _introduction(self) -> list[Received | RawPicture]:
        """Where the devices stand, and what they have said so far; what they have sensed so far is old."""
        now_ns, mounting = self._start_ns, self._config.mounting
        said: list[Message] = [lidar_transform(mounting.lidar, now_ns)]
        if self._camera is not None:
            said.append(camera_transform(mounting.camera, now_ns))
        heard = [one.message for one in self.read(now_ns) if isinstance(one, Received)]
        said += [replace(message, stamp_ns=now_ns) for message in heard if isinstance(message, LogEntry)]
        self._picture_shape = ()
        return [Received(now_ns, message) for message in said]

    def _calibration(self, picture: RawPicture) -> Iterator[Received]:
        height_px, width_px = picture.image_bgr_u8.shape[:2]
        if self._picture_shape != (height_px, width_px):
            self._picture_shape = (height_px, width_px)
            mount = self._config.mounting.camera
            yield Received(self._last_ns, camera_calibration(mount, width_px, height_px, picture.stamp_ns))

    def _devices(self) -> dict[str, str]:
        lidar, status = self._config.lidar, self.lidar.status
        devices = {"lidar": f"SICK {status.identity} at {lidar.host}:{lidar.port}, {status.dialect.label}"}
        if self._config.camera is not None:
            devices["camera"] = self._config.camera.source
        if self.base is not None and self._config.base is not None:
            session = self.base.session
            devices["base"] = f"{session.kind} {session.model} '{session.name}' at {self._config.base.address}"
        return devices
