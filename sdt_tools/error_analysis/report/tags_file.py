"""The tags of all frames as a file: Parquet, one row a frame, with what it was made from in its metadata."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import polars as pl

from sdt_tools.error_analysis.explain import Explanation
from sdt_tools.error_analysis.labelled import LabelledFrames
from sdt_tools.error_analysis.tagging import tag_columns

TAGS_KEY: Final = "sdt.error_tags"
"""Key of the Parquet metadata; its value is JSON: conditions, ε, every option, code version, hashes of the inputs."""
KEY_COLUMNS: Final = ("recording", "recording_id", "stamp_ns", "model", "label", "predicted", "loss_ce")
ROWS_A_GROUP: Final = 1 << 16


def tag_table(frames: LabelledFrames, explanation: Explanation) -> pl.LazyFrame:
    """One row a frame: its key, loss, tag, the literal Definition 1, neighbours, and membership of each condition."""
    keys = frames.table.lazy().select(KEY_COLUMNS)
    losses = pl.LazyFrame({"loss": frames.loss, "error": frames.wrong})
    inside = {f"condition_{number}": mask for number, mask in enumerate(explanation.search.inside, start=1)}
    columns = [keys, losses, tag_columns(explanation.tagged, frames.wrong).lazy(), pl.LazyFrame(inside)]
    return pl.concat(columns, how="horizontal")


def write_tags(table: pl.LazyFrame, path: Path, made_from: Mapping[str, object]) -> None:
    """Stream ``table`` to ``path``, a row group at a time, with ``made_from`` in its metadata."""
    metadata = {TAGS_KEY: json.dumps(made_from, ensure_ascii=False)}
    table.sink_parquet(path, compression="zstd", row_group_size=ROWS_A_GROUP, metadata=metadata)


def read_made_from(path: Path) -> dict[str, Any]:
    """What a tags file says of itself; empty for files that say nothing."""
    found = pl.read_parquet_metadata(path).get(TAGS_KEY)
    made_from: dict[str, Any] = json.loads(found) if found else {}
    return made_from
