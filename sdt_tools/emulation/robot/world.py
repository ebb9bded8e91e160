"""One simulated world behind all emulated devices: the base moves in it, the LiDAR and the camera see it."""

import threading
from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np
from jaxtyping import Float64

from sdt_tools.clock import FAST_EPOCH_NS, SECOND_NS, HostClock
from sdt_tools.emulation.robot.studio import Shot, Studio
from sdt_tools.frames import Gesture, LidarScan, Pose2D, Received, Twist
from sdt_tools.protocols import Observer
from sdt_tools.scene.config import SceneConfig
from sdt_tools.scene.film import between
from sdt_tools.scene.gestures import arms_at
from sdt_tools.scene.layout import Layout
from sdt_tools.scene.source import SceneSource
from sdt_tools.scene.world import STEP_S, World

_FOR_EVER_S: Final = 1e9


class EmulatedWorld:
    """The world of ``layout`` in the host's time, from ``begin`` on; until then it stands still.

    Implements ScanSupply, Body and PictureSupply, each for a thread of its own; ``close`` it. Unlike a scenario it has
    no end: the operator stays where his path has ended, and what the robot touches holds it up. ``observers`` see its
    messages, the truth among them, in the thread that moves it on; they must be quick.
    """

    def __init__(
        self, layout: Layout, config: SceneConfig | None = None, clock: HostClock | None = None, camera: bool = True
    ) -> None:
        endless = {"linger_s": _FOR_EVER_S, "stop_at_contact": False}
        settings = (config or SceneConfig()).model_copy(update=endless)
        for _ in SceneSource(layout, settings).read(FAST_EPOCH_NS + SECOND_NS):
            pass  # what a world needs is compiled before anybody waits for it
        self._scene = SceneSource(replace(layout, timeout_s=_FOR_EVER_S), settings)
        self._clock = HostClock() if clock is None else clock
        self._studio = Studio(layout) if camera else None
        self._frame = 0
        self._observers: tuple[Observer, ...] = ()
        self._lock = threading.Lock()
        self._began_ns: int | None = None
        self._ranges_m: Float64[np.ndarray, "rays"] = np.zeros(0)
        self._now = self._before = (0, self._scene.world.robot, self._scene.world.operator)
        self._read(FAST_EPOCH_NS)

    @property
    def world(self) -> World:
        """The truth; to be read by observers, or when nothing moves it any more."""
        return self._scene.world

    @property
    def has_begun(self) -> bool:
        """Whether time passes."""
        return self._began_ns is not None

    def begin(self, observers: Sequence[Observer] = ()) -> None:
        """Let time pass from now on."""
        with self._lock:
            self._observers = tuple(observers)
            self._began_ns = self._clock.now_ns()

    def show(self, gesture: Gesture) -> None:
        """Have the operator show ``gesture``."""
        self._scene.show(gesture)

    @property
    def pose(self) -> Pose2D:
        """Where the base is."""
        return self._scene.world.robot

    def move(self, twist: Twist, dt_s: float) -> None:
        """The base's wheels roll with ``twist``."""
        del dt_s  # the host's time it is that passes
        with self._lock:
            self._scene.command(twist)
            self._advance(self._clock.now_ns())

    def ranges_at(self, host_ns: int) -> Float64[np.ndarray, "rays"]:
        """The newest scan at that time."""
        with self._lock:
            self._advance(host_ns)
            return self._ranges_m

    def jpeg_at(self, host_ns: int) -> bytes:
        """What the camera sees a step of the world before that time, which lies between two steps that are known."""
        assert self._studio is not None
        with self._lock:
            self._advance(host_ns)
            world = self._scene.world
            (steps_before, robot_before, operator_before), (steps, robot, operator) = self._before, self._now
            gait = (world.gait_phase, world.gait_amplitude)
            since_s = 0.0 if self._began_ns is None else (host_ns - self._began_ns) / SECOND_NS - STEP_S
            gestures = tuple(world.gestures)
        first_s, last_s = steps_before * STEP_S, steps * STEP_S
        time_s = min(max(since_s, first_s), last_s)  # a step behind, so that it lies between two that are known
        share = 1.0 if last_s == first_s else (time_s - first_s) / (last_s - first_s)
        arms = arms_at(gestures, world.layout.behaviours, time_s)
        self._frame += 1
        shot = Shot(
            between(robot_before, robot, share),
            between(operator_before, operator, share),
            *gait,
            arms.makes,
            arms.share,
            time_s,
            self._frame,
            arms.manner,
        )
        return self._studio.jpeg(shot)

    def close(self) -> None:
        """Render no more. May be called twice."""
        if self._studio is not None:
            self._studio.close()

    def _advance(self, host_ns: int) -> None:
        if self._began_ns is not None:
            self._read(FAST_EPOCH_NS + host_ns - self._began_ns)

    def _read(self, until_ns: int) -> None:
        world = self._scene.world
        for sensed in self._scene.read(until_ns):
            if isinstance(sensed, Received):
                if isinstance(sensed.message, LidarScan):
                    self._ranges_m = sensed.message.ranges_m
                for observer in self._observers:
                    observer.observe(sensed)
        if self._now[0] != world.steps:
            self._before, self._now = self._now, (world.steps, world.robot, world.operator)
