"""What each key does to the state; nothing of screens or files."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import polars as pl
import pytest

from sdt_tools.labeling.acts import COLUMNS
from sdt_tools.labeling.app import state as turns
from sdt_tools.labeling.app.state import State, Turn, applied
from sdt_tools.labeling.frame_labels import UNSAID, labels_of
from sdt_tools.labeling.review import Suspect
from sdt_tools.labeling.vocabulary import SETTLED_BY, LabelKind

STAMPS_NS = np.arange(10) * 20
STAY, FORWARD, LEFT = 0, 1, 2


class Labeler:
    """Presses keys; writes into a journal of paper."""

    def __init__(self, *said: tuple[int, str, str, str], frames: int = 10) -> None:
        rows = [(act, "r", row * 20, label, who, source, 0) for act, (row, label, who, source) in enumerate(said, 1)]
        table = pl.DataFrame(rows, schema=dict(COLUMNS), orient="row")
        self.state = State(labels_of(LabelKind.MOTION, np.arange(frames) * 20, table), "anna")
        self.acts = len(said)
        self.written: list[tuple[str, list[int]]] = []

    def take(self, turn: Turn) -> State:
        self.state = turn.state
        if turn.deed is not None:
            self.acts += len(turn.deed.stamps_ns)
            self.written.append((turn.deed.labeler, (turn.deed.stamps_ns // 20).tolist()))
            self.state = applied(turn.state, turn.deed, self.acts)
        return self.state

    def go(self, by: int) -> State:
        return self.take(turns.step(self.state, by, 1))

    def label(self, number: int) -> State:
        return self.take(turns.label(self.state, number, 1))

    def key(self, turn: Callable[[State], Turn]) -> State:
        return self.take(turn(self.state))

    @property
    def mine(self) -> str:
        """A character a frame."""
        return "".join("." if number == UNSAID else str(number) for number in self.state.mine.tolist())


def test_a_class_is_for_the_frame_shown_and_stays_there() -> None:
    anna = Labeler()
    anna.go(3)
    assert anna.label(FORWARD).cursor == 3
    assert anna.mine == "...1......"
    anna.label(UNSAID)
    assert anna.mine == ".........."
    assert len(anna.written) == 2


def test_what_is_said_already_is_not_written_again() -> None:
    anna = Labeler()
    anna.label(FORWARD)
    assert "forward already" in anna.label(FORWARD).words
    assert len(anna.written) == 1


def test_going_stops_at_both_ends() -> None:
    anna = Labeler()
    assert anna.go(-3).cursor == 0
    assert anna.go(100).cursor == 9


def test_a_range_in_either_direction_is_one_act() -> None:
    anna = Labeler()
    anna.go(6)
    anna.key(turns.toggle_range)
    anna.go(-4)
    state = anna.label(LEFT)
    assert anna.mine == "..22222..."
    assert state.anchor is None
    assert anna.written == [("anna", [2, 3, 4, 5, 6])]
    assert anna.key(turns.undo).mine.tolist() == [UNSAID] * 10


def test_carrying_forward_labels_what_is_passed_until_the_class_changes() -> None:
    anna = Labeler()
    anna.key(turns.toggle_carry)
    anna.label(FORWARD)
    anna.go(3)
    anna.label(STAY)
    anna.go(2)
    anna.key(turns.toggle_carry)
    anna.go(2)
    assert anna.mine == "111000...."


def test_letting_go_ends_what_was_begun_last_and_then_carrying() -> None:
    anna = Labeler()
    anna.key(turns.toggle_carry)
    anna.key(turns.toggle_range)
    after_one, after_two = anna.key(turns.let_go), anna.key(turns.let_go)
    assert (after_one.anchor, after_one.carrying) == (None, True)
    assert not after_two.carrying


def test_carrying_leaves_alone_what_was_labelled_before_and_what_is_jumped_over() -> None:
    anna = Labeler()
    anna.go(2)
    anna.label(LEFT)
    anna.take(turns.go_to(anna.state, 0))
    anna.label(FORWARD)
    anna.key(turns.toggle_carry)
    anna.go(4)
    anna.take(turns.go_to(anna.state, 8))
    assert anna.mine == "11211....."
    anna.go(-3)
    assert anna.mine == "11211....."


def test_carrying_begins_with_the_label_of_the_frame_shown() -> None:
    anna = Labeler()
    anna.label(LEFT)
    anna.go(5)
    anna.label(STAY)
    anna.take(turns.go_to(anna.state, 0))
    assert anna.key(turns.toggle_carry).carried == LEFT


def test_while_a_range_is_chosen_nothing_is_carried() -> None:
    anna = Labeler()
    anna.label(FORWARD)
    anna.key(turns.toggle_carry)
    anna.key(turns.toggle_range)
    anna.go(3)
    assert anna.mine == "1........."


def test_prelabels_are_accepted_where_there_are_some() -> None:
    anna = Labeler((1, "stay", "scene", "truth"), (3, "forward", "scene", "truth"))
    assert "no pre-label" in anna.take(turns.accept(anna.state, 1)).words
    anna.key(turns.toggle_range)
    anna.go(9)
    anna.take(turns.accept(anna.state, 1))
    assert anna.mine == ".0.1......"
    assert len(anna.written) == 1


def test_predictions_of_a_file_are_offered_in_place_of_the_journals_prelabels() -> None:
    anna = Labeler((0, "stay", "scene", "truth"))
    anna.state = replace(anna.state, predicted=np.full(10, LEFT, np.int8))
    anna.take(turns.accept(anna.state, 1))
    assert anna.mine == "2........."


QUARREL = [(row, label, who, "human") for row in (4, 5) for label, who in (("stay", "anna"), ("forward", "ben"))]


def test_a_conflict_is_settled_in_ones_own_name_and_what_was_said_remains() -> None:
    carol = Labeler(*QUARREL)
    carol.state = replace(carol.state, labeler="carol")
    assert "nobody disagrees" in carol.key(turns.ask_to_settle).words
    carol.key(turns.toggle_range)
    carol.go(9)
    assert carol.key(turns.ask_to_settle).settling
    state = carol.label(LEFT)
    assert carol.written == [(SETTLED_BY + "carol", [4, 5])]
    assert state.labels.human.tolist()[4:6] == [LEFT, LEFT]
    assert not state.labels.disputed.any()
    assert state.labels.differing.tolist()[4:6] == [True, True]
    assert carol.key(turns.undo).labels.disputed.tolist()[4:6] == [True, True]
    assert carol.key(turns.redo).labels.human.tolist()[4:6] == [LEFT, LEFT]


def test_a_settlement_can_be_withdrawn() -> None:
    anna = Labeler(*QUARREL, (4, "stay", SETTLED_BY + "anna", "human"))
    anna.go(4)
    anna.key(turns.ask_to_settle)
    assert anna.label(UNSAID).labels.disputed[4]
    assert anna.mine[4] == str(STAY)


def test_escape_gives_everything_up() -> None:
    anna = Labeler(*QUARREL)
    anna.go(4)
    anna.key(turns.toggle_range)
    anna.key(turns.ask_to_settle)
    state = anna.key(turns.let_go)
    assert (state.anchor, state.settling, state.speed) == (None, False, 0.0)
    anna.label(LEFT)
    assert anna.written == [("anna", [4])]


def test_the_next_unlabelled_frame_and_around_the_end() -> None:
    anna = Labeler(*((row, "stay", "anna", "human") for row in (0, 1, 2, 5)))

    def unlabelled(*, backward: bool) -> int:
        marks = anna.state.mine == UNSAID
        return anna.take(turns.go_to_next(anna.state, marks, "frame", backward=backward, runs=False)).cursor

    assert [unlabelled(backward=False) for _ in range(4)] == [3, 4, 6, 7]
    assert [unlabelled(backward=True) for _ in range(4)] == [6, 4, 3, 9]
    assert anna.state.words == "the last frame: there is none before"


def test_disagreements_are_gone_through_run_by_run() -> None:
    anna = Labeler(*QUARREL, (7, "stay", "scene", "truth"), (7, "left_forward", "anna", "human"))
    rows = []
    for _ in range(3):
        turn = turns.go_to_next(anna.state, anna.state.disagreeing, "disagreement", backward=False, runs=True)
        rows.append(anna.take(turn).cursor)
    assert rows == [4, 7, 4]
    none = turns.go_to_next(anna.state, np.zeros(10, bool), "suspect", backward=False, runs=True)
    assert none.state.words == "no suspect"


def test_a_suspect_is_settled_by_any_other_label() -> None:
    anna = Labeler((3, "stay", "scene", "truth"))
    anna.state = replace(anna.state, suspects=(Suspect(3, "stay", "forward", 0.9),))
    assert anna.state.suspect.tolist().index(True) == 3
    anna.go(3)
    assert not anna.label(FORWARD).suspect.any()


def test_undo_shows_what_it_undoes() -> None:
    anna = Labeler()
    anna.go(7)
    anna.label(FORWARD)
    anna.go(-7)
    state = anna.key(turns.undo)
    assert (state.cursor, state.words) == (7, "undone: 1 frame forward → none")
    assert anna.key(turns.undo).words == "nothing to undo"
    assert anna.key(turns.redo).mine[7] == FORWARD
    assert anna.key(turns.redo).words == "nothing to do again"


@pytest.mark.parametrize("frames", [1, 2])
def test_the_smallest_recordings(frames: int) -> None:
    anna = Labeler(frames=frames)
    anna.key(turns.toggle_carry)
    anna.label(FORWARD)
    anna.go(10)
    assert anna.mine == "1" * frames
