"""The frames of a data set on disk: one Parquet row a frame, and a hash of what the rows say.

The hash is over the content, not the file: the same frames give the same hash whichever library version wrote them.
"""

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Final

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from jaxtyping import Float64, Int64

from sdt_tools.frames import RAYS

FRAMES_FILE: Final = "frames.parquet"
ROWS_A_GROUP: Final = 2048
_NAME = pa.dictionary(pa.int32(), pa.string())
_COMMON: Final = [
    ("split", _NAME),
    ("label", pa.uint8()),
    ("label_name", _NAME),
    ("recording_id", _NAME),
    ("recording", _NAME),
    ("stamp_ns", pa.int64()),
]
SCHEMA: Final = pa.schema([*_COMMON, ("ranges_m", pa.list_(pa.float64(), RAYS))])
"""Of scans: metres as the sensor gave them, codes kept."""
PICTURE_SCHEMA: Final = pa.schema([*_COMMON, ("picture", pa.binary())])
"""Of pictures: the bytes as the camera or its driver compressed them, JPEG or PNG."""


Ranges = Float64[np.ndarray, "frames rays"]
Pictures = Sequence[bytes]


@dataclass(frozen=True, eq=False)
class FrameBlock:
    """Frames of one recording that go into one split.

    ``content`` is what the sensor gave: ranges in metres, codes kept, or compressed pictures.
    """

    split: str
    recording_id: str
    recording: str
    stamps_ns: Int64[np.ndarray, "frames"]
    labels: Int64[np.ndarray, "frames"]
    content: Ranges | Pictures


class FramesHash:
    """SHA-256 over frames in the order they are added, however they are cut into blocks."""

    def __init__(self, schema: pa.Schema = SCHEMA) -> None:
        self._content = schema.names[-1]
        names = ("split", "recording_id", "stamp_ns", "label", self._content)
        self._columns = {name: hashlib.sha256() for name in names}

    def add(
        self,
        splits: Sequence[str],
        recording_ids: Sequence[str],
        stamps_ns: Int64[np.ndarray, "frames"],
        labels: Int64[np.ndarray, "frames"],
        content: Ranges | Pictures,
    ) -> None:
        """Take in frames that follow those before; one entry of each argument a frame."""
        self._columns["split"].update("".join(f"{split}\0" for split in splits).encode())
        self._columns["recording_id"].update("".join(f"{name}\0" for name in recording_ids).encode())
        self._columns["stamp_ns"].update(stamps_ns.astype("<i8").tobytes())
        self._columns["label"].update(labels.astype("<u1").tobytes())
        digest = self._columns[self._content]
        if isinstance(content, np.ndarray):
            digest.update(np.ascontiguousarray(content, dtype="<f8").data)
            return
        for picture in content:
            digest.update(len(picture).to_bytes(8, "little") + picture)

    def hexdigest(self) -> str:
        """The hash of all frames so far."""
        whole = hashlib.sha256()
        for name, digest in self._columns.items():
            whole.update(f"{name}:{digest.hexdigest()}\n".encode())
        return whole.hexdigest()


class FramesWriter:
    """Writes blocks of frames to a Parquet file, a row group at a time."""

    def __init__(self, path: Path, classes: Sequence[str], schema: pa.Schema = SCHEMA) -> None:
        self._classes = classes
        self._schema = schema
        self._hash = FramesHash(schema)
        self._waiting: list[pa.RecordBatch] = []
        self._rows = 0
        self._writer = pq.ParquetWriter(path, schema, compression="zstd")

    def write(self, block: FrameBlock) -> None:
        """Append the frames of ``block``."""
        count = len(block.stamps_ns)
        splits, recording_ids = [block.split] * count, [block.recording_id] * count
        self._hash.add(splits, recording_ids, block.stamps_ns, block.labels, block.content)
        content = block.content
        columns = {
            "split": splits,
            "label": block.labels.astype(np.uint8),
            "label_name": [self._classes[label] for label in block.labels.tolist()],
            "recording_id": recording_ids,
            "recording": [block.recording] * count,
            "stamp_ns": block.stamps_ns,
            self._schema.names[-1]: pa.FixedSizeListArray.from_arrays(pa.array(content.ravel()), RAYS)
            if isinstance(content, np.ndarray)
            else list(content),
        }
        self._waiting.append(pa.Table.from_pydict(columns, schema=self._schema))
        self._rows += count
        if self._rows >= ROWS_A_GROUP:
            self._flush()

    def close(self) -> str:
        """Finish the file; returns the hash of its frames."""
        if self._rows:
            self._flush()
        self._writer.close()
        return self._hash.hexdigest()

    def __enter__(self) -> "FramesWriter":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._writer.close()

    def _flush(self) -> None:
        table = pa.concat_tables(self._waiting).unify_dictionaries().combine_chunks()
        self._writer.write_table(table, row_group_size=len(table))
        self._waiting, self._rows = [], 0
