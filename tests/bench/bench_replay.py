"""A follow network over a recording of the scene, file to Parquet, on one thread; at least 5,000 scans a second."""

from itertools import count
from pathlib import Path

import pytest
from pytest_benchmark.fixture import BenchmarkFixture

from sdt_tools.labeling.auto import label_automatically
from sdt_tools.labeling.vocabulary import LabelKind, LabelSource
from sdt_tools.models.card import ModelCard
from sdt_tools.models.follow_net import FollowNet, FollowNetConfig, new_follow_net
from sdt_tools.models.loaded import LoadedModel
from sdt_tools.models.preprocess import PreprocessConfig
from sdt_tools.recording.live.drivers import ExpertDriver
from sdt_tools.recording.live.scene_session import SceneRecordingConfig, record_scene
from sdt_tools.recording.reader import Recording
from sdt_tools.replay.replay import replay
from sdt_tools.replay.tracks import read_tracks

SECONDS = 60.0


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("bench") / "plain.mcap"
    config = SceneRecordingConfig(scenario="plain", seed=7, seconds=SECONDS, camera=False)
    record_scene(config, path, lambda _, source: ExpertDriver(source.expert))
    label_automatically(path, LabelKind.MOTION, LabelSource.TRUTH, path.parent / "labels")
    return path


def test_replay_file_to_parquet(benchmark: BenchmarkFixture, recording: Path, tmp_path: Path) -> None:
    network = new_follow_net(FollowNetConfig(), PreprocessConfig(), seed=0).eval()
    card = ModelCard(kind=FollowNet.kind, seed=0, architecture=network.architecture, preprocess=network.preprocess)
    model = LoadedModel("bench", network, card)
    runs = count()

    def run() -> int:
        out = tmp_path / f"{next(runs)}.parquet"
        return replay(model, [recording], recording.parent / "labels", out).frames

    frames = benchmark.pedantic(run, warmup_rounds=1, rounds=5)
    if benchmark.stats:
        benchmark.extra_info["scans_per_s"] = round(frames / benchmark.stats.stats.min)


def test_read_poses_and_commands(benchmark: BenchmarkFixture, recording: Path) -> None:
    with Recording.open(recording) as opened:
        benchmark(read_tracks, opened)
    if benchmark.stats:
        benchmark.extra_info["us_per_scan"] = round(benchmark.stats.stats.min / (50 * SECONDS) * 1e6, 1)
