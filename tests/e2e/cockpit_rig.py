"""What a drive in the cockpit has left, and the same drive again."""

from collections.abc import Sequence
from pathlib import Path

from sdt_tools.frames import MotionClass, MotionCommand, Odometry, Received
from sdt_tools.recording.live.decide import STOP
from sdt_tools.recording.reader import Recording
from sdt_tools.scene.scenario import layout_for
from sdt_tools.scene.source import SceneSource


def messages(path: Path, *topics: str) -> list[Received]:
    with Recording.open(path) as recording:
        assert not recording.truncated
        return list(recording.messages(topics or None))


def commands(path: Path) -> list[tuple[int, MotionCommand]]:
    return [
        (one.received_ns, one.message)
        for one in messages(path, "/robot/command")
        if isinstance(one.message, MotionCommand)
    ]


def driven(path: Path) -> list[tuple[str, MotionClass]]:
    """Who drove what, one after the other, each once."""
    found: list[tuple[str, MotionClass]] = []
    for _, command in commands(path):
        if not found or found[-1] != (command.driver, command.motion):
            found.append((command.driver, command.motion))
    return found


def motions(path: Path) -> list[MotionClass]:
    """What was driven, one after the other, each once, without standing."""
    moved = [motion for driver, motion in driven(path) if driver != STOP and motion is not MotionClass.STAY]
    return [motion for place, motion in enumerate(moved) if place == 0 or moved[place - 1] is not motion]


def poses(sensed: Sequence[object]) -> list[Odometry]:
    return [one.message for one in sensed if isinstance(one, Received) and isinstance(one.message, Odometry)]


def replayed(path: Path, scenario: str, seed: int) -> list[Odometry]:
    """Where the robot comes to when the recorded commands are driven again, each at its time."""
    recorded = poses(messages(path, "/robot/odometry"))
    source = SceneSource(layout_for(scenario, seed), start_ns=recorded[0].stamp_ns)
    sensed: list[object] = []
    for received_ns, command in commands(path):
        sensed += source.read(received_ns)
        source.command(command.twist)
    sensed += source.read(recorded[-1].stamp_ns)
    return poses(sensed)
