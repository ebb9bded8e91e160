"""The emulated LMS1xx at its port: clients, scans at the device's own pace, power and cable."""

import socket
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from random import Random
from threading import Event, Lock, Thread
from time import sleep
from typing import Final

import numpy as np
from jaxtyping import Float64

from sdt_tools.clock import SECOND_NS, HostClock
from sdt_tools.emulation.lms1xx.answers import answer
from sdt_tools.emulation.lms1xx.config import EmulatedConfig
from sdt_tools.emulation.lms1xx.device import EmulatedDevice, Session
from sdt_tools.emulation.lms1xx.faults import Faults
from sdt_tools.emulation.lms1xx.making import make_scan
from sdt_tools.emulation.lms1xx.supply import ScanSupply
from sdt_tools.emulation.lms1xx.wire import Wire
from sdt_tools.errors import DeviceError
from sdt_tools.frames import RAYS
from sdt_tools.robot.lms1xx.framing import Dialect, framed, splitter_for
from sdt_tools.robot.lms1xx.reading import TelegramError
from sdt_tools.robot.lms1xx.scan_telegram import write_scan
from sdt_tools.robot.lms1xx.settings import MEASURING
from sdt_tools.robot.lms1xx.telegram import SCAN_DATA, parse_telegram
from sdt_tools.robot.lms1xx.writing import writer_for

LATENCY_US: Final = 2_429
"""From a scan's beginning, as the device tells it, to its sending: what a real LMS111 says of a scan of 541 rays."""
_IDLE_S: Final = 0.01
_US: Final = 1_000_000
_CENTIHERTZ: Final = 100

OnScan = Callable[[int, int], None]
"""Takes the number of a scan since power-on, and the host's time when it began: the truth."""


@dataclass
class EmulatedCounts:
    """What was done so far."""

    clients: int = 0
    scans: int = 0
    sent: int = 0
    dropped: int = 0
    spoilt: int = 0
    garbage: int = 0
    power_cycles: int = 0


@dataclass(eq=False)
class _Client:
    connection: socket.socket
    wire: Wire
    session: Session = field(default_factory=Session)


@dataclass(frozen=True, eq=False)
class _Taken:
    """A scan: its number since power-on, the host's time when it began, and what was seen."""

    number: int
    began_ns: int
    ranges_m: Float64[np.ndarray, "rays"]


class EmulatedLms1xx:
    """Listens at once, and serves until it is closed. Raises DeviceError where the port is taken.

    ``faults`` may be set anew at any time, from any thread; so may power, cable and silence.
    """

    def __init__(
        self,
        supply: ScanSupply,
        config: EmulatedConfig | None = None,
        faults: Faults | None = None,
        clock: HostClock | None = None,
        on_scan: OnScan | None = None,
    ) -> None:
        self._supply = supply
        self._config = config or EmulatedConfig()
        self._faults = faults or Faults()
        self._clock = clock or HostClock()
        self._on_scan = on_scan
        self._random = Random(self._faults.seed)
        self.device = EmulatedDevice(self._config, self._clock.now_ns())
        self.device.drift(self._clock.now_ns(), self._faults.drift_ppm)
        self.counts = EmulatedCounts()
        self._newest = _Taken(0, self._clock.now_ns(), np.zeros(RAYS))
        self.silent = False
        """While set, no scan is sent; commands are answered."""
        self._unplugged = Event()
        self._off = Event()
        self._closing = Event()
        self._clients: list[_Client] = []
        self._lock = Lock()
        self._server, self._port = self._listen(self._config.port), 0
        self._port = int(self._server.getsockname()[1])
        self._threads = [
            Thread(target=self._accept, name="lms1xx-accept", daemon=True),
            Thread(target=self._measure, name="lms1xx-scans", daemon=True),
        ]
        for thread in self._threads:
            thread.start()

    @property
    def port(self) -> int:
        """Where it listens; the one that was found, if any would do."""
        return self._port

    @property
    def faults(self) -> Faults:
        """Those of the moment."""
        return self._faults

    @faults.setter
    def faults(self, faults: Faults) -> None:
        self._faults = faults
        self.device.drift(self._clock.now_ns(), faults.drift_ppm)

    def unplug(self, unplugged: bool = True) -> None:
        """Cut the cable, or mend it: nothing passes, and nobody is told."""
        (self._unplugged.set if unplugged else self._unplugged.clear)()

    def hang_up(self) -> None:
        """Close all connections."""
        with self._lock:
            clients, self._clients = self._clients, []
        for client in clients:
            client.wire.close()
            client.connection.close()

    def switch_off(self) -> None:
        """Take its power: connections close, the port is shut."""
        self._off.set()
        self._shut()
        self.hang_up()

    def switch_on(self) -> None:
        """Give it power: it starts anew, with the settings that were stored."""
        self.device.switch_on(self._clock.now_ns())
        self.counts.power_cycles += 1
        self._server = self._listen(self._port)
        self._off.clear()

    def power_cycle(self, off_s: float) -> None:
        """Switch it off for ``off_s``, and on."""
        self.switch_off()
        sleep(off_s)
        self.switch_on()

    def close(self) -> None:
        """Serve nobody any more; may be called twice."""
        self._closing.set()
        self._shut()
        self.hang_up()
        for thread in self._threads:
            thread.join()

    def __enter__(self) -> "EmulatedLms1xx":
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    def _listen(self, port: int) -> socket.socket:
        try:
            return socket.create_server((self._config.host, port))
        except OSError as error:
            raise DeviceError(
                f"{self._config.host}:{port}: cannot listen there ({error.strerror}); choose another --port or --host"
            ) from None

    def _shut(self) -> None:
        with suppress(OSError):
            self._server.shutdown(socket.SHUT_RDWR)
        self._server.close()

    def _accept(self) -> None:
        while not self._closing.is_set():
            try:
                connection, _ = self._server.accept()
            except OSError:
                self._closing.wait(_IDLE_S)
                continue
            connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self.counts.clients += 1
            wire = Wire(connection, lambda: self._faults, self._unplugged, self._faults.seed + self.counts.clients)
            client = _Client(connection, wire)
            with self._lock:
                self._clients.append(client)
            Thread(target=self._serve, args=(client,), name="lms1xx-client", daemon=True).start()

    def _serve(self, client: _Client) -> None:
        """Answer one client until it goes."""
        splitter = splitter_for(self.device.dialect)
        with suppress(OSError):
            while data := client.connection.recv(4096):
                while self._unplugged.is_set() and not self._closing.wait(_IDLE_S):
                    pass
                for body in splitter.feed(data):
                    self._answer(client, body)
        with self._lock:
            if client not in self._clients:
                return
            self._clients.remove(client)
        client.wire.close()
        client.connection.close()

    def _answer(self, client: _Client, body: bytes) -> None:
        try:
            telegram = parse_telegram(self.device.dialect, body)
        except TelegramError:
            return
        host_ns = self._clock.now_ns()
        if telegram.name == SCAN_DATA and telegram.kind == "sRN":
            reply = self._scan_body("sRA", self._newest)
        else:
            reply = answer(self.device, client.session, telegram, host_ns)
        client.wire.put(framed(self.device.dialect, reply), is_scan=False)
        if telegram.name == "mSCreboot" and reply.startswith(b"sAN"):
            self._closing.wait(_IDLE_S)
            Thread(target=self.power_cycle, args=(self._config.boot_s,), daemon=True).start()

    def _measure(self) -> None:
        """Make a scan a period of the device's own clock, as long as it measures."""
        began_us: float | None = None
        powered = self.device.power_ons
        while not self._closing.is_set():
            now_ns = self._clock.now_ns()
            if self._off.is_set() or self.device.state(now_ns) != MEASURING:
                began_us = None
                self._closing.wait(_IDLE_S)
                continue
            if began_us is None or powered != self.device.power_ons:
                began_us, powered = self.device.time.us_at(now_ns), self.device.power_ons
            began_us += _US * _CENTIHERTZ / self.device.settings.scan.frequency
            began_ns = self.device.time.host_at(float(round(began_us)))
            left_s = (self.device.time.host_at(began_us + LATENCY_US) - self._clock.now_ns()) / SECOND_NS
            if left_s > 0 and self._closing.wait(left_s):
                return
            self._send_scan(began_ns)

    def _send_scan(self, began_ns: int) -> None:
        device, faults = self.device, self._faults
        device.scans += 1
        self.counts.scans += 1
        if self._on_scan is not None:
            self._on_scan(device.scans, began_ns)
        self._newest = _Taken(device.scans, began_ns, self._supply.ranges_at(began_ns))
        if self.silent or device.scans % device.settings.data.interval:
            return
        with self._lock:
            streaming = [client for client in self._clients if client.session.streams]
        if not streaming:
            return
        data = framed(device.dialect, self._scan_body("sSN", self._newest))
        if self._random.random() < faults.drop:
            self.counts.dropped += 1
            return
        if self._random.random() < faults.spoil:
            self.counts.spoilt += 1
            data = _spoilt(data, device.dialect)
        if self._random.random() < faults.garbage:
            self.counts.garbage += 1
            data = self._random.randbytes(self._random.randint(1, 64)) + data
        self.counts.sent += 1
        for client in streaming:
            client.wire.put(data, is_scan=True)

    def _scan_body(self, kind: str, taken: _Taken) -> bytes:
        """The telegram of a scan, handed over now."""
        device = self.device
        device.telegrams += 1
        settings = device.settings
        times_us = round(device.time.us_at(taken.began_ns)), round(device.time.us_at(self._clock.now_ns()))
        scan = make_scan(
            taken.ranges_m,
            settings.scan,
            settings.data,
            settings.output,
            times_us,
            (device.telegrams, taken.number),
            self._config.scale,
            self._config.device_name,
        )
        fields = writer_for(device.dialect)
        write_scan(fields, scan)
        return fields.body(f"{kind} {SCAN_DATA}")


def _spoilt(data: bytes, dialect: Dialect) -> bytes:
    """With another checksum; in CoLa-A, cut off in its middle."""
    return data[: len(data) // 2] if dialect is Dialect.A else data[:-1] + bytes([data[-1] ^ 0x55])
