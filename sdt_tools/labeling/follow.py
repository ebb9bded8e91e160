"""Labels that follow their recordings: into edited ones, and into the trash.

The journals of the originals are only read. A new recording's journal holds the acts about frames that are in it, in
their order, with the new recording's id; labeler, source and time stay.
"""

from array import array
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import polars as pl

from sdt_tools.errors import LabelError, OutputExistsError, RecordingError, UsageError
from sdt_tools.labeling.journal import Journal, read_journal
from sdt_tools.labeling.resolve import standing
from sdt_tools.labeling.vocabulary import LabelKind, journal_path
from sdt_tools.recording.container.reader import McapReader
from sdt_tools.recording.editing.edit import Finished, edit_recordings, edit_under_way
from sdt_tools.recording.editing.plan import Cut, Merge
from sdt_tools.recording.editing.provenance import EditedRecording
from sdt_tools.recording.messages.topics import CAMERA_IMAGE, LIDAR_SCAN
from sdt_tools.recording.reader import recording_id_of
from sdt_tools.recording.scratch import give_name, scratch_folder
from sdt_tools.recording.trash import discard

_FRAMES = {LabelKind.MOTION: LIDAR_SCAN, LabelKind.GESTURE: CAMERA_IMAGE}


@dataclass(frozen=True)
class FollowedJournal:
    """A journal that was made for a new recording: ``acts`` of those ``given`` are about frames that are in it."""

    path: Path
    acts: int
    given: int


def edit_with_labels(
    plan: Cut | Merge, labels_dir: Path
) -> tuple[tuple[EditedRecording, ...], tuple[FollowedJournal, ...]]:
    """Carry out ``plan``, and give each new recording the journals that follow; none where no act is about it.

    Raises as ``edit_recordings``; LabelError where a journal of an original is wrong or belongs to another recording,
    or two originals answer for one frame differently; OutputExistsError for a journal that exists. Then nothing is
    written.
    """
    acts = {kind: _acts(plan.originals, labels_dir, kind) for kind in LabelKind}
    for kind in LabelKind:
        for out in plan.outs:
            if journal_path(labels_dir, out.stem, kind).exists():
                raise OutputExistsError(journal_path(labels_dir, out.stem, kind))
    if all(table.is_empty() for table in acts.values()):
        return edit_recordings(plan), ()
    with _journals_beside(labels_dir / plan.outs[0].name) as scratch, edit_under_way(plan) as finished:
        edited = tuple(new.edited for new in finished)
        journals = tuple(journal for new in finished for journal in _follow(new, acts, labels_dir, scratch))
    return edited, journals


def discard_with_labels(recordings: Sequence[Path], labels_dir: Path, reason: str, now_ns: int) -> tuple[Path, ...]:
    """Move ``recordings`` and their journals to the trash beside each; returns their folders there.

    Raises UsageError, before anything moves, for what is no file or given twice; else as ``discard``.
    """
    for place, recording in enumerate(recordings):
        if not recording.is_file():
            raise UsageError(f"{recording}: no such recording; nothing was discarded")
        if any(recording.samefile(other) for other in recordings[:place]):
            raise UsageError(f"{recording}: is given twice; nothing was discarded")
    return tuple(discard(path, reason, now_ns, journals_of(path, labels_dir)) for path in recordings)


def journals_of(recording: Path, labels_dir: Path) -> tuple[Path, ...]:
    """The journals in ``labels_dir`` that go by the name of ``recording``, but for those of another recording's id."""
    found = [journal_path(labels_dir, recording.stem, kind) for kind in LabelKind]
    return tuple(path for path in found if path.is_file() and _may_belong(path, recording))


def _may_belong(journal: Path, recording: Path) -> bool:
    """Whether nothing speaks against it: what cannot be read is believed its name."""
    try:
        owners = read_journal(journal).table["recording_id"]
        with McapReader(recording) as source:
            return owners.is_empty() or owners[0] == recording_id_of(source)
    except (LabelError, RecordingError):
        return True


def _acts(originals: Sequence[Path], labels_dir: Path, kind: LabelKind) -> pl.DataFrame:
    """All acts about the originals, one journal after another."""
    tables: list[tuple[Path, pl.DataFrame]] = []
    said: pl.DataFrame | None = None
    for original in originals:
        path = journal_path(labels_dir, original.stem, kind)
        if not path.exists():
            continue
        with McapReader(original) as source:
            acts = read_journal(path, recording_id_of(source))
        stands = standing(acts).select("stamp_ns", "labeler", "source", "label")
        if said is not None:
            _check_agree(said, stands, tables[-1][0], path)
        said = stands if said is None else pl.concat([said, stands])
        tables.append((path, acts.table))
    columns = ["stamp_ns", "label", "labeler", "source", "created_ns"]
    if not tables:
        return pl.DataFrame(schema=dict.fromkeys(columns, pl.String) | {"stamp_ns": pl.Int64, "created_ns": pl.Int64})
    return pl.concat([table.select(columns) for _, table in tables])


def _check_agree(said: pl.DataFrame, news: pl.DataFrame, before: Path, path: Path) -> None:
    both = said.join(news, on=["stamp_ns", "labeler", "source"], suffix="_new")
    differing = both.filter(pl.col("label") != pl.col("label_new"))
    if len(differing):
        stamp_ns, labeler, source, one, other = differing.sort("stamp_ns").row(0)
        raise LabelError(
            f"{path}: {labeler} ({source}) calls the frame at {stamp_ns} '{other}', but '{one}' in a journal up to "
            f"{before}; these recordings overlap: settle it first, or merge without labels"
        )


@contextmanager
def _journals_beside(place: Path) -> Iterator[Path]:
    """A folder whose journals come to lie beside ``place`` when the block ends without an error; else they go."""
    with scratch_folder(place) as scratch:
        yield scratch
        for part in sorted(scratch.iterdir()):
            give_name(part, place.parent / part.name)


def _follow(
    new: Finished, acts: Mapping[LabelKind, pl.DataFrame], labels_dir: Path, scratch: Path
) -> Iterator[FollowedJournal]:
    """Write the journals of ``new`` into ``scratch``."""
    for kind, table in acts.items():
        about = table if table.is_empty() else table.filter(pl.col("stamp_ns").is_in(_stamps(new.path, kind).implode()))
        if len(about):
            part = journal_path(scratch, new.edited.out.stem, kind)
            with Journal(part, new.edited.recording_id) as journal:
                journal.append_table(about)
            yield FollowedJournal(labels_dir / part.name, len(about), len(table))


def _stamps(recording: Path, kind: LabelKind) -> pl.Series:
    """The stamps of the frames of a kind; 8 bytes a frame."""
    stamps = array("Q")
    with McapReader(recording) as source:
        numbers = frozenset(number for number, c in source.channels.items() if c.topic == _FRAMES[kind])
        stamps.extend(entry.publish_ns for entry in source.entries(numbers))
    return pl.Series("stamp_ns", np.frombuffer(stamps, np.uint64)).cast(pl.Int64, strict=False)
