"""Pre-labels from prediction files: what a network answered, shown beside what people say and never taken for it."""

from pathlib import Path

import polars as pl

from sdt_tools.errors import LabelError
from sdt_tools.labeling.vocabulary import LabelKind

_COLUMNS = ("recording_id", "stamp_ns", "model", "predicted")


def read_predicted(path: Path, recording_id: str, kind: LabelKind, model: str | None = None) -> pl.DataFrame:
    """What a model answered to the frames of a recording: columns stamp_ns, label, model, in order of stamps.

    Without ``model`` the file must hold the answers of one only. Raises LabelError, saying what to do, for a file that
    holds no predictions of this recording, of the model, or of other classes than ``kind`` has.
    """
    try:
        table = pl.scan_parquet(path).select(_COLUMNS).filter(pl.col("recording_id") == recording_id).collect()
    except FileNotFoundError:
        raise LabelError(f"{path}: no such file; name predictions that `sdt replay` made") from None
    except (pl.exceptions.PolarsError, OSError) as error:
        reason = str(error).splitlines()[0]
        raise LabelError(f"{path}: is no predictions file ({reason}); make one with `sdt replay`") from None
    if table.is_empty():
        raise LabelError(f"{path}: holds no predictions for this recording ({recording_id}); replay a model over it")
    models = table["model"].unique().sort().to_list()
    if model is None and len(models) > 1:
        raise LabelError(f"{path}: holds the answers of {', '.join(models)}; choose one with --model")
    if model is not None and model not in models:
        raise LabelError(f"{path}: holds no answers of '{model}', but of {', '.join(models)}")
    mine = table.filter(pl.col("model") == (model or models[0]))
    unknown = set(mine["predicted"].unique()) - set(kind.classes)
    if unknown:
        raise LabelError(
            f"{path}: predicts {', '.join(sorted(map(str, unknown)))}; a {kind} is one of {', '.join(kind.classes)}"
        )
    return mine.select("stamp_ns", pl.col("predicted").alias("label"), "model").sort("stamp_ns")
