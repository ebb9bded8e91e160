"""What goes to the motors now: the last step before the wire, which limits and stops whatever was commanded."""

import math
import threading
from typing import Final

from sdt_tools.clock import SECOND_NS
from sdt_tools.frames import Twist
from sdt_tools.robot.p3at.commands import Code, encode
from sdt_tools.robot.p3at.config import P3atConfig
from sdt_tools.robot.p3at.session import STANDSTILL
from sdt_tools.robot.p3at.status import Status

REST: Final = Twist(0.0, 0.0)


class Wheel:
    """The twist that is wanted, and since when. Commanded by one thread, asked by another.

    Times are of one monotonic clock. It takes commands only while it is ``free``: nothing that was commanded before
    moves the base afterwards.
    """

    def __init__(self, config: P3atConfig) -> None:
        self._config = config
        self._lasts_ns = round(config.command_lasts_s * SECOND_NS)
        self._lock = threading.Lock()
        self._wanted = REST
        self._since_ns = 0
        self._free = False

    def hold(self) -> None:
        """Stand, and take no commands until ``free``."""
        with self._lock:
            self._free, self._wanted = False, REST

    def free(self) -> None:
        """Stand, and take commands."""
        with self._lock:
            self._free, self._wanted = True, REST

    def command(self, twist: Twist, now_ns: int) -> None:
        """Drive with ``twist`` from now on, where commands are taken."""
        with self._lock:
            if self._free:
                self._wanted, self._since_ns = twist, now_ns

    @property
    def turns(self) -> bool:
        """Whether a motion is wanted."""
        return self._wanted != REST

    def expires(self, now_ns: int) -> bool:
        """Whether the motion that is wanted has just become too old; it is dropped then."""
        with self._lock:
            if self._wanted == REST or now_ns - self._since_ns <= self._lasts_ns:
                return False
            self._wanted = REST
            return True

    def packets(self, status: Status | None) -> bytes:
        """The packets that drive so: within the limits, and not on against a bumper that is touched."""
        with self._lock:
            twist = self._wanted if self._free else REST
        limits, speed = self._config.limits, self._config.limits.within(twist).linear_mps
        if status is not None and ((speed > 0 and status.front_bumpers) or (speed < 0 and status.rear_bumpers)):
            speed = 0.0
        if twist == REST:
            return b"".join(STANDSTILL)
        turn_dps = math.degrees(limits.within(twist).angular_radps)
        most_dps = math.floor(math.degrees(limits.turn_radps) + 1e-9)
        turn = max(-most_dps, min(most_dps, round(turn_dps)))
        scaled = int(speed * 1000.0 / self._config.speed_scale)  # towards standstill
        return encode(Code.VEL, scaled) + encode(Code.RVEL, turn)
