"""How the P3-AT is reached, and how it is driven."""

import math
from typing import Final

from pydantic import Field

from sdt_tools.config import Config
from sdt_tools.robot.limits import SpeedLimits

TCP_PORT: Final = 8101
"""Where simulators and serial bridges of these bases listen."""


class P3atConfig(Config):
    """One base.

    ``address``: a serial port (``/dev/ttyUSB0``) or ``socket://HOST:PORT``. ``refresh_s``: how often the command is
    sent again; well below the base's own watchdog. ``command_lasts_s``: a motion that nobody has commanded again for
    so long is not sent any more, the last resort against a program that hangs. ``silent_s``: the base speaks ten times
    a second, and when it has not for so long it is told to stand. Accelerations are set for the session alone.

    ``turn_steps``, ``position_scale`` and ``speed_scale`` turn the base's units into turns, mm and mm/s. Without
    ``position_scale`` it is that of the model that the base says it is.
    """

    address: str = "/dev/ttyUSB0"
    baud: int = Field(default=9600, gt=0)
    connect_s: float = Field(default=5.0, gt=0)
    refresh_s: float = Field(default=0.1, gt=0, le=0.5)
    command_lasts_s: float = Field(default=0.5, gt=0)
    silent_s: float = Field(default=0.35, gt=0)
    limits: SpeedLimits = SpeedLimits()
    accelerate_mps2: float = Field(default=0.6, gt=0, le=10)
    brake_mps2: float = Field(default=0.8, gt=0, le=10)
    turn_radps2: float = Field(default=math.radians(100), gt=0, le=20)
    low_battery_v: float = Field(default=11.5, ge=0)
    turn_steps: int = Field(default=4096, gt=0)
    position_scale: float | None = Field(default=None, gt=0)
    speed_scale: float = Field(default=1.0, gt=0)
