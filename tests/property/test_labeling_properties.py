"""Journals against a plain reading of their rules, for anything that people and crashes do to them."""

from pathlib import Path
from tempfile import TemporaryDirectory

import polars as pl
from hypothesis import given, settings
from hypothesis import strategies as st

from sdt_tools.labeling.acts import COLUMNS, HEADER, Acts
from sdt_tools.labeling.journal import Journal, read_journal
from sdt_tools.labeling.resolve import disagreements, resolve
from sdt_tools.labeling.vocabulary import LabelKind, LabelSource

LABELS = st.sampled_from(["", *LabelKind.MOTION.classes])
LABELERS = st.text(st.characters(exclude_characters=",\n\ufffd", exclude_categories=["Cs"]), min_size=1).filter(
    str.strip
)
SAID = st.tuples(st.integers(0, 2**62), LABELS, LABELERS, st.sampled_from(LabelSource))
FEW = st.tuples(
    st.integers(0, 2),
    st.sampled_from(["", "stay", "forward"]),
    st.sampled_from(["a", "b"]),
    st.sampled_from(LabelSource),
)


def as_rows(table: pl.DataFrame) -> list[tuple[object, ...]]:
    return table.select("act_id", "stamp_ns", "label", "labeler", "source").rows()


@given(before=st.lists(SAID, max_size=4), after=st.lists(SAID, min_size=1, max_size=3), data=st.data())
@settings(deadline=None, max_examples=30)
def test_a_journal_cut_anywhere_keeps_its_whole_lines_and_takes_new_acts(
    before: list[tuple[int, str, str, LabelSource]], after: list[tuple[int, str, str, LabelSource]], data: st.DataObject
) -> None:
    with TemporaryDirectory() as folder:
        path = Path(folder) / "x.motion.csv"
        with Journal(path, "r") as journal:
            for stamp_ns, label, labeler, source in before:
                journal.append(stamp_ns=stamp_ns, label=label, labeler=labeler, source=source, created_ns=1)
        whole = path.read_bytes()
        cut = data.draw(st.integers(0, len(whole)))
        path.write_bytes(whole[:cut])
        kept = max(whole[:cut].count(b"\n") - 1, 0)
        is_broken = cut > len(HEADER) and not whole[:cut].endswith(b"\n")
        assert read_journal(path).broken_lines == ((kept + 2,) if is_broken else ())
        with Journal(path, "r") as journal:
            for stamp_ns, label, labeler, source in after:
                journal.append(stamp_ns=stamp_ns, label=label, labeler=labeler, source=source, created_ns=1)
        acts = read_journal(path, "r")
        expected = [(n, *said[:3], str(said[3])) for n, said in enumerate([*before[:kept], *after], start=1)]
        assert as_rows(acts.table) == expected
        assert acts.broken_lines == ((kept + 2,) if is_broken else ())


@given(st.lists(FEW, max_size=12))
@settings(deadline=None, max_examples=60)
def test_resolving_is_what_the_rules_say(said: list[tuple[int, str, str, LabelSource]]) -> None:
    standing: dict[tuple[int, str, LabelSource], tuple[int, str]] = {}
    for act_id, (stamp_ns, label, labeler, source) in enumerate(said, start=1):
        standing[stamp_ns, labeler, source] = (act_id, label)
    expected: dict[int, tuple[str, str]] = {}
    disputed: set[int] = set()
    for stamp_ns in {key[0] for key in standing}:
        for source in LabelSource:
            words = sorted(
                word for (stamp, _, who), word in standing.items() if (stamp, who) == (stamp_ns, source) and word[1]
            )
            if not words:
                continue
            if source is LabelSource.HUMAN and len({label for _, label in words}) > 1:
                disputed.add(stamp_ns)
            else:
                expected[stamp_ns] = (words[-1][1], str(source))
            break
    rows = [(n, "r", stamp, label, who, str(source), 0) for n, (stamp, label, who, source) in enumerate(said, start=1)]
    acts = Acts(Path("x.motion.csv"), LabelKind.MOTION, pl.DataFrame(rows, schema=dict(COLUMNS), orient="row"))
    assert {stamp: (label, source) for stamp, label, source, _ in resolve(acts).iter_rows()} == expected
    assert set(disagreements(acts)["stamp_ns"]) == disputed
