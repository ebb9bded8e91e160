"""An attacked image in Rerun: the original, what was added, the result, and the answers to both."""

from collections.abc import Sequence
from pathlib import Path
from typing import Final

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from jaxtyping import Float32, UInt8

from sdt_tools.frames import Gesture
from sdt_tools.robustness.image_figure import magnified_mask, probabilities
from sdt_tools.view.attack_view import APPLICATION, STEP
from sdt_tools.view.rrd_file import RrdFile

_SEEN: Final = "seen"
_MASK: Final = "mask"
_ORIGINAL: Final = "original"
_ANSWER: Final = "answer"
_LOGITS: Final = "logits"


def write_image_attack_rrd(
    original_u8: UInt8[np.ndarray, "height width 3"],
    attacked_u8: UInt8[np.ndarray, "height width 3"],
    logits: Sequence[Float32[np.ndarray, "classes"]],
    epsilon: int,
    title: str,
    out: Path,
) -> None:
    """Write the .rrd ``out``; step 0 shows the original, step 1 the attacked image. Raises RunError.

    ``logits`` are those of the original and of the attacked image. Images are kept pixel by pixel, since a JPEG would
    round the attack away.
    """
    with RrdFile(out, APPLICATION, title, _layout(title, epsilon)) as file:
        stream = file.stream
        stream.log(_ORIGINAL, rr.Image(original_u8), static=True, strict=True)
        stream.log(_MASK, rr.Image(magnified_mask(original_u8, attacked_u8, epsilon)), static=True, strict=True)
        for step, (image_u8, values) in enumerate(zip((original_u8, attacked_u8), logits, strict=True)):
            stream.set_time(STEP, sequence=step)
            stream.log(_SEEN, rr.Image(image_u8), strict=True)
            text = _answer(values, "attacked" if step else "as it was")
            stream.log(_ANSWER, rr.TextDocument(text, media_type=rr.MediaType.MARKDOWN), strict=True)
            stream.log(_LOGITS, rr.BarChart(np.asarray(values, dtype=np.float64)), strict=True)


def _answer(logits: Float32[np.ndarray, "classes"], what: str) -> str:
    answer, shares = Gesture(int(np.argmax(logits))), probabilities(logits)
    lines = "\n".join(f"| {one.label} | {float(logits[one]):.2f} | {shares[one]:.1%} |" for one in Gesture)
    return f"## {what}: **{answer.label}**\n\n| gesture | logit | probability |\n|---|---:|---:|\n{lines}"


def _layout(title: str, epsilon: int) -> rrb.Blueprint:
    pictures = rrb.Vertical(
        rrb.Spatial2DView(origin=_SEEN, name=f"{title} (step 0: as it was, step 1: attacked)"),
        rrb.Horizontal(
            rrb.Spatial2DView(origin=_ORIGINAL, name="as it was"),
            rrb.Spatial2DView(origin=_MASK, name=f"what was added, magnified {127 / max(1, epsilon):.0f} times"),
        ),
        row_shares=[3, 2],
    )
    answers = rrb.Vertical(
        rrb.TextDocumentView(origin=_ANSWER, name="Answer"), rrb.BarChartView(origin=_LOGITS, name="Logits")
    )
    return rrb.Blueprint(
        rrb.Horizontal(pictures, answers, column_shares=[2, 1]),
        rrb.TimePanel(timeline=STEP, state="expanded"),
        rrb.SelectionPanel(state="hidden"),
        rrb.BlueprintPanel(state="hidden"),
        auto_views=False,
        auto_layout=False,
    )
