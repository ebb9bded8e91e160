"""Who drives: the hand, the policy, or nobody."""

from dataclasses import dataclass, field

from sdt_tools.frames import Mode, MotionClass
from sdt_tools.protocols import Choice, Chooser, Observation
from sdt_tools.recording.live.decide import STOP
from sdt_tools.teleop.hand import Hand
from sdt_tools.teleop.takeover import ByHand, Takeover

NOTHING = Observation(0, None, None)
FORWARD, LEFT, STAY = MotionClass.FORWARD, MotionClass.LEFT_FORWARD, MotionClass.STAY


@dataclass
class Policy:
    name: str = "policy:follow"
    asked: int = 0

    def decide(self, observation: Observation) -> MotionClass:
        self.asked += 1
        return FORWARD


@dataclass
class Clock:
    now_ns: int = 0
    hand: Hand = field(init=False)

    def __post_init__(self) -> None:
        self.hand = Hand(0.5, lambda: self.now_ns)


def test_both_are_choosers() -> None:
    hand = Clock().hand
    assert isinstance(ByHand(hand, "keyboard"), Chooser)
    assert isinstance(Takeover(Policy(), hand), Chooser)


def test_by_hand_the_robot_stays_unless_a_motion_is_held() -> None:
    clock = Clock()
    driver = ByHand(clock.hand, "keyboard")
    assert driver.choose(NOTHING) == Choice(STAY, "keyboard")
    clock.hand.change_speed(-2)
    clock.hand.press(LEFT)
    assert driver.choose(NOTHING) == Choice(LEFT, "keyboard", 0.5)
    clock.now_ns = 500_000_000
    assert driver.choose(NOTHING) == Choice(STAY, "keyboard")
    clock.hand.steer(LEFT)
    assert driver.choose(NOTHING) == Choice(LEFT, "gamepad", 0.5)
    clock.hand.stop_at_once("Esc")
    assert driver.choose(NOTHING) == Choice(STAY, STOP)


def test_a_touched_key_takes_over_and_letting_go_gives_back() -> None:
    clock, policy = Clock(), Policy()
    driver = Takeover(policy, clock.hand)
    assert driver.choose(NOTHING) == Choice(FORWARD, "policy:follow")
    clock.hand.press(LEFT)
    assert driver.choose(NOTHING) == Choice(LEFT, "keyboard", intervention=True)
    clock.now_ns = 500_000_000
    assert driver.choose(NOTHING) == Choice(FORWARD, "policy:follow")
    assert policy.asked == 2


def test_a_key_that_stays_is_an_intervention_as_any_other() -> None:
    clock = Clock()
    clock.hand.press(STAY)
    assert Takeover(Policy(), clock.hand).choose(NOTHING) == Choice(STAY, "keyboard", intervention=True)


def test_a_stop_holds_the_policy_back_until_the_robot_is_given_back() -> None:
    clock = Clock()
    driver = Takeover(Policy(), clock.hand)
    clock.hand.stop()
    clock.now_ns = 10**12
    assert driver.choose(NOTHING) == Choice(STAY, STOP, intervention=True)
    clock.hand.give_back()
    assert driver.choose(NOTHING).driver == "policy:follow"


def test_after_an_emergency_stop_the_policy_waits_to_be_given_the_robot() -> None:
    clock = Clock()
    driver = Takeover(Policy(), clock.hand)
    clock.hand.stop_at_once("Esc")
    clock.hand.give_back()
    assert driver.choose(NOTHING) == Choice(STAY, STOP, intervention=True)
    clock.hand.stop()
    clock.hand.release()
    assert driver.choose(NOTHING) == Choice(STAY, STOP, intervention=True)
    clock.hand.give_back()
    assert driver.choose(NOTHING).motion is FORWARD


@dataclass
class Resting:
    """A controller that is idle."""

    name: str = "controller"
    asked: int = 0

    def choose(self, observation: Observation) -> Choice:
        self.asked += 1
        return Choice(STAY, "idle", mode=Mode.IDLE)


def test_a_controller_is_asked_all_the_time_and_its_mode_stands_whoever_drives() -> None:
    clock, controller = Clock(), Resting()
    takeover = Takeover(controller, clock.hand)

    assert takeover.choose(NOTHING) == Choice(STAY, "idle", mode=Mode.IDLE)
    clock.hand.press(LEFT)
    assert takeover.choose(NOTHING) == Choice(LEFT, "keyboard", intervention=True, mode=Mode.IDLE)
    clock.hand.stop()
    assert takeover.choose(NOTHING) == Choice(STAY, STOP, intervention=True, mode=Mode.IDLE)
    assert controller.asked == 3
