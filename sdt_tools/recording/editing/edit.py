"""Planned edits, carried out: all of their new recordings, or none."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from sdt_tools.recording.container.reader import McapReader
from sdt_tools.recording.editing.cutting import Cutter
from sdt_tools.recording.editing.merging import write_merged
from sdt_tools.recording.editing.plan import Cut, Merge
from sdt_tools.recording.editing.provenance import EditedRecording
from sdt_tools.recording.scratch import give_name, scratch_folder


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
    with scratch_folder(plan.outs[0], plan.out_option) as scratch:
        finished = _written(plan, scratch)
        yield finished
        _put_in_place(finished)


def _written(plan: Cut | Merge, scratch: Path) -> tuple[Finished, ...]:
    if isinstance(plan, Merge):
        path = scratch / plan.out.name
        return (Finished(write_merged(plan, path), path),)
    with McapReader(plan.original) as source:
        cutter = Cutter(source, plan)
        paths = [scratch / part.out.name for part in plan.parts]
        return tuple(Finished(cutter.write(part, path), path) for part, path in zip(plan.parts, paths, strict=True))


def _put_in_place(finished: tuple[Finished, ...]) -> None:
    """All of them, or none."""
    placed: list[Path] = []
    try:
        for new in finished:
            give_name(new.path, new.edited.out)
            placed.append(new.edited.out)
    except BaseException:
        for path in placed:
            path.unlink(missing_ok=True)
        raise
