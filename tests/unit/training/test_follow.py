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
from sdt_tools.robustness.domains import SafetyLevel, domains
from sdt_tools.robustness.intervals import domain_differences, worst_margins
from sdt_tools.training.augment import AugmentConfig
from sdt_tools.training.follow import FollowTrainingConfig, train_follow
from sdt_tools.training.loop import LoopConfig
from sdt_tools.training.record import EpochRecord
from sdt_tools.training.safety import SafetyConfig
from sdt_tools.training.schedule import LearningRateConfig
from sdt_tools.training.snapshot import unfinished
from sdt_tools.training.specification import SpecificationConfig

SMALL = FollowNetConfig(kernels=(9, 5, 3), widths=(8, 16, 16), strides=(4, 4, 2), hidden=24, dropout=0.1)
BRIEF = FollowTrainingConfig(architecture=SMALL, loop=LoopConfig(epochs=2))
SAFE = FollowTrainingConfig(
    arch="gate",
    architecture=SMALL,
    specification=SpecificationConfig(level=4),
    loop=LoopConfig(epochs=2, extra_epochs=0),
    safety=SafetyConfig(start_share=0.25, ramp_share=0.25),
)


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


class Stop:
    """Interrupts after an epoch."""

    def __init__(self, epoch: int) -> None:
        self.epoch = epoch
        self.seen: list[int] = []

    def __call__(self, record: EpochRecord, epochs: int) -> None:
        self.seen.append(record.epoch)
        if record.epoch == self.epoch:
            raise KeyboardInterrupt


@pytest.mark.parametrize("config", [BRIEF, SAFE], ids=["without domains", "with domains"])
def test_an_interrupted_training_goes_on_to_the_same_weights(
    config: FollowTrainingConfig, dataset: Path, tmp_path: Path
) -> None:
    longer = config.model_copy(update={"loop": config.loop.model_copy(update={"epochs": 4})})
    straight = train_follow(dataset, longer, tmp_path / "straight")
    with pytest.raises(KeyboardInterrupt):
        train_follow(dataset, longer, tmp_path / "model", Stop(2))
    assert not (tmp_path / "model").exists()
    rest = Stop(99)
    resumed = train_follow(dataset, longer, tmp_path / "model", rest)
    assert rest.seen == [3, 4]
    assert resumed.val.accuracy == straight.val.accuracy
    one, other = weights(tmp_path / "straight"), weights(tmp_path / "model")
    assert all(torch.equal(one[name], other[name]) for name in one)
    curves = [(tmp_path / name / "curve.csv").read_text().splitlines() for name in ("straight", "model")]
    assert [len(curve) for curve in curves] == [5, 5]
    assert sorted(path.name for path in tmp_path.iterdir()) == ["model", "straight"]


def test_a_training_of_other_settings_is_not_gone_on_with(dataset: Path, tmp_path: Path) -> None:
    with pytest.raises(KeyboardInterrupt):
        train_follow(dataset, BRIEF, tmp_path / "model", Stop(1))
    other = BRIEF.model_copy(update={"seed": 5, "batch_size": 32})
    with pytest.raises(ConfigError, match=r"model\.unfinished.*batch_size 64 to 32, seed 0 to 5.*or delete it"):
        train_follow(dataset, other, tmp_path / "model")


def test_a_damaged_state_is_named(dataset: Path, tmp_path: Path) -> None:
    unfinished(tmp_path / "model").write_bytes(b"\x08" + bytes(7) + b"nonsense")
    with pytest.raises(RunError, match=r"unfinished.*damaged.*delete it to begin anew"):
        train_follow(dataset, BRIEF, tmp_path / "model")


def test_interruption_before_the_first_epoch_leaves_nothing(
    dataset: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupt(*arguments: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("sdt_tools.training.loop._epoch", interrupt)
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


def test_a_gated_network_is_certified_and_still_answers(dataset: Path, tmp_path: Path) -> None:
    """Level 4 on the small problem, whose near objects stand outside every domain."""
    config = SAFE.model_copy(
        update={
            "batch_size": 32,
            "augment": AugmentConfig(near_miss_share=0.5),
            "loop": LoopConfig(epochs=16, learning_rate=LearningRateConfig(peak=1e-2)),
            "safety": SafetyConfig(weight=0.3, start_share=0.4, ramp_share=0.2),
        }
    )
    summary = train_follow(dataset, config, tmp_path / "model")
    assert summary.satisfied is True
    assert summary.last.certified_share == 1.0
    assert summary.val.accuracy > 0.9
    network = load_checkpoint(tmp_path / "model").network
    assert (worst_margins(torch.from_numpy(domain_differences(network, domains(SafetyLevel.FOUR)))) > 0).all()


def test_a_bound_that_is_not_reached_is_told_and_the_checkpoint_kept(dataset: Path, tmp_path: Path) -> None:
    hopeless = SAFE.model_copy(update={"safety": SafetyConfig(delta=1e-9, start_share=0.9), "arch": "plain"})
    summary = train_follow(dataset, hopeless, tmp_path / "model")
    assert summary.satisfied is False
    assert load_checkpoint(tmp_path / "model").card.metrics["satisfied"] is False


def test_a_training_interrupted_in_its_extra_epochs_goes_on_to_the_last_of_them(dataset: Path, tmp_path: Path) -> None:
    hopeless = SAFE.model_copy(
        update={
            "safety": SafetyConfig(delta=1e-9),
            "loop": SAFE.loop.model_copy(update={"epochs": 1, "extra_epochs": 4}),
        }
    )
    with pytest.raises(KeyboardInterrupt):
        train_follow(dataset, hopeless, tmp_path / "model", Stop(3))
    summary = train_follow(dataset, hopeless, tmp_path / "model")
    assert (summary.last.epoch, summary.satisfied) == (5, False)
