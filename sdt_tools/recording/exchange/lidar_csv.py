"""Drives recorded as text: one scan a row, of a Pioneer P3-AT with a SICK LMS1xx, into recordings.

A row has 545 columns: a step index, two state values, the 541 ranges in metres from the right to the left, and a
steering command. No time is stated, so stamps run from a fixed epoch at a rate that the user gives. State and steering
have no topic here and are left out; the session log says so.
"""

import gzip
import hashlib
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from io import TextIOWrapper
from pathlib import Path
from typing import Final

import numpy as np
from jaxtyping import Float64

from sdt_tools.clock import FAST_EPOCH_NS, SECOND_NS
from sdt_tools.errors import OutputExistsError, RecordingError, UsageError
from sdt_tools.frames import RAYS, LidarScan, LogEntry, LogLevel, Received
from sdt_tools.protocols import SourceInfo
from sdt_tools.recording.scratch import give_name, scratch_folder
from sdt_tools.recording.writer import RecordingWriter

COLUMNS: Final = RAYS + 4
_FIRST_RANGE: Final = 3
_LEFT_OUT: Final = "columns 0 (step), 1 and 2 (state) and 544 (steering) of the file have no topic and are left out"


@dataclass(frozen=True)
class ImportSummary:
    """What was imported: number of scans, the seconds they span at ``hz``, and the recording they are in now."""

    recording_id: str
    path: Path
    scans: int
    seconds: float
    invalid_share: float
    """Of the rays that hold a code (under 0.01 m) instead of a distance."""


def import_lidar_csv(path: Path, out: Path, hz: float) -> ImportSummary:
    """Import the drive ``path`` (``.csv``, ``.csv.gz``), taken at ``hz`` scans a second, into the recording ``out``.

    ``out`` appears when all of it is written. Raises RecordingError, naming the line, for a file that is missing, empty
    or no such drive, UsageError for a rate that is not positive, OutputExistsError.
    """
    if not 0.01 <= hz <= 10_000:
        raise UsageError(f"--hz {hz:g}: give the scans a second, as in 25 or 50")
    if out.exists():
        raise OutputExistsError(out)
    notes = {"import_file": path.name, "import_sha256": _sha256(path), "import_hz": f"{hz:g}"}
    info = SourceInfo("import", devices={"lidar": "SICK LMS1xx", "base": "Pioneer P3-AT"})
    scans = codes = 0
    with scratch_folder(out) as scratch:
        part = scratch / out.name
        with RecordingWriter(part, info, "", notes=notes) as writer:
            writer.write(Received(FAST_EPOCH_NS, LogEntry(FAST_EPOCH_NS, LogLevel.INFO, _LEFT_OUT, "import")))
            for ranges_m in _rows(path):
                stamp_ns = FAST_EPOCH_NS + round(scans * SECOND_NS / hz)
                writer.write(Received(stamp_ns, LidarScan(stamp_ns, ranges_m)))
                scans += 1
                codes += int(np.count_nonzero(ranges_m < 0.01))
        if not scans:
            raise RecordingError(f"{path}: holds no scans; nothing was imported")
        give_name(part, out)
    return ImportSummary(writer.recording_id, out, scans, (scans - 1) / hz, codes / (scans * RAYS))


def _rows(path: Path) -> Iterator[Float64[np.ndarray, "rays"]]:
    try:
        with _open_text(path) as lines:
            for number, line in enumerate(lines, start=1):
                if line.strip():
                    yield _ranges(line, f"{path}: line {number}")
    except (UnicodeDecodeError, gzip.BadGzipFile, zlib.error):
        raise RecordingError(f"{path}: not a text file, nor one compressed with gzip; give a .csv or .csv.gz") from None
    except EOFError:
        raise RecordingError(f"{path}: the compressed file is cut off; copy it again") from None
    except OSError as error:
        raise _unreadable(path, error) from None


def _ranges(line: str, where: str) -> Float64[np.ndarray, "rays"]:
    columns = line.split(",")
    if len(columns) != COLUMNS:
        raise RecordingError(
            f"{where} has {len(columns)} columns, {COLUMNS} expected: step, two states, {RAYS} ranges, steering"
        )
    try:
        ranges_m = np.array(columns[_FIRST_RANGE : _FIRST_RANGE + RAYS], dtype=np.float64)
    except ValueError as error:
        raise RecordingError(f"{where}: {error}; ranges are numbers in metres") from None
    if not np.all((ranges_m >= 0) & np.isfinite(ranges_m)):
        raise RecordingError(f"{where}: has a range that is negative or not finite; ranges are metres")
    return ranges_m


def _open_text(path: Path) -> TextIOWrapper:
    if path.suffix == ".gz":
        return gzip.open(path, "rt", encoding="utf-8")
    return path.open(encoding="utf-8")


def _sha256(path: Path) -> str:
    try:
        with path.open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError as error:
        raise _unreadable(path, error) from None


def _unreadable(path: Path, error: OSError) -> RecordingError:
    if isinstance(error, FileNotFoundError):
        return RecordingError(f"{path}: no such file; check the path")
    if isinstance(error, IsADirectoryError):
        return RecordingError(f"{path}: is a folder; name one of the drives in it")
    return RecordingError(f"{path}: cannot be read: {error.strerror}")
