import numpy as np
import pytest
import torch

from sdt_tools.config import parse_config
from sdt_tools.errors import ConfigError
from sdt_tools.models.preprocess import ClipScale, PreprocessConfig, invalid_front_share, invalid_rays, resolve_codes

INTERPOLATE = PreprocessConfig()


def resolve_one(ranges_m: list[float], config: PreprocessConfig = INTERPOLATE) -> list[float]:
    return resolve_codes(np.array([ranges_m]), config)[0].tolist()


def test_codes_are_interpolated_between_their_valid_neighbours() -> None:
    assert resolve_one([1.0, 0.0, 0.003, 4.0]) == pytest.approx([1.0, 2.0, 3.0, 4.0])


def test_codes_at_the_ends_take_the_nearest_valid_ray() -> None:
    assert resolve_one([0.0, 0.002, 2.0, 3.0, 0.0]) == [2.0, 2.0, 2.0, 3.0, 3.0]


def test_a_single_valid_ray_fills_the_scan() -> None:
    assert resolve_one([0.0, 0.0, 7.0, 0.0]) == [7.0] * 4


@pytest.mark.parametrize(("policy", "reading"), [("interpolate", 0.0), ("near", 0.0), ("max_range", 20.0)])
def test_a_covered_sensor_reads_near_unless_codes_mean_free_space(policy: str, reading: float) -> None:
    assert resolve_one([0.0, 0.002, 0.0], PreprocessConfig(code_policy=policy)) == [reading] * 3


def test_codes_can_mean_free_space() -> None:
    assert resolve_one([1.0, 0.0, 2.0], PreprocessConfig(code_policy="max_range")) == [1.0, 20.0, 2.0]


def test_codes_can_mean_an_object() -> None:
    assert resolve_one([1.0, 0.003, 2.0], PreprocessConfig(code_policy="near")) == [1.0, 0.0, 2.0]


def test_the_threshold_itself_is_a_distance() -> None:
    assert resolve_one([1.0, 0.005, 0.00499, 1.0]) == pytest.approx([1.0, 0.005, 0.5025, 1.0])


@pytest.mark.parametrize("reading", [float("nan"), float("inf"), float("-inf"), -1.0])
def test_readings_that_are_no_numbers_are_codes(reading: float) -> None:
    assert resolve_one([1.0, reading, 3.0]) == [1.0, 2.0, 3.0]


def test_readings_beyond_the_sensor_s_range_are_its_range() -> None:
    assert resolve_one([65.0, 20.0]) == [20.0, 20.0]


def test_the_argument_is_left_as_it_was() -> None:
    scan = np.array([[1.0, 0.0, 3.0]])
    resolve_codes(scan, INTERPOLATE)
    assert scan.tolist() == [[1.0, 0.0, 3.0]]


def test_precision_and_memory_layout_do_not_matter() -> None:
    rng = np.random.default_rng(0)
    scans = rng.uniform(0.0, 20.0, (8, 541))
    scans[rng.random(scans.shape) < 0.3] = 0.0
    columns_first = np.asfortranarray(scans.astype(np.float32))
    resolved = resolve_codes(columns_first, INTERPOLATE)
    assert resolved.dtype == np.float32
    np.testing.assert_allclose(resolved, resolve_codes(scans, INTERPOLATE), rtol=1e-5)


def test_mirroring_and_resolving_commute() -> None:
    rng = np.random.default_rng(1)
    scans = rng.uniform(0.1, 20.0, (16, 541))
    scans[rng.random(scans.shape) < 0.4] = 0.0
    mirrored_first = resolve_codes(scans[:, ::-1], INTERPOLATE)
    np.testing.assert_allclose(mirrored_first, resolve_codes(scans, INTERPOLATE)[:, ::-1], rtol=0, atol=1e-12)


def test_invalid_front_share_counts_only_the_rays_ahead() -> None:
    scans = np.ones((2, 541))
    scans[0, :150] = 0.0
    scans[0, 390:] = 0.0
    scans[1, 150:174] = 0.002
    assert invalid_front_share(scans, INTERPOLATE).tolist() == [0.0, 0.1]


def test_invalid_rays_are_those_that_resolving_changes_the_meaning_of() -> None:
    assert invalid_rays(np.array([[0.0, 0.003, 0.005, 30.0, np.nan]]), INTERPOLATE).tolist() == [
        [True, True, False, False, True]
    ]


def test_clip_and_scale_map_metres_to_minus_one_and_one() -> None:
    scaled = ClipScale(4.0)(torch.tensor([[-1.0, 0.0, 1.0, 2.0, 4.0, 20.0]]))
    assert scaled.tolist() == [[-1.0, -1.0, -0.5, 0.0, 1.0, 1.0]]


def test_an_unknown_policy_is_refused_by_name() -> None:
    with pytest.raises(ConfigError, match=r"model\.toml: 'code_policy': .*'interpolate', 'max_range' or 'near'"):
        parse_config(PreprocessConfig, {"code_policy": "ignore"}, "model.toml")
