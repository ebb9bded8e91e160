"""What a device of the robot promises, whoever has written its driver. ``sdt robot check`` holds one against it.

Of every device: the constructor returns with the device at work, or raises DeviceError in one line that says what to
try. A thread of the device's own receives; ``read`` hands over what came, and never waits. Stamps are of ``clock``: of
each kind they ascend, and lie at or before receipt. What is worth telling (a gap, a reconnect) comes as a LogEntry
among the rest; a device that falls silent is told of as a warning, and looked for until it is back. ``close`` lets the
device go, so that it can be opened again; it may be called twice.
"""

from collections.abc import Iterable
from typing import Any, Protocol, runtime_checkable

from sdt_tools.clock import HostClock
from sdt_tools.config import Config
from sdt_tools.emergency import EmergencyStop
from sdt_tools.frames import RawPicture, Received, Twist


@runtime_checkable
class Device(Protocol):
    """What LiDARs, bases and cameras have in common."""

    def read(self, until_ns: int) -> Iterable[Received | RawPicture]:
        """Everything received after the last call and up to ``until_ns`` (inclusive), in order of ``received_ns``.

        Raises RunError where the device's own thread has failed.
        """
        ...

    def close(self) -> None:
        """Let the device go; may be called twice."""
        ...


@runtime_checkable
class Lidar(Device, Protocol):
    """A LiDAR: ``read`` gives LidarScan and LogEntry.

    A scan has 541 rays from -135° (right) to 135° (left), in metres; a ray without an echo keeps the sensor's code
    (0.000, 0.002, 0.003), and is never filled in, nan or infinite. Its stamp is when the sensor began to take it.
    Silence is told of within 200 ms. A scan's array belongs to whoever has read it: it is not written to again.
    """


@runtime_checkable
class Base(Device, Protocol):
    """A base: ``read`` gives Odometry and LogEntry, the pose where the base was when it began to stand there.

    ``command`` returns at once. A motion ends by itself within a second when it is not commanded again, and at once
    while ``emergency`` is pulled, also when the base falls silent or is closed; what was commanded before never moves
    it afterwards. Twists that are no numbers are standstill. It enforces its own speed limits.
    """

    def command(self, twist: Twist) -> None:
        """Drive with ``twist`` until told otherwise, or until it is too old."""
        ...


@runtime_checkable
class Camera(Device, Protocol):
    """A camera: ``read`` gives RawPicture and LogEntry. A picture's stamp is the moment it was grabbed.

    Its pixels are blue, green, red; its array belongs to whoever has read it. Silence is told of within a second.
    """

    finished: bool
    """Whether nothing comes any more: a film that has ended. A real camera never finishes."""


@runtime_checkable
class DeviceClass(Protocol):
    """The class of a device, called to open one.

    ``config_model`` says what can be set about it: the keys of its table in the robot's file, beside ``driver``.
    """

    config_model: type[Config]


@runtime_checkable
class LidarClass(DeviceClass, Protocol):
    """The class of a LiDAR. ``config`` is of its ``config_model``."""

    def __call__(self, config: Any, *, clock: HostClock) -> Lidar:
        """Open it."""
        ...


@runtime_checkable
class BaseClass(DeviceClass, Protocol):
    """The class of a base. ``config`` is of its ``config_model``."""

    def __call__(self, config: Any, *, emergency: EmergencyStop, clock: HostClock) -> Base:
        """Open it; it stands, ready to drive."""
        ...


@runtime_checkable
class CameraClass(DeviceClass, Protocol):
    """The class of a camera. ``config`` is of its ``config_model``."""

    def __call__(self, config: Any, *, clock: HostClock) -> Camera:
        """Open it."""
        ...
