"""Opening a camera with OpenCV: what it was asked for, what it gives, and why it does not open."""

import os
from dataclasses import dataclass
from enum import Enum, auto
from pathlib import Path
from typing import Final

import cv2

from sdt_tools.errors import DeviceError
from sdt_tools.robot.camera.config import CameraConfig

_DEVICES: Final = Path("/dev")
_OPEN_MS: Final = 3000
_READ_MS: Final = 1000
_MANUAL_EXPOSURE: Final = 1.0  # V4L2's number for it
_RATE_TOLERANCE: Final = 0.05
_MOST_HZ: Final = 1000.0
"""Files without a rate say absurd ones."""
_LITTLE_DELAY: Final = "fflags;nobuffer|flags;low_delay|probesize;65536|analyzeduration;0"
"""FFmpeg would else look at seconds of a stream before it gives the first picture, and stay behind by them."""


class SourceKind(Enum):
    """What is behind a source's name."""

    DEVICE = auto()
    FILE = auto()
    URL = auto()


@dataclass(frozen=True)
class Opened:
    """An open camera, and what it gives. ``rate_hz`` and ``exposure`` are None where it does not say."""

    capture: cv2.VideoCapture
    kind: SourceKind
    width: int
    height: int
    rate_hz: float | None
    exposure: float | None
    backend: str

    def text(self, asked: CameraConfig) -> str:
        """What was asked for and what was got, in one line."""
        wanted, got = f"{asked.width}×{asked.height}", f"{self.width}×{self.height}"
        rate = "unknown rate" if self.rate_hz is None else f"{self.rate_hz:g} Hz"
        line = (
            f"{asked.source}: asked for {wanted} at {asked.rate_hz:g} Hz, got {got} at {rate}, through {self.backend}"
        )
        if asked.exposure is None:
            return line
        exposure = "not told" if self.exposure is None else f"{self.exposure:g}"
        return f"{line}; exposure asked {asked.exposure:g}, got {exposure}"

    def differs(self, asked: CameraConfig) -> bool:
        """Whether it gives something else than was asked for."""
        rate_differs = self.rate_hz is not None and abs(self.rate_hz / asked.rate_hz - 1.0) > _RATE_TOLERANCE
        exposure_differs = asked.exposure is not None and self.exposure != asked.exposure
        return (self.width, self.height) != (asked.width, asked.height) or rate_differs or exposure_differs


def kind_of(source: str) -> SourceKind:
    """What ``source`` names."""
    if "://" in source:
        return SourceKind.URL
    return SourceKind.DEVICE if source.isdigit() or source.startswith("/dev/") else SourceKind.FILE


def open_capture(config: CameraConfig) -> Opened:
    """The camera that ``config`` names. Raises DeviceError, saying what to try, where it does not open."""
    kind = kind_of(config.source)
    if kind is SourceKind.DEVICE:
        _check_device(config.source)
    elif kind is SourceKind.FILE and not Path(config.source).is_file():
        raise DeviceError(f"camera {config.source}: no such video file; check the path")
    cv2.utils.logging.setLogLevel(cv2.utils.logging.LOG_LEVEL_SILENT)  # what goes wrong is said here, in one line
    os.environ.setdefault("OPENCV_FFMPEG_LOGLEVEL", "-8")
    capture = _captured(config, kind)
    if not capture.isOpened():
        capture.release()
        raise DeviceError(f"camera {config.source}: {_WHY[kind]}")
    return Opened(
        capture,
        kind,
        round(capture.get(cv2.CAP_PROP_FRAME_WIDTH)),
        round(capture.get(cv2.CAP_PROP_FRAME_HEIGHT)),
        _rate_hz(capture) if kind is not SourceKind.URL else None,  # FFmpeg invents one
        capture.get(cv2.CAP_PROP_EXPOSURE) if kind is SourceKind.DEVICE else None,
        capture.getBackendName(),
    )


_WHY: Final = {
    SourceKind.DEVICE: "does not open; is another program using it, or is it no camera?",
    SourceKind.FILE: "is no video that can be read; play it with another program to see whether it is whole",
    SourceKind.URL: "gives no video; is the address right, and the camera switched on?",
}


def _captured(config: CameraConfig, kind: SourceKind) -> cv2.VideoCapture:
    if kind is SourceKind.FILE:
        return cv2.VideoCapture(config.source, cv2.CAP_FFMPEG)
    if kind is SourceKind.URL:
        timeouts = [cv2.CAP_PROP_OPEN_TIMEOUT_MSEC, _OPEN_MS, cv2.CAP_PROP_READ_TIMEOUT_MSEC, _READ_MS]
        os.environ.setdefault("OPENCV_FFMPEG_CAPTURE_OPTIONS", _LITTLE_DELAY)
        return cv2.VideoCapture(config.source, cv2.CAP_FFMPEG, timeouts)
    capture = cv2.VideoCapture(int(config.source) if config.source.isdigit() else config.source, cv2.CAP_V4L2)
    capture.set(cv2.CAP_PROP_FRAME_WIDTH, config.width)
    capture.set(cv2.CAP_PROP_FRAME_HEIGHT, config.height)
    capture.set(cv2.CAP_PROP_FPS, config.rate_hz)
    capture.set(cv2.CAP_PROP_BUFFERSIZE, 1)  # a picture that has waited is an old one
    if config.exposure is not None:
        capture.set(cv2.CAP_PROP_AUTO_EXPOSURE, _MANUAL_EXPOSURE)
        capture.set(cv2.CAP_PROP_EXPOSURE, config.exposure)
    return capture


def _check_device(source: str) -> None:
    path = _DEVICES / f"video{source}" if source.isdigit() else Path(source)
    if not path.exists():
        found = sorted(str(one) for one in _DEVICES.glob("video*"))
        known = f"there are {', '.join(found)}" if found else "there is none on this machine"
        raise DeviceError(f"camera {source}: {path} does not exist; {known}; is it plugged in?")
    if not os.access(path, os.R_OK | os.W_OK):
        raise DeviceError(
            f"camera {source}: no rights on {path}; join the group that owns it (often video) and log in again"
        )


def _rate_hz(capture: cv2.VideoCapture) -> float | None:
    rate_hz: float = capture.get(cv2.CAP_PROP_FPS)
    return rate_hz if 0.0 < rate_hz <= _MOST_HZ else None
