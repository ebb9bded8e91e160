"""The operator as seen from above: a circle with a nose."""

from typing import Final

import numpy as np
import rerun as rr
from jaxtyping import Float64

from sdt_tools.top_view import arc, place, to_screen
from sdt_tools.view import palette
from sdt_tools.view.scan_view import NORMAL
from sdt_tools.view.timeline import Rows, send

BODY_RADIUS_M: Final = 0.22
NOSE_M: Final = 0.35
_BODY = arc(BODY_RADIUS_M, -np.pi, np.pi)
_NOSE = np.array([[BODY_RADIUS_M, 0.0], [NOSE_M, 0.0]])


def style_operator(stream: rr.RecordingStream, entity: str) -> None:
    """How the operator is drawn, once for all rows."""
    style = rr.LineStrips2D.from_fields(
        radii=NORMAL, colors=palette.OPERATOR, labels=["operator", ""], show_labels=True, draw_order=5.0
    )
    stream.log(entity, style, static=True, strict=True)


def send_operator(stream: rr.RecordingStream, entity: str, rows: Rows, poses: Float64[np.ndarray, "rows 3"]) -> None:
    """The operator at ``poses`` (x m, y m, yaw rad) in the frame that the view shows."""
    bodies, noses = to_screen(place(_BODY, poses)), to_screen(place(_NOSE, poses))
    strips = [strip for pair in zip(bodies, noses, strict=True) for strip in pair]
    send(stream, entity, rows, rr.LineStrips2D.columns(strips=strips).partition([2] * len(poses)))
