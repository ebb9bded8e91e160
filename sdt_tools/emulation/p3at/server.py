"""The emulated base at work: a thread between a port and the firmware."""

import select
import threading
from collections.abc import Callable
from dataclasses import dataclass
from time import monotonic_ns
from typing import Final

from sdt_tools.clock import SECOND_NS
from sdt_tools.emulation.p3at.body import Body
from sdt_tools.emulation.p3at.faults import Fault, FaultKind, Faults
from sdt_tools.emulation.p3at.firmware import FACTORY, Firmware
from sdt_tools.emulation.p3at.ports import Port
from sdt_tools.emulation.p3at.wire import FaultyWire
from sdt_tools.frames import Pose2D, Twist
from sdt_tools.robot.p3at.settings import BaseSettings

_LOOK_S: Final = 0.005
_WAIT_S: Final = 0.05
_END_S: Final = 2.0


@dataclass(frozen=True)
class Emulated:
    """How the emulated base fared."""

    packets_received: int
    watchdog_stops: int
    pose: Pose2D
    velocity: Twist
    motors_on: bool

    def document(self) -> dict[str, object]:
        """For machines."""
        pose, velocity = self.pose, self.velocity
        return {
            "packets_received": self.packets_received,
            "watchdog_stops": self.watchdog_stops,
            "motors_on": self.motors_on,
            "pose": {"x_m": pose.x_m, "y_m": pose.y_m, "yaw_rad": pose.yaw_rad},
            "velocity": {"linear_mps": velocity.linear_mps, "angular_radps": velocity.angular_radps},
        }


class EmulatedP3at:
    """A base that is there from now on until ``close``. ``faults`` may be switched meanwhile."""

    def __init__(
        self,
        port: Port,
        planned: tuple[Fault, ...] = (),
        body: Body | None = None,
        settings: BaseSettings = FACTORY,
        seed: int = 0,
    ) -> None:
        self.faults = Faults(planned)
        self._port = port
        self._start_ns = monotonic_ns()
        self._firmware = Firmware(self.faults, body, settings, self._start_ns)
        self._wire = FaultyWire(self.faults, seed)
        self._is_on = True
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run, name="emulated-p3at", daemon=True)
        self._thread.start()

    @property
    def address(self) -> str:
        """What a driver is given to reach it."""
        return self._port.address

    @property
    def report(self) -> Emulated:
        """How it fares now."""
        firmware = self._firmware
        pose, motors = firmware.body.pose, firmware.motors
        return Emulated(firmware.received, firmware.watchdog_stops, pose, motors.velocity, motors.on)

    def wait(self, seconds: float | None, ended: Callable[[], bool]) -> None:
        """Until ``seconds`` have passed, where there are any, or ``ended``."""
        until_ns = None if seconds is None else self._start_ns + round(seconds * SECOND_NS)
        while not ended() and (until_ns is None or monotonic_ns() < until_ns):
            self._ended.wait(_WAIT_S)

    def close(self) -> None:
        """End. May be called twice."""
        self._ended.set()
        self._thread.join(_END_S)
        self._port.close()

    def __enter__(self) -> "EmulatedP3at":
        return self

    def __exit__(self, *exception: object) -> None:
        self.close()

    def _run(self) -> None:
        while not self._ended.is_set():
            select.select(self._port.waits_on(), [], [], _LOOK_S)
            now_ns = monotonic_ns()
            at_s = (now_ns - self._start_ns) / SECOND_NS
            self._obey_the_switch(now_ns, at_s)
            data = self._port.read() if self._is_on else b""
            packets = self._firmware.receive(data, now_ns) if data else []
            for packet in [*packets, *self._firmware.advance(now_ns)]:
                self._wire.put(packet, now_ns, at_s)
            for piece in self._wire.take(now_ns, at_s):
                self._port.write(piece)

    def _obey_the_switch(self, now_ns: int, at_s: float) -> None:
        off = self.faults.value(FaultKind.POWER, at_s) is not None
        if off and self._is_on:
            self._port.switch_off()
            self._wire.clear()
            self._firmware.switch_on(now_ns)  # its motors are off and it knows of no session
        elif not off and not self._is_on:
            self._port.switch_on()
            self._firmware.switch_on(now_ns)
        self._is_on = not off
