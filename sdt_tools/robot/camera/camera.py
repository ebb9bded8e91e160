"""A camera that is read all the time, so that what is handed out is always new."""

import threading
from typing import ClassVar, Final

import cv2

from sdt_tools.clock import SECOND_NS, HostClock, Pacer
from sdt_tools.errors import DeviceError
from sdt_tools.frames import LogEntry, LogLevel, RawPicture, Received
from sdt_tools.robot.arrivals import Arrivals
from sdt_tools.robot.camera.capture import Opened, SourceKind, open_capture
from sdt_tools.robot.camera.config import CameraConfig

NAME: Final = "camera"
_ROOM: Final = 4
"""Pictures that wait to be read; older ones are dropped for newer ones."""
_ROOM_FOR_ENTRIES: Final = 1000
_END_S: Final = 2.0


class Camera:
    """Reads ``config.source`` in a thread of its own until ``close``.

    A picture's stamp is the moment it was grabbed. A camera that is lost is opened again until it is back. A video file
    plays at its own rate and then has ``finished``. Raises DeviceError where the camera does not open at first.
    """

    config_model: ClassVar[type[CameraConfig]] = CameraConfig

    def __init__(self, config: CameraConfig, clock: HostClock | None = None) -> None:
        self.finished = False
        """Whether nothing comes any more: the file has ended."""
        self._config = config
        self._clock = HostClock() if clock is None else clock
        self._pictures = Arrivals(_ROOM)
        self._entries = Arrivals(_ROOM_FOR_ENTRIES)
        self._newest: RawPicture | None = None
        self._dropped_told = 0
        self._silence_told = False
        self._closing = threading.Event()
        opened = open_capture(config)
        self._last_ns = self._clock.now_ns()
        self._introduce(opened)
        self._thread = threading.Thread(target=self._run, args=(opened,), name=NAME, daemon=True)
        self._thread.start()

    @property
    def newest(self) -> RawPicture | None:
        """The newest picture, whoever has read it."""
        return self._newest

    def read(self, until_ns: int) -> list[Received | RawPicture]:
        """Pictures and log entries received up to ``until_ns`` and not read before, in order of arrival."""
        received = self._pictures.take(until_ns) + self._entries.take(until_ns)
        now_ns = min(until_ns, self._clock.now_ns())
        dropped = self._pictures.dropped - self._dropped_told
        if dropped:
            self._dropped_told += dropped
            received.append(self._entry(now_ns, LogLevel.WARNING, f"{dropped} pictures dropped: not read in time"))
        silent_s = (now_ns - self._last_ns) / SECOND_NS
        if silent_s <= self._config.silent_s:
            self._silence_told = False
        elif not self._silence_told and not self.finished:
            self._silence_told = True
            received.append(self._entry(now_ns, LogLevel.WARNING, f"no picture for {silent_s:.2f} s"))
        return sorted(received, key=lambda one: one.received_ns)

    def close(self) -> None:
        """Let the camera go. May be called twice."""
        self._closing.set()
        self._thread.join(_END_S)

    def __enter__(self) -> "Camera":
        return self

    def __exit__(self, *exception: object) -> None:
        self.close()

    def _run(self, opened: Opened | None) -> None:
        while opened is not None:
            try:
                self._play(opened)
            finally:
                opened.capture.release()
            if opened.kind is SourceKind.FILE:
                self.finished = True
                return
            opened = None if self._closing.is_set() else self._open_again()

    def _play(self, opened: Opened) -> None:
        """Hand out pictures until there are no more."""
        plays = opened.kind is SourceKind.FILE
        period_ns = round(SECOND_NS / (opened.rate_hz or self._config.rate_hz))
        pacer = Pacer(period_ns, self._clock, self._pause)
        while not self._closing.is_set():
            if plays:
                pacer.wait()
            is_there = opened.capture.grab()
            grabbed_ns = self._clock.now_ns()
            is_whole, image = opened.capture.retrieve() if is_there else (False, None)
            if not is_whole or image is None:
                return
            bgr = image if image.ndim == 3 else cv2.cvtColor(image, cv2.COLOR_GRAY2BGR)
            picture = RawPicture(self._clock.now_ns(), grabbed_ns, bgr)
            self._last_ns = picture.received_ns
            self._newest = picture
            self._pictures.put(picture)

    def _pause(self, wait_s: float) -> None:
        self._closing.wait(wait_s)

    def _open_again(self) -> Opened | None:
        """The camera when it is back; None where it is not wanted any more."""
        lost_ns = self._clock.now_ns()
        self._tell(LogLevel.ERROR, f"{self._config.source}: lost; trying to open it again")
        while not self._closing.wait(self._config.try_again_s):
            try:
                opened = open_capture(self._config)
            except DeviceError:
                continue
            gone_s = (self._clock.now_ns() - lost_ns) / SECOND_NS
            self._tell(LogLevel.INFO, f"{self._config.source}: back after {gone_s:.1f} s")
            return opened
        return None

    def _introduce(self, opened: Opened) -> None:
        level = LogLevel.WARNING if opened.differs(self._config) else LogLevel.INFO
        self._tell(level, opened.text(self._config))

    def _tell(self, level: LogLevel, text: str) -> None:
        self._entries.put(self._entry(self._clock.now_ns(), level, text))

    @staticmethod
    def _entry(stamp_ns: int, level: LogLevel, text: str) -> Received:
        return Received(stamp_ns, LogEntry(stamp_ns, level, text, NAME))
