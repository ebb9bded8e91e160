"""The pictures of a recording: which can be read, and the bytes of those that are chosen."""

from collections.abc import Iterator
from typing import Final

import cv2
import numpy as np
import simplejpeg
from jaxtyping import Int64

from sdt_tools.frames import CameraImage
from sdt_tools.recording.messages.topics import CAMERA_IMAGE
from sdt_tools.recording.reader import Recording

_JPEG_STARTS: Final = b"\xff\xd8"
_REDUCED: Final = 8
"""To see whether a picture can be read, it is decoded at an eighth of its size."""


def picture_stamps(recording: Recording) -> tuple[Int64[np.ndarray, "pictures"], tuple[int, ...]]:
    """The stamps of all pictures that can be read, as they follow in the file, and of those that cannot."""
    stamps_ns: list[int] = []
    unreadable_ns: list[int] = []
    for image in _images(recording):
        (stamps_ns if readable(image.data) else unreadable_ns).append(image.stamp_ns)
    return np.array(stamps_ns, dtype=np.int64), tuple(unreadable_ns)


def picture_bytes(recording: Recording, positions: Int64[np.ndarray, "chosen"]) -> Iterator[tuple[int, bytes]]:
    """The compressed pictures at ``positions`` among those that can be read, each with its position, in file order."""
    wanted = frozenset(positions.tolist())
    place = 0
    for image in _images(recording):
        if readable(image.data):
            if place in wanted:
                yield place, image.data
            place += 1


def readable(data: bytes) -> bool:
    """Whether ``data`` is a whole picture."""
    if is_jpeg(data):
        return jpeg_damage(data) is None
    return bool(data) and cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_REDUCED_GRAYSCALE_8) is not None


def is_jpeg(data: bytes) -> bool:
    """Whether ``data`` begins as a JPEG does."""
    return data.startswith(_JPEG_STARTS)


def jpeg_damage(data: bytes) -> str | None:
    """What is wrong with a JPEG, in the decoder's words; None for nothing that can be seen.

    Most decoders fill up what is damaged, or missing, with grey and say nothing.
    """
    try:
        simplejpeg.decode_jpeg(data, "GRAY", min_factor=_REDUCED, strict=True)
    except ValueError as error:
        return str(error)
    return None


def _images(recording: Recording) -> Iterator[CameraImage]:
    for received in recording.messages(topics=[CAMERA_IMAGE]):
        if isinstance(received.message, CameraImage):
            yield received.message
