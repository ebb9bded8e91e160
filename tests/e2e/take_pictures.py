"""README's pictures of both terminal apps, taken of the real apps at work: ``make pictures`` (chromium draws them).

It is no test. Look at each picture before it is committed.
"""

import shutil
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

import numpy as np
import polars as pl
from PIL import Image
from terminal_rig import QUIT, RIGHT, Terminal, start_sdt

from sdt_tools.labeling.app.keys import class_keys
from sdt_tools.labeling.vocabulary import LabelKind
from sdt_tools.recording.messages.topics import LIDAR_SCAN
from sdt_tools.recording.reader import Recording

PICTURES = Path(__file__).parents[2] / "analysis" / "pictures"
SHUTTER = "\x1b[24~"  # F12
CAMERA = """
from textual.binding import Binding
from sdt_tools.terminal.app import TerminalApp
TerminalApp.BINDINGS.append(Binding("f12", "picture", priority=True))
TerminalApp.action_picture = lambda app: app.save_screenshot("{name}.svg", "{folder}")
"""
KEYS = dict(zip(LabelKind.MOTION.classes, (letter for _, letter in class_keys(LabelKind.MOTION)), strict=True))


def sdt(*arguments: object) -> None:
    program = "from sdt_tools.cli.app import main; main()"
    subprocess.run([sys.executable, "-c", program, *map(str, arguments)], check=True, stderr=subprocess.DEVNULL)


def at_work(folder: Path, name: str, columns: int, lines: int, *arguments: object) -> Terminal:
    before = CAMERA.format(folder=folder, name=name)
    return start_sdt(*arguments, before=before, columns=columns, lines=lines)


def take(terminal: Terminal, folder: Path, name: str) -> None:
    """Have the app draw its screen, end it, and make a PNG of the drawing."""
    drawn = folder / f"{name}.svg"
    terminal.press(SHUTTER)
    terminal.until(drawn.exists, f"{name} is not taken")
    terminal.press(QUIT)
    terminal.end()
    terminal.close()
    width, height = (float(part) for part in drawn.read_text().split('viewBox="0 0 ')[1].split('"')[0].split())
    page = folder / f"{name}.html"
    page.write_text(f'<body style="margin:0"><img src="{drawn.name}" width="{width}" height="{height}"></body>')
    shot = folder / f"{name}.png"
    size = f"--window-size={round(width)},{round(height)}"
    browser = [_browser(), "--headless", "--no-sandbox", "--hide-scrollbars", size, f"--screenshot={shot}", str(page)]
    subprocess.run(browser, check=True, capture_output=True)
    with Image.open(shot) as image:
        image.convert("RGB").save(PICTURES / f"{name}.png", optimize=True)


def _browser() -> str:
    found = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if found is None:
        raise SystemExit("make pictures needs chromium, to draw what the apps save")
    return found


def drive(folder: Path, model: Path) -> None:
    out = folder / "drive.mcap"
    call = ("--driver", "keyboard", "--scenario", "plain", "--seed", 7, "--out", out)
    terminal = at_work(folder, "cockpit", 80, 24, "record", "scene", *call)
    terminal.wait_for("REC")
    terminal.rest(2.0)
    terminal.hold("w", 1.5)
    take(terminal, folder, "cockpit")
    policy = ("--cockpit", "--driver", f"policy:{model}", "--scenario", "through_gate", "--session", folder / "monday")
    terminal = at_work(folder, "cockpit_takeover", 120, 36, "record", "scene", *policy)
    terminal.wait_for("REC")
    terminal.rest(2.5)
    terminal.press("mgate\r")
    terminal.hold("w", 0.8)
    take(terminal, folder, "cockpit_takeover")


def said(terminal: Terminal, runs: Sequence[tuple[int, int, str]]) -> None:
    """Say of each run of frames what it is."""
    for first, last, label in runs:
        terminal.press(f"g#{first + 1}\rvg#{last + 1}\r{KEYS[label]}")
        terminal.rest(0.15)


def runs_of(recording: Path, journal: Path) -> list[tuple[int, int, str]]:
    """Runs of frames with one truth."""
    with Recording.open(recording) as opened:
        stamps_ns = opened.frames(LIDAR_SCAN).stamps_ns
    truth = pl.read_csv(journal).sort("stamp_ns")
    rows = np.searchsorted(stamps_ns, truth["stamp_ns"].to_numpy())
    labels = truth["label"].to_list()
    begins = [0, *(place for place in range(1, len(rows)) if labels[place] != labels[place - 1]), len(rows)]
    ends = [*rows, len(stamps_ns)]
    return [(int(ends[a]), int(ends[b]) - 1, labels[a]) for a, b in pairwise(begins)]


def label(folder: Path) -> None:
    first, labels = folder / "first.mcap", folder / "labels"
    sdt("record", "scene", "--seed", 7, "--seconds", 20, "--out", first)
    sdt("label", "auto", first, "--from", "truth", "--labels", labels)
    runs = runs_of(first, labels / "first.motion.csv")
    edit = ("label", "edit", first, "--labels", labels, "--labeler")
    terminal = at_work(folder, "labeling", 80, 24, *edit, "anna")
    terminal.wait_for("? keys")
    said(terminal, [run for run in runs if run[1] < 330])
    terminal.press("g#330\rf" + KEYS[next(run[2] for run in runs if run[1] >= 330)])
    for _ in range(24):
        terminal.press(RIGHT)
        terminal.rest(0.05)
    terminal.rest(0.5)
    take(terminal, folder, "labeling")
    terminal = start_sdt(*edit, "anna")
    terminal.wait_for("? keys")
    said(terminal, [run for run in runs if 330 <= run[0] < 620])
    terminal.press(QUIT)
    terminal.end()
    terminal.close()
    terminal = start_sdt(*edit, "ben")
    terminal.wait_for("? keys")
    later = [(a + 3 if a else 0, b + 3, name) for a, b, name in runs if b < 700]
    said(terminal, later)
    said(terminal, [(330, 349, "left_forward")])
    terminal.press(QUIT)
    terminal.end()
    terminal.close()
    terminal = at_work(folder, "labeling_review", 80, 24, *edit, "anna")
    terminal.wait_for("? keys")
    terminal.press("l")
    terminal.wait_for("in doubt")
    terminal.rest(0.5)
    take(terminal, folder, "labeling_review")
    terminal = at_work(folder, "labeling_conflict", 160, 50, *edit, "anna")
    terminal.wait_for("? keys")
    terminal.press("g#331\rv")
    terminal.press(9 * RIGHT + "=")
    terminal.wait_for("press the class that is right")
    terminal.rest(0.5)
    take(terminal, folder, "labeling_conflict")


if __name__ == "__main__":
    model = Path(sys.argv[1])
    if not (model / "model.toml").exists():
        raise SystemExit(f"{model}: no network to take over from; `make demo` trains one, or name another")
    with tempfile.TemporaryDirectory() as name:
        drive(Path(name), model)
        label(Path(name))
