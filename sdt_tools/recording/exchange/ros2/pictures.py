"""Uncompressed sensor_msgs/Image as the compressed pictures that recordings hold."""

from dataclasses import dataclass
from typing import Any, Final

import cv2
import numpy as np
from jaxtyping import UInt8

from sdt_tools.errors import RecordingError, UsageError

_CHANNELS: Final = {
    "bgr8": (3, None),
    "8UC3": (3, None),
    "rgb8": (3, cv2.COLOR_RGB2BGR),
    "bgra8": (4, cv2.COLOR_BGRA2BGR),
    "8UC4": (4, cv2.COLOR_BGRA2BGR),
    "rgba8": (4, cv2.COLOR_RGBA2BGR),
    "mono8": (1, None),
    "8UC1": (1, None),
    "yuv422": (2, cv2.COLOR_YUV2BGR_UYVY),
    "uyvy": (2, cv2.COLOR_YUV2BGR_UYVY),
    "yuv422_yuy2": (2, cv2.COLOR_YUV2BGR_YUY2),
    "yuyv": (2, cv2.COLOR_YUV2BGR_YUY2),
    "bayer_rggb8": (1, cv2.COLOR_BayerRGGB2BGR),
    "bayer_bggr8": (1, cv2.COLOR_BayerBGGR2BGR),
    "bayer_gbrg8": (1, cv2.COLOR_BayerGBRG2BGR),
    "bayer_grbg8": (1, cv2.COLOR_BayerGRBG2BGR),
}
"""Bytes a pixel, and how they become what OpenCV calls BGR, by the encodings of sensor_msgs."""


@dataclass(frozen=True)
class PictureFormat:
    """How pictures are compressed: JPEG of a quality from 1 to 100, or without loss as PNG."""

    name: str
    quality: int = 95

    def __post_init__(self) -> None:
        if not 1 <= self.quality <= 100:
            raise UsageError(f"--jpeg-quality {self.quality}: give a number from 1 to 100")


JPEG: Final = PictureFormat("jpeg")
LOSSLESS: Final = PictureFormat("png")


def compressed(image: Any, chosen: PictureFormat) -> bytes | None:
    """The picture in ``image``, a sensor_msgs/Image, in the format ``chosen``; None where its data is cut off.

    Raises RecordingError for an encoding that is no picture of 8 bits a channel.
    """
    pixels = _pixels(image)
    if pixels is None:
        return None
    options = [cv2.IMWRITE_JPEG_QUALITY, chosen.quality] if chosen.name == "jpeg" else []
    _, data = cv2.imencode(f".{chosen.name}", pixels, options)
    return bytes(data.data)


def _pixels(image: Any) -> UInt8[np.ndarray, "height width *channels"] | None:
    if image.encoding not in _CHANNELS:
        raise RecordingError(
            f"pictures in {image.encoding or 'no encoding'} cannot be taken over; known are {', '.join(_CHANNELS)}; "
            "choose another --image-topic, or none"
        )
    size, conversion = _CHANNELS[image.encoding]
    height, width, row_bytes = int(image.height), int(image.width), int(image.step) or int(image.width) * size
    data = np.asarray(image.data, np.uint8)
    if not height or not width or row_bytes < width * size or len(data) < height * row_bytes:
        return None
    rows = data[: height * row_bytes].reshape(height, row_bytes)[:, : width * size]
    pixels = np.ascontiguousarray(rows).reshape((height, width) if size == 1 else (height, width, size))
    return pixels if conversion is None else np.asarray(cv2.cvtColor(pixels, conversion), np.uint8)
