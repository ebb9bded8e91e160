"""A watchdog: the robot stands when nobody looks, nobody decides, or nobody could stop it."""

import threading
from collections.abc import Callable
from typing import Final

from pydantic import Field

from sdt_tools.clock import SECOND_NS, HostClock
from sdt_tools.config import Config
from sdt_tools.emergency import EmergencyStop
from sdt_tools.errors import RunError
from sdt_tools.frames import LidarScan, LogEntry, LogLevel, Received, Twist
from sdt_tools.protocols import Actuator

NAME: Final = "watchdog"
_REST: Final = Twist(0.0, 0.0)
_END_S: Final = 1.0


class WatchdogConfig(Config):
    """How long the robot drives without a scan, and without a decision; and how often that is looked at."""

    scan_s: float = Field(default=0.2, gt=0)
    decision_s: float = Field(default=0.2, gt=0)
    look_s: float = Field(default=0.02, gt=0)


class Watchdog:
    """Passes twists on to ``below`` while all is well. Implements Actuator and Observer; use it as a context.

    It has to see the scans. A thread of its own stops the robot when no scan or no command has come in time, so that a
    loop that hangs, a sensor that is silent and a driver that thinks too long are all noticed; it goes on with the next
    command that comes while scans do. While ``emergency`` is pulled, or the operator is gone, it stands. On leaving
    the context, by an exception too, it stands. ``below`` is called by one thread at a time.
    """

    def __init__(
        self,
        below: Actuator,
        config: WatchdogConfig | None = None,
        emergency: EmergencyStop | None = None,
        clock: HostClock | None = None,
    ) -> None:
        self._below = below
        self._config = WatchdogConfig() if config is None else config
        self._emergency = EmergencyStop() if emergency is None else emergency
        self._clock = HostClock() if clock is None else clock
        self._lock = threading.RLock()
        self._moves = False
        self._scan_ns = self._command_ns = self._clock.now_ns()
        self._operator_gone = ""
        self._entries: list[LogEntry] = []
        self._failure: Exception | None = None
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run, name=NAME, daemon=True)
        self._emergency.tell(self._emergency_turned)
        self._thread.start()

    def command(self, twist: Twist) -> None:
        """Drive with ``twist`` while all is well, else stand. Raises RunError where the robot could not be stopped."""
        if self._failure is not None:
            raise RunError(f"the robot could not be stopped ({self._failure})") from self._failure
        with self._lock:
            now_ns = self._clock.now_ns()
            self._command_ns = now_ns
            if twist != _REST and self._why_not(now_ns):
                self._stop(self._why_not(now_ns))
            else:
                self._moves = twist != _REST
                self._below.command(twist)

    def observe(self, received: Received) -> None:
        """Note that a scan has come."""
        if isinstance(received.message, LidarScan):
            self._scan_ns = self._clock.now_ns()

    def operator_gone(self, why: str) -> None:
        """Stand until ``operator_back``: nobody could stop the robot. May be called from any thread."""
        with self._lock:
            self._operator_gone = why
            self._stop(why)

    def operator_back(self) -> None:
        """Somebody is there again; the robot stands until it is commanded anew."""
        with self._lock:
            self._operator_gone = ""

    def entries(self) -> list[LogEntry]:
        """What it has to say since the last call."""
        with self._lock:
            said, self._entries = self._entries, []
        return said

    def close(self) -> None:
        """Stop the robot, and watch no more. May be called twice."""
        if self._ended.is_set():
            return
        self._ended.set()
        self._thread.join(_END_S)
        with self._lock:
            self._moves = False
            self._below.command(_REST)

    def __enter__(self) -> "Watchdog":
        return self

    def __exit__(self, *exception: object) -> None:
        self.close()

    def _why_not(self, now_ns: int) -> str:
        """Why the robot must not move; empty where it may."""
        if self._operator_gone or self._emergency.reason:
            return self._operator_gone or self._emergency.reason
        for what, last_ns, most_s in (
            ("scan", self._scan_ns, self._config.scan_s),
            ("decision", self._command_ns, self._config.decision_s),
        ):
            if now_ns - last_ns > most_s * SECOND_NS:
                return f"no {what} for {(now_ns - last_ns) / SECOND_NS:.2f} s"
        return ""

    def _stop(self, why: str) -> None:
        """Command standstill, and say why where the robot moved."""
        if self._moves:
            self._moves = False
            now_ns = self._clock.now_ns()
            self._entries.append(LogEntry(now_ns, LogLevel.WARNING, f"{why}: the robot stops", NAME))
        self._below.command(_REST)

    def _emergency_turned(self, reason: str) -> None:
        if reason:
            self._guarded(lambda: self._stop(reason))

    def _run(self) -> None:
        while not self._ended.wait(self._config.look_s):
            self._guarded(self._look)

    def _look(self) -> None:
        why = self._why_not(self._clock.now_ns()) if self._moves else ""
        if why:
            self._stop(why)

    def _guarded(self, act: Callable[[], None]) -> None:
        """Do ``act`` alone; whoever commands next learns of its failure."""
        with self._lock:
            try:
                act()
            except Exception as error:
                self._failure = error
