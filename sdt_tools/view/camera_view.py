"""What the camera saw, and in words what the operator signals."""

from collections.abc import Sequence
from typing import Final

import rerun as rr

from sdt_tools.frames import CameraImage, Gesture, OperatorState
from sdt_tools.view import entities, palette
from sdt_tools.view.timeline import Rows, send

_COLORS: Final = {
    Gesture.IDLE: palette.ROBOT,
    Gesture.ENABLE: palette.STATUSES[palette.CORRECT],
    Gesture.DISABLE: palette.STATUSES[palette.ERROR],
}


def send_images(stream: rr.RecordingStream, rows: Rows, images: Sequence[CameraImage]) -> None:
    """Compressed pictures, as they were recorded."""
    columns = rr.EncodedImage.columns(
        blob=[image.data for image in images], media_type=[f"image/{image.format}" for image in images]
    )
    send(stream, entities.CAMERA_IMAGE, rows, columns)


def send_signals(stream: rr.RecordingStream, rows: Rows, signals: Sequence[OperatorState]) -> None:
    """The operator's true gesture, and the mode that he has asked for, as a line in the picture."""
    words = [f"gesture: {signal.gesture.label}   asked for: {signal.commanded_mode.label}" for signal in signals]
    colors = palette.packed(_COLORS[signal.gesture] for signal in signals)
    columns = [*rr.Points2D.columns(labels=words), *rr.Points2D.columns(colors=colors)]
    send(stream, entities.CAMERA_GESTURE, rows, columns)


def style_signals(stream: rr.RecordingStream, width_px: int) -> None:
    """Where the line stands: at the top of the picture, in the middle."""
    place = rr.Points2D.from_fields(positions=[[width_px / 2, 12.0]], radii=-0.1, show_labels=True, draw_order=10.0)
    stream.log(entities.CAMERA_GESTURE, place, static=True, strict=True)
