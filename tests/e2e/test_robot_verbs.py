"""Playing devices from the command line."""

import json
import subprocess
import sys

import pytest
from refusals import Sdt, assert_refused

from sdt_tools.frames import Twist
from sdt_tools.robot.p3at.base import P3atBase
from sdt_tools.robot.p3at.config import P3atConfig

PROGRAM = "from sdt_tools.cli.app import main; main()"


def test_a_base_is_played_until_ctrl_c_and_tells_how_it_fared() -> None:
    command = [sys.executable, "-c", PROGRAM, "robot", "emulate", "p3at", "--port", "0", "--json", "--fault", "merge"]
    pipe = subprocess.PIPE
    with subprocess.Popen(command, stdout=pipe, stderr=pipe, text=True) as playing:
        assert playing.stderr is not None
        address = playing.stderr.readline().split()[3].rstrip(";")
        with P3atBase(P3atConfig(address=address)) as base:
            base.command(Twist(0.3, 0.0))
        playing.send_signal(2)
        document = json.loads(playing.communicate(timeout=10)[0])
    assert playing.returncode == 0
    assert document["address"] == address
    assert document["packets_received"] > 10
    assert document["motors_on"] is False


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--fault", "fire"], "fault 'fire': write KIND[=VALUE][@FROM[-TO]]"),
        (["--host", "192.0.2.1"], "192.0.2.1:8101 cannot be listened on"),
    ],
)
def test_a_base_that_cannot_be_played(sdt: Sdt, words: list[str], said: str) -> None:
    assert_refused(sdt("robot", "emulate", "p3at", *words), said)
