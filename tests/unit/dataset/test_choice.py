from collections import Counter

import numpy as np

from sdt_tools.dataset.choice import Pool, Rules, fill_quotas


def pool(frames: int, label: int = 0, period: int = 100) -> Pool:
    return Pool(np.arange(frames, dtype=np.int64) * period, np.full(frames, label, dtype=np.int64))


def test_recordings_give_in_proportion_to_what_they_offer() -> None:
    taken = [
        [len(frames) for frames in fill_quotas([pool(20), pool(60)], {0: 40}, Rules(0, None), [seed]).taken]
        for seed in range(50)
    ]
    assert all(sum(counts) == 40 for counts in taken)
    assert 9 < np.mean([few for few, _ in taken]) < 11


def test_every_frame_of_a_run_has_its_chance_not_only_the_first() -> None:
    run = pool(7)  # 0.6 s at 10 Hz: two frames 0.4 s apart fit, with 0.2 s of slack
    taken = [fill_quotas([run], {0: 2}, Rules(400, None), [seed]).taken[0].tolist() for seed in range(300)]
    assert all(second - first >= 4 for first, second in taken)
    assert set(Counter(first for first, _ in taken)) == {0, 1, 2}
    assert set(Counter(second for _, second in taken)) == {4, 5, 6}


def test_the_rarest_class_is_served_first_however_the_classes_are_numbered() -> None:
    for rare, common in [(0, 1), (1, 0)]:
        labels = np.full(20, common, dtype=np.int64)
        labels[10] = rare
        mixed = Pool(np.arange(20, dtype=np.int64) * 100, labels)
        for seed in range(20):
            choice = fill_quotas([mixed], {0: 5, 1: 5}, Rules(400, None), [seed])
            assert choice.filled[rare] == 1


def test_the_same_seed_takes_the_same_frames() -> None:
    pools = [pool(30), pool(30, label=1)]
    one, same, other = (fill_quotas(pools, {0: 5, 1: 5}, Rules(0, None), [seed]) for seed in (1, 1, 2))
    assert [frames.tolist() for frames in one.taken] == [frames.tolist() for frames in same.taken]
    assert [frames.tolist() for frames in one.taken] != [frames.tolist() for frames in other.taken]
