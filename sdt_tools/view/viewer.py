"""Rerun's viewer as a process on this machine: with a window for people, without one for pictures.

Whatever starts it here, it listens on loopback only.
"""

import json
import os
import socket
import subprocess
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Final

import numpy as np
import rerun_cli
from rerun.experimental import ViewerClient

from sdt_tools.errors import RunError
from sdt_tools.view.timeline import ERROR, TIME

START_S: Final = 30.0
SETTLE_S: Final = 1.0
LOAD_S: Final = 60.0
_NOWHERE: Final = "http://127.0.0.1:9"
"""Port 9 (discard) of this machine: nothing listens there."""


class ViewerError(RunError):
    """The viewer could not be started, or did not show what it was given."""


def open_window(files: Sequence[Path] = ()) -> int:
    """Start a viewer with a window on ``files`` that outlives this process; returns the port that it listens on.

    Raises ViewerError where no window opens, as on a machine without a display.
    """
    port = free_port()
    command = [_executable(), "--bind", "127.0.0.1", "--port", str(port), *(str(file.resolve()) for file in files)]
    silent = subprocess.DEVNULL
    process = subprocess.Popen(command, stdin=silent, stdout=silent, stderr=silent, start_new_session=True)
    deadline = time.monotonic() + START_S
    while process.poll() is None and time.monotonic() < deadline:
        time.sleep(0.1)
        with suppress(OSError), socket.create_connection(("127.0.0.1", port), timeout=1.0):
            time.sleep(SETTLE_S)  # it listens before it looks for a display
            if process.poll() is None:
                return port
    raise ViewerError("the viewer's window does not open; run `rerun` with the .rrd on a machine with a display")


def go_to(port: int, file: Path, time_ns: int, error: int | None = None) -> None:
    """Set the viewer on ``port``, which shows ``file``, to an error by its number; without, to ``time_ns``.

    Raises ViewerError where the file does not load.
    """
    client = ViewerClient.connect(viewer_url(port))
    wait_until_loaded(client, file)
    set_place(client, time_ns, error)


def wait_until_loaded(client: ViewerClient, file: Path) -> None:
    """Wait until all of ``file`` is there. Raises ViewerError where it does not come."""
    deadline = time.monotonic() + LOAD_S
    while client.get_state().loading:
        if time.monotonic() > deadline:
            raise ViewerError(
                f"{file}: not loaded after {LOAD_S:.0f} s; show fewer scans (--every), or a shorter recording"
            )
        time.sleep(0.05)


def set_place(client: ViewerClient, time_ns: int, error: int | None = None) -> None:
    """Go to an error by its number on the timeline ``error``; without, to ``time_ns`` on the timeline ``time``."""
    if error is None:
        client.set_time(TIME, timestamp=np.datetime64(time_ns, "ns"), play_state="paused")
    else:
        client.set_time(ERROR, sequence=error, play_state="paused")


@contextmanager
def headless_viewer(width: int = 1600, height: int = 1000) -> Iterator[ViewerClient]:
    """A viewer without a window, its picture of ``width`` by ``height`` pixels, gone when the block ends.

    It needs a graphics driver; a software one will do (Debian: mesa-vulkan-drivers). It talks to nobody else: usage
    data are switched off in a configuration of its own, and the question for newer versions meets a proxy that does not
    exist. Raises ViewerError where it does not start.
    """
    with tempfile.TemporaryDirectory(prefix="sdt-viewer-") as folder:
        home, port = Path(folder), free_port()
        options = ["--headless", "--bind", "127.0.0.1", "--port", str(port), "--hide-welcome-screen"]
        options += ["--window-size", f"{width}x{height}", "--threads", "1"]
        with (home / "viewer.log").open("wb") as log:
            process = subprocess.Popen(
                [_executable(), *options], env=_secluded(home), stdout=log, stderr=subprocess.STDOUT
            )
        try:
            yield _connected(process, port, home)
        finally:
            process.terminate()
            try:
                process.wait(5.0)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()


def _connected(process: "subprocess.Popen[bytes]", port: int, home: Path) -> ViewerClient:
    """A client of the viewer, once it has painted: it listens before it looks for a graphics driver."""
    deadline = time.monotonic() + START_S
    while process.poll() is None and time.monotonic() < deadline:
        try:
            client = ViewerClient.connect(viewer_url(port))
            client.save_screenshot(str(home / "first.png"))
        except (RuntimeError, OSError):
            time.sleep(0.05)
        else:
            return client
    text = (home / "viewer.log").read_text(errors="replace")
    if "graphics adapter" in text or "render context" in text:
        raise ViewerError("the viewer finds no graphics driver; install one (Debian: mesa-vulkan-drivers)")
    lines = text.strip().splitlines() or ["it said nothing"]
    raise ViewerError(f"the viewer did not start: {lines[-1]}")


def viewer_url(port: int) -> str:
    """Where a viewer on this machine takes data."""
    return f"rerun+http://127.0.0.1:{port}/proxy"


def free_port() -> int:
    """A port of the loopback interface that is free now."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def _executable() -> str:
    """The viewer itself: the command ``rerun`` would start it as a child, which outlives being terminated."""
    return str(Path(rerun_cli.__file__).with_name("rerun.exe" if os.name == "nt" else "rerun"))


def _secluded(home: Path) -> dict[str, str]:
    """An environment with folders under ``home``, without usage data and without a way out of this machine."""
    settings = home / "rerun" / "analytics.json"
    settings.parent.mkdir()
    quiet = {"analytics_enabled": False, "analytics_id": "none", "metadata": {}}
    places = {"config_file_path": str(settings), "data_dir_path": str(home / "rerun")}
    settings.write_text(json.dumps(quiet | places))
    folders = dict.fromkeys(("XDG_CONFIG_HOME", "XDG_DATA_HOME", "XDG_CACHE_HOME", "XDG_RUNTIME_DIR"), str(home))
    names = ("http_proxy", "https_proxy", "all_proxy")
    proxies = {name: _NOWHERE for lower in names for name in (lower, lower.upper())}
    local = dict.fromkeys(("no_proxy", "NO_PROXY"), "127.0.0.1,localhost")
    return {**os.environ, **folders, **proxies, **local}
