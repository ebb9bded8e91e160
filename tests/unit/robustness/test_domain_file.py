"""Domains in TOML: the levels written out, and what is refused."""

from pathlib import Path

import numpy as np
import pytest
from matplotlib.image import imread

from sdt_tools.errors import ConfigError
from sdt_tools.frames import MotionClass
from sdt_tools.robustness.domain_file import load_domains
from sdt_tools.robustness.domains import SafetyLevel, domains
from sdt_tools.robustness.figure import domains_figure

FORM = """
[[domain]]
name = "{name}"
rays = [150, 389]
width = {width}
near = {{ lower_m = 0.0, upper_m = 0.2 }}
others = {{ lower_m = 0.0, upper_m = {far} }}
allowed = ["stay", "backward", "left_backward", "right_backward"]
"""
GOOD = FORM.format(name="near", width=1, far=4.0)


def written(folder: Path, text: str) -> Path:
    (folder / "own.toml").write_text(text)
    return folder / "own.toml"


@pytest.mark.parametrize(("level", "width", "far"), [(1, 3, 3.0), (2, 1, 3.0), (3, 1, 4.0), (4, 1, 20.0)])
def test_the_levels_written_out_are_the_levels(level: int, width: int, far: float, tmp_path: Path) -> None:
    (mine,) = load_domains(written(tmp_path, FORM.format(name="near", width=width, far=far)))
    theirs = domains(SafetyLevel(level))
    np.testing.assert_array_equal(mine.lower_m, theirs.lower_m)
    np.testing.assert_array_equal(mine.upper_m, theirs.upper_m)
    np.testing.assert_array_equal(mine.rays, theirs.rays)
    assert mine.allowed == theirs.allowed


def test_a_box_is_given_part_by_part(tmp_path: Path) -> None:
    text = """
    [[domain]]
    name = "between walls"
    box = [{ rays = [0, 9], lower_m = 0.5, upper_m = 1.0 }, { rays = [531, 540], lower_m = 0.1, upper_m = 0.3 }]
    allowed = ["forward"]
    """
    (boxes,) = load_domains(written(tmp_path, text))
    assert boxes.lower_m.shape == (1, 541)
    assert set(boxes.lower_m[0, :10]) == {0.5}
    assert set(boxes.upper_m[0, 531:]) == {0.3}
    assert (boxes.lower_m[0, 10:531] == 0.0).all()
    assert (boxes.upper_m[0, 10:531] == 20.0).all()
    assert boxes.allowed == {MotionClass.FORWARD}


def test_several_sets_come_in_order(tmp_path: Path) -> None:
    found = load_domains(written(tmp_path, GOOD + FORM.format(name="wide", width=3, far=3.0)))
    assert [boxes.name for boxes in found] == ["near", "wide"]


EVERY = '["stay", "forward", "left_forward", "right_forward", "backward", "left_backward", "right_backward"]'
NOT_FORWARD = '["stay", "backward", "left_backward", "right_backward"]'


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (GOOD.replace(NOT_FORWARD, EVERY), "allowed names every class"),
        (GOOD.replace(NOT_FORWARD, "[]"), "allowed names no class"),
        (GOOD.replace('"stay"', '"halt"'), "allowed has 'halt', but the classes are stay, forward"),
        (GOOD.replace("upper_m = 0.2", "upper_m = -0.2"), "upper_m"),
        (GOOD.replace("upper_m = 0.2", 'upper_m = "0.2"'), "upper_m"),
        (GOOD.replace("upper_m = 4.0", "upper_m = 25.0"), "upper_m"),
        (
            GOOD.replace("lower_m = 0.0, upper_m = 0.2", "lower_m = 0.3, upper_m = 0.2"),
            "lower_m = 0.3 is above upper_m",
        ),
        (GOOD.replace("[150, 389]", "[150, 541]"), "rays 150 to 541 are not on a scan"),
        (GOOD.replace("width = 1", "width = 2"), "width = 2 has no middle ray"),
        (GOOD.replace("width = 1", "widht = 1"), "unknown key 'domain.0.widht'; did you mean 'width'?"),
        (GOOD + GOOD, "two domains are called 'near'"),
        ("", "domain"),
        ("[[domain]\n", "not valid TOML"),
    ],
)
def test_what_makes_no_sense_is_refused_in_one_line(text: str, said: str, tmp_path: Path) -> None:
    path = written(tmp_path, text)
    with pytest.raises(ConfigError) as refused:
        load_domains(path)
    line = str(refused.value)
    assert line.startswith(str(path))
    assert said in line
    assert "\n" not in line


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"none\.toml: no such file of domains"):
        load_domains(tmp_path / "none.toml")


def test_the_drawing_shows_free_and_near_rays(tmp_path: Path) -> None:
    domains_figure([domains(SafetyLevel.ONE), domains(SafetyLevel.FOUR)], tmp_path / "domains.png")
    picture = imread(tmp_path / "domains.png")[..., :3]
    green = (picture[..., 1] > picture[..., 0] + 0.05) & (picture[..., 1] > picture[..., 2] + 0.02)
    red = picture[..., 0] > picture[..., 1] + 0.3
    assert green.mean() > 0.1
    assert red.any()
