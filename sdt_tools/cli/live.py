"""How a live recording is shown and driven."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Live:
    """Whether a person sits in the cockpit, with a gamepad or without; how long keys hold; whether Rerun shows it."""

    seated: bool
    gamepad: bool
    hold_s: float
    viewer: bool
