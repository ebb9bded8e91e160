"""What the robot saw at some frames, fetched for a page: scans as the sensor gave them, and small pictures."""

import base64
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final

import cv2
import numpy as np
from jaxtyping import Float64, Int64

from sdt_tools.clock import SECOND_NS
from sdt_tools.error_analysis.labelled import LabelledFrames
from sdt_tools.errors import RecordingError
from sdt_tools.frames import CameraImage
from sdt_tools.models.vision.pictures import decode_picture
from sdt_tools.recording.messages.topics import CAMERA_IMAGE, LIDAR_SCAN
from sdt_tools.recording.reader import Recording
from sdt_tools.replay.predictions import PredictionKind

DELIVERY_NS: Final = 2 * SECOND_NS
"""A scan is looked for among what was received at most this long before and after its stamp; else in the whole file."""
PICTURE_WIDTH: Final = 320
_QUALITY: Final = 80

Seen = Float64[np.ndarray, "rays"] | str
"""The ranges of a scan in metres, or a picture as a data address that a page can show."""


def seen_at(frames: LabelledFrames, rows: Int64[np.ndarray, "wanted"], paths: Sequence[Path]) -> Mapping[int, Seen]:
    """What was seen at some rows of ``frames``; ``paths`` are their recordings in order.

    Raises RecordingError where a recording cannot be read any more, or lacks a frame.
    """
    found: dict[int, Seen] = {}
    for number in np.unique(frames.recording[rows]).tolist():
        wanted = {int(frames.stamp_ns[row]): row for row in rows[frames.recording[rows] == number].tolist()}
        with Recording.open(paths[number]) as recording:
            pictures = frames.kind is PredictionKind.PICTURES
            at = _pictures(recording, list(wanted)) if pictures else _ranges(recording, list(wanted))
        for stamp_ns, row in wanted.items():
            if stamp_ns not in at:
                raise RecordingError(f"{paths[number]}: lacks the frame at {stamp_ns} ns; replay it again")
            found[row] = at[stamp_ns]
    return found


def _ranges(recording: Recording, stamps_ns: Sequence[int]) -> dict[int, Seen]:
    """Scans by their stamps."""
    found: dict[int, Seen] = {}
    for stamp_ns in stamps_ns:
        around = recording.messages((LIDAR_SCAN,), stamp_ns - DELIVERY_NS, stamp_ns + DELIVERY_NS)
        scan = next((m.message for m in around if m.message.stamp_ns == stamp_ns), None)
        if scan is not None:
            found[stamp_ns] = scan.ranges_m  # type: ignore[union-attr]
    missing = [stamp_ns for stamp_ns in stamps_ns if stamp_ns not in found]
    for batch in recording.scan_batches() if missing else ():
        for place in np.flatnonzero(np.isin(batch.stamps_ns, missing)).tolist():
            found[int(batch.stamps_ns[place])] = batch.ranges_m[place].copy()
    return found


def _pictures(recording: Recording, stamps_ns: Sequence[int]) -> dict[int, Seen]:
    """Pictures by their stamps."""
    found: dict[int, Seen] = {}
    frames = recording.frames(CAMERA_IMAGE)
    for stamp_ns in stamps_ns if len(frames) else ():
        row = frames.nearest(stamp_ns)
        if int(frames.stamps_ns[row]) != stamp_ns:
            continue
        image = frames.at(row).message
        assert isinstance(image, CameraImage)
        found[stamp_ns] = picture_address(image.data)
    return found


def picture_address(data: bytes) -> str:
    """A compressed picture as a data address, ``PICTURE_WIDTH`` wide at most."""
    picture_bgr_u8 = decode_picture(data)
    rows, columns = picture_bgr_u8.shape[:2]
    if columns > PICTURE_WIDTH:
        size = (PICTURE_WIDTH, max(1, round(rows * PICTURE_WIDTH / columns)))
        picture_bgr_u8 = np.asarray(cv2.resize(picture_bgr_u8, size, interpolation=cv2.INTER_AREA), np.uint8)
    _, small = cv2.imencode(".jpg", picture_bgr_u8, [cv2.IMWRITE_JPEG_QUALITY, _QUALITY])
    return "data:image/jpeg;base64," + base64.b64encode(small.tobytes()).decode("ascii")
