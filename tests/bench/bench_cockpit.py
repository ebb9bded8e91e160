"""The cockpit's screen: how long it takes to show the newest of everything, at three sizes.

Ten times a second it does so: more than 100 ms would be too slow."""

import asyncio
import sys
from itertools import cycle
from pathlib import Path

import pytest
from pytest_benchmark.fixture import BenchmarkFixture

sys.path.append(str(Path(__file__).parents[1] / "unit" / "teleop"))
from cockpit_samples import Clock, cockpit, first_scan, picture, recording, seen

from sdt_tools.frames import Received
from sdt_tools.teleop.app.app import CockpitApp
from sdt_tools.teleop.app.screen import CockpitScreen


@pytest.mark.parametrize("size", [(80, 24), (120, 40), (160, 50)], ids=str)
def test_show(benchmark: BenchmarkFixture, size: tuple[int, int]) -> None:
    """A new scan and a new picture, until the screen's lines are made."""
    clock = Clock()
    made = cockpit(clock=clock)
    seen(made, clock)

    async def run() -> None:
        app = CockpitApp(made, recording())
        async with app.run_test(size=size) as pilot:
            await pilot.pause()
            screen = app.screen
            assert isinstance(screen, CockpitScreen)

            def show() -> None:
                scan, image = next(news)
                made.watch.observe(Received(0, scan))
                made.watch.observe(Received(0, image))
                screen.show()
                screen._compositor.render_full_update()

            news = cycle([(first_scan(), picture()), (first_scan(), picture())])
            benchmark(show)

    asyncio.run(run())
