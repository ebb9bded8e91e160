"""Outputs that are made aside, and get their name when they are whole.

Everybody works in a folder of his own, so that two who make the same output never touch each other's files: who is
through first gives it its name, the other one is refused.
"""

import errno
import fcntl
import glob
import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Final

from sdt_tools.errors import OutputExistsError, RecordingError

_ENDING: Final = ".making"
_NO_LINKS: Final = (errno.EPERM, errno.ENOTSUP, errno.EOPNOTSUPP, errno.ENOSYS, errno.EMLINK)
_TAKEN: Final = (errno.EEXIST, errno.ENOTEMPTY, errno.ENOTDIR)


@contextmanager
def scratch_folder(out: Path, option: str = "--out") -> Iterator[Path]:
    """A new hidden folder beside ``out``, which goes when the block ends; those that killed processes left go too.

    Raises RecordingError naming ``out`` where it cannot be made; ``option`` is what the user calls it by.
    """
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        _sweep(out)
        folder, lock = _locked_folder(out)
    except OSError as error:
        in_the_way = isinstance(error, FileExistsError | NotADirectoryError)
        reason = "a file lies where its folder would be" if in_the_way else error.strerror
        raise RecordingError(f"{out}: cannot be made: {reason}; choose another {option}") from None
    try:
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)
        os.close(lock)


def give_name(made: Path, out: Path) -> None:
    """Let the file or folder ``made``, on the same disk, be ``out``.

    Raises OutputExistsError where there is something of that name, though it came in the last moment; RecordingError
    where the disk refuses.
    """
    try:
        if made.is_dir():
            if out.exists():
                raise OutputExistsError(out)
            made.rename(out)
        else:
            _rename_file(made, out)
    except OSError as error:
        if error.errno in _TAKEN:
            raise OutputExistsError(out) from None
        raise RecordingError(f"{out}: cannot be put in its place: {error.strerror}") from None


def _rename_file(made: Path, out: Path) -> None:
    """A link never replaces what is there, a plain renaming does; disks without links get the latter."""
    try:
        os.link(made, out)
    except OSError as error:
        if error.errno not in _NO_LINKS:
            raise
        if out.exists():
            raise OutputExistsError(out) from None
        made.rename(out)
    else:
        made.unlink()


def _locked_folder(out: Path) -> tuple[Path, int]:
    """A new folder, and the lock on it that says that its process lives."""
    while True:
        folder = Path(tempfile.mkdtemp(prefix=f".{out.name}.", suffix=_ENDING, dir=out.parent))
        try:
            lock = os.open(folder, os.O_RDONLY)
        except FileNotFoundError:
            continue  # swept away before it was locked
        if _lock(lock) and folder.exists():
            return folder, lock
        os.close(lock)  # being swept away


def _lock(folder: int) -> bool:
    """Lock an open folder; False where another process holds it."""
    try:
        fcntl.flock(folder, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:
        return True  # a disk without locks: what killed processes leave on it stays
    return True


def _sweep(out: Path) -> None:
    """Remove the folders of processes that are dead: nobody holds the lock on them."""
    for folder in out.parent.glob(f".{glob.escape(out.name)}.*{_ENDING}"):
        with suppress(OSError):
            lock = os.open(folder, os.O_RDONLY)
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
                shutil.rmtree(folder, ignore_errors=True)
            finally:
                os.close(lock)
