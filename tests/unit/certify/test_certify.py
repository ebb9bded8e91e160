from collections.abc import Callable
from copy import deepcopy
from dataclasses import replace

import numpy as np
import pytest
import torch

from sdt_tools.certify import certify as room
from sdt_tools.certify.certify import certify
from sdt_tools.certify.judges import representable
from sdt_tools.certify.verdicts import CertifyConfig, Verdict
from sdt_tools.errors import CheckpointError, UsageError
from sdt_tools.frames import MotionClass
from sdt_tools.models.card import ModelCard
from sdt_tools.models.gated_net import GateConfig, GatedNetConfig, new_gated_net
from sdt_tools.models.loaded import LoadedModel
from sdt_tools.models.preprocess import PreprocessConfig
from sdt_tools.robustness.attacks import AttackConfig, AttackResult
from sdt_tools.robustness.boxes import DomainSet
from sdt_tools.robustness.domains import SafetyLevel, domains

STAY, FORWARD, BACKWARD = MotionClass.STAY, MotionClass.FORWARD, MotionClass.BACKWARD
QUICK = CertifyConfig(attack=AttackConfig(restarts=2, steps=20))
Watching = Callable[..., LoadedModel]


def test_a_domain_whose_near_ray_is_watched_is_certified_and_the_others_are_violated(
    careful: LoadedModel, boxes: DomainSet
) -> None:
    """Near ray 270 is worth 9.5 logits at least, of which forward has 2; where that ray is free, forward wins by 2."""
    beside, ahead, other = certify(careful, [boxes], QUICK).verdicts
    assert (beside.verdict, ahead.verdict, other.verdict) == (Verdict.VIOLATED, Verdict.CERTIFIED, Verdict.VIOLATED)
    assert ahead.margin == pytest.approx(7.5)
    assert ahead.winner is STAY
    assert (ahead.method, ahead.restarts, ahead.violation, ahead.scan_m) == ("ibp", 0, None, None)
    assert beside.margin == pytest.approx(-2.0)
    assert beside.violation == pytest.approx(2.0)
    assert (beside.answer, beside.method, beside.restarts) == (FORWARD, "pgd", 2)


def test_a_counterexample_lies_in_its_domain_and_is_answered_with_a_forbidden_class(
    careful: LoadedModel, boxes: DomainSet
) -> None:
    beside = certify(careful, [boxes], QUICK).verdicts[0]
    scan_m = beside.scan_m
    assert scan_m is not None
    assert np.all((boxes.lower_m[0] <= scan_m) & (scan_m <= boxes.upper_m[0]))
    assert np.array_equal(scan_m, scan_m.astype(np.float32))
    assert careful.predict_logits(scan_m[None]).argmax() == FORWARD


def test_a_true_property_that_bounds_cannot_prove_is_unknown(watching: Watching, boxes: DomainSet) -> None:
    """Two equal neurons cancel; bounds, which take them for independent, lose 10 times their spread of 0.05."""
    network = watching({STAY: (10.0, -10.0, 1.25), FORWARD: (0.0, 0.0, 1.0)})
    ahead = certify(network, [boxes], QUICK).verdicts[1]
    assert ahead.verdict is Verdict.UNKNOWN
    assert ahead.margin == pytest.approx(-0.25)
    assert ahead.violation == pytest.approx(-0.25)
    assert (ahead.method, ahead.scan_m) == ("ibp+pgd", None)


def test_without_a_search_nothing_is_violated(careful: LoadedModel, boxes: DomainSet) -> None:
    found = certify(careful, [boxes], CertifyConfig(attack=None))
    assert found.counts == {Verdict.CERTIFIED: 1, Verdict.VIOLATED: 0, Verdict.UNKNOWN: 2, Verdict.ERROR: 0}
    assert found.min_margin == pytest.approx(-2.0)


@pytest.mark.parametrize(("wins_by", "verdict"), [(0.0009, Verdict.UNKNOWN), (0.0011, Verdict.CERTIFIED)])
def test_the_allowed_class_has_to_win_by_more_than_the_margin(
    watching: Watching, boxes: DomainSet, wins_by: float, verdict: Verdict
) -> None:
    network = watching({BACKWARD: (0.0, 0.0, wins_by)})
    assert [one.verdict for one in certify(network, [boxes], QUICK).verdicts] == [verdict] * 3


def test_a_network_that_loses_more_in_float32_needs_a_larger_margin(watching: Watching, boxes: DomainSet) -> None:
    """Stay beats forward by exactly 0.01, but of a million float32 keeps no hundredths: it has 0.06 between numbers."""
    million = 1e6
    found = certify(watching({STAY: (million, 0.0, 0.01), FORWARD: (million, 0.0, 0.0)}), [boxes], QUICK)
    assert found.numerical_error is not None
    assert found.numerical_error > 0.005
    assert found.required_margin == 2 * found.numerical_error
    assert found.verdicts[1].margin == pytest.approx(0.01, abs=1e-4)
    assert found.verdicts[1].verdict is Verdict.UNKNOWN


def test_a_violation_that_float32_does_not_see_is_none(watching: Watching, boxes: DomainSet) -> None:
    """Forward wins by a billionth of the nearness, in float64; in float32 that is a tie."""
    network = watching({STAY: (0.0, 0.0, 1.0), FORWARD: (1e-9, 0.0, 1.0)})
    ahead = certify(network, [boxes], QUICK).verdicts[1]
    assert ahead.violation is not None
    assert ahead.violation > 0
    assert ahead.verdict is Verdict.UNKNOWN


def test_nan_weights_make_errors_and_nothing_else(careful: LoadedModel, boxes: DomainSet) -> None:
    network = deepcopy(careful.network)
    with torch.no_grad():
        network.layers.full1.bias[0] = torch.nan
    found = certify(replace(careful, network=network), [boxes], QUICK)
    assert found.counts[Verdict.ERROR] == 3
    assert (found.numerical_error, found.required_margin, found.min_margin) == (None, None, None)
    assert all("not finite" in one.error for one in found.verdicts)


@pytest.mark.parametrize(("place", "value"), [("upper_m", np.nan), ("upper_m", -1.0), ("lower_m", 30.0)])
def test_a_domain_that_is_no_box_is_an_error_of_its_own(
    careful: LoadedModel, boxes: DomainSet, place: str, value: float
) -> None:
    bounds = getattr(boxes, place).copy()
    bounds[0, 7] = value
    beside, ahead, other = certify(careful, [replace(boxes, **{place: bounds})], QUICK).verdicts
    assert (beside.verdict, ahead.verdict, other.verdict) == (Verdict.ERROR, Verdict.CERTIFIED, Verdict.VIOLATED)
    assert "no box" in beside.error
    assert beside.margin is None


def test_a_set_that_allows_every_class_has_nothing_to_prove(careful: LoadedModel, boxes: DomainSet) -> None:
    allowing = replace(boxes, allowed=frozenset(MotionClass))
    assert [one.error for one in certify(careful, [allowing], QUICK).verdicts] == ["the domain allows every class"] * 3


def test_a_search_that_fails_in_one_domain_leaves_the_others_alone(
    careful: LoadedModel, boxes: DomainSet, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fragile(network: torch.nn.Module, part: DomainSet, config: AttackConfig) -> AttackResult:
        if 150 in part.rays:
            raise RuntimeError("out of luck")
        return real(network, part, config)

    real = room.attack
    monkeypatch.setattr(room, "attack", fragile)
    beside, ahead, other = certify(careful, [boxes], QUICK).verdicts
    assert (beside.verdict, ahead.verdict, other.verdict) == (Verdict.ERROR, Verdict.CERTIFIED, Verdict.VIOLATED)
    assert (beside.method, beside.error) == ("pgd", "RuntimeError: out of luck")
    assert beside.margin == pytest.approx(-2.0)


def test_bounds_that_fail_in_one_domain_leave_the_others_alone(
    careful: LoadedModel, boxes: DomainSet, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fragile(network: torch.nn.Module, part: DomainSet) -> np.ndarray:
        if 150 in part.rays:
            raise MemoryError("too wide")
        return real(network, part)

    real = room.domain_differences
    monkeypatch.setattr(room, "domain_differences", fragile)
    verdicts = certify(careful, [boxes], QUICK).verdicts
    assert [one.verdict for one in verdicts] == [Verdict.ERROR, Verdict.CERTIFIED, Verdict.VIOLATED]
    assert verdicts[0].error == "MemoryError: too wide"


def test_bounds_that_prove_what_is_false_are_found_out(
    careful: LoadedModel, boxes: DomainSet, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(room, "domain_differences", lambda _network, part: np.full((len(part), 4, 3), 5.0))
    believed = certify(careful, [boxes], QUICK)
    checked = certify(careful, [boxes], QUICK.model_copy(update={"attack_certified": True}))
    assert believed.counts[Verdict.CERTIFIED] == 3
    assert checked.counts[Verdict.ERROR] == 2
    assert checked.verdicts[0].error.startswith("SOUNDNESS BUG: bounds prove a margin of 5, but a scan")
    assert checked.verdicts[0].scan_m is not None


def test_searching_certified_domains_confirms_true_bounds(careful: LoadedModel, boxes: DomainSet) -> None:
    """The worst scan of the domain ahead has its ray at 0.2 m: the bound, 7.5, is met."""
    ahead = certify(careful, [boxes], QUICK.model_copy(update={"attack_certified": True})).verdicts[1]
    assert (ahead.verdict, ahead.restarts, ahead.answer) == (Verdict.CERTIFIED, 2, STAY)
    assert ahead.violation == pytest.approx(-7.5, abs=0.1)


def test_a_gate_that_outvotes_its_trunk_is_certified(boxes: DomainSet) -> None:
    """Below 0.2 m the gate gives stay at least 24 · (1 - 2 · 0.2 / 0.6) = 8 logits; the trunk has 4 · tanh(1/4)."""
    shape = GatedNetConfig(gate=GateConfig(widths=(1,), near_m=0.6, limit=4.0, first_ray=200))
    network = new_gated_net(shape, PreprocessConfig(), seed=0).eval()
    with torch.no_grad():
        for parameter in network.parameters():
            parameter.zero_()
        trunk, gate = network.layers.sum.parts()
        trunk.full2.bias[FORWARD] = 1.0
        gate.ray1.weight.fill_(-1.0)
        gate.vote.weight[STAY] = 24.0
    card = ModelCard(kind=network.kind, seed=0, architecture=shape, preprocess=network.preprocess)
    beside, ahead, other = certify(LoadedModel("gated", network, card), [boxes], QUICK).verdicts
    assert [one.verdict for one in (beside, ahead, other)] == [Verdict.VIOLATED, Verdict.CERTIFIED, Verdict.CERTIFIED]
    assert ahead.margin == pytest.approx(8.0 - 4.0 * np.tanh(0.25))
    assert beside.margin == pytest.approx(-4.0 * np.tanh(0.25))


def test_extreme_scans_are_tried_where_slopes_lead_nowhere(
    watching: Watching, boxes: DomainSet, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The search finds only scans with ray 270 at 0.1 m, which holds forward back; that ray at 20 m does not."""

    def idle(network: torch.nn.Module, part: DomainSet, config: AttackConfig) -> AttackResult:
        near_m = np.full_like(part.lower_m, 0.1)
        return AttackResult(near_m, np.zeros(len(part)), np.zeros(len(part), np.int64), np.zeros(len(part), np.bool_))

    monkeypatch.setattr(room, "attack", idle)
    beside = certify(watching({STAY: (10.0, 0.0, 0.0), FORWARD: (0.0, 0.0, 2.0)}), [boxes], QUICK).verdicts[0]
    assert (beside.verdict, beside.violation) == (Verdict.VIOLATED, 2.0)
    assert beside.scan_m is not None
    assert beside.scan_m[270] == 20.0


def test_sets_with_other_answers_are_judged_by_their_own(careful: LoadedModel, boxes: DomainSet) -> None:
    """The network never answers left_forward, so where that alone is forbidden, nothing is violated."""
    mild = replace(boxes, name="mild", allowed=frozenset(MotionClass) - {MotionClass.LEFT_FORWARD})
    found = certify(careful, [boxes, mild], QUICK)
    assert [(one.set_name, one.verdict) for one in found.verdicts[3:]] == [("mild", Verdict.CERTIFIED)] * 3


def test_the_same_seed_finds_the_same(careful: LoadedModel, boxes: DomainSet) -> None:
    first, second = (certify(careful, [boxes], QUICK).verdicts[0].scan_m for _ in range(2))
    assert first is not None
    assert second is not None
    assert np.array_equal(first, second)


def test_progress_ends_with_all_domains(careful: LoadedModel, boxes: DomainSet) -> None:
    told: list[tuple[int, int]] = []
    certify(careful, [boxes, boxes], QUICK, lambda done, total: told.append((done, total)))
    assert told == [(1, 6), (3, 6), (4, 6), (6, 6)]


def test_no_domains_are_refused(careful: LoadedModel) -> None:
    with pytest.raises(UsageError, match="no domains to certify"):
        certify(careful, [domains(SafetyLevel.NONE)], QUICK)


def test_a_layer_that_nobody_knows_is_named(careful: LoadedModel, boxes: DomainSet) -> None:
    careful.network.layers.full1_relu = torch.nn.GELU()
    with pytest.raises(CheckpointError, match="'full1_relu' is a GELU"):
        certify(careful, [boxes], QUICK)


def test_a_representable_scan_is_the_nearest_float32_inside() -> None:
    """0.2 in float32 is more than 0.2; the number below it is taken, and 0.5 stays as it is."""
    found = representable(np.array([0.2, 0.5, 0.3]), np.zeros(3), np.array([0.2, 1.0, 0.3]))
    assert found[0] == float(np.nextafter(np.float32(0.2), np.float32(0)))
    assert found[1] == 0.5
    assert np.all(found <= [0.2, 1.0, 0.3])
