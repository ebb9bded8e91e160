"""Somebody else's LiDAR and base, as their package would bring them: good ones, and some with a fault each."""

import math
import threading
import time
from collections import deque

import numpy as np

from sdt_tools.clock import HostClock
from sdt_tools.config import Config
from sdt_tools.emergency import EmergencyStop
from sdt_tools.errors import DeviceError
from sdt_tools.frames import RAYS, LidarScan, Odometry, Pose2D, Received, Twist


class WhirlConfig(Config):
    scan_hz: float = 50.0
    plugged: bool = True


class Whirl:
    """A LiDAR in a round room of 2.5 m, with a post on the left; two rays never return."""

    config_model = WhirlConfig

    def __init__(self, config: WhirlConfig, *, clock: HostClock) -> None:
        if not config.plugged:
            raise DeviceError("whirl: nothing is plugged in; plug it in")
        self._config, self._clock = config, clock
        self._arrived: deque[Received] = deque()
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._run, name="whirl", daemon=True)
        self._thread.start()

    def read(self, until_ns: int) -> list[Received]:
        given = []
        while self._arrived and self._arrived[0].received_ns <= until_ns:
            given.append(self._arrived.popleft())
        return given

    def close(self) -> None:
        self._closing.set()
        self._thread.join()

    def _run(self) -> None:
        random = np.random.default_rng(0)
        while not self._closing.wait(1 / self._config.scan_hz):
            now_ns = self._clock.now_ns()
            self._arrived.append(Received(now_ns, LidarScan(now_ns - 5_000_000, self._ranges_m(random))))

    def _ranges_m(self, random: np.random.Generator) -> np.ndarray:
        ranges_m = 2.5 + random.normal(0.0, 0.01, RAYS)
        ranges_m[360:370] = 0.7
        ranges_m[[10, 530]] = (0.0, 0.002)
        return ranges_m


class Blocking(Whirl):
    def read(self, until_ns: int) -> list[Received]:
        time.sleep(0.02)
        return super().read(until_ns)


class Greedy(Whirl):
    def read(self, until_ns: int) -> list[Received]:
        return super().read(1 << 62)


class Millimetres(Whirl):
    def _ranges_m(self, random: np.random.Generator) -> np.ndarray:
        return 1000 * super()._ranges_m(random)


class Clinging(Whirl):
    """Its thread goes on, and closing it again fails."""

    def close(self) -> None:
        if getattr(self, "closed", False):
            raise ValueError("closed already")
        self.closed = True


class Failing(Whirl):
    def __init__(self, config: WhirlConfig, *, clock: HostClock) -> None:
        raise ZeroDivisionError("division by zero")


class CartConfig(Config):
    command_lasts_s: float = 0.5


class Cart:
    """A base that moves at once."""

    config_model = CartConfig

    def __init__(self, config: CartConfig, *, emergency: EmergencyStop, clock: HostClock) -> None:
        self._config, self._clock, self._emergency = config, clock, emergency
        self._arrived: deque[Received] = deque()
        self._twist, self._since_ns = Twist(0.0, 0.0), 0
        self._x_m = self._yaw_rad = self._y_m = 0.0
        self._closing = threading.Event()
        emergency.tell(lambda _: self.command(Twist(0.0, 0.0)))
        self._thread = threading.Thread(target=self._run, name="cart", daemon=True)
        self._thread.start()

    def command(self, twist: Twist) -> None:
        is_a_number = math.isfinite(twist.linear_mps) and math.isfinite(twist.angular_radps)
        stands = bool(self._emergency.reason) or not is_a_number
        self._twist, self._since_ns = (Twist(0.0, 0.0) if stands else twist), self._clock.now_ns()

    def read(self, until_ns: int) -> list[Received]:
        given = []
        while self._arrived and self._arrived[0].received_ns <= until_ns:
            given.append(self._arrived.popleft())
        return given

    def close(self) -> None:
        self._closing.set()
        self._thread.join()

    def _lasts(self, now_ns: int) -> bool:
        return now_ns - self._since_ns < self._config.command_lasts_s * 1e9

    def _run(self) -> None:
        before_ns = self._clock.now_ns()
        while not self._closing.wait(0.05):
            now_ns = self._clock.now_ns()
            step_s, before_ns = (now_ns - before_ns) / 1e9, now_ns
            if self._lasts(now_ns):
                self._x_m += math.cos(self._yaw_rad) * self._twist.linear_mps * step_s
                self._y_m += math.sin(self._yaw_rad) * self._twist.linear_mps * step_s
                self._yaw_rad += self._twist.angular_radps * step_s
            pose = Pose2D(self._x_m, self._y_m, self._yaw_rad)
            self._arrived.append(Received(now_ns, Odometry(now_ns, pose)))


class Runaway(Cart):
    """It goes on with what it was told last, and turns the wrong way."""

    def _lasts(self, now_ns: int) -> bool:
        return True

    def command(self, twist: Twist) -> None:
        super().command(Twist(twist.linear_mps, -twist.angular_radps))
