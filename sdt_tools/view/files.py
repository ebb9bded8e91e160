"""What lies on disk about a recording, read for the view: journals, prediction files, tag files."""

from collections.abc import Sequence
from pathlib import Path

import polars as pl

from sdt_tools.errors import UsageError
from sdt_tools.labeling.resolve import read_labels
from sdt_tools.labeling.vocabulary import LabelKind
from sdt_tools.view.decisions import KEY
from sdt_tools.view.log import ViewSummary, write_rrd

ANALYSIS_TAGS = "tags.parquet"


def write_rrd_from_files(
    recording: Path,
    out: Path,
    *,
    labels_dir: Path | None = None,
    predictions: Sequence[Path] = (),
    tags: Sequence[Path] = (),
    every: int = 1,
) -> ViewSummary:
    """Write ``recording`` with its motion labels in ``labels_dir``, and what files say of it, to ``out``.

    A folder among ``tags`` stands for the tags in it, as an error analysis leaves them. Raises LabelError where
    ``labels_dir`` has no journal of the recording, UsageError for a file that does not hold what it should, and what
    ``write_rrd`` raises.
    """
    return write_rrd(
        recording,
        out,
        labels=None if labels_dir is None else read_labels(labels_dir, recording.stem, LabelKind.MOTION),
        predictions=[read_predictions(path) for path in predictions],
        tags=[read_tags(path) for path in tags],
        every=every,
    )


def read_predictions(path: Path) -> pl.DataFrame:
    """The predictions in ``path``, as far as they are drawn. Raises UsageError where it is no prediction file."""
    from sdt_tools.replay.predictions import scan_predictions  # knows the safety domains, and with them torch

    return scan_predictions([path]).select(*KEY, "label", "predicted", "loss_ce").collect()


def read_tags(path: Path) -> pl.DataFrame:
    """The tags in ``path``, or in the analysis that it is the folder of. Raises UsageError where it holds none."""
    file = path / ANALYSIS_TAGS if path.is_dir() else path
    columns = [*KEY, "tag"]
    try:
        missing = set(columns) - set(pl.read_parquet_schema(file))
    except FileNotFoundError:
        raise UsageError(f"{file}: no such file; name the tags that `sdt errors` made") from None
    except (pl.exceptions.PolarsError, OSError) as error:
        raise UsageError(
            f"{file}: not a tags file ({str(error).splitlines()[0]}); make one with `sdt errors`"
        ) from None
    if missing:
        raise UsageError(f"{file}: not a tags file: it lacks the column '{min(missing)}'; make one with `sdt errors`")
    return pl.read_parquet(file, columns=columns)
