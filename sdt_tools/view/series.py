"""Numbers over time: losses of the models, the nearest distance ahead, codes among the rays, speed."""

from collections.abc import Sequence

import numpy as np
import rerun as rr
from jaxtyping import Float64, Int64

from sdt_tools.view import entities, palette
from sdt_tools.view.decisions import ModelTrack
from sdt_tools.view.palette import Rgb
from sdt_tools.view.timeline import Rows, send, when


def send_losses(
    stream: rr.RecordingStream, models: Sequence[ModelTrack], scan_stamps_ns: Int64[np.ndarray, "scans"]
) -> None:
    """The cross-entropy of each model on its labelled frames."""
    for number, track in enumerate(models):
        known = np.isfinite(track.loss)
        entity = entities.loss(track.model)
        style_series(stream, entity, track.model, palette.model_color(number))
        send_scalars(stream, entity, when(track.stamps_ns[known], scan_stamps_ns), track.loss[known])


def send_scalars(stream: rr.RecordingStream, entity: str, rows: Rows, values: Float64[np.ndarray, "rows"]) -> None:
    """One curve; what is not finite is left out."""
    known = np.isfinite(values)
    send(stream, entity, rows.at(known), rr.Scalars.columns(scalars=values[known]))


def style_series(stream: rr.RecordingStream, entity: str, name: str, color: Rgb) -> None:
    """A curve's name and colour."""
    stream.log(entity, rr.SeriesLines(names=name, colors=color, widths=1.5), static=True, strict=True)


def style_sensor_series(stream: rr.RecordingStream) -> None:
    """Names and colours of the curves that every recording has."""
    style_series(stream, entities.FRONT_RANGE, "nearest ahead, m", (255, 138, 101))
    style_series(stream, entities.CODE_SHARE, "rays without distance, %", palette.QUIET)
    style_series(stream, entities.SPEED, "commanded speed, m/s", palette.MODES["active"])
