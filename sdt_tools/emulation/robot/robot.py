"""A whole robot that is not there: three devices at their addresses, and one world behind them."""

from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from threading import Event
from time import monotonic
from typing import Final

from sdt_tools.clock import HostClock
from sdt_tools.emulation.camera.faults import KINDS as CAMERA_KINDS
from sdt_tools.emulation.camera.server import EmulatedCamera
from sdt_tools.emulation.faults import Fault, parse_fault
from sdt_tools.emulation.lms1xx.config import EmulatedConfig
from sdt_tools.emulation.lms1xx.emulator import EmulatedLms1xx
from sdt_tools.emulation.lms1xx.fault_kinds import KINDS as LIDAR_KINDS
from sdt_tools.emulation.lms1xx.faults import Faults
from sdt_tools.emulation.lms1xx.plan import FaultPlan
from sdt_tools.emulation.p3at.faults import KINDS as BASE_KINDS
from sdt_tools.emulation.p3at.firmware import FACTORY
from sdt_tools.emulation.p3at.ports import TcpPort
from sdt_tools.emulation.p3at.server import EmulatedP3at
from sdt_tools.emulation.robot.world import EmulatedWorld
from sdt_tools.errors import UsageError
from sdt_tools.protocols import Observer
from sdt_tools.robot.camera.config import CameraConfig
from sdt_tools.robot.config import RobotConfig
from sdt_tools.robot.lms1xx.config import Lms1xxConfig
from sdt_tools.robot.p3at.config import P3atConfig

_LOOK_S: Final = 0.02
_KINDS: Final = {"lidar": LIDAR_KINDS, "base": BASE_KINDS, "camera": CAMERA_KINDS}


@dataclass(frozen=True)
class Places:
    """Where the devices listen; port 0 takes a free one. Without ``camera_port`` there is no camera."""

    host: str = "127.0.0.1"
    lidar_port: int = 2111
    base_port: int = 8101
    camera_port: int | None = 8080
    protocol: str = "a"
    watchdog_ms: int = FACTORY.watchdog_ms


@dataclass(frozen=True)
class DeviceFaults:
    """The faults that are planned for each device."""

    lidar: tuple[Fault, ...] = ()
    base: tuple[Fault, ...] = ()
    camera: tuple[Fault, ...] = ()


def parse_device_faults(texts: Sequence[str]) -> DeviceFaults:
    """Faults as ``DEVICE:KIND…``. Raises UsageError where a text is none."""
    found: dict[str, tuple[Fault, ...]] = {}
    for text in texts:
        device, _, fault = text.partition(":")
        if device not in _KINDS:
            raise UsageError(f"fault '{text}': write the device before it, as base:power@5-8; {', '.join(_KINDS)}")
        found[device] = (*found.get(device, ()), parse_fault(fault, _KINDS[device]))
    return DeviceFaults(**found)


class EmulatedRobot:
    """LiDAR, base and camera in ``world``, which is closed with them, until ``close``.

    Raises DeviceError, UsageError where a port is taken.
    """

    def __init__(
        self,
        world: EmulatedWorld,
        places: Places | None = None,
        faults: DeviceFaults | None = None,
        clock: HostClock | None = None,
        seed: int = 0,
    ) -> None:
        places, faults = places or Places(), faults or DeviceFaults()
        self.world = world
        self._host = places.host
        with ExitStack() as opened:
            opened.callback(world.close)
            device = EmulatedConfig(host=places.host, port=places.lidar_port, protocol=places.protocol)  # type: ignore[arg-type] # checked there
            self.lidar = opened.enter_context(EmulatedLms1xx(world, device, Faults(seed=seed), clock))
            self.lidar_faults = opened.enter_context(FaultPlan(self.lidar, faults.lidar, seed)).faults
            port = TcpPort(places.host, places.base_port)
            settings = replace(FACTORY, watchdog_ms=places.watchdog_ms)
            self.base = opened.enter_context(EmulatedP3at(port, faults.base, world, settings, seed))
            self.camera = None
            if places.camera_port is not None:
                self.camera = opened.enter_context(
                    EmulatedCamera(world, places.host, places.camera_port, planned=faults.camera, seed=seed)
                )
            self._opened = opened.pop_all()

    @property
    def config(self) -> RobotConfig:
        """What a driver of this robot is to be told."""
        return RobotConfig(
            lidar=Lms1xxConfig(host=self._host, port=self.lidar.port),
            camera=None if self.camera is None else CameraConfig(source=self.camera.url),
            base=P3atConfig(address=self.base.address),
        )

    def wait_for_client(self, ended: Callable[[], bool], patience_s: float | None = None) -> bool:
        """Until somebody has scans sent to him, so that the world may begin; False where ``ended``, or out of time."""
        until_s = float("inf") if patience_s is None else monotonic() + patience_s
        pause = Event()
        while not self.lidar.streams:
            if ended() or monotonic() >= until_s:
                return False
            pause.wait(_LOOK_S)
        return True

    def begin(self, observers: Sequence[Observer] = ()) -> None:
        """Let the operator walk."""
        self.world.begin(observers)

    def close(self) -> None:
        """Switch all off. May be called twice."""
        self._opened.close()

    def __enter__(self) -> "EmulatedRobot":
        return self

    def __exit__(self, *exception: object) -> None:
        self.close()
