"""Closed-loop runs kept as ordinary LiDAR recordings, the expert's advice beside each command."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

from sdt_tools.clock import FAST_EPOCH_NS
from sdt_tools.evaluation.outcome import Outcome, Verdict
from sdt_tools.frames import (
    CameraImage,
    LidarScan,
    LogEntry,
    LogLevel,
    Message,
    MotionCommand,
    Odometry,
    OperatorPose,
    Received,
)
from sdt_tools.protocols import SourceInfo
from sdt_tools.recording.writer import RecordingWriter
from sdt_tools.scene.layout import Layout, lidar_mount
from sdt_tools.scene.world import World


class SaveRuns(StrEnum):
    """Which runs are kept."""

    NONE = "none"
    FAILED = "failed"
    ALL = "all"


class MemoryRecorder:
    """Holds a run's messages until its verdict says whether they are kept, then writes them at once."""

    def __init__(self, folder: Path, layout: Layout, policy: str, keep: SaveRuns, config_toml: str) -> None:
        self._folder = folder
        self._layout = layout
        self._policy = policy
        self._keep = keep
        self._config_toml = config_toml
        self._messages: list[Message] = [lidar_mount(FAST_EPOCH_NS)]

    def scan(self, world: World, scan: LidarScan) -> None:
        """A scan was taken; the truth of its moment is kept beside it."""
        stamp_ns = scan.stamp_ns
        self._messages += [
            scan,
            Odometry(stamp_ns, world.robot),
            OperatorPose(stamp_ns, world.operator),
            world.operator_state(stamp_ns, world.time_s),
        ]

    def command(self, command: MotionCommand) -> None:
        """A motion was decided on."""
        self._messages.append(command)

    def close(self, verdict: Verdict) -> str | None:
        """Write the run, if runs of this outcome are kept, and return the recording's name."""
        failed = verdict.outcome is not Outcome.OK
        if self._keep is SaveRuns.NONE or (self._keep is SaveRuns.FAILED and not failed):
            return None
        driver = self._policy.replace(":", "-")
        name = f"{driver}_{self._layout.name}_{self._layout.seed}_{verdict.outcome}.mcap"
        told = Told(self._policy, verdict.outcome.value, verdict.reason, failed)
        received = [Received(message.stamp_ns, message) for message in self._messages]
        write_run(self._folder / name, self._layout, received, told, self._config_toml)
        self._messages.clear()
        return name


@dataclass(frozen=True)
class Told:
    """What a kept run says of itself: who drove, and how it ended."""

    driver: str
    outcome: str
    reason: str
    failed: bool


def write_run(path: Path, layout: Layout, messages: Sequence[Received], told: Told, config_toml: str) -> None:
    """Write a run's ``messages``, and at their end what came of it, as the recording ``path``."""
    cameras = {"camera": "simulated RGB camera"} if any(isinstance(m.message, CameraImage) for m in messages) else {}
    info = SourceInfo("scene", layout.name, layout.seed, {"lidar": "simulated SICK LMS1xx", **cameras})
    notes = {"light": layout.light, "driver": told.driver, "outcome": told.outcome}
    end_ns = messages[-1].received_ns
    level = LogLevel.WARNING if told.failed else LogLevel.INFO
    last = LogEntry(end_ns, level, f"{told.outcome}: {told.reason}", name="evaluation")
    path.parent.mkdir(parents=True, exist_ok=True)
    with RecordingWriter(path, info, config_toml, notes=notes) as writer:
        for received in (*messages, Received(end_ns, last)):
            writer.write(received)


def recorder_factory(
    folder: Path, policy: str, keep: SaveRuns, config_toml: str
) -> Callable[[Layout], MemoryRecorder] | None:
    """A recorder for each run, or none where nothing is kept."""
    if keep is SaveRuns.NONE:
        return None
    return lambda layout: MemoryRecorder(folder, layout, policy, keep, config_toml)
