"""Whether a run of the whole controller is ok, and what it is called where it is not."""

import math
from collections.abc import Sequence

import pytest

from sdt_tools.evaluation.outcome import SuccessConfig
from sdt_tools.evaluation.vision.commands import ModeError, ModeTally, commands_of
from sdt_tools.evaluation.vision.whole_run import WholeConfig, WholeOutcome, WholeRunJudge
from sdt_tools.frames import Gesture, Mode, MotionClass, MotionCommand, Received, Twist
from sdt_tools.scene.config import SceneConfig
from sdt_tools.scene.expert import SceneExpert
from sdt_tools.scene.scenario import layout_for
from sdt_tools.scene.world import World

CLEAN = ModeTally((), 2, 0, (), (0.1, 0.1), 250, 246, 0, 0)
STAND = Twist(0.0, 0.0)


def drive(
    active: Sequence[tuple[float, float]], idle_twist: Twist = STAND, active_twist: Twist | None = None
) -> WholeRunJudge:
    """Drive ``summoned_plain``: the expert, or a constant twist, while active, in the spans of time given."""
    world = World(layout_for("summoned_plain", 1000), SceneConfig(stop_at_contact=False))
    judge, expert = WholeRunJudge(world, SuccessConfig(), WholeConfig()), SceneExpert(world)
    twist = STAND
    while world.time_s < world.layout.timeout_s:
        if world.steps % 5 == 0:
            on = any(start <= world.time_s < end for start, end in active)
            driven = active_twist or world.config.motions.twist(expert.advise())
            twist = driven if on else idle_twist
            mode = Mode.ACTIVE if on else Mode.IDLE
            judge.observe(Received(world.steps, MotionCommand(world.steps, MotionClass.STAY, twist, "test", mode)))
        world.step(twist)
    return judge


AS_COMMANDED = [(2.6, 43.6)]


@pytest.fixture(scope="module")
def followed() -> WholeRunJudge:
    return drive(AS_COMMANDED)


def test_summoned_followed_and_sent_to_rest_is_ok(followed: WholeRunJudge) -> None:
    verdict = followed.verdict(CLEAN)

    assert (verdict.outcome, verdict.reason) == (WholeOutcome.OK, "as commanded")


def test_a_mode_error_spoils_it(followed: WholeRunJudge) -> None:
    errors = (ModeError(30.0, Mode.IDLE, True), ModeError(30.2, Mode.ACTIVE, False))
    verdict = followed.verdict(ModeTally(errors, 2, 0, (), (0.1, 0.1), 250, 246, 2, 0))

    assert verdict.outcome is WholeOutcome.SWITCHED
    assert verdict.reason == "idle at 30.0 s: disable was read where it was not shown and 1 more"


def test_a_command_that_is_missed_or_heard_late_spoils_it(followed: WholeRunJudge) -> None:
    (enable, _) = commands_of(layout_for("summoned_plain", 1000).gestures)
    missed = followed.verdict(ModeTally((), 2, 0, (enable,), (0.1,), 250, 246, 0, 0))
    late = followed.verdict(ModeTally((), 2, 0, (), (0.1, 2.1), 250, 246, 0, 0))

    assert missed.outcome is late.outcome is WholeOutcome.MISSED
    assert enable.gesture is Gesture.ENABLE
    assert late.reason == "a command was heard after 2.1 s"


def test_a_robot_that_stays_though_it_is_active_has_not_followed() -> None:
    verdict = drive(AS_COMMANDED, active_twist=STAND).verdict(CLEAN)

    assert verdict.outcome is WholeOutcome.FOLLOW


def test_a_robot_that_does_not_stand_while_idle_is_told() -> None:
    verdict = drive(AS_COMMANDED, idle_twist=Twist(-0.1, 0.0)).verdict(CLEAN)

    assert verdict.outcome is WholeOutcome.MOVED
    assert verdict.reason.startswith("idle, it moved 0.0")


def test_contact_comes_first() -> None:
    judge = drive(AS_COMMANDED, active_twist=Twist(0.5, math.tau / 400))
    verdict = judge.verdict(ModeTally((ModeError(1.0, Mode.ACTIVE, True),), 2, 0, (), (), 250, 246, 1, 0))

    assert verdict.outcome is WholeOutcome.CONTACT
