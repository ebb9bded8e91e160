"""A data set as arrays."""

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
from jaxtyping import Float64, Int64

from sdt_tools.dataset.frames_file import COLUMNS, FRAMES_FILE, FramesHash
from sdt_tools.dataset.manifest import FORMAT, MANIFEST_FILE
from sdt_tools.dataset.select import TRAIN, VAL
from sdt_tools.errors import DatasetError
from sdt_tools.frames import RAYS


@dataclass(frozen=True, eq=False)
class FrameSet:
    """The frames of one split, in order of recording and time.

    ``ranges_m`` are as the sensor gave them, invalid codes kept; ``labels`` index the classes; ``recordings`` names the
    recording of each frame by its file's stem, ``recording_ids`` by its id.
    """

    ranges_m: Float64[np.ndarray, "frames rays"]
    labels: Int64[np.ndarray, "frames"]
    stamps_ns: Int64[np.ndarray, "frames"]
    recordings: tuple[str, ...]
    recording_ids: tuple[str, ...]

    def __len__(self) -> int:
        return len(self.labels)


@dataclass(frozen=True, eq=False)
class Dataset:
    """A data set: two splits, the label texts by index, the hash of its frames, and its manifest."""

    folder: Path
    train: FrameSet
    val: FrameSet
    classes: tuple[str, ...]
    hash: str
    manifest: Mapping[str, Any]


def load_dataset(folder: Path) -> Dataset:
    """Read the data set that ``build_dataset`` made in ``folder``.

    Raises DatasetError where it is missing or incomplete, has other than 541 rays, has no frames in a split, or its
    frames are not those that the manifest was written for.
    """
    manifest = _read_manifest(folder)
    if manifest["rays"] != RAYS:
        raise DatasetError(f"{folder}: frames of {manifest['rays']} rays, {RAYS} expected; build it from other scans")
    table = _read_frames(folder / FRAMES_FILE)
    frames_hash = _hash(table)
    if frames_hash != manifest["hash"]:
        raise DatasetError(f"{folder}: {FRAMES_FILE} is not what {MANIFEST_FILE} describes; build the data set again")
    classes = tuple(manifest["classes"])
    if len(table) and int(table["label"].to_numpy().max()) >= len(classes):
        raise DatasetError(f"{folder}: a label beyond the {len(classes)} classes of its manifest; build it again")
    train, val = (_frame_set(folder, table, split) for split in (TRAIN, VAL))
    return Dataset(folder, train, val, classes, frames_hash, manifest)


def _read_manifest(folder: Path) -> dict[str, Any]:
    path = folder / MANIFEST_FILE
    if not folder.is_dir():
        raise DatasetError(f"{folder}: no such folder; name one that 'sdt dataset build' made")
    try:
        manifest = tomllib.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise DatasetError(f"{folder}: no {MANIFEST_FILE} in it; name a folder that 'sdt dataset build' made") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise DatasetError(f"{path}: not valid TOML: {error}") from None
    missing = [key for key in ("format", "hash", "rays", "classes") if key not in manifest]
    if missing or manifest["format"] != FORMAT:
        raise DatasetError(f"{path}: not the manifest of a data set in format {FORMAT}; build the data set again")
    return manifest


def _read_frames(path: Path) -> pl.DataFrame:
    if not path.is_file():
        raise DatasetError(f"{path}: no such file; build the data set again")
    try:
        table = pl.read_parquet(path)
    except (pl.exceptions.PolarsError, OSError) as error:
        raise DatasetError(f"{path}: not readable as Parquet ({str(error).splitlines()[0]})") from None
    if tuple(table.columns) != COLUMNS:
        raise DatasetError(f"{path}: the columns are {', '.join(table.columns)}, not {', '.join(COLUMNS)}")
    ranges = table.schema["ranges_m"]
    if ranges != pl.Array(pl.Float64, RAYS):
        has = f"{ranges.size} rays" if isinstance(ranges, pl.Array) else str(ranges)
        raise DatasetError(f"{path}: ranges_m holds {has}, {RAYS} rays expected; build it from other scans")
    return table


def _hash(table: pl.DataFrame) -> str:
    digest = FramesHash()
    digest.add(
        table["split"].cast(pl.String).to_list(),
        table["recording_id"].cast(pl.String).to_list(),
        table["stamp_ns"].to_numpy(),
        table["label"].cast(pl.Int64).to_numpy(),
        table["ranges_m"].to_numpy(),
    )
    return digest.hexdigest()


def _frame_set(folder: Path, table: pl.DataFrame, split: str) -> FrameSet:
    rows = table.filter(pl.col("split").cast(pl.String) == split)
    if rows.is_empty():
        raise DatasetError(f"{folder}: no frames in '{split}'; build the data set from more labelled recordings")
    return FrameSet(
        ranges_m=rows["ranges_m"].to_numpy(),
        labels=rows["label"].cast(pl.Int64).to_numpy(),
        stamps_ns=rows["stamp_ns"].to_numpy(),
        recordings=tuple(rows["recording"].cast(pl.String).to_list()),
        recording_ids=tuple(rows["recording_id"].cast(pl.String).to_list()),
    )
