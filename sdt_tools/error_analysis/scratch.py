"""Room for the scans or features of an analysis: on disk, so that logs larger than memory work."""

import os
import tempfile
from pathlib import Path

import numpy as np
from jaxtyping import Float32

from sdt_tools.errors import SdtError


def scratch_rows(folder: Path, frames: int, width: int) -> Float32[np.ndarray, "frames width"]:
    """An array of ``frames`` rows, at least one, that lies in a file without a name in ``folder``.

    The system keeps in memory what fits, and gives it up when others need it. Having no name, the file is gone with the
    array, or with the process, whatever ends it. Raises SdtError where the disk has no room for it.
    """
    folder.mkdir(parents=True, exist_ok=True)
    size = frames * width * np.dtype(np.float32).itemsize
    try:
        with tempfile.TemporaryFile(dir=folder, prefix=".rows.") as file:
            os.posix_fallocate(file.fileno(), 0, size)  # a disk that fills up later would kill the process
            return np.asarray(np.memmap(file, np.float32, "r+", shape=(frames, width)))
    except OSError as error:
        raise SdtError(
            f"{folder}: no room for {size / 1e9:.2g} GB to compare frames ({error.strerror}); "
            "free some, or choose --out on another disk"
        ) from None
