"""A million frames, 5 % of them wrong: the search beside faiss and scikit-learn, and the whole of `sdt errors`."""

import json
import os
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from many_scans import many_predictions, many_scans
from pytest_benchmark.fixture import BenchmarkFixture

from sdt_tools.clock import FAST_EPOCH_NS
from sdt_tools.error_analysis.neighbours import build_index, count_neighbours
from sdt_tools.frames import RAYS, LidarScan, Received
from sdt_tools.protocols import SourceInfo
from sdt_tools.recording.writer import RecordingWriter
from sdt_tools.replay.predictions import SCHEMA

FRAMES = 1_000_000
SEED = 1000
PEER_QUERIES = 1_000
GROUPS = 60
"""Random halves of all frames: two sets of neighbours that are as many in each half are the same set."""


@pytest.fixture(scope="module")
def million() -> tuple[np.ndarray, np.ndarray, pl.DataFrame]:
    scans, recording = many_scans(FRAMES, SEED)
    return scans, recording, many_predictions(scans, recording, SEED)


def seconds(work: Callable[[], object]) -> tuple[object, float]:
    """What ``work`` returns and the processor time that it took; all here run on one thread."""
    started = time.process_time()
    return work(), time.process_time() - started


def exactly_near(scans: np.ndarray, row: int, candidates: np.ndarray, limit: float) -> np.ndarray:
    squares = ((scans[candidates].astype(np.float64) - scans[row].astype(np.float64)) ** 2).sum(axis=1)
    return candidates[(squares > 0.0) & (squares <= limit)]


def test_neighbours_beside_faiss_and_scikit_learn(
    benchmark: BenchmarkFixture, million: tuple[np.ndarray, np.ndarray, pl.DataFrame]
) -> None:
    """Index and search for all error frames, on one thread; peers search for some of them in the same frames."""
    faiss = pytest.importorskip("faiss")
    neighbors = pytest.importorskip("sklearn.neighbors")
    scans, _, table = million
    rows = np.flatnonzero(table["loss_01"].to_numpy() > 0.5)
    steps = scans[1:100_000].astype(np.float64) - scans[: 100_000 - 1]
    epsilon_m = float(np.percentile(np.sqrt((steps**2).mean(axis=1)), 90))
    limit = epsilon_m**2 * RAYS
    everything = np.ones((1, FRAMES), bool)
    count_neighbours(build_index(scans[:300], 1), np.arange(2), epsilon_m, everything[:, :300], 1)  # compiles

    def search() -> float:
        return seconds(lambda: count_neighbours(build_index(scans, 1), rows, epsilon_m, everything, 1))[1]

    ours_s = benchmark.pedantic(search, rounds=1) / len(rows)
    some = np.random.default_rng(1).choice(rows, PEER_QUERIES, replace=False)
    asked = np.ascontiguousarray(scans[some])

    faiss.omp_set_num_threads(1)
    flat = faiss.IndexFlatL2(RAYS)
    flat.add(scans)
    flat.range_search(asked[:1], limit)
    (ends, _, found), faiss_s = seconds(lambda: flat.range_search(asked, limit))
    by_faiss = [found[ends[i] : ends[i + 1]] for i in range(PEER_QUERIES)]
    wide_ends, _, wide = flat.range_search(asked, limit * 1.001)
    del flat
    brute = neighbors.NearestNeighbors(radius=np.sqrt(limit), algorithm="brute", n_jobs=1).fit(scans)
    by_sklearn, sklearn_s = seconds(lambda: brute.radius_neighbors(asked, return_distance=False))

    halves = np.random.default_rng(2).random((GROUPS, FRAMES), np.float32) < 0.5
    counts = count_neighbours(build_index(scans), some, epsilon_m, np.vstack([everything, halves]))
    rounded = 0
    for i, row in enumerate(some):
        exact = exactly_near(scans, row, wide[wide_ends[i] : wide_ends[i + 1]], limit)
        assert counts[:, i].tolist() == [len(exact), *halves[:, exact].sum(axis=1)]
        for theirs in (by_faiss[i], by_sklearn[i]):
            rounded += len(set(theirs.tolist()) ^ set(exact.tolist()) ^ {int(row)})
    assert rounded <= 2  # the peers take float32, or differences of products: not exact where the bound itself lies
    benchmark.extra_info.update(
        {
            "frames": FRAMES,
            "queries": len(rows),
            "neighbours_per_query": float(counts[0].mean()),
            "ours, index included, us per query": ours_s * 1e6,
            "times faster than faiss": faiss_s / PEER_QUERIES / ours_s,
            "times faster than scikit-learn": sklearn_s / PEER_QUERIES / ours_s,
            "pairs that peers round otherwise": rounded,
        }
    )


@pytest.mark.parametrize("epsilon", ["estimated", "larger than everything", "smaller than everything"])
def test_sdt_errors(
    benchmark: BenchmarkFixture, million_on_disk: Path, tmp_path: Path, epsilon: str, capfd: pytest.CaptureFixture[str]
) -> None:
    """The command as users call it, in a process of its own; its report says the rest."""
    config = tmp_path / "options.toml"
    config.write_text(
        {"estimated": "", "larger than everything": "epsilon_m = 3.0\n"}.get(epsilon, "epsilon_m = 1e-4\n")
    )
    command = [sys.executable, "-c", "from sdt_tools.cli.app import main; main()", "errors"]
    command += [str(million_on_disk / "predictions.parquet"), "--recordings", str(million_on_disk / "recordings")]
    command += ["--out", str(tmp_path / "errors"), "--config", str(config), "--json"]
    used: list[float] = []

    def run() -> str:
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
            assert process.stdout
            document = process.stdout.read()
            _, status, usage = os.wait4(process.pid, 0)
            process.returncode = os.waitstatus_to_exitcode(status)
        used[:] = [usage.ru_maxrss * 1024 / 1e9, usage.ru_utime + usage.ru_stime]
        assert process.returncode == 0
        return document

    report = json.loads(benchmark.pedantic(run, rounds=1))
    assert report["frames"] == FRAMES
    assert sum(report["tags"].values()) == FRAMES
    assert (tmp_path / "errors" / "tags.parquet").exists()
    if epsilon == "smaller than everything":
        assert report["tags"]["transient"] == 0
        assert any("no error frame has a neighbour" in warning for warning in report["warnings"])
    benchmark.extra_info.update(
        {
            "frames": report["frames"],
            "errors": report["errors"],
            "epsilon_m": report["epsilon_m"],
            "peak_rss_gb": used[0],
            "processor_s": used[1],
            **{key: count for key, count in report["tags"].items() if count},
        }
    )


@pytest.fixture(scope="module")
def million_on_disk(
    million: tuple[np.ndarray, np.ndarray, pl.DataFrame], tmp_path_factory: pytest.TempPathFactory
) -> Path:
    """The recordings and predictions of these frames, as `sdt` writes them: 2.3 GB."""
    scans, recording, table = million
    folder = tmp_path_factory.mktemp("million")
    (folder / "recordings").mkdir()
    starts = np.searchsorted(recording, np.arange(recording[-1] + 2))
    stamps_ns = table["stamp_ns"].to_numpy() + FAST_EPOCH_NS
    ids = {}
    for number, stem in enumerate(table["recording"].unique(maintain_order=True)):
        with RecordingWriter(folder / "recordings" / f"{stem}.mcap", SourceInfo("import", seed=number), "") as writer:
            for row in range(starts[number], starts[number + 1]):
                stamp_ns = int(stamps_ns[row])
                writer.write(Received(stamp_ns, LidarScan(stamp_ns, scans[row].astype(np.float64))))
        ids[stem] = writer.recording_id
    whole = table.with_columns(
        pl.col("recording").replace_strict(ids).alias("recording_id"),
        pl.Series("stamp_ns", stamps_ns),
        latency_us=pl.lit(50.0, pl.Float32),
        logits=pl.lit([0.0] * 7, pl.List(pl.Float32)),
    )
    whole.select(*SCHEMA).write_parquet(folder / "predictions.parquet")
    return folder
