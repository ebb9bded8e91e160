"""The whole controller of the paper: the vision network switches it, the follow network drives while it is active."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np
from pydantic import Field

from sdt_tools.clock import SECOND_NS
from sdt_tools.config import Config, RateConfig
from sdt_tools.control.eyes import Eyes, Reading
from sdt_tools.control.mode_machine import ModeState, after_reading
from sdt_tools.errors import ConfigError
from sdt_tools.frames import CameraImage, Gesture, LidarScan, Mode, MotionClass
from sdt_tools.models.preprocess import PreprocessConfig, invalid_front_share
from sdt_tools.protocols import Choice, Driver, Observation
from sdt_tools.recording.live.decide import STOP

NOBODY: Final = "idle"
"""The driver's name in commands of an idle robot."""
_CODES: Final = PreprocessConfig()


class ControllerConfig(Config):
    """When the controller switches, and when it stops although it is active."""

    debounce: int = Field(default=1, ge=1)
    """Readings in a row that switch the mode; 1, the paper's, switches at once."""
    max_invalid_front_share: float = Field(default=0.3, ge=0, le=1)
    """The robot stays while more than this share of the 240 front rays are codes. 5,385 scans of a real SICK LMS1xx
    on a Pioneer P3-AT reach 0.17."""
    camera_silence_s: float = Field(default=1.0, gt=0)
    """The robot stays while no picture has been read for so long: nobody could send it to rest."""


@dataclass(frozen=True)
class VisionDecision:
    """What the picture of ``stamp_ns`` was read as, None where it could not be, and the mode before and after.

    ``since_ns`` is the stamp of the first of the readings that have switched the mode, this one's if none has.
    """

    stamp_ns: int
    gesture: Gesture | None
    before: Mode
    after: Mode
    since_ns: int
    took_s: float

    @property
    def switches(self) -> bool:
        """Whether it changed the mode."""
        return self.after is not self.before


class Controller:
    """Implements Chooser: asked at the follow rate, it has a picture read at the vision rate.

    Without ``eyes`` it is active from the beginning and always; ``follow`` may be any driver, as the expert. ``told``
    hears of every vision decision, in the thread that asks. Raises ConfigError where pictures were to be read more
    often than motions are decided.
    """

    def __init__(
        self,
        follow: Driver,
        eyes: Eyes | None,
        rates: RateConfig,
        config: ControllerConfig | None = None,
        told: Callable[[VisionDecision], None] | None = None,
    ) -> None:
        if rates.vision_hz > rates.follow_hz:
            raise ConfigError(
                f"rates.vision_hz = {rates.vision_hz:g} is above rates.follow_hz = {rates.follow_hz:g}: pictures are "
                "read when a motion is decided; lower the one or raise the other"
            )
        self.name = follow.name if eyes is None else f"{eyes.name}+{follow.name}"
        self.unreadable = 0
        self._follow = follow
        self._eyes = eyes
        self._config = config or ControllerConfig()
        self._told = told
        self._period_ns = SECOND_NS / rates.vision_hz
        self._state = ModeState(Mode.ACTIVE if eyes is None else Mode.IDLE)
        self._first_ns: int | None = None
        self._due = 0
        self._looked_at: CameraImage | None = None
        self._read_ns: int | None = None
        self._trouble = ""

    @property
    def mode(self) -> Mode:
        """Idle or active."""
        return self._state.mode

    def choose(self, observation: Observation) -> Choice:
        """What the follow network says while the robot is active and can see; else to stay."""
        if self._eyes is not None:
            self._watch(self._eyes, observation)
        if self.mode is Mode.IDLE:
            return Choice(MotionClass.STAY, NOBODY, mode=Mode.IDLE, says=self._trouble)
        why = self._blind(observation)
        if why:
            return Choice(MotionClass.STAY, STOP, says=why)
        return Choice(self._follow.decide(observation), self._follow.name, says=self._trouble)

    def close(self) -> None:
        """Let go of what reads the pictures; may be called twice."""
        if self._eyes is not None:
            self._eyes.close()

    def _watch(self, eyes: Eyes, observation: Observation) -> None:
        """Take what was read, hand on the newest picture where one is due, and take what is read at once."""
        for reading in eyes.readings():
            self._take(reading, observation.now_ns)
        if self._first_ns is None:
            self._first_ns = self._read_ns = observation.now_ns
        due = int((observation.now_ns - self._first_ns) // self._period_ns)
        image = observation.image
        if due < self._due or image is None or image is self._looked_at:
            return
        self._due, self._looked_at = due + 1, image
        eyes.look(image)
        for reading in eyes.readings():
            self._take(reading, observation.now_ns)

    def _take(self, reading: Reading, now_ns: int) -> None:
        before = self._state
        if reading.gesture is None:
            self.unreadable += 1
            self._trouble = f"a picture was not read: {reading.why}"
        else:
            self._trouble = ""
            self._read_ns = now_ns
            self._state = after_reading(before, reading.gesture, reading.stamp_ns, self._config.debounce)
        if self._told is not None:
            switched = self._state.mode is not before.mode
            since_ns = self._state.since_ns if switched else reading.stamp_ns
            self._told(
                VisionDecision(
                    reading.stamp_ns, reading.gesture, before.mode, self._state.mode, since_ns, reading.took_s
                )
            )

    def _blind(self, observation: Observation) -> str:
        """Why the robot cannot drive though it is active; empty where it can."""
        share = _invalid_share(observation.scan)
        if share > self._config.max_invalid_front_share:
            return (
                f"more than {self._config.max_invalid_front_share:.0%} of the front rays are invalid: the robot stays "
                "until they are not"
            )
        silence_s = 0.0 if self._read_ns is None else (observation.now_ns - self._read_ns) / SECOND_NS
        if self._eyes is not None and silence_s > self._config.camera_silence_s:
            return f"no picture was read for {self._config.camera_silence_s:g} s or more: the robot stays until one is"
        return ""


def _invalid_share(scan: LidarScan | None) -> float:
    return 0.0 if scan is None else float(invalid_front_share(scan.ranges_m[np.newaxis], _CODES)[0])
