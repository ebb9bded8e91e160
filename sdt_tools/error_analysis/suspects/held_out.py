"""Out-of-fold answers: every recording is answered by a network that learnt from others alone."""

from collections.abc import Callable

import numpy as np
import polars as pl
import torch
from jaxtyping import Bool, Float32, Int64

from sdt_tools.error_analysis.suspects.options import SuspectOptions
from sdt_tools.error_analysis.suspects.sources import Judged, LabelledScans, softmax
from sdt_tools.errors import UsageError
from sdt_tools.frames import MotionClass
from sdt_tools.models.follow_net import new_follow_net
from sdt_tools.models.loaded import logits_of
from sdt_tools.models.preprocess import resolve_codes
from sdt_tools.runs.local import Progress
from sdt_tools.training.augment import VariedBatches
from sdt_tools.training.loop import Batch, run_loop


def judge_held_out(scans: LabelledScans, options: SuspectOptions, progress: Progress | None = None) -> Judged:
    """Train a follow network a fold, on the labels of the others as they are, and let it answer the fold's frames.

    ``progress`` counts epochs over all folds. The same seed gives the same answers. Raises UsageError where there are
    fewer recordings than folds, RunError where a training diverges.
    """
    fold = folds_of(scans.keys, options)
    logits = np.empty((len(scans.labels), len(MotionClass)), np.float32)
    epochs = options.training.loop.epochs
    for number in range(options.folds):

        def report(epoch: int, done: int = number * epochs) -> None:
            if progress:
                progress(done + epoch, options.folds * epochs)

        held_out = fold == number
        logits[held_out] = _answers(scans, held_out, options, number, report)
    return Judged(scans.keys, scans.labels, softmax(logits.astype(np.float64)))


def folds_of(keys: pl.DataFrame, options: SuspectOptions) -> Int64[np.ndarray, "frames"]:
    """The fold of each frame: whole recordings, dealt out by the seed so that folds hold about as many frames.

    Raises UsageError for fewer recordings than folds.
    """
    recordings = keys.group_by("recording_id").len().sort("recording_id")
    if len(recordings) < options.folds:
        raise UsageError(
            f"{len(recordings)} recordings for {options.folds} folds: each fold needs a recording of its own; "
            "give more recordings, or fewer folds"
        )
    shuffled = np.random.default_rng(options.seed).permutation(len(recordings))
    counts = recordings["len"].to_numpy()
    order = shuffled[np.argsort(-counts[shuffled], kind="stable")]
    filled = np.zeros(options.folds, np.int64)
    fold = {}
    names = recordings["recording_id"].to_list()
    for place in order.tolist():
        emptiest = int(np.argmin(filled))
        fold[names[place]] = emptiest
        filled[emptiest] += counts[place]
    numbers: Int64[np.ndarray, "frames"] = keys["recording_id"].replace_strict(fold, return_dtype=pl.Int64).to_numpy()
    return numbers


def _answers(
    scans: LabelledScans,
    held_out: Bool[np.ndarray, "frames"],
    options: SuspectOptions,
    fold: int,
    report: Callable[[int], None],
) -> Float32[np.ndarray, "held classes"]:
    """Logits of the frames ``held_out``, by a network trained on the others."""
    config = options.training
    seed = (options.seed + config.seed) * options.folds + fold
    network = new_follow_net(config.architecture, config.preprocess, seed)
    ranges_m, labels = scans.ranges_m[~held_out].astype(np.float32), scans.labels[~held_out]
    batches = VariedBatches(ranges_m, labels, config.batch_size, config.augment, config.preprocess, seed)
    resolved = resolve_codes(scans.ranges_m[held_out].astype(np.float32), config.preprocess)
    validation = Batch(torch.from_numpy(resolved), torch.tensor(scans.labels[held_out]))
    run_loop(network, batches, validation, config.loop, seed, lambda record: report(record.epoch))
    return logits_of(network, scans.ranges_m[held_out])
