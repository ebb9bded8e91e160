import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from sdt_tools.view.timeline import LONGEST_HOLD_NS, changes, held, hold_ns, when

stamps = st.lists(st.integers(0, 10**10), unique=True, max_size=40).map(lambda times: np.array(sorted(times), np.int64))


def test_a_message_between_two_scans_belongs_to_the_earlier_one() -> None:
    rows = when(np.array([5, 10, 19, 20, 99]), np.array([10, 20, 30]))
    assert rows.frames.tolist() == [0, 0, 0, 1, 2]


def test_runs_of_equal_samples_are_one_change_each() -> None:
    told = changes(np.arange(5, dtype=np.int64) * 100, ["a", "a", "b", "b", "a"])
    assert told.states == ("a", "b", "a", "")
    assert told.stamps_ns.tolist() == [0, 200, 400, 650]


def test_a_pause_leaves_a_gap() -> None:
    told = changes(np.array([0, 100, 200, 1_000, 1_100], np.int64), ["a"] * 5)
    assert list(zip(told.stamps_ns.tolist(), told.states, strict=True)) == [
        (0, "a"),
        (450, ""),
        (1_000, "a"),
        (1_350, ""),
    ]


def test_one_sample_holds_for_half_a_second() -> None:
    assert hold_ns(np.array([7], np.int64)) == LONGEST_HOLD_NS == 500_000_000


@given(stamps, st.data())
def test_the_changes_tell_every_sample(stamps_ns: np.ndarray, data: st.DataObject) -> None:
    states = data.draw(st.lists(st.sampled_from(["", "a", "b"]), min_size=len(stamps_ns), max_size=len(stamps_ns)))
    told = changes(stamps_ns, states)
    newest = np.searchsorted(told.stamps_ns, stamps_ns, side="right") - 1
    assert [told.states[row] if row >= 0 else "" for row in newest.tolist()] == states
    assert (np.diff(told.stamps_ns) > 0).all()


@given(stamps, stamps)
def test_what_holds_is_the_newest_sample_unless_it_is_too_old(stamps_ns: np.ndarray, at_ns: np.ndarray) -> None:
    hold = hold_ns(stamps_ns)
    for row, now_ns in zip(held(stamps_ns, at_ns).tolist(), at_ns.tolist(), strict=True):
        fresh = [number for number, stamp_ns in enumerate(stamps_ns.tolist()) if 0 <= now_ns - stamp_ns <= hold]
        assert row == (fresh[-1] if fresh else -1)
