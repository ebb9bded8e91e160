"""The places of frames in feature space, read from predictions of pictures."""

from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq
from jaxtyping import Float32

from sdt_tools.error_analysis.labelled import LabelledFrames
from sdt_tools.error_analysis.scratch import scratch_rows
from sdt_tools.errors import UsageError

_KEYS = ("recording", "recording_id", "stamp_ns", "model")
_ROWS_AT_ONCE = 2048


def read_features(frames: LabelledFrames, predictions: Path, scratch: Path) -> Float32[np.ndarray, "frames features"]:
    """The features of each frame, in a nameless file in the folder ``scratch``.

    They are read some at a time. Raises UsageError where frames have none, or of other lengths than the first.
    """
    starts = np.searchsorted(frames.recording, np.arange(frames.recordings + 1))
    identities = frames.table.select("recording", "recording_id")[starts[:-1]].rows()
    places = {identity: (int(starts[n]), int(starts[n + 1])) for n, identity in enumerate(identities)}
    model = frames.table["model"][0]
    features: Float32[np.ndarray, "frames features"] | None = None
    filled = np.zeros(len(frames.loss), bool)
    for identity, rows in _runs(predictions, model):
        first, end = places.get(identity, (0, 0))
        wanted_ns = frames.stamp_ns[first:end]
        stamps_ns = rows["stamp_ns"].to_numpy()
        at = np.searchsorted(wanted_ns, stamps_ns)
        found = np.zeros(len(at), bool)
        found[at < len(wanted_ns)] = wanted_ns[at[at < len(wanted_ns)]] == stamps_ns[at < len(wanted_ns)]
        if not found.any():
            continue
        values = _matrix(rows["features"].filter(pa.array(found)), predictions)
        if features is None:
            features = scratch_rows(scratch, len(filled), values.shape[1])
        if values.shape[1] != features.shape[1]:
            raise UsageError(f"{predictions}: features of different lengths; replay the model again")
        features[first + at[found]] = values
        filled[first + at[found]] = True
    if features is None or not filled.all():
        raise UsageError(f"{predictions}: {int((~filled).sum())} frames have no features; replay the model again")
    return features


def _runs(predictions: Path, model: str) -> Iterator[tuple[tuple[str, str], pa.RecordBatch]]:
    """Rows of ``model``, some at a time, each lot of one recording."""
    with pq.ParquetFile(predictions) as file:
        for batch in file.iter_batches(_ROWS_AT_ONCE, columns=[*_KEYS, "features"]):
            own = batch.filter(pc.equal(batch["model"], model))
            names = list(zip(own["recording"].to_pylist(), own["recording_id"].to_pylist(), strict=True))
            borders = [0, *(row for row in range(1, len(names)) if names[row] != names[row - 1]), len(names)]
            for first, end in pairwise(borders):
                if end > first:
                    yield names[first], own.slice(first, end - first)


def _matrix(lists: pa.Array, predictions: Path) -> Float32[np.ndarray, "rows features"]:
    """Lists of equal length as rows."""
    lengths = np.unique(np.diff(lists.offsets.to_numpy()))
    if lists.null_count or len(lengths) != 1 or lengths[0] == 0:
        raise UsageError(f"{predictions}: features are missing, or of different lengths; replay the model again")
    values: Float32[np.ndarray, "rows features"] = lists.flatten().to_numpy().astype(np.float32)
    return values.reshape(len(lists), int(lengths[0]))
