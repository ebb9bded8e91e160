"""One simulated world behind all emulated devices: the base moves in it, the LiDAR and the camera see it."""

import threading
from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np
from jaxtyping import Float64, UInt8

from sdt_tools.clock import FAST_EPOCH_NS, HostClock
from sdt_tools.frames import Gesture, LidarScan, Pose2D, Received, Twist
from sdt_tools.protocols import Observer
from sdt_tools.scene.camera import SceneCamera
from sdt_tools.scene.config import SceneConfig
from sdt_tools.scene.film import between
from sdt_tools.scene.gestures import arms_at
from sdt_tools.scene.layout import Layout
from sdt_tools.scene.source import SceneSource
from sdt_tools.scene.world import STEP_S, World

_FOR_EVER_S: Final = 1e9


class EmulatedWorld:
    """The world of ``layout`` in the host's time, from ``begin`` on; until then it stands still.

    Implements ScanSupply, Body and PictureSupply, each for a thread of its own. Unlike a scenario it has no end: the
    operator stays where his path has ended, and what the robot touches holds it up. ``observers`` see its messages, the
    truth among them, in the thread that moves it on; they must be quick.
    """

    def __init__(
        self, layout: Layout, config: SceneConfig | None = None, clock: HostClock | None = None, camera: bool = True
    ) -> None:
        endless = {"linger_s": _FOR_EVER_S, "stop_at_contact": False}
        self._scene = SceneSource(
            replace(layout, timeout_s=_FOR_EVER_S), (config or SceneConfig()).model_copy(update=endless)
        )
        self._clock = HostClock() if clock is None else clock
        self._camera = SceneCamera(layout) if camera else None
        self._frame = 0
        self._observers: tuple[Observer, ...] = ()
        self._lock = threading.Lock()
        self._began_ns: int | None = None
        self._ranges_m: Float64[np.ndarray, "rays"] = np.zeros(0)
        self._before = (self._scene.world.robot, self._scene.world.operator)
        self._read(FAST_EPOCH_NS)
        if self._camera is not None:
            self.picture_at(0)  # compiled now, and not when somebody waits for it

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

    def picture_at(self, host_ns: int) -> UInt8[np.ndarray, "height width 3"]:
        """What the camera sees then, from between the world's last two steps."""
        assert self._camera is not None
        with self._lock:
            self._advance(host_ns)
            world = self._scene.world
            robot_before, operator_before = self._before
            robot, operator = world.robot, world.operator
            time_s, gait = world.time_s, (world.gait_phase, world.gait_amplitude)
            if self._began_ns is not None:
                time_s = min(max((host_ns - self._began_ns) / 1e9, time_s - STEP_S), time_s + STEP_S)
            gestures = tuple(world.gestures)
        share = min(max((time_s - world.time_s) / STEP_S, 0.0), 1.0)
        arms = arms_at(gestures, world.layout.behaviours, time_s)
        self._frame += 1
        return self._camera.render(
            between(robot_before, robot, share),
            between(operator_before, operator, share),
            *gait,
            arms.makes,
            arms.share,
            time_s,
            self._frame,
            arms.manner,
        )

    def _advance(self, host_ns: int) -> None:
        if self._began_ns is not None:
            self._read(FAST_EPOCH_NS + host_ns - self._began_ns)

    def _read(self, until_ns: int) -> None:
        world = self._scene.world
        before = (world.robot, world.operator)
        steps = world.steps
        for sensed in self._scene.read(until_ns):
            if isinstance(sensed, Received):
                if isinstance(sensed.message, LidarScan):
                    self._ranges_m = sensed.message.ranges_m
                for observer in self._observers:
                    observer.observe(sensed)
        if world.steps > steps:
            self._before = before
