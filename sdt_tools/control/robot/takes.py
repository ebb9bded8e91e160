"""A session of takes with the robot."""

from collections.abc import Callable, Mapping, Sequence
from contextlib import nullcontext
from pathlib import Path

from pydantic import Field

from sdt_tools.control.robot.config import shown
from sdt_tools.control.robot.drive import RobotRunConfig, run_toml
from sdt_tools.control.robot.opened import OpenRobot
from sdt_tools.errors import RunError
from sdt_tools.protocols import Chooser, Driver, Observer
from sdt_tools.recording.live.control import Control
from sdt_tools.recording.live.decide import Deciders, DecisionLoop
from sdt_tools.recording.live.encoder import PictureEncoder
from sdt_tools.recording.live.interrupt import Interrupt, deferred_interrupt
from sdt_tools.recording.live.keep_last import KeepLast
from sdt_tools.recording.live.loop import LiveLoop
from sdt_tools.recording.live.outcome import RecordingProgress
from sdt_tools.recording.live.pace import paced
from sdt_tools.recording.live.session_folder import SessionFolder
from sdt_tools.recording.live.take import Tally
from sdt_tools.recording.live.takes import SessionSummary, TakeRecorder
from sdt_tools.recording.session import random_id
from sdt_tools.recording.writer import RecordingWriter


class RobotTakesConfig(RobotRunConfig):
    """All that decides what a session of takes holds. ``seconds`` are those of a take.

    With ``keep_last_s`` it starts without a take, and the last seconds are written out when something happens.
    """

    keep_last_s: float | None = Field(default=None, gt=0)


def open_session(config: RobotTakesConfig, folder: Path, resume: bool) -> SessionFolder:
    """The session's folder. Raises RecordingError, ChangedConfigError as ``SessionFolder`` does."""
    kept = config.model_copy(update={"robot": shown(config.robot)})
    return SessionFolder.resume(folder, kept) if resume else SessionFolder.create(folder, kept, random_id())


def record_robot_takes(
    config: RobotTakesConfig,
    robot: OpenRobot,
    session: SessionFolder,
    driver: Driver | Chooser | None,
    observers: Sequence[Observer] = (),
    progress: Callable[[RecordingProgress], None] | None = None,
    control: Control | None = None,
    interrupt: Interrupt | None = None,
) -> SessionSummary:
    """Record takes of ``robot`` into ``session``; with ``control`` whoever holds it says when they begin and end.

    Signals are heard here, unless ``interrupt`` hears them already. On every way out the robot stands and its devices
    are closed. Raises RunError where the robot fails, RecordingError where the disk refuses.
    """
    rates, source = config.robot.rates, robot.source
    cut_off = session.cut_off
    keep_last = KeepLast(config.keep_last_s) if config.keep_last_s is not None else None
    recorder = TakeRecorder(session, rates, config.seconds, True, control, keep_last)
    source.begin()
    session.start_world()
    decisions = DecisionLoop(Deciders(driver), config.robot.motions, rates, source.start_ns)
    pace = paced(source.start_ns, rates.scan_hz, robot.clock, arrival=source.lidar.wait)

    def open_writer(path: Path, notes: Mapping[str, str], at_ns: int, realtime: bool) -> RecordingWriter:
        text = run_toml(config)
        return RecordingWriter(
            path, source.info, text, recording_id=random_id(), notes=notes, start_ns=at_ns, realtime=realtime
        )

    def tally() -> Tally:
        return Tally(decisions.decisions, decisions.forced, pace.missed + decisions.missed)

    watching = (*robot.observers, *observers)
    loop = LiveLoop(source, robot.actuator, decisions, pace, watching, recorder, progress, PictureEncoder(behind=True))
    try:
        with nullcontext(interrupt) if interrupt is not None else deferred_interrupt() as heard:
            recorder.begin(source.start_ns, open_writer, tally, loop.settle)
            ending = loop.run(heard)
    except RunError as error:
        raise RunError(f"{session.folder}: {error}") from error.__cause__
    finally:
        loop.close()
        recorder.close()
    return SessionSummary(session.folder, ending, session.record, cut_off)
