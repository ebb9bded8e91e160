"""The whole controller in the scene: live, in real time or as fast as it can, recorded or not."""

from collections.abc import Callable, Sequence
from contextlib import ExitStack, nullcontext
from dataclasses import dataclass, replace
from pathlib import Path

from pydantic import Field

from sdt_tools.clock import FAST_EPOCH_NS, HostClock
from sdt_tools.config import Config, dump_config
from sdt_tools.control.controller import Controller, ControllerConfig, VisionDecision
from sdt_tools.control.driving import DriveSummary, Wheel, drive
from sdt_tools.control.eyes import BackgroundEyes, Eyes, GestureNetwork, PromptEyes
from sdt_tools.frames import LidarScan, RawPicture
from sdt_tools.protocols import Chooser, Driver, Observation, Observer
from sdt_tools.recording.live.control import Control
from sdt_tools.recording.live.encoder import encode_jpeg
from sdt_tools.recording.live.interrupt import Interrupt, deferred_interrupt
from sdt_tools.recording.live.outcome import RecordingProgress
from sdt_tools.recording.session import random_id
from sdt_tools.recording.writer import RecordingWriter
from sdt_tools.scene.config import SceneConfig
from sdt_tools.scene.layout import Layout
from sdt_tools.scene.scenario import layout_for
from sdt_tools.scene.source import SceneSource


class SceneDriveConfig(Config):
    """All that decides how a scene is driven; attached to a recording of it.

    ``vision`` and ``follow`` name the networks; without ``vision`` the robot is active throughout. ``camera`` says
    whether pictures are taken; with ``realtime`` the host's time runs the scene.
    """

    scenario: str
    seed: int = Field(ge=0)
    seconds: float | None = Field(default=None, gt=0)
    vision: str | None = None
    follow: str = "expert"
    camera: bool = True
    realtime: bool = True
    controller: ControllerConfig = ControllerConfig()
    scene: SceneConfig = SceneConfig()


@dataclass(frozen=True)
class SceneCrew:
    """Who takes part: ``follow`` drives while active, ``network`` reads gestures, if any.

    ``observers`` see what passes, ``told`` hears of vision decisions, ``seat`` puts a person beside the controller.
    """

    follow: Callable[[SceneSource], Driver]
    network: GestureNetwork | None = None
    observers: Callable[[SceneSource], Sequence[Observer]] = lambda _: ()
    told: Callable[[VisionDecision], None] | None = None
    seat: Callable[[Controller, SceneSource], Chooser] | None = None


@dataclass(frozen=True)
class SceneDrive:
    """How the drive went; ``source`` as it was left, with the truth. ``unreadable`` pictures could not be decoded."""

    summary: DriveSummary
    source: SceneSource
    unreadable: int


def drive_scene(
    config: SceneDriveConfig,
    crew: SceneCrew,
    out: Path | None = None,
    progress: Callable[[RecordingProgress], None] | None = None,
    control: Control | None = None,
    interrupt: Interrupt | None = None,
) -> SceneDrive:
    """Drive the scene, recorded to ``out`` where that is given.

    In real time pictures are read by a thread of their own, else at once, and the same configuration gives the same
    drive. Signals end it in order until all is closed, unless ``interrupt`` hears them already. Raises ConfigError for
    an unknown scenario or rates that do not fit, OutputExistsError, RecordingError where the disk refuses.
    """
    with nullcontext(interrupt) if interrupt is not None else deferred_interrupt() as heard, ExitStack() as open_things:
        layout = layout_for(config.scenario, config.seed)
        clock = HostClock() if config.realtime else None
        _warm_up(layout, config, crew)
        start_ns = FAST_EPOCH_NS if clock is None else clock.now_ns()
        source = SceneSource(layout, config.scene, config.camera, start_ns)
        rates = config.scene.rates
        controller = Controller(crew.follow(source), _eyes(crew, config), rates, config.controller, crew.told)
        open_things.callback(controller.close)
        chooser = controller if crew.seat is None else crew.seat(controller, source)
        wheel = Wheel(source, source, chooser, rates, config.scene.motions, source.expert, simulated=True)
        observers = crew.observers(source)
        writer = None if out is None else open_things.enter_context(_writer(out, config, source, clock))
        summary = drive(wheel, observers, config.seconds, clock, writer, progress, control, heard)
    if writer is not None and summary.recording is not None:
        summary = replace(summary, recording=replace(summary.recording, size_bytes=writer.size))
    return SceneDrive(summary, source, controller.unreadable)


def _eyes(crew: SceneCrew, config: SceneDriveConfig) -> Eyes | None:
    if crew.network is None:
        return None
    return BackgroundEyes(crew.network) if config.realtime else PromptEyes(crew.network)


def _writer(out: Path, config: SceneDriveConfig, source: SceneSource, clock: HostClock | None) -> RecordingWriter:
    return RecordingWriter(
        out,
        source.info,
        dump_config(config),
        recording_id=None if clock is None else random_id(),
        notes={"light": source.world.layout.light},
        start_ns=source.start_ns,
        realtime=clock is not None,
    )


def _warm_up(layout: Layout, config: SceneDriveConfig, crew: SceneCrew) -> None:
    """Import and compile what scene and networks need, so that the first decisions are as quick as any."""
    source = SceneSource(layout, config.scene, config.camera)
    scan: LidarScan | None = None
    for sensed in source.read(source.start_ns):
        if isinstance(sensed, RawPicture) and crew.network is not None:
            crew.network.decide(encode_jpeg(sensed.image_bgr_u8))
        elif not isinstance(sensed, RawPicture) and isinstance(sensed.message, LidarScan):
            scan = sensed.message
    source.expert.advise()
    crew.follow(source).decide(Observation(source.start_ns, scan, None))
