"""Persons as drivers: alone at the wheel, or beside a policy that they may take it from at any moment."""

from dataclasses import replace

from sdt_tools.frames import MotionClass
from sdt_tools.protocols import Choice, Chooser, Driver, Observation
from sdt_tools.recording.live.decide import STOP
from sdt_tools.teleop.hand import Hand


class ByHand:
    """A person drives; while no motion is held the robot stays. Implements Chooser."""

    def __init__(self, hand: Hand, name: str) -> None:
        self.name = name
        self._hand = hand

    def choose(self, observation: Observation) -> Choice:
        """The motion that is held."""
        del observation
        state, motion = self._hand.state, self._hand.held
        if state.emergency:
            return Choice(MotionClass.STAY, STOP)
        if motion is None:
            return Choice(MotionClass.STAY, self.name)
        return Choice(motion, state.device, state.speed)


class Takeover:
    """A policy drives until a hand touches the controls, and again when it lets go. Implements Chooser.

    What the hand drives is marked as intervention. Where it has stopped the robot, the policy drives again only when
    the robot is given back, or a motion was touched and let go; such a stop is an intervention too, but by the driver
    ``stop``: it does not say what is right there. A policy that is a Chooser is asked all the time: it keeps the mode.
    """

    def __init__(self, policy: Driver | Chooser, hand: Hand) -> None:
        self.name = policy.name
        self._policy = policy
        self._hand = hand

    def choose(self, observation: Observation) -> Choice:
        """The hand's motion, or the policy's."""
        if isinstance(self._policy, Chooser):
            choice = self._policy.choose(observation)
            by_hand = self._by_hand()
            return choice if by_hand is None else replace(by_hand, mode=choice.mode)
        return self._by_hand() or Choice(self._policy.decide(observation), self.name)

    def _by_hand(self) -> Choice | None:
        state, motion = self._hand.state, self._hand.held
        if motion is not None:
            return Choice(motion, state.device, state.speed, intervention=True)
        if state.stopped or state.emergency:
            return Choice(MotionClass.STAY, STOP, intervention=True)
        return None
