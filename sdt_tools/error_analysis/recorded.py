"""What recordings hold of frames, fetched again: predictions carry stamps, neither scans nor pictures."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from jaxtyping import Float32

from sdt_tools.error_analysis.definitions import ErrorOptions
from sdt_tools.error_analysis.distance import situations
from sdt_tools.error_analysis.labelled import LabelledFrames
from sdt_tools.error_analysis.scratch import scratch_rows
from sdt_tools.errors import RecordingError
from sdt_tools.frames import RAYS
from sdt_tools.recording.incomplete import Incomplete, incomplete
from sdt_tools.recording.reader import Recording
from sdt_tools.runs.local import Progress


def find_recordings(frames: LabelledFrames, places: Sequence[Path]) -> tuple[Path, ...]:
    """The files behind ``frames``, in the order of their recordings: among ``places``, MCAP files and folders of them.

    Raises RecordingError for a place that does not exist and for recordings that are not found.
    """
    by_stem: dict[str, list[Path]] = {}
    for place in places:
        if not place.exists():
            raise RecordingError(f"{place}: no such file or folder; check --recordings")
        for path in sorted(place.rglob("*.mcap")) if place.is_dir() else [place]:
            by_stem.setdefault(path.stem, []).append(path)
    wanted = _identities(frames)
    missing = sorted({stem for stem, _ in wanted if stem not in by_stem})
    if missing:
        more = f" and {len(missing) - 3} more" if len(missing) > 3 else ""
        raise RecordingError(
            f"{', '.join(missing[:3])}{more}: the predictions are about recordings that are not among those given; "
            "add their folder to --recordings"
        )
    return tuple(_same_recording(by_stem[stem], recording_id) for stem, recording_id in wanted)


def read_situations(
    frames: LabelledFrames,
    paths: Sequence[Path],
    options: ErrorOptions,
    progress: Progress | None = None,
    scratch: Path | None = None,
) -> tuple[Float32[np.ndarray, "frames rays"], tuple[Incomplete, ...]]:
    """The situation of each frame, and the recordings that are cut off or damaged.

    ``paths`` are the recordings in the order of ``frames``. With ``scratch``, a folder, the situations lie in a
    nameless file there (``scratch_rows``), else in memory. Raises RecordingError where a recording cannot be read or
    lacks the scan of a frame.
    """
    total = len(frames.loss)
    scans = scratch_rows(scratch, total, RAYS) if scratch else np.empty((total, RAYS), np.float32)
    missing = []
    starts = np.searchsorted(frames.recording, np.arange(len(paths) + 1))
    for number, path in enumerate(paths):
        if progress:
            progress(number, len(paths))
        first, end = int(starts[number]), int(starts[number + 1])
        wanted_ns = frames.stamp_ns[first:end]
        filled = np.zeros(len(wanted_ns), bool)
        with Recording.open(path) as recording:
            for batch in recording.scan_batches():
                rows = np.searchsorted(wanted_ns, batch.stamps_ns)
                found = wanted_ns[np.minimum(rows, len(wanted_ns) - 1)] == batch.stamps_ns
                scans[first + rows[found]] = situations(batch.ranges_m[found], options)
                filled[rows[found]] = True
            missing.append(incomplete(recording))
        if not filled.all():
            raise RecordingError(
                f"{path}: lacks the scans of {int((~filled).sum())} of {len(filled)} frames of the predictions; "
                "replay it again"
            )
    if progress:
        progress(len(paths), len(paths))
    return scans, tuple(one for one in missing if one is not None)


def incomplete_among(paths: Sequence[Path]) -> tuple[Incomplete, ...]:
    """Those of the recordings that are cut off or damaged. Raises RecordingError where one cannot be read."""
    found = []
    for path in paths:
        with Recording.open(path) as recording:
            found.append(incomplete(recording))
    return tuple(one for one in found if one is not None)


def _identities(frames: LabelledFrames) -> list[tuple[str, str]]:
    """Stem and id of each recording, in order."""
    rows = np.flatnonzero(np.diff(frames.recording, prepend=-1))
    return list(frames.table.select("recording", "recording_id")[rows].iter_rows())


def _same_recording(paths: Sequence[Path], recording_id: str) -> Path:
    """The file of that id among files of one name."""
    for path in paths:
        with Recording.open(path) as recording:
            if recording.recording_id == recording_id:
                return path
    raise RecordingError(
        f"{paths[0]}: is another recording than the one replayed under this name (its id is not {recording_id})"
    )
