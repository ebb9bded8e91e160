from pathlib import Path

import numpy as np
import polars as pl
from hypothesis import given
from hypothesis import strategies as st

from sdt_tools.labeling.acts import COLUMNS, Acts
from sdt_tools.labeling.frame_labels import UNSAID, FrameLabels, class_numbers, labels_of, rows_of
from sdt_tools.labeling.resolve import disagreements, resolve
from sdt_tools.labeling.vocabulary import SETTLED_BY, LabelKind, LabelSource

KIND = LabelKind.MOTION
STAMPS_NS = np.arange(100, 160, 10)
Said = tuple[int, str, str, str]

acts = st.lists(
    st.tuples(
        st.sampled_from([*STAMPS_NS.tolist(), 105]),
        st.sampled_from(["", "stay", "forward", "backward"]),
        st.sampled_from(["anna", "ben", SETTLED_BY + "carol", SETTLED_BY + "dora"]),
        st.sampled_from([str(source) for source in LabelSource]),
    ),
    max_size=30,
)


def table(said: list[Said], first: int = 1) -> pl.DataFrame:
    rows = [(act, "r", *what, 0) for act, what in enumerate(said, first)]
    return pl.DataFrame(rows, schema=dict(COLUMNS), orient="row")


def as_arrays(resolved: pl.DataFrame) -> list[int]:
    known = resolved.filter(pl.col("stamp_ns").is_in(STAMPS_NS.tolist()))
    found = np.full(len(STAMPS_NS), UNSAID)
    found[rows_of(STAMPS_NS, known["stamp_ns"].to_numpy())] = class_numbers(known["label"], KIND).to_numpy()
    return found.tolist()


@given(said=acts)
def test_the_arrays_say_what_the_tables_say(said: list[Said]) -> None:
    labels = labels_of(KIND, STAMPS_NS, table(said))
    journal = Acts(Path("x.motion.csv"), KIND, table(said))
    assert labels.resolved.tolist() == as_arrays(resolve(journal))
    disputed = set(disagreements(journal)["stamp_ns"]) - {105}
    assert set(STAMPS_NS[labels.disputed].tolist()) == disputed
    assert labels.strangers == sum(what[0] == 105 for what in said)


@given(said=acts, cut=st.integers(0, 30))
def test_acts_may_be_heard_in_parts(said: list[Said], cut: int) -> None:
    at_once = labels_of(KIND, STAMPS_NS, table(said))
    before = labels_of(KIND, STAMPS_NS, table(said[:cut]))
    after = before.heard(table(said[cut:], first=cut + 1))
    assert after.resolved.tolist() == at_once.resolved.tolist()
    assert before.resolved.tolist() == labels_of(KIND, STAMPS_NS, table(said[:cut])).resolved.tolist()  # untouched


def test_prelabels_are_no_persons_word_and_are_counted_apart() -> None:
    said: list[Said] = [
        (100, "stay", "scene", "truth"),
        (100, "forward", "net", "model"),
        (110, "backward", "anna", "human"),
    ]
    labels = labels_of(KIND, STAMPS_NS, table(said))
    assert labels.labelers == ("anna",)
    assert labels.counts(labels.human) == (0, 0, 0, 0, 1, 0, 0)
    assert labels.counts(labels.prelabels) == (1, 0, 0, 0, 0, 0, 0)


def test_what_was_settled_stands_and_the_difference_can_still_be_seen() -> None:
    quarrel: list[Said] = [(100, "stay", "anna", "human"), (100, "forward", "ben", "human")]
    labels = labels_of(KIND, STAMPS_NS, table(quarrel))
    assert labels.disputed.tolist()[0]
    settled = labels.heard(table([(100, "backward", SETTLED_BY + "carol", "human")], first=3))
    assert settled.human[0] == KIND.classes.index("backward")
    assert settled.differing[0]
    assert not settled.disputed[0]
    assert settled.labelers == ("anna", "ben")


def test_a_recording_without_frames_knows_no_stamp() -> None:
    assert rows_of(np.empty(0, np.int64), np.array([1])).tolist() == [-1]
    assert len(FrameLabels(KIND, np.empty(0, np.int64), {}).resolved) == 0
