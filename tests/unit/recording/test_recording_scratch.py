"""Outputs made aside: by several at once, by some who were killed."""

import subprocess
import sys
import threading
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path

import pytest
from edit_samples import recorded, told

from sdt_tools.errors import OutputExistsError, RecordingError
from sdt_tools.recording.copying import new_file
from sdt_tools.recording.editing.edit import edit_recordings, edit_under_way
from sdt_tools.recording.editing.plan import plan_split, plan_trim
from sdt_tools.recording.repair import repair_recording
from sdt_tools.recording.scratch import give_name, scratch_folder


def test_two_edits_to_one_output_do_not_touch_each_other(tmp_path: Path) -> None:
    path, out = recorded(tmp_path), tmp_path / "new.mcap"
    first, second = plan_trim(path, "0", "1", out), plan_trim(path, "1", "2", out)
    late = ExitStack()
    late.enter_context(edit_under_way(first))
    edit_recordings(second)
    during = told(out)
    with pytest.raises(OutputExistsError, match="exists already"):
        late.close()
    assert told(out) == during
    assert sorted(p.name for p in tmp_path.iterdir()) == ["drive.mcap", "new.mcap"]


def test_two_repairs_to_one_output_do_not_touch_each_other(tmp_path: Path) -> None:
    path, out = recorded(tmp_path), tmp_path / "new.mcap"
    late = ExitStack()
    late.enter_context(new_file(out))
    repair_recording(path, out)
    with pytest.raises(OutputExistsError):
        late.close()
    assert told(out) == told(path)


def test_of_many_at_once_one_wins(tmp_path: Path) -> None:
    path, out = recorded(tmp_path), tmp_path / "new.mcap"
    plans = [plan_trim(path, "0", str(number), out) for number in (1, 2, 1, 2)]
    refused: list[OutputExistsError] = []
    start = threading.Barrier(len(plans))

    def edit(number: int) -> None:
        start.wait()
        try:
            edit_recordings(plans[number])
        except OutputExistsError as error:
            refused.append(error)

    threads = [threading.Thread(target=edit, args=(number,)) for number in range(len(plans))]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(refused) == len(plans) - 1
    assert told(out)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["drive.mcap", "new.mcap"]


def test_of_a_split_that_comes_too_late_nothing_is_left(tmp_path: Path) -> None:
    plan = plan_split(recorded(tmp_path), ["1"], tmp_path)
    with pytest.raises(OutputExistsError), edit_under_way(plan) as finished:
        finished[1].edited.out.write_text("mine")
    assert sorted(p.name for p in tmp_path.iterdir()) == ["drive.mcap", "drive_02.mcap"]


@pytest.mark.parametrize("inner", ["file", "folder"])
def test_a_name_is_given_once(tmp_path: Path, inner: str) -> None:
    for number in range(2):
        made = tmp_path / f"{number}"
        if inner == "folder":
            made.mkdir()
        (made / "content" if inner == "folder" else made).write_text(str(number))
    give_name(tmp_path / "0", tmp_path / "out")
    with pytest.raises(OutputExistsError):
        give_name(tmp_path / "1", tmp_path / "out")
    out = tmp_path / "out"
    assert (out / "content" if inner == "folder" else out).read_text() == "0"


HOLD = """
import sys, pathlib
from sdt_tools.recording.scratch import scratch_folder
with scratch_folder(pathlib.Path(sys.argv[1])) as folder:
    (folder / "half").write_text("made")
    print(folder, flush=True)
    sys.stdin.read()
"""


@pytest.fixture
def holder(tmp_path: Path) -> Callable[[], tuple["subprocess.Popen[str]", Path]]:
    def start() -> tuple["subprocess.Popen[str]", Path]:
        command = [sys.executable, "-c", HOLD, str(tmp_path / "out")]
        process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        assert process.stdout is not None
        return process, Path(process.stdout.readline().strip())

    return start


def test_what_a_killed_process_left_goes_and_what_another_makes_stays(tmp_path: Path, holder) -> None:
    (killed, left), (alive, kept) = holder(), holder()
    try:
        killed.kill()
        killed.communicate()
        assert (left / "half").exists()
        with scratch_folder(tmp_path / "out"):
            assert not left.exists()
            assert (kept / "half").exists()
    finally:
        alive.communicate()
    assert not kept.exists()


def test_a_place_where_nothing_can_be_made_is_named(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("no folder")
    with (
        pytest.raises(RecordingError, match=r"new\.mcap: cannot be made: .*choose another --out"),
        scratch_folder(tmp_path / "file" / "new.mcap"),
    ):
        pass


def test_nobody_sweeps_away_a_folder_that_is_being_made(tmp_path: Path) -> None:
    out = tmp_path / "new.mcap"
    troubles: list[Exception] = []

    def work() -> None:
        for _ in range(60):
            try:
                with scratch_folder(out) as folder:
                    (folder / "part").write_text("mine")
            except (OSError, RecordingError) as error:
                troubles.append(error)

    threads = [threading.Thread(target=work) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert troubles == []
    assert list(tmp_path.iterdir()) == []
