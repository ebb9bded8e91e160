"""Outputs that stand under their name only when they are whole."""

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from sdt_tools.errors import DiskRefusedError, OutputExistsError
from sdt_tools.recording.scratch import scratch_folder


@contextmanager
def placed(out: Path, inner: str) -> Iterator[Path]:
    """A path called ``inner`` in a hidden folder beside ``out``; what is made there becomes ``out`` at the end.

    Raises OutputExistsError where ``out`` exists, RecordingError naming it where it cannot be made, DiskRefusedError
    where the disk refuses; then nothing is left.
    """
    if out.exists():
        raise OutputExistsError(out)
    scratch = scratch_folder(out, "part")
    try:
        made = scratch / inner
        yield made
        if out.exists():
            raise OutputExistsError(out)
        made.rename(out)
    except OSError as error:
        raise DiskRefusedError(f"{out}: cannot be written: {error.strerror or error}; make room on that disk") from None
    finally:
        shutil.rmtree(scratch, ignore_errors=True)
