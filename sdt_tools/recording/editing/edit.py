"""Planned edits, carried out: all of their new recordings, or none."""

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from sdt_tools.errors import OutputExistsError, RecordingError
from sdt_tools.recording.container.reader import McapReader
from sdt_tools.recording.editing.cutting import Cutter
from sdt_tools.recording.editing.merging import write_merged
from sdt_tools.recording.editing.plan import Cut, Merge
from sdt_tools.recording.editing.provenance import EditedRecording
from sdt_tools.recording.scratch import scratch_folder


@dataclass(frozen=True)
class Finished:
    """A new recording that is whole, and lies at ``path`` until its edit is done."""

    edited: EditedRecording
    path: Path


def edit_recordings(plan: Cut | Merge) -> tuple[EditedRecording, ...]:
    """Carry out ``plan``. The originals are only read; labels stay with them (``labeling.follow`` takes them along).

    Raises OutputExistsError, and RecordingError where the disk refuses or what was written does not read back; then
    nothing is there.
    """
    with edit_under_way(plan) as finished:
        return tuple(new.edited for new in finished)


@contextmanager
def edit_under_way(plan: Cut | Merge) -> Iterator[tuple[Finished, ...]]:
    """The new recordings of ``plan``, whole and read back; they get their names when the block ends without an error.

    Raises as ``edit_recordings``.
    """
    scratch = scratch_folder(plan.outs[0], "edit", plan.out_option)
    try:
        finished = _written(plan, scratch)
        yield finished
        _put_in_place(finished)
    finally:
        shutil.rmtree(scratch, ignore_errors=True)


def _written(plan: Cut | Merge, scratch: Path) -> tuple[Finished, ...]:
    if isinstance(plan, Merge):
        path = scratch / plan.out.name
        return (Finished(write_merged(plan, path), path),)
    with McapReader(plan.original) as source:
        cutter = Cutter(source, plan)
        paths = [scratch / part.out.name for part in plan.parts]
        return tuple(Finished(cutter.write(part, path), path) for part, path in zip(plan.parts, paths, strict=True))


def _put_in_place(finished: tuple[Finished, ...]) -> None:
    for new in finished:
        if new.edited.out.exists():
            raise OutputExistsError(new.edited.out)
    for new in finished:
        try:
            new.path.rename(new.edited.out)
        except OSError as error:
            raise RecordingError(f"{new.edited.out}: cannot be put in its place: {error.strerror}") from None
