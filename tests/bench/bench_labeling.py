"""Journals of 100,000 acts: read, checked and resolved, beside the same rules over the standard library's csv."""

import csv
import time
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from pytest_benchmark.fixture import BenchmarkFixture

from sdt_tools.labeling.journal import Journal, read_journal
from sdt_tools.labeling.resolve import resolve
from sdt_tools.labeling.vocabulary import LabelKind, LabelSource

ACTS = 100_000
RANK = {str(source): rank for rank, source in enumerate(LabelSource)}


@pytest.fixture(scope="module")
def journal(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("journal") / "long.motion.csv"
    rng = np.random.default_rng(0)
    acts = pl.DataFrame(
        {
            "stamp_ns": rng.integers(0, ACTS // 3, ACTS),
            "label": rng.choice(["", *LabelKind.MOTION.classes], ACTS),
            "labeler": rng.choice(["anna", "ben"], ACTS),
            "source": rng.choice(list(RANK), ACTS),
            "created_ns": np.arange(ACTS),
        }
    )
    with Journal(path, "long") as opened:
        opened.append_table(acts)
    return path


def resolve_with_csv(path: Path) -> dict[int, str]:
    standing: dict[tuple[int, str, str], tuple[int, str]] = {}
    with path.open(newline="") as stream:
        for row in csv.DictReader(stream):
            key = (int(row["stamp_ns"]), row["labeler"], row["source"])
            standing[key] = (int(row["act_id"]), row["label"])
    words: dict[int, list[tuple[int, int, str]]] = {}
    for (stamp_ns, _, source), (act_id, label) in standing.items():
        if label:
            words.setdefault(stamp_ns, []).append((RANK[source], -act_id, label))
    resolved = {}
    for stamp_ns, said in words.items():
        human = {label for rank, _, label in said if rank == 0}
        if len(human) < 2:
            resolved[stamp_ns] = min(said)[2]
    return resolved


def test_reading_and_resolving(benchmark: BenchmarkFixture, journal: Path) -> None:
    resolved = benchmark.pedantic(lambda: resolve(read_journal(journal, "long")), rounds=5, warmup_rounds=1)
    started = time.perf_counter()
    expected = resolve_with_csv(journal)
    csv_s = time.perf_counter() - started
    assert dict(resolved.select("stamp_ns", "label").iter_rows()) == expected
    if benchmark.stats is not None:
        benchmark.extra_info["times_faster_than_csv"] = round(csv_s / benchmark.stats["median"], 1)


def test_appending_one_act(benchmark: BenchmarkFixture, journal: Path) -> None:
    with Journal(journal, "long") as opened:
        benchmark(opened.append, stamp_ns=1, label="stay", labeler="anna", source=LabelSource.HUMAN, created_ns=1)
