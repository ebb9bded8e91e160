"""How the app looks: pictures that somebody has looked at, held against what it draws now.

After a change that is meant, `pytest --snapshot-update` takes new ones: look at them.
"""

from collections.abc import Callable, Iterator
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path

import polars as pl
import pytest
from labeling_samples import START_NS, record, say, stamp_ns

from sdt_tools.labeling.app.app import LabelingApp
from sdt_tools.labeling.app.desk import Desk, Task
from sdt_tools.labeling.vocabulary import LabelKind, LabelSource

SIZES = [(80, 24), (160, 50)]
Compare = Callable[..., bool]


@pytest.fixture
def task(tmp_path: Path) -> Task:
    """Two people have labelled, the truth is known, and some labels are suspect."""
    drive, labels = record(tmp_path / "drive.mcap", 150), tmp_path / "labels"
    say(labels, drive, "scene", range(0, 150, 5), "forward", LabelSource.TRUTH)
    say(labels, drive, "ben", range(40), "forward")
    say(labels, drive, "anna", range(30), "forward")
    say(labels, drive, "anna", range(30, 60), "left_forward")
    doubts = {"recording": ["drive"], "stamp_ns": [stamp_ns(50)], "label": ["left_forward"], "suggested": ["stay"]}
    with Desk(Task(drive, LabelKind.MOTION, labels, "anna")) as desk:
        doubts["recording_id"] = [desk.recording_id]
    pl.DataFrame(doubts | {"score": [0.93]}).write_csv(tmp_path / "suspects.csv")
    return Task(drive, LabelKind.MOTION, labels, "anna", suspects=tmp_path / "suspects.csv")


@pytest.fixture
def open_app() -> Iterator[Callable[[Task], LabelingApp]]:
    with ExitStack() as opened:
        yield lambda task: LabelingApp(opened.enter_context(Desk(task)), now_ns=lambda: START_NS)


@pytest.mark.parametrize("size", SIZES, ids=str)
@pytest.mark.parametrize(
    "keys",
    [
        pytest.param([], id="opened"),
        pytest.param(["f", "4", "pagedown", "pagedown", "v", "right", "right"], id="carrying"),
        pytest.param(["home", "j", "="], id="settling"),
        pytest.param(["l"], id="review"),
        pytest.param(["?"], id="help"),
        pytest.param(["g", "1", ".", "2"], id="jump"),
    ],
)
def test_motions(
    snap_compare: Compare,
    task: Task,
    open_app: Callable[[Task], LabelingApp],
    keys: list[str],
    size: tuple[int, int],
) -> None:
    assert snap_compare(open_app(task), press=keys, terminal_size=size)


@pytest.mark.parametrize("size", SIZES, ids=str)
def test_gestures_without_scans(
    snap_compare: Compare, tmp_path: Path, open_app: Callable[[Task], LabelingApp], size: tuple[int, int]
) -> None:
    drive = record(tmp_path / "drive.mcap", 60, scans=False)
    task = Task(drive, LabelKind.GESTURE, tmp_path / "labels", "anna")
    assert snap_compare(open_app(task), press=["e", "f", "pagedown", "i"], terminal_size=size)


def test_a_small_terminal(snap_compare: Compare, task: Task, open_app: Callable[[Task], LabelingApp]) -> None:
    assert snap_compare(open_app(replace(task, suspects=None)), terminal_size=(60, 20))
