"""The standard scenarios of the vision network, with perfect sight: the operator is seen, and nothing touched."""

import math
from pathlib import Path

import pytest

from sdt_tools.errors import ConfigError
from sdt_tools.frames import Gesture, Mode, Twist
from sdt_tools.scene.expert import SceneExpert
from sdt_tools.scene.layout import Behaviour
from sdt_tools.scene.scenario import STANDARD_VISION, layout_for, load_scenario
from sdt_tools.scene.world import World

IDLE = ("staying_idle", "artificial_light_idle")
OUTDOORS = {"direct_sunlight": "outdoor", "summon_out_of_garage": "garage"}
EDGE_DEG = 33.0
"""Inside the picture's edge at 40° by what a person's half is wide at a metre and a half."""


@pytest.mark.parametrize("name", STANDARD_VISION)
def test_it_says_what_the_camera_needs(name: str) -> None:
    layout = layout_for(name, 1000)

    assert layout.camera == "video"
    assert layout.surroundings == OUTDOORS.get(name, "indoor")
    assert layout.light == ("sunlight" if name in OUTDOORS else "artificial" if "artificial" in name else "indoor")
    assert layout.mask is (True if name == "surgical_mask" else None)
    assert len(layout.behaviours) >= 3
    assert layout.gestures != layout_for(name, 1001).gestures


@pytest.mark.parametrize("name", IDLE)
def test_nothing_is_asked_for_where_the_robot_stays_idle(name: str) -> None:
    world = World(layout_for(name, 1000))
    times = [0.5 * number for number in range(120)]

    assert {world.commanded_mode_at(time_s) for time_s in times} == {Mode.IDLE}
    assert {world.gesture_at(time_s) for time_s in times} == {Gesture.IDLE}
    assert {event.does for event in world.layout.behaviours} >= {Behaviour.SCRATCH_HEAD, Behaviour.POINT_ASIDE}


@pytest.mark.parametrize("name", [name for name in STANDARD_VISION if name not in IDLE])
@pytest.mark.parametrize("seed", [1000, 1001])
def test_gestures_are_made_standing_before_the_robot(name: str, seed: int) -> None:
    world = World(layout_for(name, seed))
    expert = SceneExpert(world)
    twist, seen = Twist(0.0, 0.0), set()
    while world.time_s < world.layout.timeout_s:
        if world.steps % 5 == 0:
            active = world.commanded_mode is Mode.ACTIVE
            twist = world.config.motions.twist(expert.advise()) if active else Twist(0.0, 0.0)
        world.step(twist)
        if world.gesture is not Gesture.IDLE:
            robot, operator = world.robot, world.operator
            bearing = math.atan2(operator.y_m - robot.y_m, operator.x_m - robot.x_m) - robot.yaw_rad
            assert abs(math.degrees(math.remainder(bearing, 2 * math.pi))) < EDGE_DEG
            assert world.operator_standing
            seen.add(world.gesture)

    assert seen == {Gesture.ENABLE, Gesture.DISABLE}
    assert world.contact is None
    assert world.commanded_mode is Mode.IDLE


@pytest.mark.parametrize(
    ("line", "says"),
    [
        ('light = "sunlight"\nsurroundings = "indoor"', "light = 'sunlight' does not fit surroundings = 'indoor'"),
        ('surroundings = "garage"', "light = 'indoor' does not fit surroundings = 'garage'"),
        ("sun = { azimuth_deg = 0, elevation_deg = 30 }", "a sun does not fit light = 'indoor'"),
        ('behaviours = [{ at_s = 1, does = "dance" }]', "scratch_head"),
        ('camera = "film"', "video"),
    ],
)
def test_a_wrong_file_is_refused_in_words(tmp_path: Path, line: str, says: str) -> None:
    path = tmp_path / "mine.toml"
    path.write_text(f'name = "mine"\n{line}\noperator = {{ path = [[1.0, 0.0]] }}\n')

    with pytest.raises(ConfigError, match=says):
        load_scenario(str(path))
