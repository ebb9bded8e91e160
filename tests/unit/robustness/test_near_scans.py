"""Objects pasted into scans, and the search around them."""

import numpy as np
import pytest
import torch
from pydantic import ValidationError
from torch import Tensor, nn

from sdt_tools.models.card import ModelCard
from sdt_tools.models.follow_net import FollowNet, FollowNetConfig
from sdt_tools.models.loaded import LoadedModel
from sdt_tools.models.preprocess import PreprocessConfig
from sdt_tools.robustness.attacks import AttackConfig
from sdt_tools.robustness.near_scans import NearScanConfig, attack_near_scans, near_scan_boxes

SCANS_M = np.full((4, 541), 2.0)
FEW = AttackConfig(restarts=2, steps=20)


class ForwardIfFar(FollowNet):
    """Forward when ray 0, well outside any object, reads more than ``limit_m``."""

    def __init__(self, limit_m: float) -> None:
        nn.Module.__init__(self)
        self.preprocess = PreprocessConfig()
        self.layers = nn.Sequential()
        self.limit = nn.Parameter(torch.tensor(limit_m))

    def forward(self, ranges_m: Tensor) -> Tensor:
        forward = ranges_m[:, 0] - self.limit
        return torch.stack([torch.zeros_like(forward), forward, *[forward - 100] * 5], dim=1)


def model(limit_m: float) -> LoadedModel:
    card = ModelCard(kind=FollowNet.kind, seed=0, architecture=FollowNetConfig(), preprocess=PreprocessConfig())
    return LoadedModel("far", ForwardIfFar(limit_m).eval(), card)


def test_boxes_leave_the_object_where_it_is() -> None:
    near = NearScanConfig(centre_ray=270, width=20, object_m=0.1, radius_m=0.3)
    pasted = SCANS_M.copy()
    pasted[:, 260:280] = 0.1
    boxes = near_scan_boxes(pasted, near)
    assert (boxes.upper_m[:, 260:280] <= 0.11 + 1e-12).all()
    assert boxes.lower_m[0, 0] == pytest.approx(1.7)
    assert boxes.upper_m[0, 540] == pytest.approx(2.3)


@pytest.mark.parametrize(("limit_m", "before", "after"), [(1.9, 4, 4), (2.05, 0, 4), (2.2, 0, 0)])
def test_a_network_is_flipped_where_the_radius_reaches(limit_m: float, before: int, after: int) -> None:
    found = attack_near_scans(model(limit_m), SCANS_M, NearScanConfig(radius_m=0.1), FEW)
    assert (found.forward_before, found.forward_after) == (before, after)
    assert np.abs(found.attacked.scans_m - found.pasted_m).max() <= 0.1 + 1e-9


def test_an_object_beside_the_scan_is_refused() -> None:
    with pytest.raises(ValidationError, match="not on the scan"):
        NearScanConfig(centre_ray=3, width=20)
