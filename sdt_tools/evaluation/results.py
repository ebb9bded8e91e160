"""What a closed-loop run leaves: its outcome, and the trace of how it went."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import polars as pl

from sdt_tools.evaluation.outcome import Outcome
from sdt_tools.statistics import wilson

RUNS_FILE = "runs.parquet"
TRACES_FILE = "traces.parquet"


@dataclass(frozen=True)
class TracePoint:
    """One decision: where robot centre and operator were, what was decided, and how near things ahead were.

    Range and bearing of the operator are taken from the LiDAR. ``front_range_m`` is the nearest true range within ±20°
    of straight ahead, ``watched_range_m`` that over the rays of the safety domains; ``level3_rms_m`` and
    ``level4_rms_m`` are the true scan's distances to the nearest domain of these levels, root mean square per ray.
    """

    time_s: float
    robot_x_m: float
    robot_y_m: float
    robot_yaw_rad: float
    operator_x_m: float
    operator_y_m: float
    operator_range_m: float
    operator_bearing_rad: float
    front_range_m: float
    watched_range_m: float
    level3_rms_m: float
    level4_rms_m: float
    motion: str


@dataclass(frozen=True)
class RunResult:
    """One run of one policy; ``simulated_s`` is how long it lasted in the scene."""

    policy: str
    scenario: str
    seed: int
    outcome: Outcome
    reason: str
    simulated_s: float
    trace: tuple[TracePoint, ...]
    recording: str | None = None


@dataclass(frozen=True)
class Tally:
    """How one policy did: runs that ended well, their share's Wilson interval, and all outcomes."""

    ok: int
    runs: int
    wilson: tuple[float, float]
    outcomes: dict[str, int]


def write_results(folder: Path, results: Sequence[RunResult]) -> None:
    """Write the runs, and their traces, as two Parquet tables."""
    runs = pl.DataFrame(
        [
            {
                "policy": run.policy,
                "scenario": run.scenario,
                "seed": run.seed,
                "outcome": run.outcome.value,
                "reason": run.reason,
                "simulated_s": run.simulated_s,
                "recording": run.recording,
            }
            for run in results
        ],
        schema_overrides={"recording": pl.String},
    )
    traces = pl.DataFrame(
        [
            {"policy": run.policy, "scenario": run.scenario, "seed": run.seed, **vars(point)}
            for run in results
            for point in run.trace
        ]
    )
    runs.write_parquet(folder / RUNS_FILE)
    traces.write_parquet(folder / TRACES_FILE)


def tally(runs: pl.DataFrame) -> dict[str, dict[str, Tally]]:
    """Outcomes counted by model and scenario."""
    result: dict[str, dict[str, Tally]] = {}
    for (model, scenario), group in runs.group_by("model", "scenario", maintain_order=True):
        result.setdefault(str(model), {})[str(scenario)] = _counted(group)
    return result


def total(runs: pl.DataFrame) -> dict[str, Tally]:
    """Outcomes counted by model, all scenarios together."""
    return {str(model): _counted(group) for (model,), group in runs.group_by("model", maintain_order=True)}


def _counted(runs: pl.DataFrame) -> Tally:
    counts = {outcome.value: int((runs["outcome"] == outcome.value).sum()) for outcome in Outcome}
    ok = counts[Outcome.OK.value]
    return Tally(ok, len(runs), wilson(ok, len(runs)), counts)
