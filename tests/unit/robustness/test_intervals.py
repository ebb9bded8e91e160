import itertools

import numpy as np
import pytest
import torch
from torch import nn

from sdt_tools.errors import CheckpointError
from sdt_tools.frames import MotionClass
from sdt_tools.models.follow_net import FollowNet, FollowNetConfig, new_follow_net
from sdt_tools.models.preprocess import ClipScale, PreprocessConfig
from sdt_tools.robustness.domains import NOT_FORWARD, SafetyLevel, domains
from sdt_tools.robustness.intervals import (
    certified,
    difference_bounds,
    domain_differences,
    worst_case_loss,
    worst_margins,
)

KEPT, FORBIDDEN = [0, 4, 5, 6], [1, 2, 3]


@pytest.fixture
def follow_net() -> FollowNet:
    return new_follow_net(FollowNetConfig(), PreprocessConfig(), seed=3).eval()


def tiny_convolutional(seed: int) -> nn.Sequential:
    """Four rays in metres, every kind of layer that the follow network has."""
    torch.manual_seed(seed)
    return nn.Sequential(
        ClipScale(4.0),
        nn.Unflatten(1, (1, 4)),
        nn.Conv1d(1, 3, 3, 2, padding=1),
        nn.ReLU(),
        nn.Flatten(),
        nn.Dropout(0.5),
        nn.Linear(6, 5),
        nn.ReLU(),
        nn.Dropout(0.5),
        nn.Linear(5, 7),
    ).double()


def differences_of(logits: torch.Tensor) -> torch.Tensor:
    return logits[:, KEPT].unsqueeze(2) - logits[:, FORBIDDEN].unsqueeze(1)


def test_bounds_of_one_linear_layer_are_its_minima_over_the_box() -> None:
    """A linear function is least at the corner that its signs choose."""
    torch.manual_seed(0)
    layer = nn.Linear(5, 7).double()
    lower, upper = torch.rand(3, 5).double(), torch.rand(3, 5).double() + 1.0
    found = difference_bounds(nn.Sequential(layer), lower, upper, NOT_FORWARD)
    weight, bias = layer.weight.detach().numpy(), layer.bias.detach().numpy()
    for box, (i, kept), (j, wrong) in itertools.product(range(3), enumerate(KEPT), enumerate(FORBIDDEN)):
        slope = weight[kept] - weight[wrong]
        corner = np.where(slope > 0, lower[box].numpy(), upper[box].numpy())
        assert found[box, i, j].item() == pytest.approx(slope @ corner + bias[kept] - bias[wrong], abs=1e-12)


def test_the_elided_last_layer_is_tighter_than_bounds_of_each_logit() -> None:
    """Two logits that are the same function never differ, however wide the box."""
    layer = nn.Linear(2, 7).double()
    with torch.no_grad():
        layer.weight[:] = torch.tensor([3.0, -2.0])
        layer.bias.zero_()
    found = difference_bounds(
        nn.Sequential(layer), torch.zeros(1, 2).double(), torch.full((1, 2), 20.0).double(), NOT_FORWARD
    )
    assert torch.equal(found, torch.zeros(1, 4, 3).double())


def test_two_layers_by_hand() -> None:
    """z_0 = relu(x - y) and all others 0, with x in [0, 3] and y in [1, 2]: z_0 - z_1 ≥ 0; negated, ≥ -2."""
    hidden, last = nn.Linear(2, 1), nn.Linear(1, 7)
    with torch.no_grad():
        hidden.weight[:] = torch.tensor([[1.0, -1.0]])
        for parameter in (hidden.bias, last.weight, last.bias):
            parameter.zero_()
        last.weight[0] = 1.0
    lower, upper = torch.tensor([[0.0, 1.0]]), torch.tensor([[3.0, 2.0]])
    layers = nn.Sequential(hidden, nn.ReLU(), last)
    assert difference_bounds(layers, lower, upper, NOT_FORWARD)[0, 0].tolist() == [0.0, 0.0, 0.0]
    with torch.no_grad():
        last.weight[0] = -1.0
    assert difference_bounds(layers, lower, upper, NOT_FORWARD)[0, 0].tolist() == [-2.0, -2.0, -2.0]


@pytest.mark.parametrize("seed", range(10))
def test_no_point_of_a_fine_grid_falls_below_the_bounds(seed: int) -> None:
    layers = tiny_convolutional(seed).eval()
    lower, upper = torch.tensor([[0.0, 0.5, 1.0, 3.5]]).double(), torch.tensor([[0.2, 3.0, 1.5, 6.0]]).double()
    shares = torch.cartesian_prod(*[torch.linspace(0.0, 1.0, 9).double()] * 4)
    grid = lower + shares * (upper - lower)
    least = differences_of(layers(grid)).amin(dim=0)
    bound = difference_bounds(layers, lower, upper, NOT_FORWARD)[0]
    assert (least >= bound - 1e-12).all()


@pytest.mark.parametrize("seed", range(5))
def test_where_no_relu_bends_the_worst_corner_reaches_the_bound_of_one_hidden_layer(seed: int) -> None:
    """Hidden units that each read one ray, and are always positive: bounds are exact."""
    torch.manual_seed(seed)
    hidden, last = nn.Linear(4, 4).double(), nn.Linear(4, 7).double()
    with torch.no_grad():
        hidden.weight[:] = torch.diag(torch.rand(4) + 0.5)
        hidden.bias.fill_(0.1)
    layers = nn.Sequential(hidden, nn.ReLU(), last)
    lower, upper = torch.zeros(1, 4).double(), torch.rand(1, 4).double() + 0.5
    corners = torch.cartesian_prod(*[torch.stack([lower[0, ray], upper[0, ray]]) for ray in range(4)])
    least = differences_of(layers(corners)).amin(dim=0)
    torch.testing.assert_close(difference_bounds(layers, lower, upper, NOT_FORWARD)[0], least, rtol=0, atol=1e-12)


@pytest.mark.parametrize("dtype", [torch.float32, torch.float64])
def test_a_box_of_one_scan_gives_the_network_s_own_differences(follow_net: FollowNet, dtype: torch.dtype) -> None:
    network = follow_net.to(dtype)
    scans = torch.rand(6, 541, generator=torch.Generator().manual_seed(0)).to(dtype) * 20
    tolerance = 1e-5 if dtype == torch.float32 else 1e-13
    torch.testing.assert_close(
        difference_bounds(network.layers, scans, scans, NOT_FORWARD),
        differences_of(network(scans)),
        rtol=0,
        atol=tolerance,
    )


def test_float32_agrees_with_float64(follow_net: FollowNet) -> None:
    boxes = domains(SafetyLevel.THREE)
    lower, upper = torch.tensor(boxes.lower_m).float(), torch.tensor(boxes.upper_m).float()
    single = difference_bounds(follow_net.layers, lower, upper, NOT_FORWARD).detach().numpy()
    double = domain_differences(follow_net, boxes)
    np.testing.assert_allclose(single, double, rtol=1e-4, atol=1e-4)
    assert not np.array_equal(single, double)


def test_bounding_in_float64_leaves_the_network_as_it_is(follow_net: FollowNet) -> None:
    domain_differences(follow_net, domains(SafetyLevel.ONE))
    assert {parameter.dtype for parameter in follow_net.parameters()} == {torch.float32}


def test_no_domains_no_differences(follow_net: FollowNet) -> None:
    assert domain_differences(follow_net, domains(SafetyLevel.NONE)).shape == (0, 4, 3)


def test_a_network_that_clips_at_4_m_has_the_same_bounds_at_levels_3_and_4(follow_net: FollowNet) -> None:
    three, four = (domain_differences(follow_net, domains(level)) for level in (SafetyLevel.THREE, SafetyLevel.FOUR))
    np.testing.assert_array_equal(three, four)


def test_stricter_levels_have_looser_bounds(follow_net: FollowNet) -> None:
    """Each domain contains the one of the level before, and intervals are monotone."""
    one, two, three = (domain_differences(follow_net, domains(SafetyLevel(level))) for level in (1, 2, 3))
    assert (two <= one + 1e-9).all()
    assert (three <= two + 1e-9).all()


def test_dropout_does_not_blur_the_bounds_of_a_network_in_training() -> None:
    layers = tiny_convolutional(0)
    lower, upper = torch.zeros(1, 4).double(), torch.ones(1, 4).double()
    training = difference_bounds(layers.train(), lower, upper, NOT_FORWARD)
    assert torch.equal(training, difference_bounds(layers.eval(), lower, upper, NOT_FORWARD))


def test_the_loss_of_one_scan_is_the_negative_log_of_its_allowed_mass() -> None:
    logits = torch.randn(5, 7, generator=torch.Generator().manual_seed(0)).double() * 3
    expected = -torch.log_softmax(logits, dim=1)[:, KEPT].logsumexp(dim=1)
    torch.testing.assert_close(worst_case_loss(differences_of(logits)), expected, rtol=0, atol=1e-12)


@pytest.mark.parametrize("size", [-1e6, -40.0, 0.0, 40.0, 1e6])
def test_loss_and_gradient_are_finite_at_any_size(size: float) -> None:
    differences = torch.full((1, 4, 3), size, requires_grad=True)
    loss = worst_case_loss(differences)
    (slope,) = torch.autograd.grad(loss.sum(), differences)
    assert torch.isfinite(loss).all()
    assert torch.isfinite(slope).all()
    assert (slope <= 0.0).all()
    if size <= -40.0:
        assert loss.item() == pytest.approx(-size + np.log(3 / 4), rel=1e-5)


def test_gradients_reach_every_weight_and_are_those_of_finite_differences() -> None:
    layers = tiny_convolutional(1).eval()
    lower, upper = torch.zeros(2, 4).double(), torch.rand(2, 4).double() * 3

    def loss() -> torch.Tensor:
        return worst_case_loss(difference_bounds(layers, lower, upper, NOT_FORWARD)).sum()

    loss().backward()
    for parameter in layers.parameters():
        assert parameter.grad is not None
        assert parameter.grad.abs().sum() > 0
        with torch.no_grad():
            parameter.view(-1)[0] += 1e-6
            above = loss()
            parameter.view(-1)[0] -= 2e-6
            below = loss()
            parameter.view(-1)[0] += 1e-6
        assert parameter.grad.view(-1)[0].item() == pytest.approx(((above - below) / 2e-6).item(), abs=1e-5)


def test_descending_the_loss_certifies_a_small_network() -> None:
    layers = tiny_convolutional(2).eval()
    lower, upper = torch.zeros(1, 4).double(), torch.tensor([[0.2, 4.0, 4.0, 4.0]]).double()
    with torch.no_grad():
        layers[-1].bias[FORBIDDEN] += 2.0
    optimizer = torch.optim.Adam(layers.parameters(), lr=0.05)
    assert not certified(difference_bounds(layers, lower, upper, NOT_FORWARD)).any()
    for _ in range(200):
        optimizer.zero_grad()
        worst_case_loss(difference_bounds(layers, lower, upper, NOT_FORWARD)).sum().backward()
        optimizer.step()
    assert certified(difference_bounds(layers, lower, upper, NOT_FORWARD)).all()


def test_each_forbidden_class_has_to_be_beaten_by_some_allowed_one() -> None:
    each_by_another = torch.full((1, 4, 3), -5.0)
    each_by_another[0, [0, 1, 3], [0, 1, 2]] = torch.tensor([2.0, 0.25, 1.0])
    all_by_one = torch.full((1, 4, 3), -5.0)
    all_by_one[0, 2] = 0.5
    one_by_none = torch.full((1, 4, 3), 5.0)
    one_by_none[0, :, 1] = -1.0
    differences = torch.cat([each_by_another, all_by_one, one_by_none])
    assert certified(differences).tolist() == [True, True, False]
    assert worst_margins(differences).tolist() == [0.25, 0.5, -1.0]


def test_a_domain_in_which_different_allowed_classes_win_is_certified_and_keeps_its_promise() -> None:
    """One allowed logit falls along the ray, another rises, and a forbidden one runs below each of the two."""
    layers = nn.Sequential(nn.Linear(1, 7)).double()
    with torch.no_grad():
        layers[0].weight[:] = 0.0
        layers[0].bias[:] = -3.0
        layers[0].weight[0], layers[0].bias[0] = -1.0, -1.5
        layers[0].weight[4], layers[0].bias[4] = 1.0, -1.5
        layers[0].weight[FORBIDDEN[0]] = -1.0
        layers[0].weight[FORBIDDEN[1]] = 1.0
    lower, upper = torch.tensor([[-1.0]]).double(), torch.tensor([[1.0]]).double()
    bound = difference_bounds(layers, lower, upper, NOT_FORWARD)
    assert certified(bound).all()
    assert (bound.amin(dim=2) < 0.0).all()
    answers = layers(torch.linspace(-1.0, 1.0, 201).double()[:, None]).argmax(dim=1)
    assert not set(answers.tolist()) & set(FORBIDDEN)


def test_winning_by_the_margin_is_not_enough_and_nan_never_is() -> None:
    differences = torch.tensor([0.5, 0.5001, float("nan")]).double().reshape(3, 1, 1).expand(3, 4, 3)
    assert certified(differences, margin=0.5).tolist() == [False, True, False]


@pytest.mark.parametrize(
    ("layers", "message"),
    [
        (nn.Sequential(nn.Linear(4, 4), nn.Tanh(), nn.Linear(4, 7)), "layer '1' is a Tanh, through which no bounds"),
        (nn.Sequential(nn.BatchNorm1d(4), nn.Linear(4, 7)), "BatchNorm1d"),
        (nn.Sequential(nn.Linear(4, 7), nn.ReLU()), "the last layer, '1', must be a Linear to 7 logits"),
        (nn.Sequential(nn.Linear(4, 3)), "must be a Linear to 7 logits"),
        (nn.Sequential(), "no layers"),
        (
            nn.Sequential(
                nn.Unflatten(1, (1, 4)),
                nn.Conv1d(1, 1, 3, padding=1, padding_mode="circular"),
                nn.Flatten(),
                nn.Linear(4, 7),
            ),
            "pads with 'circular'",
        ),
    ],
)
def test_layers_that_bounds_cannot_pass_are_named(layers: nn.Sequential, message: str) -> None:
    with pytest.raises(CheckpointError, match=message):
        difference_bounds(layers, torch.zeros(1, 4), torch.ones(1, 4), NOT_FORWARD)


def test_any_set_of_classes_can_be_allowed() -> None:
    layer = nn.Linear(2, 7).double()
    scans = torch.rand(1, 2).double()
    found = difference_bounds(nn.Sequential(layer), scans, scans, frozenset({MotionClass.LEFT_FORWARD}))
    logits = layer(scans)[0]
    expected = logits[2] - logits[[0, 1, 3, 4, 5, 6]]
    torch.testing.assert_close(found[0, 0], expected, rtol=0, atol=1e-12)
