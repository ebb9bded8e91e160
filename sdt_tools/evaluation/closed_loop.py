"""Many scenes stepped together: rays cast for all of them at once, one batch for the network at each decision."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final, Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float64

from sdt_tools.clock import FAST_EPOCH_NS, SECOND_NS
from sdt_tools.config import Config
from sdt_tools.evaluation.outcome import Judge, Situation, SuccessConfig, Verdict
from sdt_tools.evaluation.policies import Policy
from sdt_tools.evaluation.results import RunResult, TracePoint
from sdt_tools.evaluation.situation import situation_in
from sdt_tools.frames import RAYS, LidarScan, MotionClass, MotionCommand, Twist
from sdt_tools.models.preprocess import FIRST_FRONT_RAY, LAST_FRONT_RAY
from sdt_tools.robustness.domains import SafetyLevel, distance_rms_m
from sdt_tools.scene.config import PHYSICS_HZ, SceneConfig
from sdt_tools.scene.expert import SceneExpert
from sdt_tools.scene.layout import Layout
from sdt_tools.scene.raycast import cast_rays_many, pack_scenes
from sdt_tools.scene.seeds import Stream, generator
from sdt_tools.scene.sensor import SensorModel
from sdt_tools.scene.world import World

FRONT_RAYS: Final = slice(230, 311)
"""The rays within ±20° of straight ahead, of which a trace notes the nearest true range."""


class ClosedLoopConfig(Config):
    """Scene and limits of an evaluation."""

    scene: SceneConfig = SceneConfig()
    success: SuccessConfig = SuccessConfig()


@runtime_checkable
class RunRecorder(Protocol):
    """Keeps what one run's sensors said and what was decided."""

    def scan(self, world: World, scan: LidarScan) -> None:
        """A scan was taken."""
        ...

    def command(self, command: MotionCommand) -> None:
        """A motion was decided on."""
        ...

    def close(self, verdict: Verdict) -> str | None:
        """The run is over; the name of the recording, where one is kept."""
        ...


STANDING: Final = Twist(0.0, 0.0)

RecorderFactory = Callable[[Layout], RunRecorder]


@dataclass(eq=False)
class _Run:
    layout: Layout
    world: World
    expert: SceneExpert
    sensor: SensorModel
    judge: Judge
    recorder: RunRecorder | None
    trace: list[TracePoint]
    twist: Twist = STANDING
    verdict: Verdict | None = None


def drive_closed_loop(
    layouts: Sequence[Layout],
    policy: Policy,
    config: ClosedLoopConfig,
    recorder_for: RecorderFactory | None = None,
) -> list[RunResult]:
    """Let ``policy`` drive each layout to its verdict; results come in the order of the layouts.

    Scans are taken at ``rates.scan_hz``. Decisions are due ``rates.follow_hz`` times a second and fall on the next
    scan, as in a recording. A run's randomness is its seed's alone: it does not depend on the runs beside it.
    """
    scan_every = round(PHYSICS_HZ / config.scene.rates.scan_hz)
    decisions_a_tick = config.scene.rates.follow_hz / PHYSICS_HZ
    decided = 0
    runs = [_start(layout, config, recorder_for) for layout in layouts]
    live, tick = runs, 0
    while live:
        if tick % scan_every == 0:
            true_ranges_m = _cast(live)
            scans = [_measure(run, ranges) for run, ranges in zip(live, true_ranges_m, strict=True)]
            due = math.floor(tick * decisions_a_tick + 1e-9) + 1
            if due > decided:
                decided = due
                _decide(live, scans, true_ranges_m, policy, config)
                live = [run for run in live if run.verdict is None]
        for run in live:
            run.world.step(run.twist)
        tick += 1
    return [_finish(run, policy) for run in runs]


def _start(layout: Layout, config: ClosedLoopConfig, recorder_for: RecorderFactory | None) -> _Run:
    world = World(layout, config.scene)
    return _Run(
        layout=layout,
        world=world,
        expert=SceneExpert(world),
        sensor=SensorModel(config.scene.sensor, generator(layout.seed, Stream.SENSOR), config.scene.rates.scan_hz),
        judge=Judge(layout.timeout_s, config.success),
        recorder=recorder_for(layout) if recorder_for else None,
        trace=[],
    )


def _cast(runs: Sequence[_Run]) -> Float64[np.ndarray, "runs rays"]:
    scenes = pack_scenes([run.world.segments for run in runs], [run.world.circles for run in runs])
    poses = np.array([(p.x_m, p.y_m, p.yaw_rad) for p in (run.world.lidar_pose for run in runs)])
    out = np.empty((len(runs), RAYS))
    cast_rays_many(poses, scenes.segments, scenes.segment_ends, scenes.circles, scenes.circle_ends, out)
    return out


def _measure(run: _Run, true_ranges_m: Float64[np.ndarray, "rays"]) -> LidarScan:
    scan = LidarScan(_stamp_ns(run.world), run.sensor.measure(true_ranges_m))
    if run.recorder:
        run.recorder.scan(run.world, scan)
    return scan


def _decide(
    runs: Sequence[_Run],
    scans: Sequence[LidarScan],
    true_ranges_m: Float64[np.ndarray, "runs rays"],
    policy: Policy,
    config: ClosedLoopConfig,
) -> None:
    motions = policy.decide(np.stack([scan.ranges_m for scan in scans]), [run.expert for run in runs])
    surroundings = _surroundings(true_ranges_m)
    for run, scan, around, motion in zip(runs, scans, surroundings, motions, strict=True):
        situation = situation_in(run.world)
        run.trace.append(_trace_point(run.world, situation, around, motion))
        run.twist = config.scene.motions.twist(motion)
        if run.recorder:
            run.recorder.command(
                MotionCommand(scan.stamp_ns, motion, run.twist, driver=policy.name, expert=run.expert.advise())
            )
        run.verdict = run.judge.see(situation)


@dataclass(frozen=True)
class _Surroundings:
    """The fields of a ``TracePoint`` that come from the true scan."""

    front_range_m: float
    watched_range_m: float
    level3_rms_m: float
    level4_rms_m: float


def _surroundings(true_ranges_m: Float64[np.ndarray, "runs rays"]) -> list[_Surroundings]:
    columns = (
        true_ranges_m[:, FRONT_RAYS].min(axis=1),
        true_ranges_m[:, FIRST_FRONT_RAY : LAST_FRONT_RAY + 1].min(axis=1),
        distance_rms_m(true_ranges_m, SafetyLevel.THREE),
        distance_rms_m(true_ranges_m, SafetyLevel.FOUR),
    )
    return [_Surroundings(*values) for values in np.stack(columns, axis=1).tolist()]


def _trace_point(world: World, now: Situation, around: _Surroundings, motion: MotionClass) -> TracePoint:
    return TracePoint(
        time_s=now.time_s,
        robot_x_m=now.robot.x_m,
        robot_y_m=now.robot.y_m,
        robot_yaw_rad=now.robot.yaw_rad,
        operator_x_m=world.operator.x_m,
        operator_y_m=world.operator.y_m,
        operator_range_m=now.operator_range_m,
        operator_bearing_rad=now.operator_bearing_rad,
        **vars(around),
        motion=motion.label,
    )


def _finish(run: _Run, policy: Policy) -> RunResult:
    assert run.verdict is not None
    return RunResult(
        policy=policy.name,
        scenario=run.layout.name,
        seed=run.layout.seed,
        outcome=run.verdict.outcome,
        reason=run.verdict.reason,
        simulated_s=run.world.time_s,
        trace=tuple(run.trace),
        recording=run.recorder.close(run.verdict) if run.recorder else None,
    )


def _stamp_ns(world: World) -> int:
    return FAST_EPOCH_NS + round(world.time_s * SECOND_NS)
