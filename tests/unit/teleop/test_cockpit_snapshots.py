"""How the cockpit looks: pictures that somebody has looked at, held against what it draws now.

After a change that is meant, `pytest --snapshot-update` takes new ones: look at them.
"""

from collections.abc import Callable
from dataclasses import replace

import pytest
from cockpit_samples import PROGRESS, Clock, cockpit, recording, seen

from sdt_tools.frames import MotionClass
from sdt_tools.teleop.app.app import CockpitApp

SIZES = [(80, 24), (160, 50)]
Compare = Callable[..., bool]


@pytest.mark.parametrize("size", SIZES, ids=str)
@pytest.mark.parametrize(
    "keys",
    [
        pytest.param([], id="driving"),
        pytest.param(["escape"], id="emergency"),
        pytest.param(["?"], id="help"),
        pytest.param(["m", "d", "o", "o", "r"], id="note"),
    ],
)
def test_by_hand(snap_compare: Compare, keys: list[str], size: tuple[int, int]) -> None:
    clock = Clock()
    made = cockpit(clock=clock)
    seen(made, clock)
    assert snap_compare(CockpitApp(made, recording()), press=keys, terminal_size=size)


@pytest.mark.parametrize("size", SIZES, ids=str)
def test_a_hand_over_a_policy(snap_compare: Compare, size: tuple[int, int]) -> None:
    clock = Clock()
    made = cockpit("policy:follow-0", clock=clock)
    seen(made, clock, motion=MotionClass.RIGHT_BACKWARD, intervention=True)
    made.watch.tell(replace(PROGRESS, paused=True, dropped=7, missed_deadlines=12, disk_left_s=130.0))
    assert snap_compare(CockpitApp(made, recording()), press=["-"], terminal_size=size)


@pytest.mark.parametrize("size", SIZES, ids=str)
def test_nothing_has_come_for_a_while(snap_compare: Compare, size: tuple[int, int]) -> None:
    clock = Clock()
    made = cockpit("policy:follow-0", clock=clock)
    seen(made, clock, motion=MotionClass.STAY)
    clock.now_ns += 3_400_000_000
    made.watch.tell(replace(PROGRESS, running=False, state="no take is running (take_003 kept)", disk_left_s=None))
    assert snap_compare(CockpitApp(made, recording()), press=["space"], terminal_size=size)


def test_getting_ready(snap_compare: Compare) -> None:
    assert snap_compare(CockpitApp(cockpit(), recording()), terminal_size=(80, 24))


def test_too_small(snap_compare: Compare) -> None:
    assert snap_compare(CockpitApp(cockpit(), recording()), terminal_size=(60, 20))
