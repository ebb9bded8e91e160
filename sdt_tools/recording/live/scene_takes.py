"""A session of takes in the scene."""

from collections.abc import Callable, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path

from pydantic import Field

from sdt_tools.clock import FAST_EPOCH_NS, HostClock
from sdt_tools.config import dump_config
from sdt_tools.errors import RunError
from sdt_tools.protocols import Observer
from sdt_tools.recording.live.control import Control
from sdt_tools.recording.live.decide import Deciders, DecisionLoop
from sdt_tools.recording.live.encoder import PictureEncoder
from sdt_tools.recording.live.interrupt import Interrupt, deferred_interrupt
from sdt_tools.recording.live.keep_last import KeepLast
from sdt_tools.recording.live.loop import LiveLoop
from sdt_tools.recording.live.outcome import ENDING_BY_SIGNAL, Ending, RecordingProgress
from sdt_tools.recording.live.pace import paced
from sdt_tools.recording.live.perturb import perturbation_of
from sdt_tools.recording.live.reading import reading_of
from sdt_tools.recording.live.scene_session import MakeDriver, SceneRecordingConfig, warm_up
from sdt_tools.recording.live.session_folder import SessionFolder, SessionRecord
from sdt_tools.recording.live.take import Tally
from sdt_tools.recording.live.takes import TakeRecorder
from sdt_tools.recording.session import derived_id, random_id
from sdt_tools.recording.writer import RecordingWriter
from sdt_tools.scene.scenario import layout_for
from sdt_tools.scene.source import SceneSource


class SceneTakesConfig(SceneRecordingConfig):
    """All that decides what a session of takes holds. ``seconds`` are those of a take.

    With ``keep_last_s`` the session starts without a take, and the last seconds are written out when something happens.
    """

    keep_last_s: float | None = Field(default=None, gt=0)


@dataclass(frozen=True)
class SessionSummary:
    """What a session's folder holds now, and why it ended; ``cut_off`` takes were never closed."""

    folder: Path
    ending: Ending
    record: SessionRecord
    cut_off: tuple[Path, ...]


def record_scene_takes(
    config: SceneTakesConfig,
    folder: Path,
    make_driver: MakeDriver,
    resume: bool = False,
    control: Control | None = None,
    observers: Callable[[], Sequence[Observer]] = tuple,
    progress: Callable[[RecordingProgress], None] | None = None,
    interrupt: Interrupt | None = None,
) -> SessionSummary:
    """Record takes of the scene into ``folder``; with ``control`` whoever holds it says when they begin and end.

    Takes that follow each other lie in one world, whose seed is the config's; when it has ended, the next take begins
    in a world with the next seed. A session that is resumed goes on with the next seed too. Signals are heard here,
    unless ``interrupt`` hears them already.

    Raises RecordingError where ``folder`` holds a session and is not to be resumed, or holds none and is;
    ChangedConfigError where it was begun with another config; else what ``record_scene`` raises.
    """
    session_id = random_id() if config.realtime else derived_id(dump_config(config))
    make_driver(
        config.driver, SceneSource(layout_for(config.scenario, config.seed), config.scene)
    )  # or nothing is begun
    with nullcontext(interrupt) if interrupt is not None else deferred_interrupt() as interrupt:
        session = SessionFolder.resume(folder, config) if resume else SessionFolder.create(folder, config, session_id)
        cut_off = session.cut_off
        keep_last = KeepLast(config.keep_last_s) if config.keep_last_s is not None else None
        recorder = TakeRecorder(session, config.scene.rates, config.seconds, config.realtime, control, keep_last)
        clock = HostClock()
        try:
            while True:
                ending = _play_world(config, session, recorder, make_driver, interrupt, clock, observers(), progress)
                if ending is not Ending.SOURCE or not recorder.wait_for_start(interrupt, clock.now_ns, progress):
                    break
        except RunError as error:
            raise RunError(f"{folder}: {error}") from error.__cause__
        finally:
            recorder.close()
        if interrupt.signal is not None:
            ending = ENDING_BY_SIGNAL[interrupt.signal]
    return SessionSummary(folder, ending, session.record, cut_off)


def _play_world(
    config: SceneTakesConfig,
    session: SessionFolder,
    recorder: TakeRecorder,
    make_driver: MakeDriver,
    interrupt: Interrupt,
    clock: HostClock,
    observers: Sequence[Observer],
    progress: Callable[[RecordingProgress], None] | None,
) -> Ending:
    seed = config.seed + session.start_world()
    layout = layout_for(config.scenario, seed)
    if config.realtime:
        warm_up(layout, config, make_driver)
    start_ns = clock.now_ns() if config.realtime else FAST_EPOCH_NS
    source = SceneSource(layout, config.scene, config.camera, start_ns)
    rates = config.scene.rates
    perturb = perturbation_of(config.perturb, seed, rates.follow_hz)
    deciders = Deciders(make_driver(config.driver, source), source.expert, perturb)
    decisions = DecisionLoop(deciders, config.scene.motions, rates, start_ns)
    pace = paced(start_ns, rates.scan_hz, clock if config.realtime else None)

    def open_writer(path: Path, notes: Mapping[str, str], at_ns: int, realtime: bool) -> RecordingWriter:
        return RecordingWriter(
            path,
            source.info,
            dump_config(config),
            recording_id=random_id() if config.realtime else None,
            notes={**layout.notes(), **notes},
            start_ns=at_ns,
            realtime=realtime,
        )

    def tally() -> Tally:
        return Tally(decisions.decisions, decisions.forced, pace.missed + decisions.missed)

    encoder = PictureEncoder(behind=config.realtime)
    reading = reading_of(source, pace.takes_long, config.realtime)
    loop = LiveLoop(source, source, decisions, pace, observers, recorder, progress, encoder, reading)
    recorder.begin(start_ns, open_writer, tally, loop.settle)
    try:
        return loop.run(interrupt)
    finally:
        loop.close()
