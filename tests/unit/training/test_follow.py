import csv
import io
from pathlib import Path

import numpy as np
import pytest
import torch
from matplotlib.image import imread
from nearest_object import draw_frames, write_dataset
from safetensors.torch import load_file

from sdt_tools.config import load_config
from sdt_tools.errors import ConfigError, DatasetError, OutputExistsError, RunError
from sdt_tools.models.checkpoint import load_checkpoint
from sdt_tools.models.follow_net import FollowNetConfig
from sdt_tools.training.follow import FollowTrainingConfig, train_follow
from sdt_tools.training.loop import EpochRecord, LoopConfig
from sdt_tools.training.schedule import LearningRateConfig

SMALL = FollowNetConfig(kernels=(9, 5, 3), widths=(8, 16, 16), strides=(4, 4, 2), hidden=24, dropout=0.1)
BRIEF = FollowTrainingConfig(architecture=SMALL, loop=LoopConfig(epochs=2))


@pytest.fixture(scope="module")
def dataset(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_dataset(tmp_path_factory.mktemp("data") / "nearest", train=700, val=280)


def weights(folder: Path) -> dict[str, torch.Tensor]:
    return load_file(folder / "weights.safetensors")


def test_training_learns_where_the_nearest_object_is(dataset: Path, tmp_path: Path) -> None:
    config = FollowTrainingConfig(
        architecture=SMALL, batch_size=32, loop=LoopConfig(epochs=12, learning_rate=LearningRateConfig(peak=1e-2))
    )
    summary = train_follow(dataset, config, tmp_path / "model")
    assert summary.val.accuracy > 0.95
    scans, labels = draw_frames(seed=99, count=300)
    predicted = load_checkpoint(tmp_path / "model").predict_logits(scans).argmax(axis=1)
    assert (predicted == labels).mean() > 0.95


def test_the_same_seed_gives_the_same_weights_and_another_does_not(dataset: Path, tmp_path: Path) -> None:
    for name, seed in (("one", 3), ("again", 3), ("other", 4)):
        torch.manual_seed(hash(name) % 1000)
        train_follow(dataset, BRIEF.model_copy(update={"seed": seed}), tmp_path / name)
    one, again, other = (weights(tmp_path / name) for name in ("one", "again", "other"))
    assert all(torch.equal(one[name], again[name]) for name in one)
    assert not torch.equal(one["layers.full2.weight"], other["layers.full2.weight"])


def test_the_checkpoint_says_what_it_was_made_from(dataset: Path, tmp_path: Path) -> None:
    summary = train_follow(dataset, BRIEF, tmp_path / "model")
    card = load_checkpoint(tmp_path / "model").card
    assert card.dataset == "nearest"
    assert len(card.dataset_hash) == 64
    assert card.training["loop"]["epochs"] == 2
    assert card.training["augment"]["mirror"] is True
    assert card.metrics["val_accuracy"] == pytest.approx(summary.val.accuracy, abs=1e-6)
    assert card.metrics["train_frames"] == 700
    assert np.sum(card.metrics["val_confusion"]) == 280


def test_the_metrics_are_those_of_the_weights_on_disk(dataset: Path, tmp_path: Path) -> None:
    summary = train_follow(dataset, BRIEF, tmp_path / "model")
    scans, labels = draw_frames(seed=1, count=280)
    predicted = load_checkpoint(tmp_path / "model").predict_logits(scans).argmax(axis=1)
    assert summary.val.accuracy == pytest.approx((predicted == labels).mean())


def test_the_learning_curve_is_a_table_and_a_picture(dataset: Path, tmp_path: Path) -> None:
    seen: list[tuple[int, int]] = []
    train_follow(dataset, BRIEF, tmp_path / "model", lambda record, epochs: seen.append((record.epoch, epochs)))
    rows = list(csv.DictReader(io.StringIO((tmp_path / "model" / "curve.csv").read_text())))
    assert [row["epoch"] for row in rows] == ["1", "2"]
    assert 0.0 <= float(rows[1]["val_accuracy"]) <= 1.0
    assert seen == [(1, 2), (2, 2)]
    assert imread(tmp_path / "model" / "curve.png").std() > 0.01


def test_interrupted_training_keeps_the_best_epoch(dataset: Path, tmp_path: Path) -> None:
    records: list[EpochRecord] = []

    def interrupt(record: EpochRecord, epochs: int) -> None:
        records.append(record)
        if record.epoch == 4:
            raise KeyboardInterrupt

    steep = LearningRateConfig(peak=0.03, warm_up_share=0.0, decay_share=0.0)
    config = BRIEF.model_copy(update={"loop": LoopConfig(epochs=50, learning_rate=steep)})
    summary = train_follow(dataset, config, tmp_path / "model", interrupt)
    best = max(records, key=lambda record: record.val_accuracy)
    assert summary.interrupted
    assert (summary.epochs, summary.kept_epoch) == (4, best.epoch)
    assert summary.val.accuracy == pytest.approx(best.val_accuracy)
    assert load_checkpoint(tmp_path / "model").card.metrics["interrupted"] is True


def test_interruption_before_the_first_epoch_leaves_nothing(
    dataset: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupt(*arguments: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("sdt_tools.training.loop._train_epoch", interrupt)
    with pytest.raises(KeyboardInterrupt):
        train_follow(dataset, BRIEF, tmp_path / "model")
    assert list(tmp_path.iterdir()) == []


def test_an_existing_checkpoint_is_refused_before_any_work(dataset: Path, tmp_path: Path) -> None:
    with pytest.raises(OutputExistsError):
        train_follow(dataset, BRIEF, tmp_path)


def test_a_data_set_of_other_classes_is_refused(tmp_path: Path) -> None:
    gestures = write_dataset(tmp_path / "gestures", 7, 7, tuple("abcdefg"))
    with pytest.raises(DatasetError, match=r"gestures: its classes are a, b, .* build a data set of motions"):
        train_follow(gestures, BRIEF, tmp_path / "model")


def test_training_that_diverges_says_so(dataset: Path, tmp_path: Path) -> None:
    absurd = LearningRateConfig(peak=1e30, warm_up_share=0.0)
    config = BRIEF.model_copy(update={"loop": LoopConfig(epochs=2, learning_rate=absurd)})
    with pytest.raises(RunError, match=r"diverged in epoch \d: .* lower learning_rate.peak"):
        train_follow(dataset, config, tmp_path / "model")


def test_an_unknown_key_of_the_configuration_is_named(tmp_path: Path) -> None:
    path = tmp_path / "train.toml"
    path.write_text("[loop.learning_rate]\npaek = 2e-3\n")
    with pytest.raises(ConfigError, match=r"unknown key 'loop\.learning_rate\.paek'; did you mean 'peak'\?"):
        load_config(FollowTrainingConfig, path)
