import numpy as np
import pytest
from prediction_samples import OPTIONS, frames_table, material

from sdt_tools.error_analysis.claims import propositions
from sdt_tools.error_analysis.claims.propositions import judge_proposition_1, judge_systematic, judge_transients
from sdt_tools.error_analysis.claims.verdict import Finding
from sdt_tools.models.follow_net import FollowNetConfig, new_follow_net
from sdt_tools.models.preprocess import PreprocessConfig

RNG = np.random.default_rng(4)


def test_the_two_criteria_are_one() -> None:
    network = new_follow_net(FollowNetConfig(), PreprocessConfig(), 0).eval()
    scans_m = RNG.uniform(0.02, 5.0, (10, 541)).astype(np.float32)
    verdict = judge_proposition_1(network, "net", scans_m, RNG.integers(0, 7, 10), OPTIONS)
    assert verdict.finding is Finding.SUPPORTED
    assert verdict.numbers["all_in_domains"]
    assert verdict.numbers["adversarial"] == pytest.approx(verdict.numbers["safety_domain"], rel=1e-4)
    assert np.ptp(verdict.numbers["adversarial"]) > 0.0


def test_scans_outside_their_ball_would_be_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    network = new_follow_net(FollowNetConfig(), PreprocessConfig(), 0).eval()
    scans_m = RNG.uniform(0.1, 5.0, (3, 541)).astype(np.float32)
    monkeypatch.setattr(propositions, "_in_ball", lambda _net, scan, *_: scan[None] + np.float32(0.06))
    verdict = judge_proposition_1(network, "net", scans_m, np.zeros(3, np.int64), OPTIONS)
    assert verdict.finding is Finding.CONTRADICTED


def test_transients_are_those_of_brute_force() -> None:
    """Situations on a line, a metre apart or less; an error is transient where all within ε are right."""
    table = frames_table(recordings=10, frames=40)
    place_m = np.sort(RNG.uniform(0.0, 60.0, 400)).astype(np.float32)
    situations = np.repeat(place_m[:, None], 5, axis=1)
    wrong = RNG.random(400) < 0.2
    frames = material(table, {1: [wrong]}).labelled(0, OPTIONS)
    verdict = judge_transients(frames, "net", situations, 0.3, OPTIONS)
    apart_m = np.abs(place_m[:, None] - place_m[None])
    near = (apart_m > 0.0) & (apart_m <= 0.3)
    expected = [row for row in np.flatnonzero(wrong) if near[row].any() and not wrong[near[row]].any()]
    assert verdict.frames == len(expected) > 5
    assert sorted(verdict.numbers["neighbours"]) == sorted(int(near[row].sum()) for row in expected)
    assert verdict.finding is Finding.SUPPORTED
    assert verdict.estimate.value == 1.0


def test_no_transient_error_leaves_it_undecided() -> None:
    table = frames_table(recordings=10, frames=40)
    frames = material(table, {1: [np.ones(400, bool)]}).labelled(0, OPTIONS)
    verdict = judge_transients(frames, "net", np.zeros((400, 5), np.float32), 0.3, OPTIONS)
    assert verdict.finding is Finding.UNDECIDED


def test_a_recording_that_is_all_wrong_is_the_limit_case() -> None:
    table = frames_table(recordings=10, frames=40)
    frames = material(table, {1: [np.arange(400) < 40]}).labelled(0, OPTIONS)
    verdict = judge_systematic(frames, "net", OPTIONS)
    assert (verdict.finding, verdict.numbers["selections"]) == (Finding.SUPPORTED, ["recording = drive_000"])


def test_without_a_systematic_error_the_wrong_frames_are_one() -> None:
    table = frames_table(recordings=10, frames=40)
    frames = material(table, {1: [np.arange(400) % 5 == 0]}).labelled(0, OPTIONS)
    verdict = judge_systematic(frames, "net", OPTIONS)
    assert verdict.finding is Finding.SUPPORTED
    assert verdict.numbers["in_data"] == 0
