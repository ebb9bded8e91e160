"""The learning curve, as a table and as a picture."""

import csv
import io
from collections.abc import Sequence
from dataclasses import asdict, fields

from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator, PercentFormatter

from sdt_tools.training.loop import EpochRecord

_TRAIN, _VAL = "#8a8f98", "#1f6feb"


def curve_csv(history: Sequence[EpochRecord]) -> bytes:
    """One row an epoch, a header first."""
    text = io.StringIO()
    writer = csv.DictWriter(text, [field.name for field in fields(EpochRecord)], lineterminator="\n")
    writer.writeheader()
    for record in history:
        row = asdict(record)
        writer.writerow({name: f"{value:.6g}" if isinstance(value, float) else value for name, value in row.items()})
    return text.getvalue().encode()


def curve_png(history: Sequence[EpochRecord], kept_epoch: int, title: str) -> bytes:
    """Loss and accuracy over the epochs, the kept one marked."""
    epochs = [record.epoch for record in history]
    figure = Figure(figsize=(9.0, 3.6), layout="constrained")
    loss, accuracy = figure.subplots(1, 2)
    loss.plot(epochs, [record.train_loss for record in history], color=_TRAIN, label="training, as varied")
    loss.plot(epochs, [record.val_loss for record in history], color=_VAL, label="validation")
    loss.set(xlabel="epoch", title="cross-entropy", ylim=(0.0, None))
    accuracy.plot(epochs, [record.train_accuracy for record in history], color=_TRAIN, label="training, as varied")
    accuracy.plot(epochs, [record.val_accuracy for record in history], color=_VAL, label="validation")
    kept = history[kept_epoch - 1]
    accuracy.plot([kept.epoch], [kept.val_accuracy], "o", color=_VAL, label=f"kept: {kept.val_accuracy:.1%}")
    accuracy.set(xlabel="epoch", title="accuracy", ylim=(0.0, 1.0))
    accuracy.yaxis.set_major_formatter(PercentFormatter(1.0, decimals=0))
    for axes, place in ((loss, "upper right"), (accuracy, "lower right")):
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
        axes.grid(alpha=0.25)
        axes.legend(loc=place, frameon=False)
        axes.spines[["top", "right"]].set_visible(False)
    figure.suptitle(title)
    picture = io.BytesIO()
    figure.savefig(picture, format="png", dpi=120)
    return picture.getvalue()
