"""Recordings that were thrown away, and can be had back: a folder ``.trash`` beside them.

Each has a folder of its own there, with ``trash.toml``, which says where from, when and why. That record is on disk
before the first file moves, and a file moves by being renamed: whenever the process dies, each file is in its old place
or in the trash, and ``restore`` brings back what is in the trash.
"""

import errno
import os
import shutil
import tomllib
from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Final

import tomli_w

from sdt_tools.clock import SECOND_NS
from sdt_tools.errors import OutputExistsError, RecordingError, UsageError

TRASH: Final = ".trash"
RECORD: Final = "trash.toml"
_NO_LINKS: Final = (errno.EPERM, errno.EOPNOTSUPP, errno.ENOSYS)
"""What file systems without hard links say."""


@dataclass(frozen=True)
class TrashedFile:
    """A file in the trash, and where it came from."""

    path: Path
    origin: Path


@dataclass(frozen=True)
class Trashed:
    """A recording in the trash. ``files`` are what lies there now, the recording first, then its journals.

    ``discarded_ns`` is None, and ``files`` have no origin to go to, where ``trash.toml`` is gone or unreadable.
    """

    name: str
    folder: Path
    discarded_ns: int | None
    reason: str
    files: tuple[TrashedFile, ...]

    @property
    def size_bytes(self) -> int:
        """How much room it takes."""
        return sum(file.path.stat().st_size for file in self.files)


def discard(recording: Path, reason: str, now_ns: int, companions: Sequence[Path] = ()) -> Path:
    """Move ``recording``, and its ``companions`` (journals), to the trash beside it; returns their folder there.

    ``now_ns`` is the time that the record states. Raises UsageError for what is no file or is in the trash already,
    RecordingError where the disk refuses; then each file is in its old place or in the trash.
    """
    files = [recording, *companions]
    for file in files:
        if not file.is_file():
            raise UsageError(f"{file}: no such file; there is nothing to discard")
    if TRASH in recording.absolute().parts:
        raise UsageError(f"{recording}: is in the trash already")
    if len({file.name for file in files} | {RECORD}) <= len(files):
        raise UsageError(f"{recording}: two of its files are called the same, or '{RECORD}'; rename one first")
    home = recording.parent.resolve()
    try:
        folder = _new_folder(home / TRASH, recording, now_ns)
        _write_record(folder, files, home, reason, now_ns)
        for file in files:
            _move_away(file, folder / file.name)
    except OSError as error:
        raise RecordingError(f"{recording}: cannot be moved to the trash: {error.strerror}; check the disk") from None
    return folder


def trashed(folder: Path) -> tuple[Trashed, ...]:
    """What is in the trash of the recordings in ``folder``, oldest first. Raises UsageError for what is no folder."""
    if not folder.is_dir():
        raise UsageError(f"{folder}: no such folder of recordings")
    trash = folder / TRASH
    entries = sorted(path for path in trash.iterdir() if path.is_dir()) if trash.is_dir() else []
    found = [_read(entry) for entry in entries]
    return tuple(entry for entry in found if entry.files)


def restore(folder: Path, name: str) -> tuple[Path, ...]:
    """Bring ``name`` back to where it came from: a name that ``trashed`` gives, or the recording's own if it is alone.

    Returns the files. Nothing is ever written over: raises OutputExistsError, before anything moves, where one of the
    places is taken; UsageError for a name that is not there, or is there more than once.
    """
    entry = _find(folder, name)
    if entry.discarded_ns is None:
        raise UsageError(f"{entry.folder / RECORD}: cannot be read; nobody knows where its files came from")
    for file in entry.files:
        if file.origin.exists() and not file.origin.samefile(file.path):
            raise OutputExistsError(file.origin, None)
    try:
        for file in reversed(entry.files):  # the recording last: while it is here, what is left of it is found here
            file.origin.parent.mkdir(parents=True, exist_ok=True)
            _move_back(file.path, file.origin)
        (entry.folder / RECORD).unlink()
        with suppress(OSError):  # something else lies in it
            entry.folder.rmdir()
    except OSError as error:
        raise RecordingError(f"{entry.folder}: cannot be restored: {error.strerror}; it stays there") from None
    return tuple(file.origin for file in entry.files)


def _find(folder: Path, name: str) -> Trashed:
    entries = trashed(folder)
    found = [entry for entry in entries if entry.name == name]
    found = found or [e for e in entries if name in (e.files[0].path.name, e.files[0].path.stem)]
    if not found:
        raise UsageError(f"{name}: not in the trash of {folder}; `sdt edit trash list` shows what is")
    if len(found) > 1:
        raise UsageError(f"{name}: more than one in the trash; name one: {', '.join(e.name for e in found)}")
    return found[0]


def _new_folder(trash: Path, recording: Path, now_ns: int) -> Path:
    moment = datetime.fromtimestamp(now_ns // SECOND_NS, UTC).strftime("%Y%m%dT%H%M%SZ")
    number = 1
    while True:
        folder = trash / f"{moment}-{recording.name}{'' if number == 1 else f'-{number}'}"
        try:
            folder.mkdir(parents=True)
        except FileExistsError:
            number += 1
        else:
            return folder


def _write_record(folder: Path, files: Iterable[Path], home: Path, reason: str, now_ns: int) -> None:
    """Origins are told as seen from the recordings' folder: it may be moved with all that is in it."""
    origins = [{"name": f.name, "from": os.path.relpath(f.parent.resolve() / f.name, home)} for f in files]
    part = folder / f".{RECORD}.part"
    with part.open("wb") as stream:
        tomli_w.dump({"discarded_ns": now_ns, "reason": reason, "file": origins}, stream)
        stream.flush()
        os.fsync(stream.fileno())
    part.rename(folder / RECORD)
    _sync_folder(folder)
    _sync_folder(folder.parent)


def _read(folder: Path) -> Trashed:
    home = folder.parent.parent.resolve()
    try:
        record = tomllib.loads((folder / RECORD).read_text(encoding="utf-8"))
        files = [
            TrashedFile(folder / Path(f["name"]).name, Path(os.path.normpath(home / f["from"]))) for f in record["file"]
        ]
        there = tuple(file for file in files if file.path.is_file())
        return Trashed(folder.name, folder, int(record["discarded_ns"]), str(record["reason"]), there)
    except (OSError, KeyError, TypeError, ValueError):
        there = tuple(TrashedFile(path, path) for path in sorted(folder.iterdir()) if RECORD not in path.name)
        return Trashed(folder.name, folder, None, "", there)


def _move_away(source: Path, target: Path) -> None:
    """Move a file into a folder that is new."""
    try:
        source.rename(target)
    except OSError as error:
        if error.errno != errno.EXDEV:
            raise
        _move_between_disks(source, target)
    _sync_folder(target.parent)


def _move_back(source: Path, target: Path) -> None:
    """Move a file to where nothing is: a link never replaces what came there meanwhile, as renaming does."""
    try:
        os.link(source, target, follow_symlinks=False)
    except FileExistsError:
        if not source.samefile(target):  # else moving it was interrupted
            raise
    except OSError as error:
        if error.errno not in (errno.EXDEV, *_NO_LINKS):
            raise
        _move_between_disks(source, target)
        return
    _sync_folder(target.parent)
    source.unlink()


def _move_between_disks(source: Path, target: Path) -> None:
    """A copy is on its disk, under its name, before the source goes."""
    part = target.with_name(f".{target.name}.part")
    try:
        shutil.copy2(source, part)
        with part.open("rb+") as stream:
            os.fsync(stream.fileno())
        if target.exists():
            raise FileExistsError(errno.EEXIST, os.strerror(errno.EEXIST), str(target))
        part.rename(target)
    finally:
        part.unlink(missing_ok=True)
    _sync_folder(target.parent)
    source.unlink()


def _sync_folder(folder: Path) -> None:
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
