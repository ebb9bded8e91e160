"""What can be set about the LiDAR."""

import re
from typing import Final, Literal

from pydantic import Field, field_validator, model_validator

from sdt_tools.config import Config
from sdt_tools.robot.lms1xx.framing import Dialect
from sdt_tools.robot.lms1xx.settings import ScanSettings

PASSWORDS: Final = {"maintenance": (2, "B21ACE26"), "client": (3, "F4724744"), "service": (4, "81BE23AA")}
"""Level and hash of the passwords that devices are delivered with (SICK, *Telegram Listing*, 8014631, "Log in")."""
_CLIENT_LEVEL: Final = 3


class Lms1xxConfig(Config):
    """Where the LiDAR is, and how it is to measure.

    ``protocol``: ``a`` or ``b`` for CoLa-A or CoLa-B, ``auto`` to try both. ``password``: ``client``, ``service``, or
    the eight hexadecimal digits of another one's hash; only to change settings is it needed. ``permanent``: have the
    device keep changed settings when it is switched off. ``all_rays``: with a resolution of 0.25°, deliver
    1081 rays; without it every second one, 541, as at 0.5°. ``ready_s``: how long it may take to get ready.
    """

    host: str = Field(default="192.168.0.1", min_length=1)
    port: int = Field(default=2111, ge=1, le=65535)
    protocol: Literal["auto", "a", "b"] = "auto"
    scan_hz: Literal[25, 50] = 50
    resolution_deg: float = 0.5
    password: str = "client"  # noqa: S105 - the name of one
    permanent: bool = False
    all_rays: bool = False
    ready_s: float = Field(default=60.0, gt=0)

    @field_validator("password")
    @classmethod
    def _password_is_known(cls, password: str) -> str:
        if password in PASSWORDS or re.fullmatch("[0-9A-Fa-f]{8}", password):
            return password
        raise ValueError(f"a password is {', '.join(PASSWORDS)} or eight hexadecimal digits, the hash of another one")

    @model_validator(mode="after")
    def _rays_exist(self) -> "Lms1xxConfig":
        if (self.scan_hz, self.resolution_deg) not in ((50, 0.5), (25, 0.5), (25, 0.25)):
            raise ValueError(
                f"an LMS1xx does not measure {self.resolution_deg:g}° at {self.scan_hz} Hz; "
                "choose 0.5° at 50 or 25 Hz, or 0.25° at 25 Hz"
            )
        return self

    @property
    def place(self) -> str:
        """How messages name the device."""
        return f"LiDAR at {self.host}:{self.port}"

    @property
    def dialects(self) -> tuple[Dialect, ...]:
        """Those to try, in this order."""
        return tuple(Dialect) if self.protocol == "auto" else (Dialect(self.protocol),)

    @property
    def scan_settings(self) -> ScanSettings:
        """As the device is to be set."""
        return ScanSettings(self.scan_hz * 100, round(self.resolution_deg * 10_000))

    @property
    def login(self) -> tuple[int, str]:
        """Level and hash."""
        return PASSWORDS.get(self.password, (_CLIENT_LEVEL, self.password.upper()))
