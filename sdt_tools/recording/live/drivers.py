"""Drivers that need no network: the expert, and the constant answers that every other one is compared with."""

from dataclasses import dataclass

from sdt_tools.frames import MotionClass
from sdt_tools.protocols import Expert, Observation


@dataclass(frozen=True)
class ExpertDriver:
    """Does what the expert advises."""

    expert: Expert
    name: str = "expert"

    def decide(self, observation: Observation) -> MotionClass:
        """The expert's advice; it knows the scene and needs no observation."""
        del observation
        return self.expert.advise()


@dataclass(frozen=True)
class ConstantDriver:
    """Gives the same answer, whatever it sees."""

    motion: MotionClass

    @property
    def name(self) -> str:
        """As on the command line: ``constant:forward``."""
        return f"constant:{self.motion.label}"

    def decide(self, observation: Observation) -> MotionClass:
        """The constant."""
        del observation
        return self.motion
