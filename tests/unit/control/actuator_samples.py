"""An actuator that remembers."""

from sdt_tools.frames import Twist


class Remembers:
    """What was commanded, in order."""

    def __init__(self) -> None:
        self.commanded: list[Twist] = []

    def command(self, twist: Twist) -> None:
        self.commanded.append(twist)

    @property
    def now(self) -> Twist:
        return self.commanded[-1]
