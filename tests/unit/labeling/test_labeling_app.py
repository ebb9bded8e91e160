"""The app under a pilot: keys in, journal and screen out."""

import asyncio
from collections.abc import Awaitable, Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from labeling_samples import record, say, stamp_ns
from textual.pilot import Pilot
from textual.widgets import Static

from sdt_tools.errors import LabelError, RecordingError, RunError
from sdt_tools.frames import Received
from sdt_tools.labeling.app.app import LabelingApp
from sdt_tools.labeling.app.desk import Desk, Task
from sdt_tools.labeling.app.dialogs import HelpDialog, ReviewDialog, place_of
from sdt_tools.labeling.app.keys import ACTIONS, class_keys
from sdt_tools.labeling.app.screen import LabelingScreen
from sdt_tools.labeling.frame_labels import UNSAID
from sdt_tools.labeling.journal import read_journal
from sdt_tools.labeling.vocabulary import LabelKind, LabelSource, check_labeler
from sdt_tools.terminal.app import TooSmall
from sdt_tools.terminal.picture_view import PictureView
from sdt_tools.terminal.scan_view import ScanView

Use = Callable[[LabelingApp, Pilot], Awaitable[None]]


@pytest.fixture
def task(tmp_path: Path) -> Task:
    return Task(record(tmp_path / "drive.mcap"), LabelKind.MOTION, tmp_path / "labels", "anna")


def use(task: Task, by: Use, size: tuple[int, int] = (100, 30), beside: object = None) -> None:
    async def run() -> None:
        with Desk(task) as desk:
            app = LabelingApp(desk, beside)  # type: ignore[arg-type]
            async with app.run_test(size=size) as pilot:
                await pilot.pause()
                await by(app, pilot)

    asyncio.run(run())


def journal(task: Task) -> pl.DataFrame:
    return read_journal(task.labels_dir / f"drive.{task.kind}.csv").table


def text_of(app: LabelingApp, selector: str) -> str:
    return str(app.screen.query_one(selector, Static).render())


def test_keys_write_a_journal(task: Task) -> None:
    async def label(app: LabelingApp, pilot: Pilot) -> None:
        await pilot.press("2", "right", "q", "pagedown", "v", "left", "left", "0", "3", "u")
        assert app.state.cursor == 9
        assert "forward" in text_of(app, "#classes")

    use(task, label)
    said = [(row["stamp_ns"], row["label"]) for row in journal(task).iter_rows(named=True)]
    assert said == [
        (stamp_ns(0), "forward"),
        (stamp_ns(1), "left_forward"),
        (stamp_ns(9), "left_forward"),
        (stamp_ns(9), ""),
    ]
    assert set(journal(task)["labeler"]) == {"anna"}
    assert set(journal(task)["source"]) == {"human"}


def test_every_act_is_on_disk_before_the_screen_shows_it(task: Task, monkeypatch: pytest.MonkeyPatch) -> None:
    shown: list[int] = []
    before = LabelingScreen._show

    def show(screen: LabelingScreen) -> None:
        said = int(np.count_nonzero(screen.state.mine != UNSAID))
        path = task.labels_dir / "drive.motion.csv"
        assert len(read_journal(path).table["stamp_ns"].unique()) == said
        shown.append(said)
        before(screen)

    monkeypatch.setattr(LabelingScreen, "_show", show)

    async def label(app: LabelingApp, pilot: Pilot) -> None:
        await pilot.press("f", "2", *["right"] * 10, "v", *["right"] * 4, "1")

    use(task, label)
    assert max(shown) == 15


def test_one_goes_on_where_one_left_and_undoes_what_was_done_before(task: Task) -> None:
    async def first(app: LabelingApp, pilot: Pilot) -> None:
        await pilot.press("pagedown", "v", "pagedown", "2", "home")

    async def second(app: LabelingApp, pilot: Pilot) -> None:
        assert app.state.cursor == 20
        assert "you go on where you left, at frame 21" in text_of(app, "#message")
        await pilot.press("u")
        assert not (app.state.mine != UNSAID).any()

    async def third(app: LabelingApp, pilot: Pilot) -> None:
        await pilot.press("r")
        assert int((app.state.mine != UNSAID).sum()) == 11

    for by in (first, second, third):
        use(task, by)


def test_where_nothing_can_be_written_nothing_moves(task: Task, monkeypatch: pytest.MonkeyPatch) -> None:
    async def label(app: LabelingApp, pilot: Pilot) -> None:
        (task.labels_dir / "drive.motion.csv").unlink()
        await pilot.press("2", "f")
        assert not (app.state.mine != UNSAID).any()
        await pilot.press("2")
        assert "the journal was moved or rewritten" in text_of(app, "#message")

    use(task, label)


def test_two_people_see_each_other_and_settle(task: Task) -> None:
    async def both(app: LabelingApp, pilot: Pilot) -> None:
        await pilot.press("v", "right", "right", "2")
        say(task.labels_dir, task.recording, "ben", range(1, 5), "stay")
        await pilot.pause(0.7)
        assert app.state.labels.disputed.tolist()[:6] == [False, True, True, False, False, False]
        await pilot.press("home", "j", "l")
        assert isinstance(app.screen, ReviewDialog)
        assert app.screen.items[0].words == "anna: forward · ben: stay"
        await pilot.press("enter", "=", "3")
        assert not app.state.labels.disputed.any()

    use(task, both)
    last = journal(task).tail(2)
    assert last["labeler"].to_list() == ["settled:anna"] * 2
    assert last["label"].to_list() == ["left_forward"] * 2


def test_the_same_person_at_two_desks_can_undo_at_either(task: Task) -> None:
    async def here(app: LabelingApp, pilot: Pilot) -> None:
        await pilot.press("2")
        with Desk(task) as desk:
            there = LabelingApp(desk)
            async with there.run_test(size=(80, 24)) as elsewhere:
                await elsewhere.press("5", "right", "5")
        await pilot.pause(0.7)
        await pilot.press("u", "u")
        assert app.state.mine[0] == LabelKind.MOTION.classes.index("forward")

    use(task, here)


def test_playing_carries_forward_and_stops_at_the_end(task: Task) -> None:
    async def play(app: LabelingApp, pilot: Pilot) -> None:
        await pilot.press("f", "2", "+", "+")
        for _ in range(100):
            await pilot.pause(0.05)
            if not app.state.speed:
                break
        assert app.state.cursor == 99
        assert (app.state.mine == 1).all()

    use(task, play)


def test_a_file_of_predictions_and_one_of_suspects_help(task: Task, tmp_path: Path) -> None:
    with Desk(task) as desk:
        recording_id = desk.recording_id
    rows = {"recording_id": [recording_id] * 2, "stamp_ns": [stamp_ns(0), stamp_ns(7)]}
    pl.DataFrame(rows | {"model": ["net"] * 2, "predicted": ["stay", "backward"]}).write_parquet(tmp_path / "p.parquet")
    doubts = {"recording": ["drive"] * 2, "label": ["stay"] * 2, "suggested": ["forward"] * 2, "score": [0.2, 0.9]}
    pl.DataFrame(rows | doubts).write_csv(tmp_path / "s.csv")

    async def help_(app: LabelingApp, pilot: Pilot) -> None:
        await pilot.press("k", "a", "l")
        assert isinstance(app.screen, ReviewDialog)
        assert [item.score for item in app.screen.items] == [0.2]  # the other is labelled otherwise now
        await pilot.press("escape")
        assert app.state.mine[7] == LabelKind.MOTION.classes.index("backward")

    use(replace(task, predictions=tmp_path / "p.parquet", suspects=tmp_path / "s.csv"), help_)
    assert journal(task)["source"].to_list() == ["human"]


def test_help_names_every_key_and_any_key_closes_it(task: Task) -> None:
    async def ask(app: LabelingApp, pilot: Pilot) -> None:
        await pilot.press("?")
        assert isinstance(app.screen, HelpDialog)
        await pilot.press("escape")
        assert isinstance(app.screen, LabelingScreen)

    use(task, ask)


def test_no_key_does_two_things_and_every_action_exists() -> None:
    for kind in LabelKind:
        given = [key for keys in class_keys(kind) for key in keys]
        assert len(set(given) | set(ACTIONS)) == len(given) + len(ACTIONS)
    for action in ACTIONS.values():
        assert hasattr(LabelingScreen, f"action_{action.partition('(')[0]}")


def test_a_time_is_asked_for(task: Task) -> None:
    async def jump(app: LabelingApp, pilot: Pilot) -> None:
        await pilot.press("g", *"1.5", "enter")
        assert app.state.cursor == 75
        await pilot.press("g", *"soon", "enter")
        assert app.state.cursor == 75
        await pilot.press("escape", "g", *"-1", "enter")
        assert app.state.cursor == 25
        assert place_of("#4", app.state) == 3
        assert place_of("50%", app.state) == 50
        assert place_of("0:00.5", app.state) == 25
        assert place_of("99999", app.state) == 99
        assert [place_of(text, app.state) for text in ("", "x", "nan", "1:x", "#", "%")] == [None] * 6

    use(task, jump)


def test_a_terminal_that_is_too_small_says_so_and_works_again_when_it_is_not(task: Task) -> None:
    async def resize(app: LabelingApp, pilot: Pilot) -> None:
        assert isinstance(app.screen, TooSmall)
        assert "60 × 20 is too small" in str(app.screen.query_one(Static).render())
        await pilot.press("2")
        assert not (app.state.mine != UNSAID).any()
        await pilot.resize_terminal(80, 24)
        await pilot.pause()
        await pilot.press("2")
        assert (app.state.mine != UNSAID).any()
        await pilot.resize_terminal(160, 50)
        await pilot.pause()
        assert app.screen.has_class("wide")

    use(task, resize, size=(60, 20))


@pytest.mark.parametrize(
    ("kind", "missing", "words"),
    [(LabelKind.MOTION, "camera", "no camera"), (LabelKind.GESTURE, "scans", "no scans in this recording")],
)
def test_a_recording_without_the_other_sensor_is_labelled_all_the_same(
    tmp_path: Path, kind: LabelKind, missing: str, words: str
) -> None:
    drive = record(tmp_path / "drive.mcap", 10, **{missing: False})
    task = Task(drive, kind, tmp_path / "labels", "anna")

    async def label(app: LabelingApp, pilot: Pilot) -> None:
        await pilot.press("1", "right", "2")
        view = app.screen.query_one(ScanView if missing == "scans" else PictureView)
        drawn = "\n".join(view.render_line(y).text for y in range(view.size.height))
        assert words in drawn

    use(task, label)
    assert len(journal(task)) == 2


@pytest.mark.parametrize(
    ("kind", "missing", "words"),
    [(LabelKind.MOTION, "scans", "no scans in it"), (LabelKind.GESTURE, "camera", "no pictures in it")],
)
def test_a_recording_without_what_is_labelled_is_refused(
    tmp_path: Path, kind: LabelKind, missing: str, words: str
) -> None:
    drive = record(tmp_path / "drive.mcap", 4, **{missing: False})
    with pytest.raises(LabelError, match=words):
        Desk(Task(drive, kind, tmp_path / "labels", "anna"))
    assert not (tmp_path / "labels").exists()


def test_foreign_labels_are_refused_or_told(task: Task) -> None:
    path = task.labels_dir / "drive.motion.csv"
    path.parent.mkdir()
    header = "act_id,recording_id,stamp_ns,label,labeler,source,created_ns\n"
    path.write_text(f"{header}1,other,5,stay,ben,human,0\n")
    with pytest.raises(LabelError, match=":2: the label belongs to recording 'other'"):
        Desk(task)
    with pytest.raises(RecordingError, match="no such recording"):
        Desk(replace(task, recording=Path("missing.mcap")))
    path.unlink()
    with Desk(task) as desk:
        path.write_text(f"{header}1,{desk.recording_id},5,fly,ben,human,0\n")
    with pytest.raises(LabelError, match=":2: unknown label 'fly'"):
        Desk(task)
    path.write_text(f"{header}1,{desk.recording_id},5,stay,anna,human,0\n")

    async def see(app: LabelingApp, pilot: Pilot) -> None:
        assert "1 acts in the journal are about no frame" in text_of(app, "#message")
        await pilot.press("u")
        assert app.state.words == "nothing to undo"

    use(task, see)


def test_a_broken_last_line_is_kept_told_and_closed_by_the_next_act(task: Task) -> None:
    with Desk(task):
        pass
    path = task.labels_dir / "drive.motion.csv"
    with path.open("a") as stream:
        stream.write("1,what")

    async def label(app: LabelingApp, pilot: Pilot) -> None:
        assert "drive.motion.csv:2 is broken off; it is kept" in text_of(app, "#message")
        await pilot.press("2")

    use(task, label)
    lines = path.read_text().splitlines()
    assert lines[1] == "1,what#broken"
    assert lines[2].startswith("1,")
    assert journal(task)["label"].to_list() == ["forward"]


def test_a_damaged_scan_is_told_and_passed(task: Task) -> None:
    async def see(app: LabelingApp, pilot: Pilot) -> None:
        await pilot.press("right")
        view = app.screen.query_one(ScanView)
        assert "this scan is damaged" in "\n".join(view.render_line(y).text for y in range(view.size.height))

    async def run() -> None:
        with Desk(task) as desk:

            def damaged(stamp: int) -> None:
                raise RecordingError("damaged")

            desk.scan_at = damaged  # type: ignore[assignment]
            app = LabelingApp(desk)
            async with app.run_test(size=(80, 24)) as pilot:
                await see(app, pilot)

    asyncio.run(run())


class Companion:
    """Stands for a viewer; gone after the second frame."""

    def __init__(self) -> None:
        self.shown: list[int] = []
        self.messages: list[int] = []

    def show(self, messages: tuple[Received, ...], stamp: int) -> None:
        if len(self.shown) == 2:
            raise RunError("the viewer is gone; labeling goes on without it")
        self.shown.append(stamp)
        self.messages.append(len(messages))

    def close(self) -> None:
        pass


def test_what_is_beside_shows_the_same_stamp_and_may_go_away(task: Task) -> None:
    companion = Companion()

    async def go(app: LabelingApp, pilot: Pilot) -> None:
        await pilot.press("pagedown", "2", "right")
        assert "the viewer is gone" in text_of(app, "#message")
        await pilot.press("right")
        assert app.state.cursor == 12

    use(task, go, beside=companion)
    assert companion.shown == [stamp_ns(0), stamp_ns(10)]
    assert companion.messages == [2, 2]


@pytest.mark.parametrize("name", ["", " ", "a,b", "a\nb", '"a"', "settled:anna", "a#b"])
def test_a_name_that_a_journal_cannot_hold_is_refused(name: str) -> None:
    with pytest.raises(LabelError, match="cannot be a labeler's name"):
        check_labeler(name)


def test_prelabels_from_the_recording_are_never_counted_as_a_persons(task: Task) -> None:
    say(task.labels_dir, task.recording, "scene", range(100), "stay", LabelSource.TRUTH)

    async def see(app: LabelingApp, pilot: Pilot) -> None:
        assert "you            0   0.0%" in text_of(app, "#classes")
        assert "truth    stay (pre)" in text_of(app, "#said")

    use(task, see)
