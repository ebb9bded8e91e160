"""Pictures of an .rrd, taken without a display."""

import time
from pathlib import Path
from typing import Final

import numpy as np
from rerun.experimental import ViewerClient

from sdt_tools.view.timeline import TIME
from sdt_tools.view.viewer import ViewerError, headless_viewer

LOAD_S: Final = 60.0
NOTICES_S: Final = 8.0
"""The viewer's notices about itself cover its corner for some seconds after its start."""


def show(viewer: ViewerClient, rrd: Path, time_ns: int | None = None) -> None:
    """Open ``rrd``, wait until all of it is there, and go to ``time_ns`` where it is given.

    Raises ViewerError where it does not load.
    """
    viewer.open(str(rrd.resolve()))
    deadline = time.monotonic() + LOAD_S
    while viewer.get_state().loading:
        if time.monotonic() > deadline:
            raise ViewerError(
                f"{rrd}: not loaded after {LOAD_S:.0f} s; show fewer scans (--every), or a shorter recording"
            )
        time.sleep(0.05)
    if time_ns is not None:
        viewer.set_time(TIME, timestamp=np.datetime64(time_ns, "ns"), play_state="paused")


def screenshot(rrd: Path, out: Path, time_ns: int | None = None, width: int = 1600, height: int = 1000) -> None:
    """Save a picture of the whole viewer on ``rrd`` at ``time_ns`` as PNG. Raises ViewerError where none starts."""
    started = time.monotonic()
    with headless_viewer(width, height) as viewer:
        show(viewer, rrd, time_ns)
        time.sleep(max(0.0, NOTICES_S - (time.monotonic() - started)))
        viewer.save_screenshot(str(out.resolve()))
