"""What kind of LMS1xx is emulated."""

from typing import Literal

from pydantic import Field

from sdt_tools.config import Config


class EmulatedConfig(Config):
    """Where it listens, what it says it is, and how long it takes.

    ``protocol``: ``a`` or ``b``, CoLa-A or CoLa-B. ``kind``: what it calls itself. ``password``: the hash that an
    authorised client must give. ``scan_hz`` and ``resolution_deg``: as it was set when it was last switched off.
    ``boot_s`` and ``start_s``: until it measures after it was switched on, and after it was set and told to.
    ``start_us``: what its clock of 32 bits shows first. ``scale``: distances are sent in so many millimetres.
    """

    host: str = "127.0.0.1"
    port: int = Field(default=2111, ge=0, le=65535)
    protocol: Literal["a", "b"] = "a"
    kind: str = "LMS10x_FieldEval"
    version: str = "V1.36-21.10.2010"
    password: str = Field(default="F4724744", pattern="^[0-9A-Fa-f]{8}$")
    scan_hz: Literal[25, 50] = 50
    resolution_deg: Literal["0.5", "0.25"] = "0.5"
    boot_s: float = Field(default=0.0, ge=0)
    start_s: float = Field(default=1.0, ge=0)
    start_us: int = Field(default=0, ge=0, lt=1 << 32)
    scale: Literal[1, 2] = 1
    device_name: str = Field(default="", max_length=16)
