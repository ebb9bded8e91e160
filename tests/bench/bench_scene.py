"""What a moment of the scene costs: a step of the world, a reported scan, the expert's advice."""

import numpy as np
from pytest_benchmark.fixture import BenchmarkFixture

from sdt_tools.frames import RAYS, MotionClass, Twist
from sdt_tools.scene.expert import SceneExpert
from sdt_tools.scene.scenario import layout_for
from sdt_tools.scene.sensor import SensorConfig, SensorModel
from sdt_tools.scene.world import World


def test_step_of_the_world(benchmark: BenchmarkFixture) -> None:
    world = World(layout_for("around_boxes", 1000))
    turning = Twist(0.0, 0.3)

    benchmark.pedantic(world.step, (turning,), rounds=100, iterations=20, warmup_rounds=3)

    assert world.contact is None


def test_scan_through_the_sensor(benchmark: BenchmarkFixture) -> None:
    sensor = SensorModel(SensorConfig(), np.random.Generator(np.random.SFC64(0)))
    truth, out = np.linspace(0.5, 6.0, RAYS), np.empty(RAYS)

    benchmark.pedantic(sensor.measure_into, (truth, out), rounds=100, iterations=64, warmup_rounds=3)

    assert (out < 7.0).all()


def test_advice_of_the_expert(benchmark: BenchmarkFixture) -> None:
    expert = SceneExpert(World(layout_for("around_boxes", 1000)))

    motion = benchmark.pedantic(expert.advise, rounds=100, iterations=20, warmup_rounds=3)

    assert motion in MotionClass
