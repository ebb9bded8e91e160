"""What lies on disk about a recording, read for the view: journals, prediction files, tag files."""

from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import Any

import polars as pl

from sdt_tools.errors import UsageError
from sdt_tools.labeling.resolve import read_labels
from sdt_tools.labeling.vocabulary import LabelKind, journal_path
from sdt_tools.view.decisions import KEY
from sdt_tools.view.log import ViewSummary, write_rrd

ANALYSIS_TAGS = "tags.parquet"
_MORE = ("recording", "label", "predicted", "loss_ce", "neighbours", "right_neighbours")


def write_rrd_from_files(
    recording: Path,
    out: Path,
    *,
    labels_dir: Path | None = None,
    predictions: Sequence[Path] = (),
    errors: Sequence[Path] = (),
    step_tags: Collection[str] = (),
    every: int = 1,
) -> ViewSummary:
    """Write ``recording`` with its labels in ``labels_dir``, and what files say of it, to ``out``.

    ``errors`` are folders of error analyses, or the tags files in them; errors with one of the tags ``step_tags`` (all
    without) can be stepped through. Raises LabelError where ``labels_dir`` has no journal, neither of motions nor of
    gestures, of the recording, UsageError for a file that does not hold what it should, and what ``write_rrd`` raises.
    """
    return write_rrd(
        recording,
        out,
        labels=None if labels_dir is None else read_both_kinds(labels_dir, recording.stem),
        predictions=[read_predictions(path) for path in predictions],
        tags=[read_tags(path) for path in errors],
        step_tags=step_tags,
        every=every,
    )


def read_both_kinds(labels_dir: Path, stem: str) -> pl.DataFrame:
    """The resolved labels of a recording, motions and gestures. Raises LabelError where it has neither journal."""
    kinds = [kind for kind in LabelKind if journal_path(labels_dir, stem, kind).exists()]
    return pl.concat(read_labels(labels_dir, stem, kind) for kind in kinds or [LabelKind.MOTION])


def read_predictions(path: Path) -> pl.DataFrame:
    """The predictions in ``path``, as far as they are drawn. Raises UsageError where it is no prediction file."""
    from sdt_tools.replay.predictions import scan_predictions  # knows the safety domains, and with them torch

    return scan_predictions([path]).select(*KEY, "label", "predicted", "loss_ce").collect()


def read_tags(path: Path) -> pl.DataFrame:
    """The tags in ``path``, or in the analysis that it is the folder of. Raises UsageError where it holds none.

    Beside what is needed come, as far as they are there, answers, neighbours and the ``condition`` in words.
    """
    from sdt_tools.error_analysis.report.tags_file import read_made_from

    file = path / ANALYSIS_TAGS if path.is_dir() else path
    columns = [*KEY, "tag"]
    try:
        names = list(pl.read_parquet_schema(file))
        missing = set(columns) - set(names)
    except FileNotFoundError:
        raise UsageError(f"{file}: no such file; name the tags that `sdt errors` made") from None
    except (pl.exceptions.PolarsError, OSError) as error:
        raise UsageError(
            f"{file}: not a tags file ({str(error).splitlines()[0]}); make one with `sdt errors`"
        ) from None
    if missing:
        raise UsageError(f"{file}: not a tags file: it lacks the column '{min(missing)}'; make one with `sdt errors`")
    known = [name for name in names if name in {*columns, *_MORE}]
    table = pl.scan_parquet(file)
    return table.select(*known, _conditions(names, read_made_from(file)).alias("condition")).collect()


def _conditions(names: Sequence[str], made_from: Mapping[str, Any]) -> pl.Expr:
    """The texts of the conditions that a frame lies in."""
    texts = [str(condition["text"]) for condition in made_from.get("conditions", [])]
    inside = [(f"condition_{number}", text) for number, text in enumerate(texts, start=1)]
    parts = [pl.when(pl.col(name)).then(pl.lit(text)) for name, text in inside if name in names]
    return pl.concat_str(parts, separator="; ", ignore_nulls=True) if parts else pl.lit("")
