"""A stream into an .rrd whose writing to disk is our own.

Rerun writes a file in a thread of its own. Where the disk refuses, that thread ends, and who waits for it may wait for
ever. So Rerun writes into a pipe that never refuses, and what comes out of it is written here.
"""

import os
from pathlib import Path
from threading import Thread
from types import TracebackType
from typing import Final

import rerun as rr
import rerun.blueprint as rrb

from sdt_tools.errors import RunError

PIECE_BYTES: Final = 1 << 20


class RrdFile:
    """An .rrd at ``path``, begun anew, with its layout; ``stream`` logs into it until ``close``.

    Raises RunError where the path cannot be written to.
    """

    def __init__(self, path: Path, application: str, recording_id: str, layout: rrb.Blueprint) -> None:
        self.path = path
        try:
            self._file = path.open("wb")
        except OSError as error:
            raise RunError(f"{path}: cannot be written ({error.strerror}); choose another place") from None
        self._refused: OSError | None = None
        self._closed = False
        self._reading, writing = os.pipe()
        self._copier = Thread(target=self._copy, name="rrd-file")
        self._copier.start()
        self.stream = rr.RecordingStream(application, recording_id=recording_id, send_properties=False)
        try:
            self.stream.save(f"/dev/fd/{writing}", default_blueprint=layout)
        finally:
            os.close(writing)

    def close(self) -> None:
        """Write what is left; may be called twice. Raises RunError where the disk did not take all of it."""
        if self._closed:
            return
        self._closed = True
        self.stream.disconnect()
        self._copier.join()
        os.close(self._reading)
        try:
            self._file.close()
        except OSError as error:
            self._refused = self._refused or error
        if self._refused is not None:
            reason = self._refused.strerror
            raise RunError(f"{self.path}: the disk does not take it ({reason}); make room, or show fewer scans")

    def __enter__(self) -> "RrdFile":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self.close()

    def _copy(self) -> None:
        """From the pipe to the file until the pipe's end, whatever the file says to it."""
        while piece := os.read(self._reading, PIECE_BYTES):
            if self._refused is None:
                try:
                    self._file.write(piece)
                except OSError as error:
                    self._refused = error
