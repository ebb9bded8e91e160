"""One run of the whole controller in a scene, by the loop that drives a robot live."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from sdt_tools.clock import SECOND_NS
from sdt_tools.config import Config
from sdt_tools.control.controller import Controller, ControllerConfig, VisionDecision
from sdt_tools.control.driving import Wheel, drive
from sdt_tools.control.eyes import Eyes
from sdt_tools.evaluation.outcome import SuccessConfig
from sdt_tools.evaluation.policies import Policy
from sdt_tools.evaluation.vision.commands import ModeTally, tally_modes
from sdt_tools.evaluation.vision.whole_run import WholeConfig, WholeRunJudge, WholeVerdict
from sdt_tools.frames import MotionClass
from sdt_tools.protocols import Driver, Expert, Observation, Observer
from sdt_tools.recording.live.interrupt import Interrupt
from sdt_tools.recording.live.outcome import Ending
from sdt_tools.scene.config import SceneConfig
from sdt_tools.scene.gestures import behaviour_at, first_mode
from sdt_tools.scene.layout import Layout
from sdt_tools.scene.source import SceneSource
from sdt_tools.scene.world import World


class VisionLoopConfig(Config):
    """Scene, controller and limits of an evaluation of the whole controller.

    The scene's ``rates.image_hz`` is not used: only the pictures that the controller reads are taken.
    """

    scene: SceneConfig = SceneConfig()
    controller: ControllerConfig = ControllerConfig()
    success: SuccessConfig = SuccessConfig()
    whole: WholeConfig = WholeConfig()


EyesFor = Callable[[SceneSource], Eyes]
"""Makes what reads the pictures of a scene that is about to begin."""


class PolicyAtTheWheel:
    """A policy of an evaluation, which decides for many runs, in one of them. Implements Driver."""

    def __init__(self, policy: Policy, expert: Expert) -> None:
        self.name = policy.name
        self._policy = policy
        self._expert = expert

    def decide(self, observation: Observation) -> MotionClass:
        """The policy's answer; it stays where there is no scan yet."""
        if observation.scan is None:
            return MotionClass.STAY
        return self._policy.decide(observation.scan.ranges_m[None], [self._expert])[0]


@dataclass(frozen=True)
class DecisionRow:
    """A vision decision beside the truth of its picture, and where robot and operator were when it was taken up."""

    time_s: float
    read: str
    shown: str
    behaviour: str
    before: str
    after: str
    error: bool
    robot_x_m: float
    robot_y_m: float
    robot_yaw_rad: float
    operator_range_m: float
    took_ms: float


@dataclass(frozen=True)
class VisionRun:
    """What one run leaves."""

    scenario: str
    seed: int
    verdict: WholeVerdict
    tally: ModeTally
    simulated_s: float
    decisions: tuple[DecisionRow, ...]


class _DecisionBook:
    """Keeps vision decisions, and where everybody was."""

    def __init__(self, world: World) -> None:
        self.decisions: list[VisionDecision] = []
        self.places: list[tuple[float, float, float, float]] = []
        self._world = world

    def note(self, decision: VisionDecision) -> None:
        """One more."""
        robot, operator = self._world.robot, self._world.operator
        range_m = math.hypot(operator.x_m - robot.x_m, operator.y_m - robot.y_m)
        self.decisions.append(decision)
        self.places.append((robot.x_m, robot.y_m, robot.yaw_rad, range_m))


def drive_run(
    layout: Layout,
    eyes_for: EyesFor,
    policy: Policy,
    config: VisionLoopConfig,
    observers: Sequence[Observer] = (),
) -> VisionRun:
    """Let the controller of ``eyes_for`` and ``policy`` drive ``layout`` to its end, which is at a contact or its time.

    Everything passes the loop of a live drive, as fast as it can: pictures are compressed and read, scans come at the
    scan rate. The same arguments give the same run. Raises KeyboardInterrupt where the user stops it.
    """
    rates = config.scene.rates
    scene = config.scene.model_copy(update={"rates": rates.model_copy(update={"image_hz": rates.vision_hz})})
    source = SceneSource(layout, scene, camera=True)
    world, start_ns = source.world, source.start_ns
    book = _DecisionBook(world)
    follow: Driver = PolicyAtTheWheel(policy, source.expert)
    controller = Controller(follow, eyes_for(source), scene.rates, config.controller, book.note)
    judge = WholeRunJudge(world, config.success, config.whole)
    wheel = Wheel(source, source, controller, scene.rates, scene.motions, source.expert, simulated=True)
    summary = drive(wheel, [judge, *observers], interrupt=Interrupt())
    if summary.ending is Ending.INTERRUPTED:
        raise KeyboardInterrupt
    tally = tally_modes(book.decisions, world.gestures, start_ns, world.time_s, first_mode(layout.gestures))
    return VisionRun(
        scenario=layout.name,
        seed=layout.seed,
        verdict=judge.verdict(tally),
        tally=tally,
        simulated_s=world.time_s,
        decisions=tuple(_rows(book, tally, world, start_ns)),
    )


def _rows(book: _DecisionBook, tally: ModeTally, world: World, start_ns: int) -> list[DecisionRow]:
    wrong = {error.time_s for error in tally.errors}
    rows = []
    for decision, place in zip(book.decisions, book.places, strict=True):
        time_s = (decision.stamp_ns - start_ns) / SECOND_NS
        rows.append(
            DecisionRow(
                time_s,
                "" if decision.gesture is None else decision.gesture.label,
                world.gesture_at(time_s).label,
                behaviour_at(world.layout.behaviours, time_s) or "",
                decision.before.label,
                decision.after.label,
                time_s in wrong,
                *place,
                1e3 * decision.took_s,
            )
        )
    return rows
