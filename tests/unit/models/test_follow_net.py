import numpy as np
import pytest
import torch
from pydantic import ValidationError
from torch import nn

from sdt_tools.models.follow_net import FollowNet, FollowNetConfig, new_follow_net
from sdt_tools.models.preprocess import PreprocessConfig


def weights(network: FollowNet) -> list[nn.Conv1d | nn.Linear]:
    return [layer for layer in network.layers if isinstance(layer, nn.Conv1d | nn.Linear)]


def test_the_paper_s_network_has_nine_layers_with_weights() -> None:
    layers = weights(new_follow_net(FollowNetConfig(), PreprocessConfig(), seed=0))
    assert [type(layer).__name__ for layer in layers] == ["Conv1d"] * 7 + ["Linear"] * 2
    assert sum(layer.stride == (2,) for layer in layers[:7]) == 6


def test_541_ranges_become_7_logits() -> None:
    network = new_follow_net(FollowNetConfig(), PreprocessConfig(), seed=0).eval()
    assert network(torch.rand(3, 541) * 20).shape == (3, 7)


def test_the_seed_alone_decides_the_first_weights() -> None:
    torch.manual_seed(1)
    first = new_follow_net(FollowNetConfig(), PreprocessConfig(), seed=5).state_dict()
    torch.manual_seed(2)
    again = new_follow_net(FollowNetConfig(), PreprocessConfig(), seed=5).state_dict()
    other = new_follow_net(FollowNetConfig(), PreprocessConfig(), seed=6).state_dict()
    assert all(torch.equal(first[name], again[name]) for name in first)
    assert not torch.equal(first["layers.conv1.weight"], other["layers.conv1.weight"])


def test_making_a_network_leaves_the_global_random_numbers_alone() -> None:
    torch.manual_seed(0)
    expected = torch.rand(1)
    torch.manual_seed(0)
    new_follow_net(FollowNetConfig(), PreprocessConfig(), seed=5)
    assert torch.equal(torch.rand(1), expected)


def test_the_answer_is_that_of_its_layers_one_by_one() -> None:
    """An independent forward pass in numpy, from the weights alone."""
    network = new_follow_net(FollowNetConfig(), PreprocessConfig(clip_m=3.0), seed=1).double().eval()
    ranges_m = np.random.default_rng(0).uniform(0.0, 20.0, 541)
    signal = (np.minimum(ranges_m, 3.0) / 1.5 - 1.0)[None]
    *convolutions, full1, full2 = weights(network)
    for layer in convolutions:
        weight, bias = layer.weight.detach().numpy(), layer.bias.detach().numpy()
        half, stride = weight.shape[2] // 2, layer.stride[0]
        padded = np.pad(signal, ((0, 0), (half, half)))
        windows = np.lib.stride_tricks.sliding_window_view(padded, weight.shape[2], axis=1)[:, ::stride]
        signal = np.maximum(np.einsum("ock,clk->ol", weight, windows) + bias[:, None], 0.0)
    hidden = np.maximum(full1.weight.detach().numpy() @ signal.ravel() + full1.bias.detach().numpy(), 0.0)
    expected = full2.weight.detach().numpy() @ hidden + full2.bias.detach().numpy()
    np.testing.assert_allclose(network(torch.from_numpy(ranges_m[None])).detach().numpy()[0], expected, atol=1e-10)


def test_ranges_beyond_the_clip_change_nothing() -> None:
    network = new_follow_net(FollowNetConfig(), PreprocessConfig(clip_m=4.0), seed=0).eval()
    scan = torch.rand(1, 541) * 20
    assert torch.equal(network(scan), network(scan.clamp(max=4.0)))


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"kernels": (7, 5)}, "one entry a convolution each"),
        ({"kernels": (7, 5, 5, 3, 3, 3, 4)}, "odd"),
        ({"strides": (2, 2, 2, 2, 2, 2, 0)}, "positive"),
        ({"dropout": 1.0}, "less than 1"),
    ],
)
def test_impossible_shapes_are_refused(values: dict[str, object], message: str) -> None:
    with pytest.raises(ValidationError, match=message):
        FollowNetConfig.model_validate(values)
