"""What parts may expect of each other; the command line plugs them together."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Protocol, runtime_checkable

from sdt_tools.frames import CameraImage, Gesture, LidarScan, Mode, MotionClass, RawPicture, Received, Twist


@dataclass(frozen=True)
class SourceInfo:
    """Where a recording comes from, for its metadata: ``source`` is scene, robot or import."""

    source: str
    scenario: str = ""
    seed: int | None = None
    devices: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Observation:
    """The newest data that a driver may decide on; ``now_ns`` is the moment of the decision."""

    now_ns: int
    scan: LidarScan | None
    image: CameraImage | None


@runtime_checkable
class Source(Protocol):
    """Scans, images and poses, in order of arrival."""

    @property
    def info(self) -> SourceInfo:
        """What the source is."""
        ...

    @property
    def start_ns(self) -> int:
        """The moment that the first ``read`` starts from."""
        ...

    @property
    def finished(self) -> bool:
        """Whether the source will give nothing more (a scenario that has ended); a robot never finishes."""
        ...

    def read(self, until_ns: int) -> Iterable[Received | RawPicture]:
        """Everything received after the last call and up to ``until_ns`` (inclusive), in order of ``received_ns``.

        Pictures may come raw: whoever records encodes them, beside what else it does. In real time this runs in a
        thread of its own; where it does not come back the robot is stopped, and in the end the source is given up.
        """
        ...

    def close(self) -> None:
        """Release what the source holds; may be called twice, and while ``read`` hangs."""
        ...


@runtime_checkable
class Actuator(Protocol):
    """Something that moves."""

    def command(self, twist: Twist) -> None:
        """Drive with ``twist`` until told otherwise; may be called while a source that is the same object is read."""
        ...


@runtime_checkable
class Driver(Protocol):
    """Chooses a motion class."""

    @property
    def name(self) -> str:
        """How the driver is called in recordings, as in ``expert`` or ``policy:follow-0``."""
        ...

    def decide(self, observation: Observation) -> MotionClass:
        """The motion for the newest data."""
        ...


@dataclass(frozen=True)
class Choice:
    """A motion class, which of several drivers has chosen it, and at what share of the class's twist it is driven.

    ``intervention`` says that a person has taken over from a driver that is a program; ``mode`` is that of the
    controller. ``says`` is for the session log, once, as long as choice after choice says the same.
    """

    motion: MotionClass
    driver: str
    speed: float = 1.0
    intervention: bool = False
    mode: Mode = Mode.ACTIVE
    says: str = ""


@runtime_checkable
class Chooser(Protocol):
    """A driver that says more than a class: persons, and whoever shares the wheel with them."""

    @property
    def name(self) -> str:
        """How the driver is called in recordings."""
        ...

    def choose(self, observation: Observation) -> Choice:
        """The choice for the newest data."""
        ...


@runtime_checkable
class Gesturing(Protocol):
    """Somebody whose gestures can be asked for, as the simulated operator."""

    def show(self, gesture: Gesture) -> None:
        """Show ``gesture`` now. May be called from any thread."""
        ...


@runtime_checkable
class Expert(Protocol):
    """Knows, with the scene's truth, which motion is right now."""

    def advise(self) -> MotionClass:
        """The motion that the expert would choose at this moment."""
        ...


@runtime_checkable
class Observer(Protocol):
    """Sees what passes, without touching it."""

    def observe(self, received: Received) -> None:
        """Take note of one message."""
        ...

    def close(self) -> None:
        """The session has ended."""
        ...
