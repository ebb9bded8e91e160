"""Scenario files: drawing, mirroring, and what a user is told about a wrong one."""

from pathlib import Path

import pytest

from sdt_tools.errors import ConfigError
from sdt_tools.frames import Gesture
from sdt_tools.scene.scenario import draw, layout_for, load_scenario, scenario_names

OWN = """
name = "mine"
robot = { yaw_deg = 90 }
operator = { path = [[0.0, 1.5], [{ low = 0.5, high = 1.0 }, 3.0]], pauses_s = [1, 2], speed_mps = 0.5 }
wall = [{ from = [2, 0], to = [2, 4] }]
box = [{ x = -2, y = 1, length = 0.6, width = 0.4, yaw_deg = 10 }]
post = [{ x = -1, y = 3, radius = 0.04 }]
gestures = [{ at_s = 5, gesture = "disable" }, { at_s = 1, gesture = "enable" }]
"""


def written(folder: Path, text: str) -> str:
    path = folder / "mine.toml"
    path.write_text(text)
    return str(path)


def test_the_standard_scenarios_are_there() -> None:
    assert {"plain", "around_boxes"} <= set(scenario_names())


@pytest.mark.parametrize("name", scenario_names())
def test_every_scenario_can_be_drawn(name: str) -> None:
    scenario = load_scenario(name)

    assert scenario.name == name
    assert all(draw(scenario, seed).seed == seed for seed in range(1000, 1030))


def test_same_seed_same_world_and_other_seed_another() -> None:
    assert layout_for("around_boxes", 7) == layout_for("around_boxes", 7)
    assert layout_for("around_boxes", 7) != layout_for("around_boxes", 8)


def test_numbers_are_drawn_between_their_bounds() -> None:
    plain = load_scenario("plain")

    speeds = [draw(plain, seed).operator.speed_mps for seed in range(60)]

    assert 0.35 <= min(speeds) < 0.37
    assert 0.48 < max(speeds) < 0.5


def test_half_of_the_seeds_are_mirrored(tmp_path: Path) -> None:
    own = load_scenario(written(tmp_path, "mirror = true\n" + OWN))

    drawn = [draw(own, seed) for seed in range(100)]

    assert all(layout.operator.path_m[1][0] > 0 for layout in drawn)  # only left and right change places
    assert 35 < sum(layout.robot.yaw_rad > 0 for layout in drawn) < 65


def test_mirroring_turns_everything() -> None:
    mirrored = [layout_for("around_boxes", seed) for seed in range(16)]

    for layout in mirrored:
        first, second = layout.boxes
        assert (first.y_m > 0) != (second.y_m > 0)
        assert (layout.operator.path_m[2][1] > 0) == (second.y_m > 0)


def test_a_file_of_the_users_own(tmp_path: Path) -> None:
    layout = layout_for(written(tmp_path, OWN), 3)

    assert layout.name == "mine"
    assert layout.operator.pauses_s == (1.0, 2.0)
    assert 0.5 <= layout.operator.path_m[1][0] <= 1.0
    assert len(layout.segments()) == 5
    assert layout.circles().tolist() == [[-1.0, 3.0, 0.04]]
    assert [event.gesture for event in layout.gestures] == [Gesture.ENABLE, Gesture.DISABLE]


def test_an_unknown_name_lists_the_known_ones() -> None:
    with pytest.raises(ConfigError, match=r"unknown scenario 'plane'; did you mean 'plain'\?.*around_boxes.*practice"):
        layout_for("plane", 0)


def test_a_missing_file_is_named() -> None:
    with pytest.raises(ConfigError, match=r"nowhere\.toml: no such file"):
        layout_for("nowhere.toml", 0)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("speed_mps", "speed_mph"), r"unknown key 'operator\.speed_mph'; did you mean 'speed_mps'\?"),
        (("pauses_s = [1, 2]", "pauses_s = [1, 2, 3]"), "3 pauses_s for 2 points"),
        (("high = 1.0", "high = 0.1"), "low = 0.5 is above high = 0.1"),
        (("speed_mps = 0.5", 'speed_mps = "fast"'), r"a number or \{ low = …, high = … \}"),
        (('gesture = "enable"', 'gesture = "wave"'), "'idle', 'enable' or 'disable'"),
        (("to = [2, 4]", "to = [0, 4]"), r"mine.*seed 0.*path comes within 0\.2 m of something after its point"),
        (("x = -2, y = 1", "x = 0, y = 0.2"), "mine.*seed 0.*robot starts in contact"),
    ],
)
def test_what_is_wrong_with_a_file_is_said(tmp_path: Path, change: tuple[str, str], message: str) -> None:
    path = written(tmp_path, OWN.replace(*change))

    with pytest.raises(ConfigError, match=message):
        layout_for(path, 0)


def test_a_negative_seed_is_refused() -> None:
    with pytest.raises(ConfigError, match="seeds are 0 or greater"):
        layout_for("plain", -1)
