"""Undo and redo derived from the journal alone, against a plain stack of states."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import polars as pl
from hypothesis import given, settings
from hypothesis import strategies as st

from sdt_tools.labeling.app import state as turns
from sdt_tools.labeling.app.state import State, Turn, applied
from sdt_tools.labeling.frame_labels import UNSAID, labels_of
from sdt_tools.labeling.history import Deed, History, history_of
from sdt_tools.labeling.journal import Journal, read_journal
from sdt_tools.labeling.vocabulary import LabelKind

KIND = LabelKind.MOTION
STAMPS_NS = np.arange(1000, 1012)
NOTHING = pl.DataFrame(
    schema={"act_id": pl.Int64, "stamp_ns": pl.Int64, "label": pl.String, "labeler": pl.String, "source": pl.String}
)

keys = st.lists(
    st.one_of(
        st.tuples(st.just("label"), st.integers(UNSAID, 6)),
        st.tuples(st.just("range"), st.integers(-5, 5)),
        st.tuples(st.just("go"), st.integers(0, 11)),
        st.tuples(st.sampled_from(["undo", "redo"]), st.just(0)),
    ),
    max_size=40,
)


def fresh() -> State:
    return State(labels_of(KIND, STAMPS_NS, NOTHING), "anna")


def turn_of(state: State, key: tuple[str, int], now_ns: int) -> Turn:
    what, number = key
    match what:
        case "label":
            return turns.label(state, number, now_ns)
        case "range":
            return turns.step(turns.toggle_range(state).state, number, now_ns)
        case "go":
            return turns.go_to(state, number)
        case "undo":
            return turns.undo(state)
        case _:
            return turns.redo(state)


def same(one: Deed, other: Deed) -> bool:
    return (one.created_ns, one.labeler) == (other.created_ns, other.labeler) and all(
        np.array_equal(getattr(one, name), getattr(other, name)) for name in ("stamps_ns", "before", "after")
    )


def written(journal: Journal, state: State, turn: Turn) -> State:
    if turn.deed is None:
        return turn.state
    journal.append_table(turn.deed.rows(KIND))
    return applied(turn.state, turn.deed, journal.last_act)


@settings(max_examples=40, deadline=None)
@given(pressed=keys)
def test_undo_and_redo_are_those_of_a_stack_and_survive_a_restart_at_every_moment(
    pressed: list[tuple[str, int]], tmp_path_factory: object
) -> None:
    path = tmp_path_factory.mktemp("history") / "r.motion.csv"  # type: ignore[attr-defined]
    state, past, future = fresh(), [], []
    with Journal(path, "r") as journal:
        for key in pressed:
            before = state.mine.tolist()
            turn = turn_of(state, key, 5)  # a clock that stands still must do
            state = written(journal, state, turn)
            if turn.deed is not None and key[0] == "undo":
                future.append(before)
                assert state.mine.tolist() == past.pop()
            elif turn.deed is not None and key[0] == "redo":
                past.append(before)
                assert state.mine.tolist() == future.pop()
            elif turn.deed is not None:
                past.append(before)
                future = []
            assert (len(state.history.done), len(state.history.undone)) == (len(past), len(future))
            again = history_of(read_journal(path, "r").table, KIND, "anna")
            for one, other in ((again.done, state.history.done), (again.undone, state.history.undone)):
                assert len(one) == len(other)
                assert all(map(same, one, other))
    assert labels_of(KIND, STAMPS_NS, read_journal(path, "r").table).resolved.tolist() == state.mine.tolist()


def test_what_others_do_is_not_undone(tmp_path: Path) -> None:
    path = tmp_path / "r.motion.csv"
    state = fresh()
    with Journal(path, "r") as mine, Journal(path, "r") as other:
        state = written(mine, state, turns.label(state, 1, 5))
        theirs = Deed(6, "ben", STAMPS_NS[:1], np.array([UNSAID], np.int8), np.array([2], np.int8))
        other.append_table(theirs.rows(KIND))
        state = written(mine, state, turns.undo(state))
    found = labels_of(KIND, STAMPS_NS, read_journal(path, "r").table)
    assert found.resolved[0] == 2
    history = history_of(read_journal(path, "r").table, KIND, "anna")
    assert (len(history.done), len(history.undone)) == (0, 1)


def test_a_new_deed_ends_what_could_be_done_again() -> None:
    deed = Deed(5, "anna", STAMPS_NS[:1], np.array([UNSAID], np.int8), np.array([1], np.int8))
    undone = History().after(deed).after(deed.reversed)
    assert undone.undone == (deed,)
    assert undone.after(replace(deed, created_ns=6)).undone == ()
