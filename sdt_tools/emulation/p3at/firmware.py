"""What the emulated base's controller does with commands and with time; no sockets, and no clock of its own.

Sources: Pioneer 3 Operations Manual, "Client-server connection", "Robots in motion", "Watchdogs".
"""

import math
from typing import Final

from sdt_tools.clock import SECOND_NS
from sdt_tools.emulation.p3at.body import Body, FreeBody
from sdt_tools.emulation.p3at.faults import FaultKind, Faults
from sdt_tools.emulation.p3at.motors import REST, Motors
from sdt_tools.frames import Twist
from sdt_tools.robot.p3at.commands import Code, Command, decode, wheels_of
from sdt_tools.robot.p3at.packets import PacketSplitter, packet
from sdt_tools.robot.p3at.settings import BaseSettings, encode_settings
from sdt_tools.robot.p3at.status import Status, encode_status

FACTORY: Final = BaseSettings(
    kind="Pioneer",
    model="p3at-sh",
    serial="EMULATED",
    name="emulated",
    turn_top_dps=140,
    speed_top_mmps=750,
    cycle_ms=100,
    low_battery_v=11.5,
    watchdog_ms=2000,
)
_STEP_NS: Final = 20_000_000
_FULL_V: Final = 12.8
_HALF_TRACK_M: Final = 1.0 / (0.0034 * 1000)
"""Half the distance of the wheels as the skidding base turns: 1 / DiffConvFactor of ARIA's p3at-sh."""
_STEPS_A_TURN: Final = 4096
_SYNCS: Final = (0, 1, 2)


class Firmware:
    """The controller of a P3-AT. ``receive`` takes bytes, ``advance`` lets time pass; both give packets to send.

    The watchdog stops the base when no packet has come for its time, and as in the real one, what was commanded last
    goes on with the next packet, whichever it is. Closing the session ends that too. Times are nanoseconds of one
    monotonic clock, beginning at ``start_ns``.
    """

    def __init__(
        self,
        faults: Faults,
        body: Body | None = None,
        settings: BaseSettings = FACTORY,
        start_ns: int = 0,
    ) -> None:
        self.settings = settings
        self.body: Body = FreeBody() if body is None else body
        self.motors = Motors()
        self.received = 0
        self.watchdog_stops = 0
        self._faults = faults
        self._start_ns = start_ns
        self._now_ns = start_ns
        self.switch_on(start_ns)

    def switch_on(self, now_ns: int) -> None:
        """Begin as after power-up: no session, standing, its odometry at the origin."""
        self.motors = Motors()
        self.is_open = False
        self._splitter = PacketSplitter()
        self._synchronised = 0
        self._button = False
        self._sonar_on = True
        self._watched_off = False
        self._origin = self.body.pose
        self._heard_ns = self._now_ns = self._told_ns = now_ns

    @property
    def velocity(self) -> Twist:
        """How the base moves now."""
        return self.motors.velocity

    def receive(self, data: bytes, now_ns: int) -> list[bytes]:
        """Obey; the packets that answer."""
        answers = []
        for body in self._splitter.feed(data):
            self.received += 1
            self._heard_ns = now_ns
            self._watched_off = False
            command = decode(body)
            if command is not None:
                answers += self._obey(command, body)
        return answers

    def advance(self, now_ns: int) -> list[bytes]:
        """Move on to ``now_ns``; the status packets that were due on the way."""
        told = []
        while self._now_ns + _STEP_NS <= now_ns:
            self._now_ns += _STEP_NS
            self._step()
            if self.is_open and self._now_ns - self._told_ns >= self.settings.cycle_ms * 1_000_000:
                self._told_ns = self._now_ns
                told.append(packet(encode_status(self.status)))
        return told

    @property
    def status(self) -> Status:
        """What the base says of itself."""
        x_mm, y_mm, yaw_rad = self._odometry()
        velocity, stalled = self.velocity, self._trouble(FaultKind.STALL)
        wheel_mps = velocity.angular_radps * _HALF_TRACK_M
        return Status(
            x=round(x_mm) & 0x7FFF,
            y=round(y_mm) & 0x7FFF,
            heading=round(yaw_rad / (2 * math.pi) * _STEPS_A_TURN),
            left_mmps=round((velocity.linear_mps - wheel_mps) * 1000),
            right_mmps=round((velocity.linear_mps + wheel_mps) * 1000),
            battery_v=self._faults.value(FaultKind.BATTERY, self._at_s) or _FULL_V,
            left_stalled=stalled,
            right_stalled=stalled,
            front_bumpers=0b00100 * self._trouble(FaultKind.FRONT_BUMPER),
            rear_bumpers=0b00100 * self._trouble(FaultKind.REAR_BUMPER),
            motors_on=self.motors.on,
            button_pressed=self._button,
            moving=velocity != REST,
            sonar_on=self._sonar_on,
        )

    @property
    def _at_s(self) -> float:
        return (self._now_ns - self._start_ns) / SECOND_NS

    def _trouble(self, kind: FaultKind) -> bool:
        return self._faults.value(kind, self._at_s) is not None

    def _odometry(self) -> tuple[float, float, float]:
        """Where the body is from where the counters began, in mm and rad."""
        pose, origin = self.body.pose, self._origin
        x_m, y_m = pose.x_m - origin.x_m, pose.y_m - origin.y_m
        cos, sin = math.cos(origin.yaw_rad), math.sin(origin.yaw_rad)
        yaw_rad = math.remainder(pose.yaw_rad - origin.yaw_rad, 2 * math.pi)
        return 1000 * (cos * x_m + sin * y_m), 1000 * (cos * y_m - sin * x_m), yaw_rad

    def _step(self) -> None:
        watchdog_ns = self.settings.watchdog_ms * 1_000_000
        if not self._watched_off and watchdog_ns and self._now_ns - self._heard_ns >= watchdog_ns:
            self._watched_off = True
            self.watchdog_stops += self.motors.goal != REST
        if self._trouble(FaultKind.BUTTON):
            self._button = True
            self.motors.on = False
            self.motors.goal = REST
        goal = REST if self._watched_off or self._trouble(FaultKind.STALL) else self.motors.goal
        self.body.move(self.motors.step(goal, _STEP_NS / SECOND_NS), _STEP_NS / SECOND_NS)

    def _obey(self, command: Command, body: bytes) -> list[bytes]:
        if not self.is_open:
            return self._synchronise(command, body)
        argument, motors = command.argument or 0, self.motors
        match command.code:
            case Code.CLOSE:
                motors.goal, motors.on = REST, False
                self.is_open, self._synchronised = False, 0
            case Code.ENABLE:
                motors.on = bool(argument) and not self._trouble(FaultKind.BUTTON)
                self._button = self._button and not motors.on
                motors.goal = REST
            case Code.VEL:
                motors.goal = Twist(argument / 1000, motors.goal.angular_radps)
            case Code.RVEL:
                motors.goal = Twist(motors.goal.linear_mps, math.radians(argument))
            case Code.VEL2:
                left_mps, right_mps = wheels_of(argument)
                motors.goal = Twist((left_mps + right_mps) / 2, (right_mps - left_mps) / 2 / _HALF_TRACK_M)
            case Code.STOP:
                motors.goal = REST
            case Code.ESTOP:
                motors.stop_hard()
            case Code.SONAR:
                self._sonar_on = bool(argument)
            case Code.SETO:
                self._origin = self.body.pose
            case Code.CONFIG:
                return [packet(encode_settings(self.settings))]
            case _:
                self._set(command.code, argument)
        return []

    def _set(self, code: int, argument: int) -> None:
        """The settings that last for a session: speeds, and by the argument's sign accelerations."""
        motors = self.motors
        if code == Code.SETV:
            motors.max_mps = min(argument, self.settings.speed_top_mmps) / 1000
        elif code == Code.SETRV:
            motors.max_radps = math.radians(min(argument, self.settings.turn_top_dps))
        elif code == Code.SETA and argument > 0:
            motors.accelerate_mps2 = argument / 1000
        elif code == Code.SETA and argument < 0:
            motors.brake_mps2 = -argument / 1000
        elif code == Code.SETRA and argument > 0:
            motors.turn_up_radps2 = math.radians(argument)
        elif code == Code.SETRA and argument < 0:
            motors.turn_down_radps2 = math.radians(-argument)

    def _synchronise(self, command: Command, body: bytes) -> list[bytes]:
        """Echo 0, 1 and 2 in turn, the last with the base's name; then wait for OPEN."""
        if self._synchronised == len(_SYNCS):
            if command.code == Code.OPEN:
                self.is_open = True
                self._told_ns = self._now_ns
            return []
        if command.code != _SYNCS[self._synchronised]:
            self._synchronised = 1 if command.code == 0 else 0
            return [packet(body)] if command.code == 0 else []
        self._synchronised += 1
        if command.code != _SYNCS[-1]:
            return [packet(body)]
        texts = (self.settings.name, self.settings.kind, self.settings.model)
        return [packet(bytes([_SYNCS[-1]]) + b"".join(text.encode("latin-1") + b"\0" for text in texts))]
