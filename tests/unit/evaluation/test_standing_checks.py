"""Each check against a network made to fail it."""

import numpy as np
import pytest
import torch
from torch import Tensor, nn

from sdt_tools.dataset.load import FrameSet
from sdt_tools.evaluation.standing_checks import standing_checks, with_object
from sdt_tools.frames import MotionClass
from sdt_tools.models.card import ModelCard
from sdt_tools.models.follow_net import FollowNet, FollowNetConfig
from sdt_tools.models.loaded import LoadedModel
from sdt_tools.models.preprocess import PreprocessConfig

FORWARD, STAY, LEFT = MotionClass.FORWARD, MotionClass.STAY, MotionClass.LEFT_FORWARD


class Rule(FollowNet):
    """Answers ``yes`` where a rule of the scan holds, else ``no``."""

    def __init__(self, rule, yes: MotionClass = FORWARD, no: MotionClass = STAY) -> None:
        nn.Module.__init__(self)
        self.preprocess = PreprocessConfig()
        self.layers = nn.Sequential()
        self._rule, self._yes, self._no = rule, yes, no

    def forward(self, ranges_m: Tensor) -> Tensor:
        answers = torch.where(self._rule(ranges_m), int(self._yes), int(self._no))
        return nn.functional.one_hot(answers, 7).float()


def checked(rule, **answers: MotionClass) -> dict:
    card = ModelCard(kind=FollowNet.kind, seed=0, architecture=FollowNetConfig(), preprocess=PreprocessConfig())
    report = standing_checks(LoadedModel("rule", Rule(rule, **answers).eval(), card), frames())
    return {name: rate.share for name, rate in report.rates.items()} | {"clip_loss": report.clip_loss()}


def frames() -> FrameSet:
    """Twelve scans, forward and stay in turns, six metres wide; the front of the last forward one is not clear."""
    rng = np.random.default_rng(0)
    ranges_m = 6.0 + rng.uniform(-0.5, 0.5, (12, 541))
    ranges_m[10, 200] = 0.4
    labels = np.array([int(FORWARD), int(STAY)] * 6)
    return FrameSet(
        ranges_m=ranges_m,
        labels=labels,
        stamps_ns=np.arange(12),
        recordings=("drawn",) * 12,
        recording_ids=("id",) * 12,
    )


def everything(ranges_m: Tensor) -> Tensor:
    return torch.ones(len(ranges_m), dtype=torch.bool)


def test_who_always_drives_drives_into_pasted_objects() -> None:
    rates = checked(everything)
    assert rates["forward_recall"] == 1.0
    assert rates["accuracy"] == 0.5
    assert {rates[f"pasted_forward_{width}"] for width in (1, 3, 20)} == {1.0}


def test_who_stops_for_any_near_front_ray_passes() -> None:
    rates = checked(lambda scans: scans[:, 150:390].amin(dim=1) > 0.25)
    assert rates["pasted_forward"] == 0.0
    assert rates["clear_forward"] == 1.0


def test_who_sees_wide_objects_alone_is_told_apart() -> None:
    rates = checked(lambda scans: scans[:, 150:390].median(dim=1).values > 1.0)
    assert rates["pasted_forward_1"] == 1.0
    rates = checked(lambda scans: (scans[:, 150:390] < 0.25).sum(dim=1) < 5)
    assert (rates["pasted_forward_3"], rates["pasted_forward_20"]) == (1.0, 0.0)


def test_who_drives_only_with_something_far_in_sight_loses_all_when_ranges_are_clipped() -> None:
    assert checked(lambda scans: scans.amax(dim=1) > 4.5)["clip_loss"] == 1.0
    assert checked(everything)["clip_loss"] == 0.0


def test_who_never_drives_has_no_forward_recall() -> None:
    assert checked(lambda scans: ~everything(scans))["forward_recall"] == 0.0


def test_who_always_turns_left_is_not_mirror_consistent() -> None:
    assert checked(everything, yes=LEFT)["mirror_consistent"] == 0.0
    assert checked(everything)["mirror_consistent"] == 1.0


def test_codes_are_resolved_before_the_network_sees_them() -> None:
    rates = checked(lambda scans: scans.amin(dim=1) > 0.1)
    assert [rates[f"codes_{share}%_flipped"] for share in (1, 5, 11, 25)] == [0.0] * 4
    assert rates["dropout_flipped"] == 0.0


def test_pasting_leaves_the_scans_as_they_were() -> None:
    scans = np.full((2, 541), 3.0)
    pasted = with_object(scans, 260, 20)
    assert (pasted == 0.10).sum() == 40
    assert pasted[0, 260] == pytest.approx(0.10)
    assert (scans == 3.0).all()
