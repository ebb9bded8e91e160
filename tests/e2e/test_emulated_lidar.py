"""``sdt robot emulate lms1xx`` as a user starts it, with the driver as its client."""

import json
import re
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

from sdt_tools.cli.app import app
from sdt_tools.errors import SdtError
from sdt_tools.frames import RAYS, LidarScan
from sdt_tools.robot.lms1xx.config import Lms1xxConfig
from sdt_tools.robot.lms1xx.driver import Lms1xx

SAMPLE = next((Path(__file__).parents[2] / "recordings").glob("*.mcap"))
SDT = [sys.executable, "-c", "from sdt_tools.cli.app import main; main()", "robot", "emulate", "lms1xx"]


def test_a_recording_is_served_until_ctrl_c_and_what_was_done_is_told() -> None:
    command = [*SDT, "--port", "0", "--recording", str(SAMPLE), "--protocol", "b", "--drop", "0.1", "--json"]
    emulator = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    try:
        assert emulator.stderr is not None
        said = re.search(r"127\.0\.0\.1:(\d+), CoLa-B; Ctrl-C ends it", emulator.stderr.readline())
        assert said is not None
        lidar = Lms1xx(Lms1xxConfig(host="127.0.0.1", port=int(said[1])))
        lidar.wait(1.0)
        scans = [one.message for one in lidar.read(2**62) if isinstance(one.message, LidarScan)]
        lidar.close()
        emulator.send_signal(signal.SIGINT)
        out, _ = emulator.communicate(timeout=10)
    finally:
        emulator.kill()
        emulator.communicate()
    assert scans[0].ranges_m.shape == (RAYS,)
    assert emulator.returncode == 0
    counts = json.loads(out)
    assert counts["clients"] >= 1
    assert counts["sent"] > 20


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--scene", "plain", "--recording", "x.mcap"], "serve either --scene or --recording"),
        (["--recording", "x.mcap"], "x.mcap"),
        (["--scene", "nowhere"], "nowhere"),
        (["--hz", "30"], "--hz: input should be 25 or 50, not 30"),
        (["--password", "secret"], "--password"),
        (["--host", "192.0.2.1"], "192.0.2.1:2111: cannot listen there"),
    ],
)
def test_bad_input_is_said_in_a_line(options: list[str], words: str) -> None:
    result = CliRunner().invoke(app, ["robot", "emulate", "lms1xx", *options])
    assert isinstance(result.exception, SdtError)
    assert words in str(result.exception)
    assert "\n" not in str(result.exception)
