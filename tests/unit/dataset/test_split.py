from collections import Counter

import pytest

from sdt_tools.dataset.split import SplitEntry, validation_ids
from sdt_tools.errors import DatasetError

SCENARIOS = {"a": 50, "b": 20, "c": 30}
ENTRIES = [SplitEntry(f"{name}-{n}", name) for name, count in SCENARIOS.items() for n in range(count)]


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("share", [0.1, 0.2, 0.33, 0.5])
def test_each_scenario_gives_its_share(share: float, seed: int) -> None:
    chosen = Counter(name[0] for name in validation_ids(ENTRIES, share, seed))
    for scenario, count in SCENARIOS.items():
        assert abs(chosen[scenario] - share * count) <= 1
    assert abs(chosen.total() - share * 100) < 1


def test_the_order_of_the_recordings_does_not_matter_but_the_seed_does() -> None:
    assert validation_ids(ENTRIES, 0.2, 3) == validation_ids(ENTRIES[::-1], 0.2, 3)
    assert validation_ids(ENTRIES, 0.2, 3) != validation_ids(ENTRIES, 0.2, 4)


@pytest.mark.parametrize("seed", range(20))
@pytest.mark.parametrize("share", [0.01, 0.99])
def test_neither_side_is_ever_empty(share: float, seed: int) -> None:
    assert len(validation_ids(ENTRIES[:2], share, seed)) == 1


def test_over_seeds_every_recording_validates_about_as_often() -> None:
    times = Counter(name for seed in range(300) for name in validation_ids(ENTRIES[:10], 0.2, seed))
    assert set(times) == {entry.recording_id for entry in ENTRIES[:10]}
    assert max(times.values()) <= 90  # 60 expected, standard deviation 7
    assert min(times.values()) >= 30


def test_one_recording_cannot_be_split() -> None:
    with pytest.raises(DatasetError, match="one recording given; training and validation need at least one each"):
        validation_ids(ENTRIES[:1], 0.2, 0)
