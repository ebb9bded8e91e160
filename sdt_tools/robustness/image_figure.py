"""An attacked image: as it was, what was added to it, what came of it, and what the network says to both."""

from collections.abc import Sequence
from pathlib import Path
from typing import Final

import numpy as np
from jaxtyping import Float32, UInt8
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from sdt_tools.frames import Gesture

_ORIGINAL: Final = "#8a8f98"
_ATTACKED: Final = "#d62828"


def probabilities(logits: Float32[np.ndarray, "classes"]) -> Float32[np.ndarray, "classes"]:
    """The softmax."""
    grown = np.exp(logits - logits.max())
    shares: Float32[np.ndarray, "classes"] = grown / grown.sum()
    return shares


def magnified_mask(
    original_u8: UInt8[np.ndarray, "height width 3"], attacked_u8: UInt8[np.ndarray, "height width 3"], epsilon: int
) -> UInt8[np.ndarray, "height width 3"]:
    """What the attack added, grey where nothing, black and white (of each colour) at ``epsilon`` steps."""
    moved = attacked_u8.astype(np.int16) - original_u8.astype(np.int16)
    magnified: UInt8[np.ndarray, "height width 3"] = np.clip(
        128.0 + moved * (127.0 / max(1, epsilon)), 0.0, 255.0
    ).astype(np.uint8)
    return magnified


def attacked_image_figure(
    original_u8: UInt8[np.ndarray, "height width 3"],
    attacked_u8: UInt8[np.ndarray, "height width 3"],
    logits: Sequence[Float32[np.ndarray, "classes"]],
    epsilon: int,
    title: str,
    out: Path,
) -> None:
    """Draw it as a PNG; ``logits`` are those of the original and of the attacked image."""
    figure = Figure(figsize=(13.0, 5.6), layout="constrained")
    FigureCanvasAgg(figure)
    grid = figure.add_gridspec(2, 3, height_ratios=(2.4, 1.0))
    mask_u8 = magnified_mask(original_u8, attacked_u8, epsilon)
    answers = [_told(values) for values in logits]
    for column, (image_u8, told) in enumerate(
        (
            (original_u8, f"as it was: {answers[0]}"),
            (mask_u8, f"what was added, magnified {127 / max(1, epsilon):.0f} times"),
            (attacked_u8, f"their sum: {answers[1]}"),
        )
    ):
        panel = figure.add_subplot(grid[0, column])
        panel.imshow(image_u8, interpolation="nearest")
        panel.set_axis_off()
        panel.set_title(told, fontsize=11)
    bars = figure.add_subplot(grid[1, :])
    places = np.arange(len(Gesture))
    for offset, values, colour, label in (
        (-0.2, logits[0], _ORIGINAL, "as it was"),
        (0.2, logits[1], _ATTACKED, "attacked"),
    ):
        drawn = bars.barh(places + offset, values, height=0.38, color=colour, label=label)
        texts = [f"{value:.1f}  ({share:.1%})" for value, share in zip(values, probabilities(values), strict=True)]
        bars.bar_label(drawn, texts, padding=4, fontsize=8)
    bars.axvline(0.0, color="black", linewidth=0.6)
    bars.set_yticks(places, [gesture.label for gesture in Gesture])
    bars.invert_yaxis()
    bars.margins(x=0.12)
    bars.set_xlabel("logit (probability)")
    bars.spines[["top", "right"]].set_visible(False)
    bars.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), frameon=False)
    figure.suptitle(title, fontsize=11)
    figure.savefig(out, dpi=110)


def _told(logits: Float32[np.ndarray, "classes"]) -> str:
    answer = Gesture(int(np.argmax(logits)))
    return f"{answer.label}, {probabilities(logits)[answer]:.1%}"
