"""A data set as arrays."""

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import pyarrow as pa
from jaxtyping import Float64, Int64

from sdt_tools.dataset.frames_file import FRAMES_FILE, PICTURE_SCHEMA, SCHEMA, FramesHash, Pictures, Ranges
from sdt_tools.dataset.manifest import FORMAT, MANIFEST_FILE
from sdt_tools.dataset.select import TRAIN, VAL
from sdt_tools.errors import DatasetError
from sdt_tools.frames import RAYS
from sdt_tools.labeling.vocabulary import LabelKind


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
class PictureSet:
    """The frames of one split, in order of recording and time: compressed pictures as they were recorded."""

    pictures: tuple[bytes, ...]
    labels: Int64[np.ndarray, "frames"]
    stamps_ns: Int64[np.ndarray, "frames"]
    recordings: tuple[str, ...]

    def __len__(self) -> int:
        return len(self.labels)


@dataclass(frozen=True, eq=False)
class GestureDataset:
    """A data set of pictures: as ``Dataset``."""

    folder: Path
    train: PictureSet
    val: PictureSet
    classes: tuple[str, ...]
    hash: str
    manifest: Mapping[str, Any]


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
    manifest = _read_manifest(folder, LabelKind.MOTION)
    if manifest["rays"] != RAYS:
        raise DatasetError(f"{folder}: frames of {manifest['rays']} rays, {RAYS} expected; build it from other scans")
    table, classes = _read_frames(folder, manifest, SCHEMA)
    train, val = (_frame_set(folder, table, split) for split in (TRAIN, VAL))
    return Dataset(folder, train, val, classes, manifest["hash"], manifest)


def load_gestures(folder: Path) -> GestureDataset:
    """Read the data set of pictures that ``build_dataset`` made in ``folder``. Raises DatasetError as above."""
    manifest = _read_manifest(folder, LabelKind.GESTURE)
    table, classes = _read_frames(folder, manifest, PICTURE_SCHEMA)
    train, val = (_picture_set(folder, table, split) for split in (TRAIN, VAL))
    return GestureDataset(folder, train, val, classes, manifest["hash"], manifest)


def _read_manifest(folder: Path, kind: LabelKind) -> dict[str, Any]:
    path = folder / MANIFEST_FILE
    if not folder.is_dir():
        raise DatasetError(f"{folder}: no such folder; name one that 'sdt dataset build' made")
    try:
        manifest = tomllib.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise DatasetError(f"{folder}: no {MANIFEST_FILE} in it; name a folder that 'sdt dataset build' made") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise DatasetError(f"{path}: not valid TOML: {error}") from None
    held = manifest.get("config", {}).get("kind", kind)
    if held != kind:
        raise DatasetError(f"{folder}: a data set of {held}s, where one of {kind}s is needed")
    needed = ("format", "hash", "classes", *(("rays",) if kind is LabelKind.MOTION else ()))
    missing = [key for key in needed if key not in manifest]
    if missing or manifest["format"] != FORMAT:
        raise DatasetError(f"{path}: not the manifest of a data set in format {FORMAT}; build the data set again")
    return manifest


def _read_frames(folder: Path, manifest: Mapping[str, Any], schema: pa.Schema) -> tuple[pl.DataFrame, tuple[str, ...]]:
    """The frames, found to be those of the manifest, and their classes."""
    table = _read_table(folder / FRAMES_FILE, schema)
    if _hash(table, schema) != manifest["hash"]:
        raise DatasetError(f"{folder}: {FRAMES_FILE} is not what {MANIFEST_FILE} describes; build the data set again")
    classes = tuple(manifest["classes"])
    if len(table) and int(table["label"].to_numpy().max()) >= len(classes):
        raise DatasetError(f"{folder}: a label beyond the {len(classes)} classes of its manifest; build it again")
    return table, classes


def _read_table(path: Path, schema: pa.Schema) -> pl.DataFrame:
    if not path.is_file():
        raise DatasetError(f"{path}: no such file; build the data set again")
    try:
        table = pl.read_parquet(path)
    except (pl.exceptions.PolarsError, OSError) as error:
        raise DatasetError(f"{path}: not readable as Parquet ({str(error).splitlines()[0]})") from None
    if table.columns != schema.names:
        raise DatasetError(f"{path}: the columns are {', '.join(table.columns)}, not {', '.join(schema.names)}")
    content = table.schema[schema.names[-1]]
    if schema is SCHEMA and content != pl.Array(pl.Float64, RAYS):
        has = f"{content.size} rays" if isinstance(content, pl.Array) else str(content)
        raise DatasetError(f"{path}: ranges_m holds {has}, {RAYS} rays expected; build it from other scans")
    if schema is PICTURE_SCHEMA and content != pl.Binary:
        raise DatasetError(f"{path}: picture holds {content}, not bytes; build the data set again")
    return table


def _hash(table: pl.DataFrame, schema: pa.Schema) -> str:
    digest = FramesHash(schema)
    column = table[schema.names[-1]]
    content: Ranges | Pictures = column.to_numpy() if schema is SCHEMA else column.to_list()
    digest.add(
        table["split"].cast(pl.String).to_list(),
        table["recording_id"].cast(pl.String).to_list(),
        table["stamp_ns"].to_numpy(),
        table["label"].cast(pl.Int64).to_numpy(),
        content,
    )
    return digest.hexdigest()


def _frame_set(folder: Path, table: pl.DataFrame, split: str) -> FrameSet:
    rows = _rows(folder, table, split)
    return FrameSet(
        ranges_m=rows["ranges_m"].to_numpy(),
        labels=rows["label"].cast(pl.Int64).to_numpy(),
        stamps_ns=rows["stamp_ns"].to_numpy(),
        recordings=tuple(rows["recording"].cast(pl.String).to_list()),
        recording_ids=tuple(rows["recording_id"].cast(pl.String).to_list()),
    )


def _picture_set(folder: Path, table: pl.DataFrame, split: str) -> PictureSet:
    rows = _rows(folder, table, split)
    return PictureSet(
        pictures=tuple(rows["picture"].to_list()),
        labels=rows["label"].cast(pl.Int64).to_numpy(),
        stamps_ns=rows["stamp_ns"].to_numpy(),
        recordings=tuple(rows["recording"].cast(pl.String).to_list()),
    )


def _rows(folder: Path, table: pl.DataFrame, split: str) -> pl.DataFrame:
    rows = table.filter(pl.col("split").cast(pl.String) == split)
    if rows.is_empty():
        raise DatasetError(f"{folder}: no frames in '{split}'; build the data set from more labelled recordings")
    return rows
