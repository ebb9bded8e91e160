"""Takes under single keys, and what is printed of a session."""

import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Final

from sdt_tools.cli.console import console
from sdt_tools.cli.live import Live

if TYPE_CHECKING:
    from sdt_tools.protocols import Observer
    from sdt_tools.recording.live.control import Control
    from sdt_tools.recording.live.scene_takes import SceneTakesConfig, SessionSummary

_WISHES: Final = {
    " ": "toggle",
    "n": "next",
    "k": "stop",
    "x": "discard",
    "m": "mark",
    "s": "save",
    "q": "quit",
}
_KEYS: Final = "space pause, n next take, k keep and stop, x discard, m mark, s save the last seconds, q quit"


def record_takes(config: "SceneTakesConfig", folder: Path, resume: bool, how: Live) -> "SessionSummary":
    """Record a session into ``folder``, with keys where somebody is there to press them.

    Raises what ``record_scene_takes`` raises; a changed config is shown line by line first.
    """
    from sdt_tools.cli.drivers import make_driver
    from sdt_tools.cli.recording_progress import recording_progress
    from sdt_tools.cli.seat import viewer_observers
    from sdt_tools.recording.live.scene_takes import record_scene_takes
    from sdt_tools.recording.live.session_folder import ChangedConfigError

    observers = viewer_observers(how.viewer, config.scene.motions, config.realtime)
    try:
        if how.seated:
            return _drive_takes(config, folder, resume, how, observers)
        with _control() as control, recording_progress(f"session {folder.name}") as progress:
            return record_scene_takes(config, folder, make_driver, resume, control, observers, progress)
    except ChangedConfigError as error:
        for line in error.differences:
            console.print(line, soft_wrap=True)
        raise


def _drive_takes(
    config: "SceneTakesConfig", folder: Path, resume: bool, how: Live, observers: "Callable[[], Sequence[Observer]]"
) -> "SessionSummary":
    from sdt_tools.cli.seat import seat
    from sdt_tools.recording.live.scene_takes import record_scene_takes
    from sdt_tools.teleop.app.app import drive

    keeps_last = config.keep_last_s is not None
    with seat(config.driver, folder.name, how, takes=True, keeps_last=keeps_last) as (cockpit, make_seated):
        return drive(
            cockpit,
            lambda interrupt: record_scene_takes(
                config,
                folder,
                make_seated,
                resume,
                cockpit.control,
                lambda: [cockpit.watch, *observers()],
                cockpit.watch.tell,
                interrupt,
            ),
        )


@contextmanager
def _control() -> Iterator["Control | None"]:
    from sdt_tools.cli.keys import at_a_terminal, pressed_keys
    from sdt_tools.recording.live.control import Control, Wish

    if not at_a_terminal():
        yield None
        return
    control = Control()

    def heard(key: str) -> None:
        wish = _WISHES.get(key.lower())
        if wish is not None:
            control.want(Wish(wish))

    console.print(_KEYS)
    with pressed_keys(heard, sys.stdin.fileno()):
        yield control


def session_document(summary: "SessionSummary") -> dict[str, object]:
    """The session for machines."""
    return {
        "session": str(summary.folder),
        "id": summary.record.id,
        "ending": summary.ending,
        "takes": [take.model_dump() for take in summary.record.takes],
        "cut_off": [str(path) for path in summary.cut_off],
    }


def print_session(summary: "SessionSummary") -> None:
    """The session for people."""
    from rich.table import Column, Table

    table = Table(Column("take", no_wrap=True), "seconds", "messages", "dropped", "missing", "ended by", "")
    for take in summary.record.takes:
        remark = "discarded" if take.trash else take.trigger
        numbers = (f"{take.seconds:.1f}", str(take.messages), str(take.dropped), str(take.missing))
        table.add_row(take.name, *numbers, take.ending or "cut off", remark)
    console.print(table)
    for path in summary.cut_off:
        console.print(f"{path} was cut off; `sdt repair` makes a whole file of it", soft_wrap=True)
