"""How a command ends that a signal or a full disk has ended."""

import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

import typer

if TYPE_CHECKING:
    from sdt_tools.recording.live.outcome import Ending


@contextmanager
def last_words(ending: "Ending") -> Iterator[None]:
    """Print in the block; then exit with 128 + n where a signal other than Ctrl-C ended it, with 1 for a full disk.

    A terminal that hangs up, perhaps after a SIGTERM, is not written to.
    """
    code = {"terminated": 128 + signal.SIGTERM, "hangup": 128 + signal.SIGHUP, "disk": 1}.get(ending, 0)
    try:
        yield
        sys.stdout.flush()
    except OSError:
        if code <= 128:
            raise
    if code:
        raise typer.Exit(code)
