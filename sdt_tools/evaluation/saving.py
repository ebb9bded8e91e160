"""Closed-loop runs kept as ordinary LiDAR recordings, the expert's advice beside each command."""

from collections.abc import Callable
from enum import StrEnum
from pathlib import Path

from sdt_tools.clock import FAST_EPOCH_NS
from sdt_tools.evaluation.outcome import Outcome, Verdict
from sdt_tools.frames import (
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
        end_ns = self._messages[-1].stamp_ns
        level = LogLevel.WARNING if failed else LogLevel.INFO
        self._messages.append(LogEntry(end_ns, level, f"{verdict.outcome}: {verdict.reason}", name="evaluation"))
        driver = self._policy.replace(":", "-")
        name = f"{driver}_{self._layout.name}_{self._layout.seed}_{verdict.outcome}.mcap"
        info = SourceInfo("scene", self._layout.name, self._layout.seed, {"lidar": "simulated SICK LMS1xx"})
        notes = {"light": self._layout.light, "driver": self._policy, "outcome": verdict.outcome.value}
        self._folder.mkdir(parents=True, exist_ok=True)
        with RecordingWriter(self._folder / name, info, self._config_toml, notes=notes) as writer:
            for message in self._messages:
                writer.write(Received(message.stamp_ns, message))
        self._messages.clear()
        return name


def recorder_factory(
    folder: Path, policy: str, keep: SaveRuns, config_toml: str
) -> Callable[[Layout], MemoryRecorder] | None:
    """A recorder for each run, or none where nothing is kept."""
    if keep is SaveRuns.NONE:
        return None
    return lambda layout: MemoryRecorder(folder, layout, policy, keep, config_toml)
