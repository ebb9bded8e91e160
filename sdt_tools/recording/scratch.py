"""Hidden places beside an output, where it is made: what it is called when it is whole appears only then."""

import shutil
from pathlib import Path

from sdt_tools.errors import OutputExistsError, RecordingError


def scratch_file(out: Path) -> Path:
    """A path beside ``out`` where a file can be created; what an interrupted run left there is removed.

    Raises OutputExistsError where ``out`` exists, RecordingError naming ``out`` where nothing can be made beside it.
    """
    if out.exists():
        raise OutputExistsError(out)
    part = out.with_name(f".{out.name}.part")
    try:
        part.parent.mkdir(parents=True, exist_ok=True)
        part.unlink(missing_ok=True)
        part.touch()
        part.unlink()
    except OSError as error:
        raise _refused(out, error, "--out") from None
    return part


def scratch_folder(out: Path, purpose: str, option: str = "--out") -> Path:
    """A new folder beside ``out``; one that an interrupted run left there is removed.

    Raises RecordingError naming ``out`` where it cannot be made; ``option`` is what the user calls it by.
    """
    scratch = out.with_name(f".{out.name}.{purpose}")
    shutil.rmtree(scratch, ignore_errors=True)
    try:
        scratch.mkdir(parents=True)
    except OSError as error:
        raise _refused(out, error, option) from None
    return scratch


def _refused(out: Path, error: OSError, option: str) -> RecordingError:
    in_the_way = isinstance(error, FileExistsError | NotADirectoryError)
    reason = "a file lies where its folder would be" if in_the_way else error.strerror
    return RecordingError(f"{out}: cannot be made: {reason}; choose another {option}")
