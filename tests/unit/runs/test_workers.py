"""Workers end with whoever started them, however that one dies."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from sdt_tools.runs.local import run_units
from sdt_tools.runs.unit import Unit

START = """
import sys
sys.path.insert(0, {folder!r})
from collections.abc import Callable
from pathlib import Path
from test_workers import start_waiting
if __name__ == "__main__":
    start_waiting(Path({out!r}))
"""


def wait_for_ever(out: Path, said: str) -> None:
    Path(said).write_text(str(os.getpid()))
    time.sleep(600)


def start_waiting(out: Path) -> None:
    units = [Unit(f"unit-{n}", wait_for_ever, {"said": str(out / f"pid-{n}")}) for n in range(2)]
    run_units(units, out / "units", workers=2)


def soon(holds: Callable[[], bool]) -> bool:
    end_s = time.monotonic() + 60.0
    while time.monotonic() < end_s:
        if holds():
            return True
        time.sleep(0.05)
    return False


def gone(pid: int) -> bool:
    try:
        state = Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0]
    except (FileNotFoundError, ProcessLookupError):
        return True
    return state == "Z"


@pytest.mark.parametrize("end", [signal.SIGTERM, signal.SIGKILL])
def test_workers_follow_their_parent(end: signal.Signals, tmp_path: Path) -> None:
    script = tmp_path / "start.py"
    script.write_text(START.format(folder=str(Path(__file__).parent), out=str(tmp_path)))
    parent = subprocess.Popen([sys.executable, script], env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)})
    said = [tmp_path / f"pid-{n}" for n in range(2)]
    try:
        assert soon(lambda: all(path.exists() and path.read_text() for path in said))
    finally:
        parent.send_signal(end)
        parent.wait()
    workers = [int(path.read_text()) for path in said]
    assert soon(lambda: all(gone(pid) for pid in workers))
