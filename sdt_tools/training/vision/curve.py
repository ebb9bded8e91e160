"""The learning curve of a vision network, as a picture."""

import io
from collections.abc import Sequence
from typing import Final

from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator, PercentFormatter

from sdt_tools.training.vision.loop import VisionEpoch

_TRAIN: Final = "#8a8f98"
_VAL: Final = "#1f6feb"
_ATTACKED: Final = "#f3d5d8"


def vision_curve_png(history: Sequence[VisionEpoch], title: str) -> bytes:
    """Loss and accuracy over the epochs; those in which images were attacked are shaded."""
    figure = Figure(figsize=(9.0, 3.6), layout="constrained")
    loss, accuracy = figure.subplots(1, 2)
    epochs = [record.epoch for record in history]
    for axes, train, val, what in (
        (loss, [one.train_loss for one in history], [one.val_loss for one in history], "cross-entropy"),
        (accuracy, [one.train_accuracy for one in history], [one.val_accuracy for one in history], "accuracy"),
    ):
        for record in history:
            if record.epsilon:
                axes.axvspan(record.epoch - 0.5, record.epoch + 0.5, color=_ATTACKED, linewidth=0)
        axes.plot(epochs, train, color=_TRAIN, marker=".", label="training, as varied (and attacked)")
        axes.plot(epochs, val, color=_VAL, marker=".", label="validation, clean")
        axes.set(title=what, xlabel="epoch")
        axes.set_ylim(bottom=0.0)
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
        axes.grid(alpha=0.25)
        axes.spines[["top", "right"]].set_visible(False)
    accuracy.set_ylim(0.0, 1.02)
    accuracy.yaxis.set_major_formatter(PercentFormatter(1.0, decimals=0))
    last = history[-1]
    said = [f"training: {last.train_accuracy:.1%}", f"validation: {last.val_accuracy:.1%}"]
    accuracy.legend(accuracy.get_lines(), said, loc="lower right", frameon=False)
    attacked = [Patch(color=_ATTACKED, label="attacked epochs")] if any(record.epsilon for record in history) else []
    figure.legend(handles=[*loss.get_lines(), *attacked], loc="outside lower center", ncols=3, frameon=False)
    figure.suptitle(title)
    picture = io.BytesIO()
    figure.savefig(picture, format="png", dpi=120)
    return picture.getvalue()
