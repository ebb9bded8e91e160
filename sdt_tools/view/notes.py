"""What a recording says in small messages besides poses and commands: signals, log, and where sensors are mounted."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final

import numpy as np

from sdt_tools.frames import (
    FRAME_BASE,
    FRAME_LIDAR,
    CameraCalibration,
    FrameTransform,
    LogEntry,
    OperatorState,
    Received,
)
from sdt_tools.recording.messages.topics import CAMERA_CALIBRATION, OPERATOR_STATE, SESSION_LOG, TRANSFORM
from sdt_tools.top_view import Mount

NOTE_TOPICS: Final = (OPERATOR_STATE, SESSION_LOG, TRANSFORM, CAMERA_CALIBRATION)
USUAL_MOUNT: Final = Mount()
USUAL_WIDTH_PX: Final = 640


@dataclass(frozen=True)
class Notes:
    """Signals and log in order of stamps; the LiDAR's mount and the width of the camera's pictures, as last told."""

    signals: tuple[OperatorState, ...] = ()
    log: tuple[LogEntry, ...] = ()
    mount: Mount = USUAL_MOUNT
    image_width_px: int = USUAL_WIDTH_PX


def read_notes(messages: Iterable[Received]) -> Notes:
    """Gather the notes among ``messages``; the others are passed over."""
    signals: list[OperatorState] = []
    log: list[LogEntry] = []
    mount, width_px = USUAL_MOUNT, USUAL_WIDTH_PX
    for received in messages:
        match received.message:
            case OperatorState() as signal:
                signals.append(signal)
            case LogEntry() as entry:
                log.append(entry)
            case FrameTransform() as transform if is_lidar_mount(transform):
                mount = mount_of(transform)
            case CameraCalibration(width=width):
                width_px = width
            case _:
                pass
    signals.sort(key=lambda signal: signal.stamp_ns)
    log.sort(key=lambda entry: entry.stamp_ns)
    return Notes(tuple(signals), tuple(log), mount, width_px)


def is_lidar_mount(transform: FrameTransform) -> bool:
    """Whether a transform says where the LiDAR stands on the robot."""
    return (transform.parent, transform.child) == (FRAME_BASE, FRAME_LIDAR)


def mount_of(transform: FrameTransform) -> Mount:
    """The LiDAR's place in the plane."""
    x, y, z, w = transform.rotation_xyzw
    yaw_rad = float(np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z)))
    return Mount(transform.translation_m[0], transform.translation_m[1], yaw_rad)
