"""The wire to the base: a serial port, or a TCP connection to a bridge or an emulator."""

import errno
import socket
from contextlib import suppress
from typing import Final, Protocol, runtime_checkable
from urllib.parse import urlsplit

import serial

from sdt_tools.errors import DeviceError, UsageError
from sdt_tools.robot.p3at.config import TCP_PORT

_WRITE_S: Final = 0.2
"""A wire that takes no command for so long counts as broken."""
_LINGER_S: Final = 0.05
_SCHEMES: Final = ("socket", "tcp")
_BITS_A_BYTE: Final = 10  # a start and a stop bit


class LinkLostError(Exception):
    """The wire is broken; the text says how."""


@runtime_checkable
class Link(Protocol):
    """An open wire."""

    @property
    def byte_s(self) -> float:
        """How long a byte is on its way."""
        ...

    def fileno(self) -> int:
        """What to wait on for something to read."""
        ...

    def read(self) -> bytes:
        """What has come, without waiting. Raises LinkLostError where nothing can come any more."""
        ...

    def write(self, data: bytes) -> None:
        """Send all of ``data``. Raises LinkLostError where that is not possible at once."""
        ...

    def close(self) -> None:
        """Let it go; may be called twice."""
        ...


def open_link(address: str, baud: int, timeout_s: float) -> Link:
    """The wire to ``address``. Raises UsageError where that is no address, and DeviceError where there is no wire."""
    if "://" in address:
        return TcpLink(address, *_host_and_port(address), timeout_s)
    return SerialLink(address, baud)


def _host_and_port(address: str) -> tuple[str, int]:
    parts = urlsplit(address)
    try:
        port = parts.port or TCP_PORT
    except ValueError:
        port = 0
    if parts.scheme not in _SCHEMES or not parts.hostname or not port or parts.path.strip("/"):
        raise UsageError(f"base address '{address}': name a serial port as /dev/ttyUSB0, or socket://HOST:PORT")
    return parts.hostname, port


class TcpLink:
    """A TCP connection that carries the bytes of a serial port."""

    byte_s = 0.0

    def __init__(self, address: str, host: str, port: int, timeout_s: float) -> None:
        try:
            self._socket = socket.create_connection((host, port), timeout_s)
        except ConnectionRefusedError:
            raise DeviceError(
                f"base at {address}: nobody listens on port {port}; is it switched on, and the port right?"
            ) from None
        except TimeoutError:
            raise DeviceError(f"base at {address}: no answer within {timeout_s:g} s; check address and cable") from None
        except OSError as error:
            reason = error.strerror or str(error)
            raise DeviceError(f"base at {address}: {reason}; check the address and that it can be pinged") from None
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._socket.settimeout(_WRITE_S)

    def fileno(self) -> int:
        """What to wait on."""
        return self._socket.fileno()

    def read(self) -> bytes:
        """What has come."""
        try:
            data = self._socket.recv(4096, socket.MSG_DONTWAIT)
        except BlockingIOError:
            return b""
        except OSError as error:
            raise LinkLostError(error.strerror or str(error)) from None
        if not data:
            raise LinkLostError("the other side has closed the connection")
        return data

    def write(self, data: bytes) -> None:
        """Send all of it."""
        try:
            self._socket.sendall(data)
        except OSError as error:
            raise LinkLostError(error.strerror or str(error)) from None

    def close(self) -> None:
        """Let it go, once the other side has what was sent."""
        with suppress(OSError):
            self._socket.shutdown(socket.SHUT_WR)
            self._socket.settimeout(_LINGER_S)
            while self._socket.recv(4096):  # closed on unread data, a connection is reset, and what was sent with it
                pass
        self._socket.close()


class SerialLink:
    """A serial port of this computer, for nobody else while it is open."""

    def __init__(self, path: str, baud: int) -> None:
        self.byte_s = _BITS_A_BYTE / baud
        try:
            self._port = serial.Serial(path, baud, timeout=0, write_timeout=_WRITE_S, exclusive=True)
        except ValueError as error:
            raise DeviceError(f"base at {path}: {error}") from None
        except serial.SerialException as error:
            raise DeviceError(f"base at {path}: {_why(error)}") from None

    def fileno(self) -> int:
        """What to wait on."""
        number: int = self._port.fileno()
        return number

    def read(self) -> bytes:
        """What has come."""
        try:
            data: bytes = self._port.read(4096)
        except (OSError, TypeError) as error:  # TypeError: closed meanwhile
            raise LinkLostError(f"the serial port fails ({error})") from None
        return data

    def write(self, data: bytes) -> None:
        """Send all of it."""
        try:
            self._port.write(data)
        except OSError as error:
            raise LinkLostError(f"the serial port takes nothing ({error})") from None

    def close(self) -> None:
        """Let it go, once all is on the wire."""
        with suppress(OSError, serial.SerialException):
            self._port.flush()
        self._port.close()


def _why(error: serial.SerialException) -> str:
    """What is wrong with a port that does not open, and what to try."""
    if error.errno == errno.EACCES:
        return "no rights; join the group that owns it (often dialout) and log in again"
    if error.errno == errno.ENOENT:
        return "no such serial port; is the adapter plugged in? dmesg names its port"
    if error.errno in (errno.EBUSY, errno.EAGAIN) or "exclusively lock" in str(error):
        return "in use by another program; end that one"
    return f"does not open as a serial port ({error.strerror or error}); check the path"
