"""Where a client reaches the emulated base: a TCP port, or a terminal that looks like a serial port."""

import os
import socket
import tty
from contextlib import suppress
from typing import Protocol, runtime_checkable

from sdt_tools.errors import UsageError


@runtime_checkable
class Port(Protocol):
    """One place for one client at a time."""

    @property
    def address(self) -> str:
        """What a driver is given to reach it."""
        ...

    def waits_on(self) -> list[int]:
        """The descriptors on which something may come."""
        ...

    def read(self) -> bytes:
        """What has come, without waiting; who comes second is sent away."""
        ...

    def write(self, data: bytes) -> None:
        """Send, as far as somebody is there to take it."""
        ...

    def switch_off(self) -> None:
        """Be there for nobody, until ``switch_on``."""
        ...

    def switch_on(self) -> None:
        """Be there again."""
        ...

    def close(self) -> None:
        """End; may be called twice."""
        ...


class TcpPort:
    """A TCP port. Raises UsageError where it cannot be had."""

    def __init__(self, host: str, port: int) -> None:
        self._host, self._port = host, port
        self._client: socket.socket | None = None
        self._server: socket.socket | None = None
        self.switch_on()

    @property
    def address(self) -> str:
        """As the driver wants it."""
        return f"socket://{self._host}:{self._port}"

    def waits_on(self) -> list[int]:
        """The port and its client."""
        return [one.fileno() for one in (self._server, self._client) if one is not None]

    def read(self) -> bytes:
        """What the client has sent."""
        self._accept()
        if self._client is None:
            return b""
        try:
            data = self._client.recv(4096)
        except BlockingIOError:
            return b""
        except OSError:
            data = b""
        if not data:
            self._hang_up()
        return data

    def write(self, data: bytes) -> None:
        """Send; what does not go at once is lost."""
        if self._client is not None:
            with suppress(OSError):
                self._client.send(data)

    def switch_off(self) -> None:
        """Close the connection and the port."""
        self._hang_up()
        if self._server is not None:
            self._server.close()
            self._server = None

    def switch_on(self) -> None:
        """Listen."""
        if self._server is not None:
            return
        try:
            self._server = socket.create_server((self._host, self._port), backlog=4)
        except OSError as error:
            raise UsageError(
                f"{self._host}:{self._port} cannot be listened on ({_reason(error)}); choose another --host or --port"
            ) from None
        self._server.setblocking(False)
        self._port = self._server.getsockname()[1]

    def close(self) -> None:
        """Close all."""
        self.switch_off()

    def _accept(self) -> None:
        if self._server is None:
            return
        with suppress(BlockingIOError):
            client, _ = self._server.accept()
            if self._client is not None:
                client.close()  # a serial line has room for one
                return
            client.setblocking(False)
            client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self._client = client

    def _hang_up(self) -> None:
        if self._client is not None:
            self._client.close()
            self._client = None


def _reason(error: OSError) -> str:
    return os.strerror(error.errno) if error.errno and error.errno > 0 else str(error)


class PtyPort:
    """A pseudo-terminal. It stays the same while the base is switched off, as a serial adapter does."""

    def __init__(self) -> None:
        self._master, self._slave = os.openpty()  # held open, so that a client that leaves is no end
        tty.setraw(self._slave)
        os.set_blocking(self._master, False)
        self.address = os.ttyname(self._slave)
        self._is_on = True

    def waits_on(self) -> list[int]:
        """The terminal."""
        return [self._master]

    def read(self) -> bytes:
        """What was written to the terminal; nobody hears it while switched off."""
        try:
            data = os.read(self._master, 4096)
        except BlockingIOError:
            return b""
        return data if self._is_on else b""

    def write(self, data: bytes) -> None:
        """Have it read from the terminal."""
        if self._is_on:
            with suppress(BlockingIOError):
                os.write(self._master, data)

    def switch_off(self) -> None:
        """Say and hear nothing."""
        self._is_on = False

    def switch_on(self) -> None:
        """Say and hear again."""
        self._is_on = True

    def close(self) -> None:
        """Take the terminal away."""
        if self._master >= 0:
            os.close(self._master)
            os.close(self._slave)
            self._master = -1
