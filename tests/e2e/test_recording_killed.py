"""``sdt record``, killed: what is on the disk is whole up to the last second."""

from pathlib import Path

import pytest
from killed_recordings import check_that_it_is_saved, kill_a_recording


@pytest.mark.parametrize("seed", range(3))
def test_a_killed_recording_is_saved_up_to_its_last_second(tmp_path: Path, seed: int) -> None:
    killed = kill_a_recording(tmp_path / "r.mcap", seed)
    assert check_that_it_is_saved(killed) > 0
    assert killed.lost_s <= 1.0
