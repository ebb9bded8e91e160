"""What the operator commanded, what the vision network made of it: mode errors, missed commands, reactions.

A *mode error* is a switch of the mode by a gesture that was misread: the operator's arms were not in that gesture, nor
on the way to it or from it, in any of the pictures that the mode was switched by. A misread gesture that changes
nothing, as enable while active, is no error (the paper's masking). A switch back after an error is an error too, unless
he gestures it.

A *command* is an enable or disable gesture in full length. It is *moot* where the mode was the commanded one when his
arms began to move. Else it is *heard* if a picture of it, arms on the way included, switches the mode to the commanded
one, and *missed* otherwise.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from sdt_tools.clock import SECOND_NS
from sdt_tools.control.controller import VisionDecision
from sdt_tools.control.mode_machine import SWITCHES
from sdt_tools.frames import Gesture, Mode
from sdt_tools.scene.gestures import commanded_mode_at
from sdt_tools.scene.layout import GestureEvent


@dataclass(frozen=True)
class Command:
    """A gesture that asks for ``mode``: it counts as shown from ``at_s``; arms move in [``from_s``, ``until_s``)."""

    gesture: Gesture
    mode: Mode
    at_s: float
    from_s: float
    until_s: float

    def shown(self, from_s: float, until_s: float) -> bool:
        """Whether his arms were in it at some moment from ``from_s`` to ``until_s``, both included."""
        return self.from_s <= until_s and from_s < self.until_s


def commands_of(gestures: Sequence[GestureEvent]) -> list[Command]:
    """The enable and disable gestures among ``gestures``, which are in the order of time.

    Where another event begins before the arms are down, arms follow that one (``scene.gestures.arms_at``).
    """
    commands = []
    for number, event in enumerate(gestures):
        if event.gesture is Gesture.IDLE:
            continue
        from_s = event.at_s - event.lead_s
        until_s = from_s + event.lasts_s + event.moves_s
        if number + 1 < len(gestures):
            following = gestures[number + 1]
            until_s = min(until_s, following.at_s - following.lead_s)
        mode = Mode.ACTIVE if event.gesture is Gesture.ENABLE else Mode.IDLE
        commands.append(Command(event.gesture, mode, event.at_s, from_s, until_s))
    return commands


@dataclass(frozen=True)
class ModeError:
    """A switch to ``mode`` at ``time_s`` that nobody commanded; ``against`` what the operator had asked for last."""

    time_s: float
    mode: Mode
    against: bool


@dataclass(frozen=True)
class ModeTally:
    """What happened to the mode in one run.

    ``reactions_s`` are those of the heard commands, from when the gesture counts as shown; negative where the arms'
    rise was enough. ``exposed`` of the ``decisions`` could have been mode errors: the gesture that would have switched
    the mode was not shown. ``misread`` pictures were read as a gesture that was not shown, with an effect or without.
    """

    errors: tuple[ModeError, ...]
    commands: int
    moot: int
    missed: tuple[Command, ...]
    reactions_s: tuple[float, ...]
    decisions: int
    exposed: int
    misread: int
    unreadable: int

    @property
    def heard(self) -> int:
        """Commands that were heard."""
        return len(self.reactions_s)


def tally_modes(
    decisions: Sequence[VisionDecision], gestures: Sequence[GestureEvent], start_ns: int, end_s: float, first: Mode
) -> ModeTally:
    """Count what ``decisions`` on pictures of a scene that began at ``start_ns`` made of the operator's ``gestures``.

    ``end_s`` is when the run ended: a command whose arms were not down by then was not given in full. ``first`` is the
    mode that the operator wants before his first gesture.
    """
    commands = commands_of(gestures)
    timed = [(_seconds(one.stamp_ns, start_ns), one) for one in decisions]
    read = [(time_s, one) for time_s, one in timed if one.gesture is not None]
    errors = [
        ModeError(time_s, one.after, one.after is not commanded_mode_at(gestures, time_s, first))
        for time_s, one in read
        if one.switches and not _commanded(commands, one, start_ns)
    ]
    given = [command for command in commands if command.until_s <= end_s]
    reactions_s, missed, moot = [], [], 0
    for command in given:
        if _mode_before(timed, command.from_s) is command.mode:
            moot += 1
            continue
        heard_s = next((time_s for time_s, one in timed if _heard(command, one, start_ns)), None)
        if heard_s is None:
            missed.append(command)
        else:
            reactions_s.append(heard_s - command.at_s)
    return ModeTally(
        errors=tuple(errors),
        commands=len(given),
        moot=moot,
        missed=tuple(missed),
        reactions_s=tuple(reactions_s),
        decisions=len(timed),
        exposed=sum(not _shown(commands, SWITCHES[one.before], time_s) for time_s, one in read),
        misread=sum(
            one.gesture in SWITCHES.values() and not _shown(commands, one.gesture, time_s) for time_s, one in read
        ),
        unreadable=len(timed) - len(read),
    )


def _seconds(stamp_ns: int, start_ns: int) -> float:
    return (stamp_ns - start_ns) / SECOND_NS


def _commanded(commands: Sequence[Command], one: VisionDecision, start_ns: int) -> bool:
    return any(_heard(command, one, start_ns) for command in commands)


def _heard(command: Command, one: VisionDecision, start_ns: int) -> bool:
    """Whether ``one`` switches to what ``command`` asks for, by pictures of it."""
    span_s = (_seconds(one.since_ns, start_ns), _seconds(one.stamp_ns, start_ns))
    return one.switches and one.after is command.mode and command.shown(*span_s)


def _shown(commands: Sequence[Command], gesture: Gesture | None, time_s: float) -> bool:
    return any(command.gesture is gesture and command.shown(time_s, time_s) for command in commands)


def _mode_before(timed: Sequence[tuple[float, VisionDecision]], time_s: float) -> Mode:
    """The mode of the controller before the first picture of ``time_s`` or later; it begins idle."""
    earlier = [one.after for at_s, one in timed if at_s < time_s]
    return earlier[-1] if earlier else Mode.IDLE
