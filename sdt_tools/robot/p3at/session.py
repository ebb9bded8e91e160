"""Beginning and ending a session with the base: synchronise, open, ask for its settings, enable; and all that back.

Sources: Pioneer 3 Operations Manual, "Client-server connection".
"""

import select
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from time import monotonic
from typing import Final

from sdt_tools.errors import DeviceError
from sdt_tools.robot.p3at.commands import Code, encode
from sdt_tools.robot.p3at.config import P3atConfig
from sdt_tools.robot.p3at.link import Link, LinkLostError
from sdt_tools.robot.p3at.packets import PacketSplitter, packet
from sdt_tools.robot.p3at.settings import BaseSettings, decode_settings
from sdt_tools.robot.p3at.status import MOVING, STANDING, Status, decode_status

_ANSWER_S: Final = 0.5
_LOOK_S: Final = 0.05
_LISTEN_S: Final = 0.25
"""A base in a session speaks every 100 ms."""
_SYNCS: Final = (0, 1, 2)
_DEGREES: Final = 57.29577951308232


@dataclass(frozen=True)
class Session:
    """An open session. ``settings`` is None where the base does not tell them, as firmware before P2OS 1.4."""

    link: Link
    splitter: PacketSplitter
    name: str
    kind: str
    model: str
    settings: BaseSettings | None

    def close(self, at_once: bool) -> None:
        """Leave the base standing, its motors off and its session closed, as far as the wire still goes."""
        halt = [encode(Code.ESTOP)] if at_once else []
        packets = [*halt, *STANDSTILL, encode(Code.STOP), encode(Code.ENABLE, 0), encode(Code.CLOSE)]
        try:
            self.link.write(b"".join(packets))
        except LinkLostError:
            pass  # the base stops by its own watchdog
        finally:
            self.link.close()


STANDSTILL: Final = (encode(Code.VEL, 0), encode(Code.RVEL, 0))


def open_session(link: Link, config: P3atConfig, gives_up: Callable[[], bool] = lambda: False) -> Session:
    """Synchronise, and make the base ready to drive; it stands, its motors on.

    A session that an earlier client has left open is closed first. Raises DeviceError where no base answers within
    ``connect_s`` or ``gives_up`` says so, and LinkLostError where the wire breaks; the link stays open then.
    """
    talk = Introduction(link, config, gives_up)
    identity = talk.synchronise()
    link.write(encode(Code.OPEN))
    settings = talk.ask_settings()
    limits = config.limits
    for code, argument in (
        (Code.VEL, 0),
        (Code.RVEL, 0),
        (Code.SONAR, 0),
        (Code.SETV, round(max(limits.forward_mps, limits.backward_mps) * 1000)),
        (Code.SETRV, max(1, round(limits.turn_radps * _DEGREES))),
        (Code.SETA, round(config.accelerate_mps2 * 1000)),
        (Code.SETA, -round(config.brake_mps2 * 1000)),
        (Code.SETRA, round(config.turn_radps2 * _DEGREES)),
        (Code.SETRA, -round(config.turn_radps2 * _DEGREES)),
        (Code.ENABLE, 1),
    ):
        link.write(encode(code, argument))
    name, kind, model = identity
    return Session(link, talk.splitter, name, kind, model, settings)


class Introduction:
    """Questions and answers that begin a session; nothing of it moves the base or switches its motors on."""

    def __init__(self, link: Link, config: P3atConfig, gives_up: Callable[[], bool] = lambda: False) -> None:
        self.splitter = PacketSplitter()
        self._link = link
        self._config = config
        self._gives_up = gives_up
        self._until_s = monotonic() + config.connect_s
        self._heard = b""

    def synchronise(self) -> tuple[str, str, str]:
        """Name, kind and model of the base.

        A base that speaks unasked is still in a session, perhaps with a motion that any packet lets go on; all it is
        told is to close it. One that is silent is not told that: CLOSE has the number of the last synchronisation.
        """
        while monotonic() < self._until_s and not self._gives_up():
            if any(body[0] in (STANDING, MOVING) for body in self._bodies(_LISTEN_S)):
                self._link.write(encode(Code.CLOSE))
                continue
            answer = b""
            for sync in _SYNCS:
                self._link.write(packet(bytes([sync])))
                answer = self._answer(sync)
                if not answer:
                    break
            if answer:
                texts = answer[1:].split(b"\0")
                name, kind, model = (text.decode("latin-1") for text in (texts + [b""] * 3)[:3])
                return name, kind, model
        raise self._nobody()

    def ask_settings(self) -> BaseSettings | None:
        """The base's settings, asked for thrice."""
        for _ in range(3):
            self._link.write(encode(Code.CONFIG))
            for body in self._bodies(_ANSWER_S):
                settings = decode_settings(body)
                if settings is not None:
                    return settings
        return None

    def overheard(self) -> Status | None:
        """What the base says of itself, unasked; None where it says nothing, as outside of a session."""
        for body in self._bodies(_LISTEN_S):
            status = decode_status(body)
            if status is not None:
                return status
        return None

    def _answer(self, sync: int) -> bytes:
        """The echo of ``sync``; empty where none comes. A base in an old session is told to end it."""
        for body in self._bodies(_ANSWER_S):
            if body[0] == sync:
                return body
            if body[0] in (STANDING, MOVING):
                self._link.write(encode(Code.CLOSE))
                return b""
        return b""

    def _bodies(self, for_s: float) -> Iterator[bytes]:
        until_s = monotonic() + for_s
        while (left_s := until_s - monotonic()) > 0 and not self._gives_up():
            if select.select([self._link], [], [], min(left_s, _LOOK_S))[0]:
                data = self._link.read()
                self._heard = (self._heard + data)[:32]
                yield from self.splitter.feed(data)

    def _nobody(self) -> DeviceError:
        where, within = f"base at {self._config.address}", f"within {self._config.connect_s:g} s"
        if not self._heard:
            return DeviceError(f"{where}: nothing answers {within}; is it switched on, and the cable and baud right?")
        return DeviceError(
            f"{where}: does not synchronise {within}, but says {self._heard!r}; is it a P3-AT, and the baud right?"
        )
