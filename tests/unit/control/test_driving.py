"""A controller drives the scene by the live loop: recorded or not, its modes in the commands and in the log."""

from collections.abc import Sequence
from pathlib import Path

import pytest

from sdt_tools.config import RateConfig
from sdt_tools.control.controller import VisionDecision
from sdt_tools.control.driving import Wheel, drive
from sdt_tools.control.scene_drive import SceneCrew, SceneDrive, SceneDriveConfig, drive_scene
from sdt_tools.errors import OutputExistsError, RunError
from sdt_tools.frames import Gesture, LogEntry, Mode, MotionClass, MotionCommand, Received, Twist
from sdt_tools.protocols import Choice, Observation
from sdt_tools.recording.live.control import Control, Wish
from sdt_tools.recording.live.decide import MODE_LOG, STOP
from sdt_tools.recording.live.drivers import ConstantDriver, ExpertDriver
from sdt_tools.recording.live.outcome import Ending
from sdt_tools.recording.messages.topics import SESSION_LOG
from sdt_tools.recording.reader import Recording
from sdt_tools.scene.config import SceneConfig
from sdt_tools.scene.scenario import layout_for
from sdt_tools.scene.source import SceneSource

SCENE = SceneConfig(rates=RateConfig(image_hz=5))
CONFIG = SceneDriveConfig(scenario="summoned_plain", seed=0, seconds=3.0, vision="script", realtime=False, scene=SCENE)
ENABLED_S, DISABLED_S = 1.0, 2.0


class OnTheSecond:
    """Reads enable in the sixth picture and disable in the eleventh: five a second, from the start on."""

    name = "script"

    def __init__(self) -> None:
        self._read = -1

    def decide(self, data: bytes) -> Gesture:
        assert data
        self._read += 1
        return {5: Gesture.ENABLE, 10: Gesture.DISABLE}.get(self._read, Gesture.IDLE)


class Notes:
    """Keeps what passes."""

    def __init__(self) -> None:
        self.commands: list[MotionCommand] = []
        self.entries: list[LogEntry] = []
        self.closed = 0

    def observe(self, received: Received) -> None:
        if isinstance(received.message, MotionCommand):
            self.commands.append(received.message)
        elif isinstance(received.message, LogEntry):
            self.entries.append(received.message)

    def close(self) -> None:
        self.closed += 1


def crew(notes: Notes, told: list[VisionDecision] | None = None) -> SceneCrew:
    # The warm-up reads one picture too.
    network = OnTheSecond()
    network._read = -2
    return SceneCrew(lambda source: ExpertDriver(source.expert), network, lambda _: [notes], (told or []).append)


def driven(out: Path | None = None) -> tuple[SceneDrive, Notes]:
    notes = Notes()
    return drive_scene(CONFIG, crew(notes), out), notes


def seconds(messages: Sequence[MotionCommand | LogEntry], start_ns: int) -> list[float]:
    return [(message.stamp_ns - start_ns) / 1e9 for message in messages]


def test_commands_carry_the_mode_and_the_log_tells_when_it_changes() -> None:
    done, notes = driven()
    start_ns = done.source.start_ns

    active = [command for command in notes.commands if command.mode is Mode.ACTIVE]
    assert seconds(active, start_ns) == pytest.approx([ENABLED_S + 0.1 * number for number in range(10)])
    assert {command.motion for command in notes.commands if command.mode is Mode.IDLE} == {MotionClass.STAY}
    assert [entry.text for entry in notes.entries if entry.name == MODE_LOG] == ["mode: active", "mode: idle"]
    assert (done.summary.ending, done.summary.seconds, done.summary.decisions) == (Ending.TIME, 3.0, 30)
    assert done.summary.latency.count == 30
    assert notes.closed == 1


def test_a_recorded_drive_holds_what_an_unrecorded_one_does(tmp_path: Path) -> None:
    _, notes = driven()
    done, _ = driven(tmp_path / "drive.mcap")

    with Recording.open(tmp_path / "drive.mcap") as recording:
        assert [received.message for received in recording.messages(["/robot/command"])] == notes.commands
        assert [received.message for received in recording.messages([SESSION_LOG])] == notes.entries
    assert done.summary.recording is not None
    assert done.summary.recording.size_bytes == (tmp_path / "drive.mcap").stat().st_size
    with pytest.raises(OutputExistsError):
        driven(tmp_path / "drive.mcap")


class Quits:
    """Drives forward, and wants it to end with its fifth decision; or fails then."""

    name = "quits"

    def __init__(self, control: Control | None) -> None:
        self._control = control
        self._asked = 0

    def choose(self, observation: Observation) -> Choice:
        self._asked += 1
        if self._asked == 5:
            if self._control is None:
                raise OSError("the wheel fell off")
            self._control.want(Wish.QUIT)
        return Choice(MotionClass.FORWARD, self.name)


class Wheels:
    def __init__(self) -> None:
        self.twists: list[Twist] = []

    def command(self, twist: Twist) -> None:
        self.twists.append(twist)


def wheel(chooser: Quits, wheels: Wheels) -> Wheel:
    source = SceneSource(layout_for("plain", 0))
    config = source.world.config
    return Wheel(source, wheels, chooser, config.rates, config.motions, simulated=True)


def test_whoever_holds_the_controls_may_end_it_and_then_the_robot_stands() -> None:
    control, wheels, notes = Control(), Wheels(), Notes()
    summary = drive(wheel(Quits(control), wheels), [notes], control=control)

    assert (summary.ending, summary.decisions) == (Ending.STOPPED, 5)
    assert wheels.twists[-1] == Twist(0.0, 0.0)
    assert notes.commands[-1].driver == STOP


def test_where_the_controller_fails_the_robot_stands() -> None:
    wheels = Wheels()
    with pytest.raises(RunError, match="the wheel fell off"):
        drive(wheel(Quits(None), wheels))

    assert wheels.twists[-1] == Twist(0.0, 0.0)


def test_a_constant_driver_alone_is_active_throughout() -> None:
    notes = Notes()
    config = CONFIG.model_copy(update={"vision": None, "camera": False, "seconds": 1.0})
    drive_scene(config, SceneCrew(lambda _: ConstantDriver(MotionClass.STAY), observers=lambda _: [notes]))

    assert {(command.mode, command.driver) for command in notes.commands} == {(Mode.ACTIVE, "constant:stay")}
    assert notes.entries == []
