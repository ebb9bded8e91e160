"""Policies × scenarios × seeds: units of closed-loop runs, and their tally."""

import json
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from sdt_tools.config import dump_config
from sdt_tools.evaluation.closed_loop import ClosedLoopConfig, drive_closed_loop
from sdt_tools.evaluation.failures import Nesting, WhereFailed, failure_table, nesting, where_failed
from sdt_tools.evaluation.grid import check_given, gather, identity, refuse_repeated
from sdt_tools.evaluation.policies import policy_for
from sdt_tools.evaluation.results import RUNS_FILE, TRACES_FILE, Tally, tally, total, write_results
from sdt_tools.evaluation.saving import SaveRuns, recorder_factory
from sdt_tools.runs.local import Progress, run_units
from sdt_tools.runs.unit import Unit
from sdt_tools.scene.layout import Layout
from sdt_tools.scene.scenario import layout_for

SEEDS_A_UNIT: Final = 10
"""Runs stepped together. The same whatever the number of workers, so that results do not depend on it."""

FAILURES_FILE: Final = "failures.parquet"
_TIMING_FILE = "timing.json"
_RECORDINGS = "recordings"


@dataclass(frozen=True)
class EvaluationSummary:
    """Tallies by model (as it was named in the call) and scenario, and where runs, traces and recordings lie.

    ``total`` pools a model's scenarios. ``nesting`` compares each model with the next, ``where_failed`` sums up
    ``failures``, a table with one row a failed run. ``real_time_factor`` is simulated robot-seconds per second of
    stepping, all workers together; starting processes is left out of it.
    """

    models: Mapping[str, Mapping[str, Tally]]
    total: Mapping[str, Tally]
    nesting: tuple[Nesting, ...]
    where_failed: tuple[WhereFailed, ...]
    real_time_factor: float
    runs: Path
    traces: Path
    failures: Path
    recordings: tuple[Path, ...]


def evaluate_follow(
    models: Sequence[str],
    scenarios: Sequence[str],
    seeds: Sequence[int],
    config: ClosedLoopConfig,
    out: Path,
    save: SaveRuns = SaveRuns.NONE,
    workers: int = 1,
    progress: Progress | None = None,
) -> EvaluationSummary:
    """Drive every model through every scenario with every seed, in blocks that are skipped where ``out`` has them.

    ``models`` are checkpoint folders, ``expert``, ``polar`` or ``constant:<class>``; ``scenarios`` names or files.
    Raises UsageError for empty or repeated arguments and what loading a model or a scenario raises, before any run.
    """
    check_given({"model": models, "scenario": scenarios, "seed": seeds})
    drawn = [[layout_for(scenario, seed) for seed in seeds] for scenario in scenarios]
    refuse_repeated("scenario", [layouts[0].name for layouts in drawn])
    names = {model: _unit_name(model) for model in models}
    refuse_repeated("model", list(names.values()))
    units = {
        model: [unit for layouts in drawn for unit in _units(names[model], model, layouts, config, save)]
        for model in models
    }
    folders = iter(run_units([unit for group in units.values() for unit in group], out, workers, progress))
    by_model = {model: [next(folders) for _ in group] for model, group in units.items()}
    every = [folder for group in by_model.values() for folder in group]
    runs, traces = gather(by_model, RUNS_FILE, out), gather(by_model, TRACES_FILE, out)
    failures = failure_table(runs, traces)
    failures.write_parquet(out / FAILURES_FILE)
    return EvaluationSummary(
        models=tally(runs),
        total=total(runs),
        nesting=tuple(nesting(runs, models)),
        where_failed=tuple(where_failed(failures, models)),
        real_time_factor=_real_time_factor(every, workers),
        runs=out / RUNS_FILE,
        traces=out / TRACES_FILE,
        failures=out / FAILURES_FILE,
        recordings=tuple(sorted(path for folder in every for path in (folder / _RECORDINGS).glob("*.mcap"))),
    )


def run_block(out: Path, model: str, layouts: Sequence[Layout], config: ClosedLoopConfig, save: SaveRuns) -> None:
    """One unit: a block of one model's runs in one scenario."""
    policy = policy_for(model)
    recorder_for = recorder_factory(out / _RECORDINGS, policy.name, save, dump_config(config))
    started_s = time.perf_counter()
    results = drive_closed_loop(layouts, policy, config, recorder_for)
    timing = {
        "busy_s": time.perf_counter() - started_s,
        "simulated_s": sum(result.simulated_s for result in results),
    }
    write_results(out, results)
    (out / _TIMING_FILE).write_text(json.dumps(timing) + "\n", encoding="utf-8")


def _unit_name(model: str) -> str:
    policy = policy_for(model)
    return f"{policy.name.replace(':', '-')}-{identity(model)}"


def _units(name: str, model: str, layouts: Sequence[Layout], config: ClosedLoopConfig, save: SaveRuns) -> list[Unit]:
    """Blocks of runs. The worlds are drawn already, so that an edited scenario file makes other units."""
    blocks = [layouts[start : start + SEEDS_A_UNIT] for start in range(0, len(layouts), SEEDS_A_UNIT)]
    return [
        Unit(
            f"{name}/{block[0].name}/{block[0].seed}-{block[-1].seed}",
            run_block,
            {"model": model, "layouts": tuple(block), "config": config, "save": save},
        )
        for block in blocks
    ]


def _real_time_factor(folders: Sequence[Path], workers: int) -> float:
    timings = [json.loads((folder / _TIMING_FILE).read_text(encoding="utf-8")) for folder in folders]
    busy_s = sum(timing["busy_s"] for timing in timings)
    return float(sum(timing["simulated_s"] for timing in timings) / busy_s * min(workers, len(folders)))
