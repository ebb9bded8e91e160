"""The driver of an LMS1xx: a thread that reads it, and comes back to it when it was away."""

from collections import deque
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from enum import Enum
from threading import Condition, Event, Thread
from time import monotonic
from typing import ClassVar, Final

from sdt_tools.clock import SECOND_NS, HostClock
from sdt_tools.errors import DeviceError, SdtError
from sdt_tools.frames import LidarScan, LogEntry, LogLevel, Received
from sdt_tools.robot.lms1xx.config import Lms1xxConfig
from sdt_tools.robot.lms1xx.framing import Dialect
from sdt_tools.robot.lms1xx.handshake import Say, open_link, start_stream
from sdt_tools.robot.lms1xx.link import LinkLostError
from sdt_tools.robot.lms1xx.reading import TelegramError
from sdt_tools.robot.lms1xx.scan_telegram import read_scan
from sdt_tools.robot.lms1xx.scans import RaysError
from sdt_tools.robot.lms1xx.settings import Identity
from sdt_tools.robot.lms1xx.stream import LOG_NAME, ScanStream
from sdt_tools.robot.lms1xx.telegram import SCAN_DATA, Telegram

SILENT_S: Final = 0.16
"""A LiDAR that sends nothing for so long is reported: eight scans at 50 Hz, four at 25."""
GIVEN_UP_S: Final = 0.6
"""After so long a silence the connection is closed and opened anew: a cut cable closes none."""
_STILL_SILENT_S: Final = 2.0
"""The same for a new connection over which nothing came yet."""
FIRST_SCAN_S: Final = 5.0
_RETRY_S: Final = 0.2
_RECONNECT_S: Final = 0.5
"""How long an attempt to come back may wait for a device that does not answer."""
_KEPT: Final = 3000
"""Messages that nobody fetches are kept for a minute at 50 Hz; then the oldest go, and are counted."""
_TOLD_AGAIN_S: Final = 10.0


class LinkState(Enum):
    """How it stands with the device."""

    LEARNING = "learning its clock"
    STREAMING = "streaming"
    SILENT = "silent"
    AWAY = "away"
    CLOSED = "closed"


@dataclass(frozen=True)
class LidarStatus:
    """What the driver knows of its device; ``problem`` is empty while all is well."""

    state: LinkState
    identity: Identity
    dialect: Dialect
    scans: int
    missing: int
    learning: int
    damaged: int
    reconnects: int
    unfetched: int
    drift_ppm: float | None
    """Of its clock: positive where it is slower than the host's; None in the first seconds."""
    problem: str


class Lms1xx:
    """An LMS1xx that streams. Implements Lidar.

    Raises DeviceError, in words, where it cannot be reached, set up, or does not send. What it received waits for
    ``read``, log entries on gaps and reconnects among it. Given the same ``clock`` as the rest of the robot, its stamps
    are on the same time. ``say`` takes a line about each thing that is done at the start.
    """

    config_model: ClassVar[type[Lms1xxConfig]] = Lms1xxConfig

    def __init__(self, config: Lms1xxConfig, clock: HostClock | None = None, say: Say | None = None) -> None:
        self._config = config
        self._clock = clock or HostClock()
        self._received: deque[Received] = deque()
        self._changed = Condition()
        self._closing = Event()
        self._stream = ScanStream(config)
        self._state = LinkState.LEARNING
        self._problem = self._unreadable = ""
        self._failure: Exception | None = None
        self._damaged_before = self._reconnects = self._unfetched = 0
        self._last_scan_ns: int | None = None
        self._last_scan_s = monotonic()
        self._given_up_s = GIVEN_UP_S
        self._mute: set[str] = set()
        self._link, self._identity = open_link(config)
        try:
            start_stream(self._link, config, self._closing, say or self._say, self._mute)
        except BaseException:
            self._link.close()
            raise
        self._last_scan_s = monotonic()
        self._thread = Thread(target=self._run, name="lms1xx", daemon=True)
        self._thread.start()
        self._await_first_scan()

    @property
    def status(self) -> LidarStatus:
        """How it stands now. May be asked from any thread."""
        counts = self._stream.counts
        return LidarStatus(
            self._state,
            self._identity,
            self._link.dialect,
            counts.scans,
            counts.missing,
            counts.learning,
            self._damaged_before + self._link.damaged,
            self._reconnects,
            self._unfetched,
            self._stream.clock.drift_ppm,
            self._problem,
        )

    @property
    def age_s(self) -> float:
        """How long ago the last scan was received; infinite before the first."""
        last_ns = self._last_scan_ns
        return float("inf") if last_ns is None else (self._clock.now_ns() - last_ns) / SECOND_NS

    def read(self, until_ns: int) -> Iterator[Received]:
        """What was received after the last call and up to ``until_ns`` (inclusive), in order.

        Raises what the reading thread failed with, which is a bug: devices that fail are logged.
        """
        if self._failure is not None:
            raise self._failure
        while True:
            with self._changed:
                if not self._received or self._received[0].received_ns > until_ns:
                    return
                received = self._received.popleft()
            yield received

    def wait(self, timeout_s: float) -> bool:
        """Wait until ``read`` has something; whether it has, within ``timeout_s``."""
        with self._changed:
            return self._changed.wait_for(lambda: bool(self._received) or self._failure is not None, timeout_s)

    def close(self) -> None:
        """Have the device stop sending, and let it go; may be called twice."""
        self._closing.set()
        self._thread.join()

    def _await_first_scan(self) -> None:
        """Wait until the clock is learnt and scans come; close, and raise, where they do not."""
        with self._changed:
            came = self._changed.wait_for(lambda: self._last_scan_ns is not None or self._failed, FIRST_SCAN_S)
        if came and not self._failed:
            return
        self.close()
        if self._failure is not None:
            raise self._failure
        reason = f"it accepts all commands, but sent no scans within {FIRST_SCAN_S:g} s; power it off and on"
        raise DeviceError(f"{self._config.place}: {self._problem or reason}")

    @property
    def _failed(self) -> bool:
        return self._failure is not None or self._state is LinkState.AWAY

    def _run(self) -> None:
        try:
            while not self._closing.is_set():
                try:
                    self._listen()
                except DeviceError as error:
                    self._lost(error)
                    self._come_back()
        except Exception as error:  # reported by ``read``, in the thread that can do something
            self._failure = error
            with self._changed:
                self._changed.notify_all()
        finally:
            self._state = LinkState.CLOSED
            self._say_good_bye()

    def _listen(self) -> None:
        """Take what comes, until the driver is closed. Raises DeviceError where the link breaks or is silent."""
        while not self._closing.is_set():
            silent_at_s = self._last_scan_s + (SILENT_S if self._state is not LinkState.SILENT else self._given_up_s)
            telegrams = self._link.receive(silent_at_s)
            received_ns = self._clock.now_ns()
            for telegram in telegrams:
                if telegram.name == SCAN_DATA and telegram.is_scan:
                    self._take(telegram, received_ns)
            if monotonic() >= self._last_scan_s + self._given_up_s:
                raise LinkLostError(f"{self._config.place}: no scan{self._unreadable} for {self._given_up_s:g} s")
            if monotonic() >= self._last_scan_s + SILENT_S and self._state is not LinkState.SILENT:
                self._state = LinkState.SILENT
                self._problem = f"no scan{self._unreadable} for {SILENT_S:g} s"
                self._log(LogLevel.WARNING, f"{self._problem}; is it powered and cabled?")

    def _take(self, telegram: Telegram, received_ns: int) -> None:
        try:
            messages = list(self._stream.take(read_scan(telegram.fields), received_ns))
        except RaysError as error:
            raise DeviceError(f"{self._config.place}: {error}") from None
        except TelegramError as error:
            self._link.spoil()
            self._unreadable = f" that can be read ({error})"
            return
        silent_s = monotonic() - self._last_scan_s
        self._last_scan_s = monotonic()
        if self._state is LinkState.SILENT:
            self._log(LogLevel.INFO, f"scans again, after {silent_s:.2f} s", received_ns)
        self._state = LinkState.STREAMING if self._stream.clock.settled else LinkState.LEARNING
        self._problem = self._unreadable = ""
        self._given_up_s = GIVEN_UP_S
        for message in messages:
            self._put(Received(received_ns, message))

    def _lost(self, error: DeviceError) -> None:
        self._damaged_before += self._link.damaged
        self._link.close()
        self._problem = str(error).removeprefix(f"{self._config.place}: ")
        self._state = LinkState.AWAY
        self._log(LogLevel.WARNING, f"lost: {self._problem}; trying to come back")

    def _come_back(self) -> None:
        """Try to connect until it works, or the driver is closed."""
        told_s, told = monotonic(), ""
        while not self._closing.wait(_RETRY_S):
            try:
                link, identity = open_link(self._config, _RECONNECT_S, _RECONNECT_S, self._link.dialect)
            except SdtError as error:
                self._problem = str(error).removeprefix(f"{self._config.place}: ")
            else:
                self._link, self._identity = link, identity
                try:
                    start_stream(link, self._config, self._closing, self._say, self._mute)
                except SdtError as error:
                    link.close()
                    self._problem = str(error).removeprefix(f"{self._config.place}: ")
                else:
                    self._welcome_back()
                    return
            if self._problem != told or monotonic() - told_s > _TOLD_AGAIN_S:
                self._log(LogLevel.WARNING, f"still away: {self._problem}")
                told_s, told = monotonic(), self._problem

    def _welcome_back(self) -> None:
        away_s = monotonic() - self._last_scan_s
        self._reconnects += 1
        self._stream.reconnected()
        self._last_scan_s = monotonic()
        self._given_up_s = _STILL_SILENT_S
        self._state, self._problem = LinkState.LEARNING, ""
        self._log(LogLevel.INFO, f"reconnected, {away_s:.2f} s after the last scan")

    def _say_good_bye(self) -> None:
        with suppress(SdtError):
            fields = self._link.writer()
            fields.unsigned(0, 8)
            self._link.send(fields.body(f"sEN {SCAN_DATA}"))
        self._link.close()

    def _say(self, text: str) -> None:
        self._log(LogLevel.INFO, text.removeprefix(f"{self._config.place}: "))

    def _log(self, level: LogLevel, text: str, at_ns: int | None = None) -> None:
        now_ns = self._clock.now_ns() if at_ns is None else at_ns
        self._put(Received(now_ns, LogEntry(now_ns, level, f"LiDAR: {text}", LOG_NAME)))

    def _put(self, received: Received) -> None:
        with self._changed:
            self._received.append(received)
            if len(self._received) > _KEPT:
                self._received.popleft()
                self._unfetched += 1
            if isinstance(received.message, LidarScan):
                self._last_scan_ns = received.received_ns
            self._changed.notify_all()
