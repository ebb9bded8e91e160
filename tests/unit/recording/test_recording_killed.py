"""The process dies without a word: what is lost is what was handed over in the last second, at most."""

from pathlib import Path

import pytest
from recording_killed import kill_a_recorder


@pytest.mark.parametrize("killed_at", [30, 75, 110])
def test_a_recorder_that_is_killed_loses_a_second_at_most(tmp_path: Path, killed_at: int) -> None:
    assert kill_a_recorder(tmp_path, killed_at) <= 1.0
