"""``sdt label edit`` in a real terminal: typing, resizing, hanging up, kills, two people at once."""

import json
import random
import shlex
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest
from labeling_rig import frame_shown, record, rows_labelled
from terminal_rig import DEAF_TO_HANGUP, LONGEST_S, QUIT, RIGHT, Terminal, terminal_environment

Start = Callable[..., Terminal]
SDT = [sys.executable, "-c", "from sdt_tools.cli.app import main; main()"]


@pytest.fixture
def labeling(at_terminal: Start) -> Start:
    """``sdt label edit`` at a terminal."""
    return lambda *arguments, **size: at_terminal("label", "edit", *arguments, **size)


def label(folder: Path, drive: Path, labeler: str) -> list[object]:
    return [drive, "--labels", folder / "labels", "--labeler", labeler]


def type_at(terminal: Terminal, keys: list[str], acts_a_second: float) -> None:
    """Type at a steady pace, whether or not the app keeps up."""
    begin_s = time.monotonic()
    for number, key in enumerate(keys):
        time.sleep(max(begin_s + number / acts_a_second - time.monotonic(), 0.0))
        terminal.press(key)
        terminal.look()


@pytest.mark.parametrize("frames", [40, pytest.param(1000, marks=pytest.mark.slow)])
def test_twenty_acts_a_second_are_all_taken(tmp_path: Path, labeling: Start, frames: int) -> None:
    drive = record(tmp_path / "drive.mcap", frames)
    terminal = labeling(*label(tmp_path, drive, "anna"), columns=120, lines=40)
    terminal.wait_for("? keys")
    classes = ["2" if row // 10 % 2 else "7" for row in range(frames)]
    keys = ["f", classes[0]]
    for row in range(1, frames):
        keys.append(RIGHT)
        if classes[row] != classes[row - 1]:
            keys.append(classes[row])
    type_at(terminal, keys, 20.0)
    terminal.press(QUIT)
    assert terminal.end() == 0
    assert terminal.restored
    assert f"drive: {frames:,} of {frames:,} frames have your label, +{frames:,} in this sitting" in terminal.look()
    journal = tmp_path / "labels" / "drive.motion.csv"
    assert sorted(set(rows_labelled(journal, "anna"))) == list(range(frames))
    stats = [*SDT, "label", "stats", str(drive), "--labels", str(tmp_path / "labels"), "--json"]
    counts = json.loads(subprocess.run(stats, capture_output=True, check=True).stdout)["recordings"][0]["human_counts"]
    assert (counts["forward"], counts["right_backward"]) == (classes.count("2"), classes.count("7"))


def test_resizing_in_the_middle(tmp_path: Path, labeling: Start) -> None:
    drive = record(tmp_path / "drive.mcap", 30)
    journal = tmp_path / "labels" / "drive.motion.csv"
    terminal = labeling(*label(tmp_path, drive, "anna"))
    terminal.wait_for("? keys")
    terminal.press("2")
    terminal.until(lambda: rows_labelled(journal, "anna") == [0], "not labelled")
    terminal.resize(50, 10)
    terminal.wait_for("50 × 10 is too small")
    terminal.resize(160, 50)
    terminal.shown = b""
    terminal.wait_for("left_backward")
    terminal.press(RIGHT + RIGHT + "3")
    terminal.until(lambda: rows_labelled(journal, "anna") == [0, 2], "not labelled")
    terminal.press(QUIT)
    assert terminal.end() == 0


def test_keys_that_come_at_once_are_taken_one_after_the_other(tmp_path: Path, labeling: Start) -> None:
    drive = record(tmp_path / "drive.mcap", 60)
    terminal = labeling(*label(tmp_path, drive, "anna"))
    terminal.wait_for("? keys")
    terminal.press("g0.8\r2g1.23\x7f\x7f\r" + RIGHT + "5g#60\r")  # as from a connection that was slow
    terminal.until(lambda: frame_shown(terminal, 60) == 60, "the last frame is not shown")
    terminal.press(QUIT)
    assert terminal.end() == 0
    assert rows_labelled(tmp_path / "labels" / "drive.motion.csv", "anna") == [40, 51]


@pytest.mark.parametrize("how", ["hang-up", "hang-up without a signal", "SIGTERM"])
def test_the_end_of_a_terminal_is_the_end_of_the_app_and_nothing_is_lost(
    tmp_path: Path, labeling: Start, how: str
) -> None:
    drive = record(tmp_path / "drive.mcap", 30)
    before = DEAF_TO_HANGUP if how == "hang-up without a signal" else ""
    terminal = labeling(*label(tmp_path, drive, "anna"), before=before)
    terminal.wait_for("? keys")
    terminal.press("f2" + 9 * RIGHT)
    terminal.until(lambda: frame_shown(terminal, 30) == 10, "the tenth frame is not shown")
    if how != "SIGTERM":
        terminal.hang_up()
    else:
        terminal.process.send_signal(signal.SIGTERM)
        assert terminal.end() == 128 + signal.SIGTERM
        assert terminal.restored
    terminal.process.wait(LONGEST_S)
    assert rows_labelled(tmp_path / "labels" / "drive.motion.csv", "anna") == list(range(10))


@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(1, 6))])
def test_what_was_shown_before_a_kill_is_on_disk(tmp_path: Path, labeling: Start, seed: int) -> None:
    drive, chance = record(tmp_path / "drive.mcap", 400), random.Random(seed)
    terminal = labeling(*label(tmp_path, drive, "anna"))
    terminal.wait_for("? keys")
    terminal.press("f2")
    kill_s = time.monotonic() + chance.uniform(0.3, 2.0)
    while time.monotonic() < kill_s:
        terminal.press(RIGHT * chance.randint(1, 3))
        terminal.look()
        time.sleep(0.01)
    terminal.process.kill()
    terminal.process.wait()
    shown = frame_shown(terminal, 400)
    journal = tmp_path / "labels" / "drive.motion.csv"
    kept = rows_labelled(journal, "anna")
    assert shown > 1
    assert kept == list(range(len(kept)))
    assert len(kept) >= shown
    again = labeling(*label(tmp_path, drive, "anna"))
    again.wait_for(f"at frame {len(kept)}")
    again.press("u")
    again.until(lambda: rows_labelled(journal, "anna")[len(kept) :] != [], "nothing is undone")
    again.press(QUIT)
    assert again.end() == 0


def test_two_people_at_once_lose_nothing_and_their_agreement_is_computed(tmp_path: Path, labeling: Start) -> None:
    drive = record(tmp_path / "drive.mcap", 40)
    people = {name: labeling(*label(tmp_path, drive, name)) for name in ("anna", "ben")}
    for terminal in people.values():
        terminal.wait_for("? keys")
    for terminal in people.values():
        terminal.press("f2")
    for row in range(1, 40):
        for name, terminal in people.items():
            terminal.press(RIGHT + ("5" if name == "anna" and row == 30 else ""))
            terminal.look()
            time.sleep(0.01)
    journal = tmp_path / "labels" / "drive.motion.csv"
    for name, terminal in people.items():
        terminal.until(lambda name=name: set(rows_labelled(journal, name)) == set(range(40)), f"{name} has lost acts")
    for terminal in people.values():
        terminal.wait_for("! conflicts 10")  # each sees the other
        terminal.press(QUIT)
    assert [terminal.end() for terminal in people.values()] == [0, 0]
    stats = [*SDT, "label", "stats", str(drive), "--labels", str(tmp_path / "labels"), "--json"]
    found = json.loads(subprocess.run(stats, capture_output=True, check=True).stdout)["recordings"][0]
    assert (found["conflicts"], found["words"]) == (10, {"anna (human)": 40, "ben (human)": 40})
    (pair,) = found["agreement"]["pairs"]
    assert (pair["frames"], pair["agreed"]) == (40, 30)
    assert found["agreement"]["alpha"] is not None


def test_without_a_terminal_it_says_what_to_do(tmp_path: Path) -> None:
    drive = record(tmp_path / "drive.mcap", 3)
    call = [*SDT, "label", "edit", str(drive), "--labels", str(tmp_path)]
    ended = subprocess.run(call, stdin=subprocess.DEVNULL, capture_output=True, text=True)
    assert ended.returncode == 2
    assert ended.stderr.count("\n") == 1
    assert "needs a terminal" in ended.stderr


@pytest.mark.skipif(shutil.which("tmux") is None, reason="tmux is not installed")
def test_in_tmux_the_screen_is_what_it_should_be(tmp_path: Path) -> None:
    drive = record(tmp_path / "drive.mcap", 30)
    socket = str(tmp_path / "tmux")
    tmux = ["tmux", "-S", socket, "-f", "/dev/null"]
    command = shlex.join([*SDT, "label", "edit", str(drive), "--labels", str(tmp_path), "--labeler", "anna"])

    def call(*words: str) -> str:
        done = subprocess.run([*tmux, *words], env=terminal_environment(), capture_output=True, text=True, check=True)
        return done.stdout

    def screen_with(words: str) -> list[str]:
        end_s = time.monotonic() + LONGEST_S
        while True:
            lines = call("capture-pane", "-p", "-t", "label").splitlines()
            if any(words in text for text in lines):
                return lines
            assert time.monotonic() < end_s, "\n".join(lines)
            time.sleep(0.05)

    call("new-session", "-d", "-s", "label", "-x", "80", "-y", "24", command)
    try:
        screen_with("? keys")
        call("send-keys", "-t", "label", "f", "2", "Right", "Right", "Right", "4")
        lines = screen_with("4/30")
        lines = screen_with("2224")
        assert len(lines) == 24
        assert "drive motion  anna" in lines[0]
        assert lines[2].split()[-1] == "3"
        assert any(text.startswith("you") and "2224" in text for text in lines)
        call("resize-window", "-t", "label", "-x", "40", "-y", "10")
        screen_with("40 × 10 is too small")
        call("resize-window", "-t", "label", "-x", "120", "-y", "40")
        screen_with("right_forward")
        call("send-keys", "-t", "label", "C-q")
    finally:
        subprocess.run([*tmux, "kill-server"], capture_output=True, check=False)
    assert rows_labelled(tmp_path / "drive.motion.csv", "anna") == [0, 1, 2, 3, 3]
