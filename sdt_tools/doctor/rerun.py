"""Rerun's viewer: whether it is there, and whether it draws."""

import os
from collections.abc import Iterator

from sdt_tools.doctor.finding import Finding, fail, ok, warn
from sdt_tools.errors import SdtError


def display() -> Iterator[Finding]:
    """Whether a window could open."""
    found = os.environ.get("WAYLAND_DISPLAY") or os.environ.get("DISPLAY")
    if found:
        yield ok("rerun", "display", found)
    else:
        do = "pictures and .rrd files work; open these on a machine with a display"
        yield warn("rerun", "display", "none: no window can open here", do)


def drawing() -> Iterator[Finding]:
    """Whether the viewer draws without a display."""
    try:
        from sdt_tools.view.viewer import headless_viewer
    except ImportError as error:
        yield fail("rerun", "viewer", f"not found ({error})", "pip install rerun-sdk")
        return
    try:
        with headless_viewer(320, 240):
            yield ok("rerun", "viewer", "draws without a display")
    except SdtError as error:
        yield warn("rerun", "viewer", str(error), "sdt view --screenshot needs it; .rrd files do not")
