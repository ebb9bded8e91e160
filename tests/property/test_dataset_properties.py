"""Choosing frames, against brute force."""

from itertools import combinations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from sdt_tools.dataset.choice import Pool, Rules, available, equal_quotas, fill_quotas, largest_equal_quota, pack

STAMPS = st.lists(st.integers(0, 60), max_size=14).map(lambda stamps: np.array(sorted(stamps), dtype=np.int64))
SPACING = st.integers(0, 12)
CAP = st.none() | st.integers(1, 6)


@st.composite
def pools(draw: st.DrawFn) -> list[Pool]:
    made = []
    for stamps in draw(st.lists(STAMPS, min_size=1, max_size=4)):
        labels = draw(st.lists(st.integers(0, 2), min_size=len(stamps), max_size=len(stamps)))
        made.append(Pool(stamps, np.array(labels, dtype=np.int64)))
    return made


@given(STAMPS.filter(lambda stamps: len(stamps) <= 10), st.integers(1, 12))
@settings(deadline=None, max_examples=60)
def test_no_spaced_subset_is_larger_than_the_packed_one(stamps: np.ndarray, spacing: int) -> None:
    packed = stamps[pack(stamps, spacing)]
    assert np.all(np.diff(packed) >= spacing)
    larger = combinations(stamps.tolist(), len(packed) + 1)
    assert not any(np.all(np.diff(subset) >= spacing) for subset in larger)


@given(pools(), st.lists(st.integers(0, 12), min_size=3, max_size=3), SPACING, CAP, st.integers(0, 5))
@settings(deadline=None, max_examples=60)
def test_the_choice_keeps_every_rule(
    given_pools: list[Pool], quotas: list[int], spacing: int, cap: int | None, seed: int
) -> None:
    choice = fill_quotas(given_pools, dict(enumerate(quotas)), Rules(spacing, cap), [seed])
    filled = np.zeros(3, dtype=int)
    for pool, frames in zip(given_pools, choice.taken, strict=True):
        assert np.all(np.diff(frames) > 0)
        assert np.all(np.diff(pool.stamps_ns[frames]) >= spacing)
        assert cap is None or len(frames) <= cap
        filled += np.bincount(pool.labels[frames], minlength=3)
    assert dict(enumerate(filled.tolist())) == choice.filled
    assert all(choice.filled[label] <= quotas[label] for label in range(3))


@given(pools(), st.lists(st.integers(0, 12), min_size=3, max_size=3), SPACING, CAP, st.integers(0, 5))
@settings(deadline=None, max_examples=60)
def test_nothing_that_still_fits_is_left_when_a_quota_is_short(
    given_pools: list[Pool], quotas: list[int], spacing: int, cap: int | None, seed: int
) -> None:
    choice = fill_quotas(given_pools, dict(enumerate(quotas)), Rules(spacing, cap), [seed])
    for pool, frames in zip(given_pools, choice.taken, strict=True):
        if cap is not None and len(frames) == cap:
            continue
        taken = pool.stamps_ns[frames]
        for place, (stamp, label) in enumerate(zip(pool.stamps_ns.tolist(), pool.labels.tolist(), strict=True)):
            fits = place not in frames and np.all(np.abs(taken - stamp) >= spacing)
            assert not fits or choice.filled[label] == quotas[label]


@given(pools(), SPACING, CAP, st.integers(0, 5))
@settings(deadline=None, max_examples=60)
def test_one_class_alone_gets_all_that_is_available(
    given_pools: list[Pool], spacing: int, cap: int | None, seed: int
) -> None:
    rules = Rules(spacing, cap)
    supply = available(given_pools, [1], rules)[1]
    assert fill_quotas(given_pools, {1: 100}, rules, [seed]).filled == {1: supply}


@given(pools(), SPACING, CAP, st.integers(0, 5))
@settings(deadline=None, max_examples=60)
def test_the_largest_equal_quota_is_filled_by_every_class(
    given_pools: list[Pool], spacing: int, cap: int | None, seed: int
) -> None:
    rules = Rules(spacing, cap)
    quota = largest_equal_quota(given_pools, range(3), rules, [seed])
    quotas = dict.fromkeys(range(3), quota)
    assert fill_quotas(given_pools, quotas, rules, [seed]).filled == quotas
    one_more = dict.fromkeys(range(3), quota + 1)
    assert fill_quotas(given_pools, one_more, rules, [seed]).filled != one_more


@given(st.integers(0, 100), st.dictionaries(st.integers(0, 6), st.integers(0, 9), min_size=1))
def test_equal_quotas_add_up_and_favour_the_commonest(total: int, supply: dict[int, int]) -> None:
    quotas = equal_quotas(total, supply)
    assert sum(quotas.values()) == total
    assert max(quotas.values()) - min(quotas.values()) <= 1
    more = [supply[label] for label in supply if quotas[label] > total // len(supply)]
    less = [supply[label] for label in supply if quotas[label] == total // len(supply)]
    assert not more or not less or min(more) >= max(less)
