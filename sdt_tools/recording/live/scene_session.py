"""A recording of the scene, from its configuration to the closed file."""

from collections.abc import Callable, Sequence
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path

from pydantic import Field

from sdt_tools.clock import FAST_EPOCH_NS, HostClock
from sdt_tools.config import Config, dump_config
from sdt_tools.frames import LidarScan, Received
from sdt_tools.protocols import Chooser, Driver, Observation, Observer
from sdt_tools.recording.live.control import Control
from sdt_tools.recording.live.interrupt import Interrupt, deferred_interrupt
from sdt_tools.recording.live.outcome import RecordingProgress, RecordingSummary
from sdt_tools.recording.live.perturb import PerturbConfig, perturbation_of
from sdt_tools.recording.live.record import record
from sdt_tools.recording.session import random_id
from sdt_tools.recording.writer import RecordingWriter
from sdt_tools.scene.config import SceneConfig
from sdt_tools.scene.layout import Layout
from sdt_tools.scene.scenario import layout_for
from sdt_tools.scene.source import SceneSource


class SceneRecordingConfig(Config):
    """All that decides what a recording of the scene holds; attached to it.

    ``driver`` names the driver; ``perturb`` forces random motions on it. With ``realtime`` the host's time runs the
    scene, else it runs as fast as it can and the same configuration gives the same bytes.
    """

    scenario: str
    seed: int = Field(ge=0)
    seconds: float | None = Field(default=None, gt=0)
    driver: str = "expert"
    camera: bool = True
    realtime: bool = False
    perturb: PerturbConfig | None = None
    scene: SceneConfig = SceneConfig()


MakeDriver = Callable[[str, SceneSource], Driver | Chooser]
"""Builds the driver of a name for a scene that is about to begin."""


def record_scene(
    config: SceneRecordingConfig,
    out: Path,
    make_driver: MakeDriver,
    observers: Sequence[Observer] = (),
    progress: Callable[[RecordingProgress], None] | None = None,
    control: Control | None = None,
    interrupt: Interrupt | None = None,
) -> RecordingSummary:
    """Record the scene to ``out``; whoever holds ``control`` may pause, mark and end it.

    Signals are heard until the file is closed, unless ``interrupt`` hears them already. Raises ConfigError for an
    unknown scenario, OutputExistsError, RecordingError where the disk refuses, and what ``make_driver`` raises.
    """
    with nullcontext(interrupt) if interrupt is not None else deferred_interrupt() as heard:
        return _record_scene(config, out, make_driver, observers, progress, control, heard)


def _record_scene(
    config: SceneRecordingConfig,
    out: Path,
    make_driver: MakeDriver,
    observers: Sequence[Observer],
    progress: Callable[[RecordingProgress], None] | None,
    control: Control | None,
    interrupt: Interrupt,
) -> RecordingSummary:
    clock = HostClock()
    layout = layout_for(config.scenario, config.seed)
    if config.realtime:
        warm_up(layout, config, make_driver)
    start_ns = clock.now_ns() if config.realtime else FAST_EPOCH_NS
    source = SceneSource(layout, config.scene, config.camera, start_ns)
    driver = make_driver(config.driver, source)
    rates = config.scene.rates
    perturb = perturbation_of(config.perturb, config.seed, rates.follow_hz)
    with RecordingWriter(
        out,
        source.info,
        dump_config(config),
        recording_id=random_id() if config.realtime else None,
        notes=layout.notes(),
        start_ns=start_ns,
        realtime=config.realtime,
    ) as writer:
        summary = record(
            source,
            source,
            driver,
            source.expert,
            writer,
            observers,
            rates,
            config.scene.motions,
            config.seconds,
            config.realtime,
            clock,
            perturb,
            progress,
            interrupt=interrupt,
            control=control,
        )
    return replace(summary, size_bytes=writer.size)


def warm_up(layout: Layout, config: SceneRecordingConfig, make_driver: MakeDriver) -> None:
    """Import and compile what scene and driver need, so that they can keep the pace from their first second on."""
    scene = SceneSource(layout, config.scene, config.camera)
    scan = None
    for sensed in scene.read(scene.start_ns):
        if isinstance(sensed, Received) and isinstance(sensed.message, LidarScan):
            scan = sensed.message
    scene.expert.advise()
    driver, observation = make_driver(config.driver, scene), Observation(scene.start_ns, scan, None)
    if isinstance(driver, Chooser):
        driver.choose(observation)
    else:
        driver.decide(observation)
