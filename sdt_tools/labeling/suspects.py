"""Labels that are probably wrong, as a file: one row a frame, what it is labelled and what it should rather be."""

import os
from pathlib import Path
from typing import Final

import polars as pl

from sdt_tools.errors import LabelError

COLUMNS: Final = {
    "recording": pl.String(),  # stem of the recording's file
    "recording_id": pl.String(),
    "stamp_ns": pl.Int64(),
    "label": pl.String(),
    "suggested": pl.String(),
    "score": pl.Float64(),  # the higher, the more suspect
}


def read_suspects(path: Path, recording_id: str) -> pl.DataFrame:
    """The suspects of one recording, the most suspect first. Raises LabelError for what is no file of suspects."""
    try:
        table = pl.read_csv(path) if path.suffix == ".csv" else pl.read_parquet(path)
    except FileNotFoundError:
        raise LabelError(f"{path}: no such file of suspects; `sdt errors suspects` makes one") from None
    except (pl.exceptions.PolarsError, OSError) as error:
        reason = str(error).splitlines()[0]
        raise LabelError(f"{path}: is no file of suspects ({reason}); `sdt errors suspects` makes one") from None
    missing = [name for name in COLUMNS if name not in table.columns]
    if missing:
        lacks = ", ".join(missing)
        raise LabelError(f"{path}: is no file of suspects: it lacks {lacks}; `sdt errors suspects` makes one")
    mine = table.select(list(COLUMNS)).filter(pl.col("recording_id") == recording_id)
    try:
        return mine.cast(COLUMNS).sort("score", descending=True)  # type: ignore[arg-type]
    except pl.exceptions.PolarsError as error:
        raise LabelError(f"{path}: a column is not what it should be: {str(error).splitlines()[0]}") from None


def write_suspects(suspects: pl.DataFrame, path: Path) -> None:
    """Write ``suspects`` (the columns above, of any recordings) as CSV, or as Parquet where ``path`` says so."""
    table = suspects.select(pl.col(name).cast(dtype) for name, dtype in COLUMNS.items())
    path.parent.mkdir(parents=True, exist_ok=True)
    scratch = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        if path.suffix == ".csv":
            table.write_csv(scratch)
        else:
            table.write_parquet(scratch)
        scratch.rename(path)
    finally:
        scratch.unlink(missing_ok=True)
