"""The learning curve, as a table and as a picture."""

import csv
import io
import math
from collections.abc import Sequence
from dataclasses import asdict, fields

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator, PercentFormatter

from sdt_tools.training.record import EpochRecord, Record

_TRAIN, _VAL, _RECALL = "#8a8f98", "#1f6feb", "#7fb0f5"
_BOUND, _CERTIFIED = "#d1495b", "#2a9d8f"


def curve_csv(history: Sequence[Record]) -> bytes:
    """One row an epoch, a header first."""
    text = io.StringIO()
    writer = csv.DictWriter(text, [field.name for field in fields(history[0])], lineterminator="\n")
    writer.writeheader()
    for record in history:
        row = asdict(record)
        writer.writerow({name: f"{value:.6g}" if isinstance(value, float) else value for name, value in row.items()})
    return text.getvalue().encode()


def curve_png(history: Sequence[EpochRecord], title: str) -> bytes:
    """Loss and accuracy over the epochs; with safety domains, their bound and certified share beside them."""
    safe = history[-1].bound is not None
    figure = Figure(figsize=(13.0 if safe else 9.0, 3.6), layout="constrained")
    loss, accuracy, *bound = figure.subplots(1, 3 if safe else 2)
    _loss_panel(loss, history)
    _accuracy_panel(accuracy, history)
    for axes in bound:
        _bound_panel(axes, history)
    for axes in (loss, accuracy, *bound):
        axes.set_xlabel("epoch")
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
        axes.grid(alpha=0.25)
        axes.spines[["top", "right"]].set_visible(False)
    figure.suptitle(title)
    picture = io.BytesIO()
    figure.savefig(picture, format="png", dpi=120)
    return picture.getvalue()


def _loss_panel(axes: Axes, history: Sequence[EpochRecord]) -> None:
    epochs = [record.epoch for record in history]
    axes.plot(epochs, [record.train_loss for record in history], color=_TRAIN, label="training, as varied")
    axes.plot(epochs, [record.val_loss for record in history], color=_VAL, label="validation")
    axes.set(title="cross-entropy", ylim=(0.0, None))
    axes.legend(loc="upper right", frameon=False)


def _accuracy_panel(axes: Axes, history: Sequence[EpochRecord]) -> None:
    epochs, last = [record.epoch for record in history], history[-1]
    axes.plot(epochs, [record.train_accuracy for record in history], color=_TRAIN, label="training, as varied")
    label = f"validation: {last.val_accuracy:.1%}"
    axes.plot(epochs, [record.val_accuracy for record in history], color=_VAL, label=label)
    if not math.isnan(last.val_forward_recall):
        label = f"its forward recall: {last.val_forward_recall:.1%}"
        axes.plot(epochs, [r.val_forward_recall for r in history], color=_RECALL, linewidth=1.0, label=label)
    axes.set(title="accuracy", ylim=(0.0, 1.0))
    axes.yaxis.set_major_formatter(PercentFormatter(1.0, decimals=0))
    axes.legend(loc="lower right", frameon=False)


def _bound_panel(axes: Axes, history: Sequence[EpochRecord]) -> None:
    """The safety bound on a logarithmic scale, and the certified share on its own."""
    epochs, last = [record.epoch for record in history], history[-1]
    axes.plot(
        epochs,
        [record.bound or math.nan for record in history],
        color=_BOUND,
        label=f"largest bound: {last.bound:.2g} nats",
    )
    axes.set(title="safety domains: worst-case loss, share certified", yscale="log")
    axes.tick_params(axis="y", colors=_BOUND)
    share = axes.twinx()
    label = f"certified: {last.certified_share:.1%}"
    share.plot(epochs, [record.certified_share or 0.0 for record in history], color=_CERTIFIED, label=label)
    share.set_ylim(0.0, 1.05)
    share.yaxis.set_major_formatter(PercentFormatter(1.0, decimals=0))
    share.spines[["top"]].set_visible(False)
    handles = [*axes.get_lines(), *share.get_lines()]
    share.legend(handles, [str(line.get_label()) for line in handles], loc="center left", frameon=False)
