"""The scene as a source of messages, and as a thing to command."""

from collections.abc import Iterator
from dataclasses import replace
from queue import SimpleQueue
from typing import Final, Protocol, runtime_checkable

import numpy as np

from sdt_tools.clock import FAST_EPOCH_NS, SECOND_NS
from sdt_tools.frames import (
    RAYS,
    Gesture,
    LidarScan,
    LogEntry,
    LogLevel,
    Message,
    Odometry,
    OperatorPose,
    OperatorState,
    Pose2D,
    RawPicture,
    Received,
    Twist,
)
from sdt_tools.protocols import SourceInfo
from sdt_tools.scene.config import PHYSICS_HZ, SceneConfig
from sdt_tools.scene.expert import SceneExpert
from sdt_tools.scene.layout import Layout, lidar_mount
from sdt_tools.scene.raycast import cast_rays
from sdt_tools.scene.seeds import Stream, generator
from sdt_tools.scene.sensor import SensorModel
from sdt_tools.scene.world import World

_STEP_NS: Final = SECOND_NS // PHYSICS_HZ


@runtime_checkable
class Film(Protocol):
    """A camera at work in a world (``film.SceneFilm``; apart, because pictures need much that scans do not)."""

    def introduction(self) -> Iterator[Message]:
        """Where the camera is, and its lens."""
        ...

    def pictures(self, now_ns: int, robot_before: Pose2D, operator_before: Pose2D) -> Iterator[Message | RawPicture]:
        """The pictures due since the last call, and at each one's stamp what the operator shows."""
        ...


class SceneSource:
    """Plays ``layout``: what its sensors say, in order, and the truth beside it.

    Implements Source, Actuator and Gesturing.

    Nothing is delayed: every message is received at its own stamp. Scans and poses come at the scan rate, images at the
    image rate, the operator's state with every image, when it changes, and once a second.
    """

    def __init__(
        self, layout: Layout, config: SceneConfig | None = None, camera: bool = False, start_ns: int = FAST_EPOCH_NS
    ) -> None:
        self.world = World(layout, config)
        self.expert = SceneExpert(self.world)
        self._config = self.world.config
        self._start_ns = start_ns
        self._twist = Twist(0.0, 0.0)
        self._sensor = SensorModel(
            self._config.sensor, generator(layout.seed, Stream.SENSOR), self._config.rates.scan_hz
        )
        self._film = _film(self.world, start_ns) if camera else None
        self._ticks = 0
        self._scans = 0
        self._state: OperatorState | None = None
        self._ended_at_s: float | None = None
        self._touched = False
        self._asked: SimpleQueue[Gesture] = SimpleQueue()

    @property
    def info(self) -> SourceInfo:
        """The scenario, its seed, and what is simulated."""
        devices = {"lidar": "simulated SICK LMS1xx", "base": "simulated Pioneer P3-AT"}
        if self._film is not None:
            devices["camera"] = "simulated RGB camera"
        layout = self.world.layout
        return SourceInfo("scene", layout.name, layout.seed, devices)

    @property
    def start_ns(self) -> int:
        """When the scene starts."""
        return self._start_ns

    @property
    def finished(self) -> bool:
        """Whether the time is up, something was touched, or the operator has ended his path ``linger_s`` ago."""
        world = self.world
        if self._touched and self._config.stop_at_contact:
            return True
        lingered = self._ended_at_s is not None and world.time_s - self._ended_at_s >= self._config.linger_s
        return lingered or world.time_s >= world.layout.timeout_s

    def command(self, twist: Twist) -> None:
        """Drive with ``twist`` from now on."""
        self._twist = twist

    def show(self, gesture: Gesture) -> None:
        """Have the operator show ``gesture`` at the next tick. May be called from any thread."""
        self._asked.put(gesture)

    def close(self) -> None:
        """A scene holds nothing open."""

    def read(self, until_ns: int) -> Iterator[Received | RawPicture]:
        """Move the world on to ``until_ns`` and yield what is sensed on the way."""
        while not self.finished and (now_ns := self._start_ns + self._ticks * _STEP_NS) <= until_ns:
            for sensed in self._tick(now_ns):
                yield sensed if isinstance(sensed, RawPicture) else Received(sensed.stamp_ns, sensed)

    def _tick(self, now_ns: int) -> Iterator[Message | RawPicture]:
        """Advance to the tick at ``now_ns`` and say what has been sensed since the last one."""
        world = self.world
        while not self._asked.empty():  # nobody else takes
            world.show(self._asked.get())
        robot_before, operator_before = world.robot, world.operator
        if self._ticks == 0:
            yield from self._introduction()
        else:
            world.step(self._twist)
        self._ticks += 1
        if world.operator_done and self._ended_at_s is None:
            self._ended_at_s = world.time_s
        if self._film is not None:
            yield from self._film.pictures(now_ns, robot_before, operator_before)
        if self._scan_is_due(now_ns):
            yield self._scan(now_ns)
            yield Odometry(now_ns, world.robot)
            yield OperatorPose(now_ns, world.operator)
        yield from self._operator_state(now_ns)
        if world.contact is not None and not self._touched:
            self._touched = True
            yield LogEntry(now_ns, LogLevel.WARNING, f"the robot touched {world.contact}", "scene")

    def _introduction(self) -> Iterator[Message]:
        yield lidar_mount(self._start_ns)
        if self._film is not None:
            yield from self._film.introduction()

    def _scan_is_due(self, now_ns: int) -> bool:
        due_ns = self._start_ns + round(self._scans * SECOND_NS / self._config.rates.scan_hz)
        if due_ns > now_ns:
            return False
        self._scans += 1
        return True

    def _scan(self, now_ns: int) -> LidarScan:
        world, pose = self.world, self.world.lidar_pose
        true_ranges_m = np.empty(RAYS)
        cast_rays(pose.x_m, pose.y_m, pose.yaw_rad, world.segments, world.circles, true_ranges_m)
        return LidarScan(now_ns, self._sensor.measure(true_ranges_m))

    def _operator_state(self, now_ns: int) -> Iterator[Message]:
        """His gesture and what he has asked for, when one of them changes and once a second."""
        world, old = self.world, self._state
        state = world.operator_state(now_ns, world.time_s)
        if old is None or replace(old, stamp_ns=now_ns) != state or now_ns - old.stamp_ns >= SECOND_NS:
            self._state = state
            yield state


def _film(world: World, start_ns: int) -> Film:
    from sdt_tools.scene.film import SceneFilm

    return SceneFilm(world, start_ns)
