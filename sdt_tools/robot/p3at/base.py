"""The base as the rest of the program knows it: something to command, that says where it is and how it fares."""

import atexit
import select
import socket
import threading
from contextlib import suppress
from time import monotonic_ns
from typing import ClassVar, Final

from sdt_tools.clock import SECOND_NS, HostClock
from sdt_tools.emergency import EmergencyStop
from sdt_tools.errors import DeviceError, RunError
from sdt_tools.frames import LogEntry, LogLevel, Odometry, RawPicture, Received, Twist
from sdt_tools.robot.arrivals import Arrivals
from sdt_tools.robot.p3at.commands import Code, encode
from sdt_tools.robot.p3at.config import P3atConfig
from sdt_tools.robot.p3at.health import Health
from sdt_tools.robot.p3at.link import LinkLostError, open_link
from sdt_tools.robot.p3at.odometry import Odometer
from sdt_tools.robot.p3at.session import STANDSTILL, Session, open_session
from sdt_tools.robot.p3at.status import Status, decode_status
from sdt_tools.robot.p3at.wheel import Wheel

NAME: Final = "p3at"
_ROOM: Final = 6000
"""Ten minutes of poses that nobody reads."""
_SETTLES_NS: Final = SECOND_NS
"""So long after its motors were switched on the base may still say that they are off, until it first says otherwise."""
_GIVES_UP_FACTOR: Final = 3
_TRY_AGAIN_S: Final = 0.5
_FAREWELL_S: Final = 1.0


class P3atBase:
    """A session with the base, kept up by a thread of its own. Implements Base.

    The thread sends the newest command at once and again every ``refresh_s``, within the limits. A motion ends by
    itself when it is not commanded again for ``command_lasts_s``. Where the base falls silent, where its emergency
    button is pressed, its motors are switched off or ``emergency`` is pulled, it is told to stand and nothing commanded
    before moves it again; commands are taken again when it has come back, or the stop is released. ``close``, or the
    end of the interpreter, leaves it standing with its motors off. What ends the process at once (``kill -9``, or
    SIGTERM where nobody handles it) leaves it to the base's own watchdog.

    Raises DeviceError where there is no base. ``read`` gives poses, and what there is to tell.
    """

    config_model: ClassVar[type[P3atConfig]] = P3atConfig

    def __init__(
        self, config: P3atConfig, emergency: EmergencyStop | None = None, clock: HostClock | None = None
    ) -> None:
        self.emergency = EmergencyStop() if emergency is None else emergency
        self.status: Status | None = None
        """The newest that the base has said."""
        self._config = config
        self._clock = HostClock() if clock is None else clock
        self._arrivals = Arrivals(_ROOM)
        self._wheel = Wheel(config)
        self._closing = threading.Event()
        self._emergency_news = threading.Event()
        self._woken, self._wake = socket.socketpair()
        self._wake.setblocking(False)
        self._silent = False
        self._heard_ns = monotonic_ns()
        self._enabled_ns = monotonic_ns()
        self._dropped_told = 0
        self._failure: Exception | None = None
        try:
            self.session = self._connect(config)
        except BaseException:
            self._woken.close()
            self._wake.close()
            raise
        self._odometer = Odometer(config, self.session.model)
        self._health = Health(self._low_battery_v())
        self._introduce()
        self._thread = threading.Thread(target=self._run, name=NAME, daemon=True)
        atexit.register(self.close)
        self.emergency.tell(self._emergency_turned)
        self._thread.start()

    def command(self, twist: Twist) -> None:
        """Drive with ``twist``. Nothing happens while the base is lost or the emergency stop is pulled."""
        self._wheel.command(twist, monotonic_ns())
        self._wake_up()

    def read(self, until_ns: int) -> list[Received | RawPicture]:
        """Poses and log entries received up to ``until_ns`` and not read before, in order of arrival.

        Raises RunError where the thread has failed.
        """
        if self._failure is not None:
            raise RunError(
                f"the base's driver failed ({type(self._failure).__name__}: {self._failure}); it was stopped"
            )
        received = self._arrivals.take(until_ns)
        dropped = self._arrivals.dropped - self._dropped_told
        if dropped:
            self._dropped_told += dropped
            now_ns = min(until_ns, self._clock.now_ns())
            text = f"{dropped} messages of the base were dropped: nobody has read them"
            received.append(Received(now_ns, LogEntry(now_ns, LogLevel.WARNING, text, NAME)))
        return received

    def close(self) -> None:
        """Leave the base standing, its motors off. May be called twice."""
        atexit.unregister(self.close)
        if self._closing.is_set():
            return
        self._closing.set()
        self._wake_up()
        self._thread.join(_FAREWELL_S)
        if not self._thread.is_alive():
            self._woken.close()
            self._wake.close()

    def __enter__(self) -> "P3atBase":
        return self

    def __exit__(self, *exception: object) -> None:
        self.close()

    # the thread

    def _run(self) -> None:
        try:
            while not self._closing.is_set():
                lost = self._serve()
                if lost:
                    self._reconnect(lost)
        except Exception as error:
            self._failure = error
            raise
        finally:
            moves = self._wheel.turns or (self.status is not None and self.status.rolls)
            self._wheel.hold()
            self.session.close(at_once=moves)

    def _serve(self) -> str:
        """Talk with the base until the session is to end, or is lost; why it is lost, empty where it is not."""
        self._heard_ns = monotonic_ns()
        self._take_commands()
        refresh_ns = round(self._config.refresh_s * SECOND_NS)
        due_ns = monotonic_ns()
        try:
            wire, woken = self.session.link.fileno(), self._woken.fileno()
            while not self._closing.is_set():
                left_s = max(0, due_ns - monotonic_ns()) / SECOND_NS
                ready = select.select([wire, woken], [], [], left_s)[0]
                if woken in ready:
                    self._woken.recv(4096)
                if wire in ready:
                    self._hear(self.session.link.read())
                if self._emergency_news.is_set():
                    self._emergency_news.clear()
                    self._obey_emergency()
                silent_s = (monotonic_ns() - self._heard_ns) / SECOND_NS
                self._note_silence(silent_s)
                if silent_s > _GIVES_UP_FACTOR * self._config.silent_s:
                    return f"silent for {silent_s:.1f} s"
                if woken in ready or monotonic_ns() >= due_ns:
                    self._send()
                    due_ns = monotonic_ns() + refresh_ns
        except LinkLostError as error:
            return str(error)
        return ""

    def _send(self) -> None:
        if self._wheel.expires(monotonic_ns()):
            self._tell(LogLevel.WARNING, f"no command for {self._config.command_lasts_s:g} s: the base stops")
        if self.emergency.reason:  # whatever the wheel says: who frees it may not have heard yet
            self.session.link.write(b"".join((encode(Code.ESTOP), *STANDSTILL)))
        else:
            self.session.link.write(self._wheel.packets(self.status))

    def _hear(self, data: bytes) -> None:
        bad = self.session.splitter.bad_checksums
        for body in self.session.splitter.feed(data):
            status = decode_status(body)
            if status is not None:
                self._take(status, len(body))
        if self.session.splitter.bad_checksums > bad:
            self._tell(LogLevel.WARNING, f"{self.session.splitter.bad_checksums} packets with a bad checksum so far")

    def _take(self, status: Status, size: int) -> None:
        self.status = status
        self._heard_ns = monotonic_ns()
        if self._silent:
            self._silent = False
            self._tell(LogLevel.INFO, "the base speaks again; it stands until it is commanded anew")
            self._take_commands()
        for level, text in self._health.remarks(status):
            self._tell(level, text)
        if status.motors_on and not status.button_pressed:
            self._enabled_ns = 0
        elif self._heard_ns - self._enabled_ns > _SETTLES_NS:
            if status.button_pressed:
                self.emergency.pull("the base's emergency button is pressed")
            else:
                self.emergency.pull("the base's motors were switched off")
        if not self._odometer.follow(status):
            self._tell(LogLevel.WARNING, "the base's odometry has jumped; it goes on from where it was")
        now_ns = self._clock.now_ns()
        on_its_way_ns = round(size * self.session.link.byte_s * SECOND_NS)
        self._arrivals.put(Received(now_ns, Odometry(now_ns - on_its_way_ns, self._odometer.pose)))

    def _note_silence(self, silent_s: float) -> None:
        if not self._silent and silent_s > self._config.silent_s:
            self._silent = True
            self._wheel.hold()
            self._tell(LogLevel.ERROR, f"the base is silent for {silent_s:.2f} s: it is told to stand")

    def _obey_emergency(self) -> None:
        reason = self.emergency.reason
        if reason:
            self._tell(LogLevel.ERROR, f"emergency stop: {reason}")
            return
        self._tell(LogLevel.INFO, "the emergency stop is released; the base stands until it is commanded anew")
        self.session.link.write(encode(Code.ENABLE, 1))
        self._enabled_ns = monotonic_ns()
        if not self._silent:
            self._take_commands()

    def _take_commands(self) -> None:
        if not self.emergency.reason:
            self._wheel.free()

    # connecting

    def _connect(self, config: P3atConfig) -> Session:
        link = open_link(config.address, config.baud, config.connect_s)
        try:
            session = open_session(link, config, self._closing.is_set)
        except LinkLostError as error:
            link.close()
            raise DeviceError(f"base at {config.address}: {error}; is another program using it?") from None
        except BaseException:
            link.close()
            raise
        self._enabled_ns = monotonic_ns()
        return session

    def _reconnect(self, why: str) -> None:
        """Try until the base is back, or the session is to end."""
        self._wheel.hold()
        self.session.close(at_once=True)
        self._silent = False
        lost_ns = monotonic_ns()
        self._tell(LogLevel.ERROR, f"the base is lost ({why}); trying to reach it again")
        while not self._closing.is_set():
            try:
                self.session = self._connect(self._config)
            except DeviceError:
                self._closing.wait(_TRY_AGAIN_S)
                continue
            self._odometer.reconnected()
            gone_s = (monotonic_ns() - lost_ns) / SECOND_NS
            self._tell(LogLevel.INFO, f"the base is back after {gone_s:.1f} s; it stands until it is commanded anew")
            return

    def _introduce(self) -> None:
        session, settings = self.session, self.session.settings
        if settings is None:
            self._tell(LogLevel.WARNING, "the base does not tell its settings: its watchdog time is not known")
            return
        self._tell(
            LogLevel.INFO,
            f"{session.kind} {session.model} '{session.name}', serial {settings.serial}; "
            f"its watchdog stops it after {settings.watchdog_ms} ms",
        )
        if not settings.watchdog_ms:
            self._tell(LogLevel.ERROR, "the base's watchdog is off: a program that dies leaves it moving")

    def _low_battery_v(self) -> float:
        settings = self.session.settings
        return max(self._config.low_battery_v, 0.0 if settings is None else settings.low_battery_v)

    # little things

    def _emergency_turned(self, reason: str) -> None:
        if reason:
            self._wheel.hold()
        self._emergency_news.set()
        self._wake_up()

    def _wake_up(self) -> None:
        with suppress(OSError):  # it is awake, or gone
            self._wake.send(b"!")

    def _tell(self, level: LogLevel, text: str) -> None:
        now_ns = self._clock.now_ns()
        self._arrivals.put(Received(now_ns, LogEntry(now_ns, level, text, NAME)))
