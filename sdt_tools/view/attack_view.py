"""An attacked scan in Rerun: the scan as it was, and what the attack made of it, with the answers to both."""

from collections.abc import Sequence
from pathlib import Path
from typing import Final

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from jaxtyping import Float, Float64

from sdt_tools.config import MotionConfig
from sdt_tools.frames import MotionClass
from sdt_tools.top_view import Mount, distances, hits_lidar, to_screen
from sdt_tools.view import entities, palette
from sdt_tools.view.rrd_file import RrdFile
from sdt_tools.view.scan_view import BOLD, POINT, draw_furniture, motion_strips

APPLICATION: Final = "sdt attack"
STEP: Final = "attack"
"""The timeline: 0 is the scan as it was, 1 the attacked one."""

_ANSWER: Final = "answer"
_LOGITS: Final = "logits"
_MOTION: Final = f"{entities.SCAN}/answer"
_ORIGINAL: Final = f"{entities.SCAN}/original"
_ATTACKED: Final = f"{entities.SCAN}/attacked"


def write_attack_rrd(
    original_m: Float64[np.ndarray, "rays"],
    attacked_m: Float64[np.ndarray, "rays"],
    logits: Sequence[Float[np.ndarray, "classes"]],
    title: str,
    out: Path,
) -> None:
    """Write the .rrd ``out``; ``logits`` are those of the original and of the attacked scan. Raises RunError."""
    reach_m = float(np.clip(np.percentile(attacked_m, 90) * 1.1, 1.5, 8.0))
    with RrdFile(out, APPLICATION, title, _layout(reach_m, title)) as file:
        stream = file.stream
        draw_furniture(stream, Mount(), reach_m)
        for step, (ranges_m, values) in enumerate(zip((original_m, attacked_m), logits, strict=True)):
            stream.set_time(STEP, sequence=step)
            _log_points(stream, _ORIGINAL, original_m, palette.QUIET)
            if step:
                _log_points(stream, _ATTACKED, ranges_m, palette.ZONE)
            _log_answer(stream, values, "as it was" if step == 0 else "attacked")


def _log_points(
    stream: rr.RecordingStream, entity: str, ranges_m: Float64[np.ndarray, "rays"], colour: palette.Rgb
) -> None:
    rows = ranges_m[None]
    shown = distances(rows)
    points = to_screen(hits_lidar(np.where(shown, rows, 0.0))[shown])
    stream.log(entity, rr.Points2D(points, colors=colour, radii=POINT), strict=True)


def _log_answer(stream: rr.RecordingStream, logits: Float[np.ndarray, "classes"], what: str) -> None:
    answer = MotionClass(int(np.argmax(logits)))
    strips = motion_strips(answer, MotionConfig(), Mount())
    arrow = rr.LineStrips2D(strips, colors=palette.MOTIONS[answer.label], radii=BOLD, draw_order=20.0)
    stream.log(_MOTION, arrow, strict=True)
    lines = "\n".join(f"| {motion.label} | {float(logits[motion]):.2f} |" for motion in MotionClass)
    text = f"## {what}: **{answer.label}**\n\n| motion | logit |\n|---|---:|\n{lines}"
    stream.log(_ANSWER, rr.TextDocument(text, media_type=rr.MediaType.MARKDOWN), strict=True)
    stream.log(_LOGITS, rr.BarChart(np.asarray(logits, dtype=np.float64)), strict=True)


def _layout(reach_m: float, title: str) -> rrb.Blueprint:
    scan = rrb.Spatial2DView(
        origin=entities.SCAN,
        name=f"{title} (ahead is up; grey: as it was, red: attacked)",
        background=palette.BACKGROUND,
        visual_bounds=rrb.VisualBounds2D(x_range=[-reach_m, reach_m], y_range=[-reach_m, 0.75 * reach_m]),
    )
    answers = rrb.Vertical(
        rrb.TextDocumentView(origin=_ANSWER, name="Answer"), rrb.BarChartView(origin=_LOGITS, name="Logits")
    )
    return rrb.Blueprint(
        rrb.Horizontal(scan, answers, column_shares=[2, 1]),
        rrb.TimePanel(timeline=STEP, state="expanded"),
        rrb.SelectionPanel(state="hidden"),
        rrb.BlueprintPanel(state="hidden"),
        auto_views=False,
        auto_layout=False,
    )
