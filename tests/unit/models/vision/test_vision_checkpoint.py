"""Vision networks on disk, and how they answer from there."""

from pathlib import Path

import numpy as np
import pytest
import torch
from vision_samples import SMALL, SMALL_RESNET, jpeg, noise, save_small, small_network

from sdt_tools.errors import CheckpointError, RecordingError, RunError
from sdt_tools.frames import Gesture
from sdt_tools.models.card import ModelCard, VisionCard
from sdt_tools.models.checkpoint import load_checkpoint, save_checkpoint
from sdt_tools.models.follow_net import FollowNet, FollowNetConfig, new_follow_net
from sdt_tools.models.preprocess import PreprocessConfig
from sdt_tools.models.vision import loaded as loaded_module
from sdt_tools.models.vision.checkpoint import load_vision_checkpoint
from sdt_tools.models.vision.loaded import ready_to_answer, torch_logits


@pytest.mark.parametrize("architecture", [SMALL, SMALL_RESNET])
def test_onnx_runtime_answers_as_torch_does(architecture, tmp_path: Path) -> None:
    network = small_network(architecture)
    model = load_vision_checkpoint(save_small(tmp_path / "vision", network))
    images_u8 = noise(11)
    np.testing.assert_allclose(model.predict_logits(images_u8), torch_logits(network, images_u8), rtol=1e-3, atol=1e-3)
    with torch.inference_mode():
        images = torch.from_numpy(images_u8).permute(0, 3, 1, 2).float()
        expected = network.embed(network.trunk(images, 0), 0)
    np.testing.assert_allclose(model.predict_features(images_u8), expected, rtol=1e-3, atol=1e-3)


def test_a_graph_that_answers_otherwise_is_not_used(monkeypatch: pytest.MonkeyPatch) -> None:
    network, other = small_network(seed=1), small_network(seed=2)
    build = loaded_module.vision_onnx
    monkeypatch.setattr(loaded_module, "vision_onnx", lambda _: build(other))
    card = VisionCard(kind="vision", seed=1, architecture=SMALL, preprocess=network.preprocess)
    with pytest.raises(RunError, match="ONNX Runtime and torch differ by"):
        ready_to_answer("wrong", network, card)


def test_the_order_of_colours_is_red_green_blue(tmp_path: Path) -> None:
    """A network that sees red alone, in the first channel, finds it in the camera's last."""
    network = small_network()
    model = load_vision_checkpoint(save_small(tmp_path / "vision", network))
    red_bgr = np.zeros((48, 64, 3), np.uint8)
    red_bgr[:, :, 2] = 255
    assert model.pixels(red_bgr)[0, 0].tolist() == [255, 0, 0]
    as_rgb = np.tile(np.array([255, 0, 0], np.uint8), (1, 24, 32, 1))
    np.testing.assert_array_equal(model.predict_logits(model.pixels(red_bgr)[None]), model.predict_logits(as_rgb))
    swapped = model.predict_logits(as_rgb[:, :, :, ::-1])
    assert not np.allclose(swapped, model.predict_logits(as_rgb), atol=1e-2)


def test_a_jpeg_is_decided_as_its_pixels_are(tmp_path: Path) -> None:
    model = load_vision_checkpoint(save_small(tmp_path / "vision", small_network()))
    data = jpeg(noise(1, 48, 64)[0])
    assert model.decide(data) == Gesture(int(model.read(data).argmax()))


@pytest.mark.parametrize("shape", [(48, 64), (48, 64, 1), (7, 300, 3), (1, 1, 3), (480, 640, 3)])
def test_grey_and_oddly_sized_pictures_are_seen(shape: tuple[int, ...], tmp_path: Path) -> None:
    model = load_vision_checkpoint(save_small(tmp_path / "vision", small_network()))
    picture = np.random.default_rng(0).integers(0, 256, shape).astype(np.uint8)
    assert model.pixels(picture).shape == (24, 32, 3)
    assert model.read(jpeg(picture)).shape == (3,)


def test_grey_has_three_equal_colours(tmp_path: Path) -> None:
    model = load_vision_checkpoint(save_small(tmp_path / "vision", small_network()))
    pixels = model.pixels(noise(1, 48, 64)[0, :, :, 0])
    assert (pixels == pixels[:, :, :1]).all()


@pytest.mark.parametrize(
    ("spoil", "said"),
    [
        (lambda data: data[: len(data) // 2], "damaged: Premature end"),
        (lambda data: data[:700] + bytes(range(1, 61)) + data[760:], "damaged: Corrupt JPEG data"),
        (lambda _: b"", "of 0 bytes"),
        (lambda _: b"no picture", "cannot be decoded"),
    ],
)
def test_corrupt_pictures_are_refused(spoil, said: str, tmp_path: Path) -> None:
    model = load_vision_checkpoint(save_small(tmp_path / "vision", small_network()))
    with pytest.raises(RecordingError, match=said):
        model.read(spoil(jpeg(noise(1)[0])))


def test_pictures_of_other_channels_are_refused(tmp_path: Path) -> None:
    model = load_vision_checkpoint(save_small(tmp_path / "vision", small_network()))
    with pytest.raises(RecordingError, match="shape"):
        model.pixels(np.zeros((4, 4, 4), np.uint8))


def test_each_kind_of_network_is_refused_where_the_other_is_needed(tmp_path: Path) -> None:
    vision = save_small(tmp_path / "vision", small_network())
    network = new_follow_net(FollowNetConfig(), PreprocessConfig(), seed=0)
    card = ModelCard(kind=FollowNet.kind, seed=0, architecture=network.architecture, preprocess=network.preprocess)
    save_checkpoint(tmp_path / "follow", network, card)
    with pytest.raises(CheckpointError, match="a follow network, which answers scans, is needed here"):
        load_checkpoint(vision)
    with pytest.raises(CheckpointError, match="a vision network, which answers images, is needed here"):
        load_vision_checkpoint(tmp_path / "follow")


def test_weights_of_another_shape_are_refused(tmp_path: Path) -> None:
    folder = save_small(tmp_path / "vision", small_network())
    card = (folder / "model.toml").read_text()
    (folder / "model.toml").write_text(card.replace("head = 24", "head = 25"))
    with pytest.raises(CheckpointError, match=r"'head.conv.weight' is float32 \[24, 12, 1, 1\], but .* \[25, 12"):
        load_vision_checkpoint(folder)
