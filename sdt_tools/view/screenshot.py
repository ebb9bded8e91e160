"""Pictures of an .rrd, taken without a display."""

import time
from pathlib import Path
from typing import Final

from rerun.experimental import ViewerClient

from sdt_tools.view.viewer import headless_viewer, set_place, wait_until_loaded

NOTICES_S: Final = 8.0
"""The viewer's notices about itself cover its corner for some seconds after its start."""


def show(viewer: ViewerClient, rrd: Path, time_ns: int | None = None, error: int | None = None) -> None:
    """Open ``rrd``, wait until all of it is there, and go to ``time_ns``, or to an error, where it is given.

    Raises ViewerError where it does not load.
    """
    viewer.open(str(rrd.resolve()))
    wait_until_loaded(viewer, rrd)
    if time_ns is not None or error is not None:
        set_place(viewer, time_ns or 0, error)


def screenshot(
    rrd: Path,
    out: Path,
    time_ns: int | None = None,
    width: int = 1600,
    height: int = 1000,
    error: int | None = None,
) -> None:
    """Save a picture of the whole viewer on ``rrd`` at ``time_ns``, or at an error, as PNG.

    Raises ViewerError where no viewer starts.
    """
    started = time.monotonic()
    with headless_viewer(width, height) as viewer:
        show(viewer, rrd, time_ns, error)
        time.sleep(max(0.0, NOTICES_S - (time.monotonic() - started)))
        viewer.save_screenshot(str(out.resolve()))
