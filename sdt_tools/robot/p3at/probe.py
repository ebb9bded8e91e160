"""Asking a P3-AT who it is and how it does. It stays where it is, and its motors are not switched on."""

from dataclasses import dataclass
from typing import Final

from sdt_tools.errors import DeviceError
from sdt_tools.robot.p3at.commands import Code, encode
from sdt_tools.robot.p3at.config import P3atConfig
from sdt_tools.robot.p3at.link import Link, LinkLostError, open_link
from sdt_tools.robot.p3at.session import Introduction
from sdt_tools.robot.p3at.settings import BaseSettings
from sdt_tools.robot.p3at.status import Status

CONNECT_S: Final = 2.5


@dataclass(frozen=True)
class BaseProbe:
    """What it says. ``busy``: it is in a session with somebody else, and was asked nothing."""

    kind: str
    model: str
    name: str
    settings: BaseSettings | None
    status: Status | None
    busy: bool = False


def probe(config: P3atConfig) -> BaseProbe:
    """Ask the base that ``config`` names.

    A base that speaks unasked is in a session, perhaps somebody's who drives it: it is listened to, and not spoken to.
    Raises DeviceError where there is no base, UsageError where the address is none.
    """
    link = open_link(config.address, config.baud, config.connect_s)
    try:
        return _asked(link, config)
    except LinkLostError as error:
        raise DeviceError(f"base at {config.address}: {error}; is another program using it?") from None
    finally:
        link.close()


def _asked(link: Link, config: P3atConfig) -> BaseProbe:
    talk = Introduction(link, config)
    status = talk.overheard()
    if status is not None:
        return BaseProbe("", "", "", None, status, busy=True)
    name, kind, model = talk.synchronise()
    link.write(encode(Code.OPEN))
    try:
        settings = talk.ask_settings()
        return BaseProbe(kind, model, name, settings, talk.overheard())
    finally:
        link.write(encode(Code.CLOSE))
