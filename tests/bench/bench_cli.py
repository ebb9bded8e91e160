"""How long a user waits for ``--help``: whole processes, every verb."""

import subprocess
import sys
from pathlib import Path

import pytest
from pytest_benchmark.fixture import BenchmarkFixture

from sdt_tools.cli.app import VERBS

SDT = Path(sys.executable).with_name("sdt")


@pytest.mark.parametrize("verb", VERBS)
def test_help(benchmark: BenchmarkFixture, verb: str) -> None:
    benchmark.pedantic(
        subprocess.run, args=([SDT, verb, "--help"],), kwargs={"check": True, "capture_output": True}, rounds=3
    )
