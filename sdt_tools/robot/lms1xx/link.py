"""One TCP connection to a device that speaks CoLa: telegrams out and in, and errors in words."""

import select
import socket
from collections.abc import Iterator
from contextlib import suppress
from time import monotonic
from typing import Final

from sdt_tools.errors import DeviceError
from sdt_tools.robot.lms1xx.framing import Dialect, framed, splitter_for
from sdt_tools.robot.lms1xx.reading import TelegramError
from sdt_tools.robot.lms1xx.refusals import refusal_words
from sdt_tools.robot.lms1xx.telegram import REFUSAL, Telegram, parse_telegram, refusal_code
from sdt_tools.robot.lms1xx.writing import FieldWriter, writer_for

ANSWER_S: Final = 1.0
"""A device that listens answers within some 10 ms."""
_CHUNK: Final = 1 << 16
_ANSWERS: Final = {"sRN": "sRA", "sRI": "sRA", "sWN": "sWA", "sMN": "sAN", "sEN": "sEA"}
_SHOWN_BYTES: Final = 40


class LinkLostError(DeviceError):
    """The connection broke."""


class NoAnswerError(DeviceError):
    """A question was not answered."""


class RefusedError(DeviceError):
    """The device refused a command."""


class Link:
    """A connection that is open. ``place`` names the device in messages.

    Raises DeviceError where it cannot be opened within ``connect_s``; every method raises LinkLostError where it broke.
    """

    def __init__(self, host: str, port: int, dialect: Dialect, place: str, connect_s: float = 3.0) -> None:
        self.dialect = dialect
        self.place = place
        self._splitter = splitter_for(dialect)
        self._malformed = 0
        self._heard = bytearray()
        """What came first, to be shown where it is no telegram."""
        self._socket = _connected(host, port, place, connect_s)

    @property
    def damaged(self) -> int:
        """Telegrams that came damaged."""
        return self._splitter.damaged + self._malformed

    @property
    def heard(self) -> bytes:
        """The first bytes that came."""
        return bytes(self._heard)

    def writer(self) -> FieldWriter:
        """For the values of a telegram to be sent."""
        return writer_for(self.dialect)

    def send(self, body: bytes) -> None:
        """Send one telegram."""
        try:
            self._socket.sendall(framed(self.dialect, body))
        except OSError as error:
            raise LinkLostError(f"{self.place}: the connection broke ({_reason(error)})") from None

    def receive(self, until_s: float) -> Iterator[Telegram]:
        """The telegrams that came, as soon as something did; none where nothing comes before ``until_s`` (monotonic).

        One whose head is damaged is left out and counted.
        """
        try:
            readable, _, _ = select.select([self._socket], [], [], max(until_s - monotonic(), 0.0))
            data = self._socket.recv(_CHUNK) if readable else None
        except (OSError, ValueError) as error:
            raise LinkLostError(f"{self.place}: the connection broke ({_reason(error)})") from None
        if data is None:
            return iter(())
        if not data:
            raise LinkLostError(f"{self.place}: the device closed the connection")
        if len(self._heard) < _SHOWN_BYTES:
            self._heard += data[:_SHOWN_BYTES]
        return self._parsed(self._splitter.feed(data))

    def spoil(self) -> None:
        """Count a telegram whose values were damaged."""
        self._malformed += 1

    def ask(self, head: str, fields: FieldWriter | None = None, wait_s: float = ANSWER_S) -> Telegram:
        """Send ``head``, as ``sRN STlms``, with values, and wait for its answer; other telegrams are passed over.

        Raises RefusedError, in words, and NoAnswerError where none comes within ``wait_s``.
        """
        kind, _, name = head.partition(" ")
        self.send((fields or self.writer()).body(head))
        until_s = monotonic() + wait_s
        while monotonic() < until_s:
            for telegram in self.receive(until_s):
                if telegram.kind == REFUSAL:
                    raise RefusedError(f"{self.place} refused {name}: {refusal_words(refusal_code(telegram))}")
                if telegram.kind == _ANSWERS[kind] and telegram.name == name:
                    return telegram
        raise NoAnswerError(f"{self.place} did not answer {name} within {wait_s:g} s; is it busy? try again")

    def close(self) -> None:
        """Close the connection; may be called twice."""
        with suppress(OSError):
            self._socket.close()

    def _parsed(self, bodies: list[bytes]) -> Iterator[Telegram]:
        for body in bodies:
            try:
                yield parse_telegram(self.dialect, body)
            except TelegramError:
                self._malformed += 1


def _connected(host: str, port: int, place: str, connect_s: float) -> socket.socket:
    try:
        connection = socket.create_connection((host, port), connect_s)
    except socket.gaierror:
        raise DeviceError(f"{place}: no such host; check the address") from None
    except ConnectionRefusedError:
        raise DeviceError(
            f"{place}: nothing listens at this port; an LMS1xx listens at 2111 and 2112, once it has started"
        ) from None
    except TimeoutError:
        raise DeviceError(
            f"{place}: no answer within {connect_s:g} s; is it powered and cabled, and this computer in its network?"
        ) from None
    except OSError as error:
        raise DeviceError(f"{place}: cannot be reached ({_reason(error)}); check address, cable and network") from None
    connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    return connection


def _reason(error: Exception) -> str:
    return getattr(error, "strerror", None) or str(error) or type(error).__name__
