"""Training by what it must achieve on a small problem, and by what it must leave alone."""

from pathlib import Path

import numpy as np
import pytest
import torch
from corner_gestures import TINY_CONFIG, draw_data, draw_images
from matplotlib.image import imread

from sdt_tools.errors import ConfigError, OutputExistsError, UsageError
from sdt_tools.models.vision.checkpoint import load_vision_checkpoint
from sdt_tools.training.schedule import LearningRateConfig
from sdt_tools.training.snapshot import unfinished
from sdt_tools.training.vision.batches import GestureBatches, trunk_features
from sdt_tools.training.vision.config import AdversarialConfig, VisionTrainingConfig, vision_recipe
from sdt_tools.training.vision.data import as_batch
from sdt_tools.training.vision.loop import VisionEpoch
from sdt_tools.training.vision.train import attacked_score, new_vision_net, train_vision
from sdt_tools.training.vision.views import ViewConfig, varied

LONG = TINY_CONFIG.model_copy(
    update={"epochs": 20, "learning_rate": LearningRateConfig(peak=5e-3, warm_up_share=0.1, decay_share=0.6)}
)


def attacked(epsilon: int, plain_epochs: int = 0, **more: object) -> VisionTrainingConfig:
    term = AdversarialConfig(epsilon=epsilon, plain_epochs=plain_epochs, **more)
    return TINY_CONFIG.model_copy(update={"adversarial": term})


def weights_of(folder: Path) -> bytes:
    return (folder / "weights.safetensors").read_bytes()


def test_plain_training_learns_the_gestures(tmp_path: Path) -> None:
    summary = train_vision(draw_data(), LONG, tmp_path / "net")
    assert summary.val.accuracy > 0.95
    assert summary.epsilon == 0
    assert summary.attacked_train.accuracy == summary.train.accuracy
    assert not unfinished(tmp_path / "net").exists()


def test_adversarial_training_holds_where_plain_training_breaks(tmp_path: Path) -> None:
    """The halves differ by 60 steps, so that ±12 leave the right answer in sight."""
    data = draw_data()
    train_vision(data, LONG, tmp_path / "plain")
    config = LONG.model_copy(update={"adversarial": AdversarialConfig(epsilon=12, plain_epochs=4), "last_blocks": 3})
    robust = train_vision(data, config, tmp_path / "robust")
    of_plain = attacked_score(load_vision_checkpoint(tmp_path / "plain").network, data.train, 12)
    assert robust.attacked_train.accuracy > of_plain.accuracy + 0.2


def test_the_checkpoint_says_what_it_came_from(tmp_path: Path) -> None:
    summary = train_vision(draw_data(), attacked(2, plain_epochs=1), tmp_path / "net")
    card = load_vision_checkpoint(tmp_path / "net").card
    assert (card.kind, card.dataset, card.dataset_hash) == ("vision", "corners", "corners 60")
    assert card.training["adversarial"] == {"epsilon": 2, "plain_epochs": 1, "ramp_epochs": 0, "clean_share": 0.0}
    assert card.metrics["adversarial_train_accuracy"] == round(summary.attacked_train.accuracy, 6)
    rows = (tmp_path / "net/curve.csv").read_text().splitlines()
    assert [row.split(",")[1] for row in rows] == ["epsilon", "0", "2", "2"]
    assert imread(tmp_path / "net/curve.png").ndim == 3


def test_the_same_seed_gives_the_same_weights(tmp_path: Path) -> None:
    config = attacked(1, plain_epochs=1)
    for name, seed in (("a", 1), ("b", 1), ("c", 2)):
        train_vision(draw_data(), config.model_copy(update={"seed": seed}), tmp_path / name)
    assert weights_of(tmp_path / "a") == weights_of(tmp_path / "b")
    assert weights_of(tmp_path / "a") != weights_of(tmp_path / "c")


@pytest.mark.parametrize("after", [1, 2])
def test_an_interrupted_training_goes_on_to_the_same_weights(after: int, tmp_path: Path) -> None:
    config = attacked(1, plain_epochs=1)

    def interrupt(record: VisionEpoch, _epochs: int) -> None:
        if record.epoch == after:
            raise KeyboardInterrupt

    train_vision(draw_data(), config, tmp_path / "whole")
    with pytest.raises(KeyboardInterrupt):
        train_vision(draw_data(), config, tmp_path / "broken", interrupt)
    assert unfinished(tmp_path / "broken").exists()
    train_vision(draw_data(), config, tmp_path / "broken")
    assert weights_of(tmp_path / "whole") == weights_of(tmp_path / "broken")


def test_a_training_of_other_settings_is_not_gone_on_with(tmp_path: Path) -> None:
    def interrupt(_record: VisionEpoch, _epochs: int) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        train_vision(draw_data(), TINY_CONFIG, tmp_path / "net", interrupt)
    with pytest.raises(ConfigError, match="batch_size 16 to 8"):
        train_vision(draw_data(), TINY_CONFIG.model_copy(update={"batch_size": 8}), tmp_path / "net")


def test_nothing_is_overwritten(tmp_path: Path) -> None:
    with pytest.raises(OutputExistsError):
        train_vision(draw_data(), TINY_CONFIG, tmp_path)


def test_the_trunk_is_left_as_it_was(tmp_path: Path) -> None:
    before = new_vision_net(TINY_CONFIG).state_dict()
    train_vision(draw_data(), attacked(1), tmp_path / "net")
    after = load_vision_checkpoint(tmp_path / "net").network.state_dict()
    changed = {name.split(".conv")[0] for name in before if not torch.equal(before[name], after[name])}
    assert {"classifier.weight", "head"} <= changed
    assert not any(name.startswith(("stem", "blocks.0")) for name in changed)


@pytest.mark.parametrize(
    ("config", "expected"),
    [
        (AdversarialConfig(epsilon=2, plain_epochs=2), [0, 0, 2, 2, 2, 2]),
        (AdversarialConfig(epsilon=2, plain_epochs=1, ramp_epochs=2), [0, 1, 1, 2, 2, 2]),
        (AdversarialConfig(epsilon=0, plain_epochs=1, ramp_epochs=2), [0, 0, 0, 0, 0, 0]),
    ],
)
def test_epsilon_rises_as_asked(config: AdversarialConfig, expected: list[int]) -> None:
    assert [config.epsilon_in(epoch) for epoch in range(1, 7)] == expected


def test_attacked_features_are_those_of_images_within_epsilon() -> None:
    """With everything left clean they are the trunk's of the images themselves; attacked they differ, and hurt."""
    images = draw_images(0, 24)
    network = new_vision_net(TINY_CONFIG)
    still = ViewConfig(mirror=False, shift=0, zoom=0, turn_deg=0, light=0)
    batches = GestureBatches(network, 1, images, 24, still, seed=0)
    (clean,) = batches.attacked(1, 5, clean_share=1.0)
    (moved,) = batches.attacked(1, 5, clean_share=0.0)
    order = np.random.default_rng((0, 1)).permutation(24)
    with torch.inference_mode():
        expected = network.trunk(as_batch(images.images_u8[order]), 1)
        losses = [
            torch.nn.functional.cross_entropy(network.tail(batch.features, 1), batch.labels) for batch in (clean, moved)
        ]
    torch.testing.assert_close(clean.features, expected)
    assert losses[1] > losses[0]


def test_kept_features_are_the_trunks_in_half_precision() -> None:
    images, network = draw_images(0, 24), new_vision_net(TINY_CONFIG)
    batches = GestureBatches(network, 2, images, 24, ViewConfig(kept=1), seed=0)
    (batch,) = batches.plain(3)
    order = np.random.default_rng((0, 3)).permutation(24)
    torch.testing.assert_close(batch.features, trunk_features(network, 2, images.images_u8[order]).float())
    assert batch.labels.tolist() == images.labels[order].tolist()


def test_views_vary_within_bounds_and_mirror_at_the_middle() -> None:
    image = np.random.default_rng(0).integers(0, 256, (24, 32, 3)).astype(np.uint8)
    still = ViewConfig(shift=0, zoom=0, turn_deg=0, light=0)
    seen = {varied(image, still, np.random.default_rng(seed)).tobytes() for seed in range(20)}
    assert seen == {image.tobytes(), np.ascontiguousarray(image[:, ::-1]).tobytes()}
    lit = varied(image, still.model_copy(update={"mirror": False, "light": 0.2}), np.random.default_rng(3))
    assert 0 < np.abs(lit.astype(int) - image).max() <= 0.2 * 128 * 2 + 1


def test_views_turn_hues_and_keep_what_is_bright() -> None:
    image = np.zeros((8, 8, 3), np.uint8)
    image[:, :4] = (200, 40, 40)
    image[:, 4:] = 90
    still = ViewConfig(mirror=False, shift=0.0, zoom=0.0, turn_deg=0.0, light=0.0, hue_deg=180.0)
    seen = [varied(image, still, np.random.default_rng(seed)) for seed in range(40)]

    assert len({view[0, 0].tobytes() for view in seen}) > 20
    assert {tuple(sorted((int(view[0, 0].max()), int(view[0, 0].min())))) for view in seen} == {(40, 200)}
    assert all((view[:, 4:] == 90).all() for view in seen)
    faded = still.model_copy(update={"hue_deg": 0.0, "saturation": 1.0})
    spans = [int(np.ptp(varied(image, faded, np.random.default_rng(seed))[0, 0])) for seed in range(40)]
    assert min(spans) < 40
    assert max(spans) > 170


def test_recipes_keep_each_backbones_own_statistics() -> None:
    lite, resnet = vision_recipe("lite0", 0), vision_recipe("resnet50", 2)
    assert lite.preprocess.mean == (127.0, 127.0, 127.0)
    assert resnet.preprocess.mean == (123.675, 116.28, 103.53)
    assert (resnet.epochs, resnet.adversarial.epsilon, resnet.adversarial.plain_epochs) == (9, 2, 5)
    assert vision_recipe("lite0", 1, epochs=1).adversarial.plain_epochs == 0
    with pytest.raises(UsageError, match="choose lite0 or resnet50"):
        vision_recipe("vgg", 0)
