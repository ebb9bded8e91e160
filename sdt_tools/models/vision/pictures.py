"""From a camera's picture to the pixels that a vision network sees, up to its first layer.

Attacks count their steps on these pixels: red, green, blue in 8 bits, after resizing and before normalisation.
"""

import cv2
import numpy as np
import simplejpeg
from jaxtyping import UInt8

from sdt_tools.dataset.pictures import is_jpeg
from sdt_tools.errors import RecordingError
from sdt_tools.models.vision.config import ImagePreprocessConfig


def decode_picture(data: bytes) -> UInt8[np.ndarray, "height width 3"]:
    """A compressed picture as blue, green, red; a grey one has three equal colours.

    Raises RecordingError for one that cannot be decoded or, as a JPEG, is damaged: most decoders would fill it up.
    """
    if is_jpeg(data):
        try:
            return np.asarray(simplejpeg.decode_jpeg(data, "BGR", strict=True), np.uint8)
        except ValueError as error:
            raise RecordingError(f"a JPEG picture of {len(data)} bytes that is damaged: {error}") from None
    picture = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR_BGR) if data else None
    if picture is None:
        raise RecordingError(f"a picture of {len(data)} bytes that cannot be decoded")
    return np.asarray(picture, np.uint8)


def resize_picture(
    image_bgr_u8: UInt8[np.ndarray, "rows columns *colours"], config: ImagePreprocessConfig
) -> UInt8[np.ndarray, "height width 3"]:
    """Red, green, blue at the size that the network sees; a grey picture, of one colour, is taken for three equal ones.

    Shrunk by area, so that no pixel is left out; enlarged along lines. Raises RecordingError for other channels.
    """
    if image_bgr_u8.ndim == 2 or image_bgr_u8.shape[2] == 1:
        image_bgr_u8 = np.repeat(image_bgr_u8.reshape(*image_bgr_u8.shape[:2], 1), 3, axis=2)
    if image_bgr_u8.shape[2] != 3 or not image_bgr_u8.size:
        raise RecordingError(f"a picture of shape {list(image_bgr_u8.shape)}; [height, width, 3] or grey is needed")
    rows, columns = image_bgr_u8.shape[:2]
    if (rows, columns) != (config.height, config.width):
        shrinks = rows >= config.height and columns >= config.width
        how = cv2.INTER_AREA if shrinks else cv2.INTER_LINEAR
        image_bgr_u8 = cv2.resize(image_bgr_u8, (config.width, config.height), interpolation=how)
    return np.ascontiguousarray(image_bgr_u8[:, :, ::-1])
