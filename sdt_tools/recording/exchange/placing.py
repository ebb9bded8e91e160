"""Outputs that stand under their name only when they are whole."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from sdt_tools.errors import DiskRefusedError, OutputExistsError
from sdt_tools.recording.scratch import give_name, scratch_folder


@contextmanager
def placed(out: Path, inner: str) -> Iterator[Path]:
    """A path called ``inner`` in a hidden folder beside ``out``; what is made there becomes ``out`` at the end.

    Raises OutputExistsError where ``out`` exists, RecordingError naming it where it cannot be made, DiskRefusedError
    where the disk refuses; then nothing is left.
    """
    if out.exists():
        raise OutputExistsError(out)
    with scratch_folder(out) as scratch:
        made = scratch / inner
        try:
            yield made
        except OSError as error:
            reason = error.strerror or error
            raise DiskRefusedError(f"{out}: cannot be written: {reason}; make room on that disk") from None
        give_name(made, out)
