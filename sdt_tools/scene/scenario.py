"""Scenario files: standard worlds in TOML, whose ``{ low, high }`` numbers are drawn from a seed.

Metres, degrees, seconds; x ahead, y left. ``mirror = true`` flips half of the seeds left to right.
"""

import difflib
import math
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Final, Literal

import numpy as np
from pydantic import AfterValidator, BeforeValidator, Field, model_validator

from sdt_tools.config import Config, load_config
from sdt_tools.errors import ConfigError
from sdt_tools.frames import Gesture, Pose2D
from sdt_tools.scene.layout import (
    Behaviour,
    BehaviourEvent,
    Box,
    CameraKind,
    GestureEvent,
    Layout,
    OperatorPlan,
    Post,
    Sun,
    Surroundings,
    Wall,
)
from sdt_tools.scene.manners import with_manners
from sdt_tools.scene.practice import PRACTICE_FAMILIES, practice_layout
from sdt_tools.scene.practice_courses import NAME as PRACTICE_COURSE
from sdt_tools.scene.practice_courses import course_layout
from sdt_tools.scene.practice_gestures import NAME as PRACTICE_GESTURES
from sdt_tools.scene.practice_gestures import gesture_layout
from sdt_tools.scene.seeds import Stream, generator
from sdt_tools.scene.validity import check_layout

STANDARD_FOLLOW: Final = (
    "plain",
    "around_boxes",
    "out_of_corner",
    "through_gate",
    "around_table",
    "garage_parking",
    "narrow_hallway",
)
"""The standard scenarios of the follow network, in the order of the paper's Table IV."""

STANDARD_VISION: Final = (
    "forward_backward",
    "surgical_mask",
    "direct_sunlight",
    "staying_idle",
    "summon_out_of_garage",
    "artificial_light_idle",
    "artificial_light_follow",
)
"""The standard scenarios of the vision network, in the order of the paper's Table V."""

_FOLDER: Final = Path(__file__).parent / "scenarios"


class Span(Config):
    """A number drawn evenly from [low, high)."""

    low: float
    high: float

    @model_validator(mode="after")
    def _ordered(self) -> "Span":
        if self.low > self.high:
            raise ValueError(f"low = {self.low} is above high = {self.high}")
        return self

    def draw(self, rng: np.random.Generator) -> float:
        """One number of the span. A plain number draws too, so that it may become a span without moving others."""
        return self.low + (self.high - self.low) * float(rng.random())


def _as_span(value: object) -> object:
    if isinstance(value, dict | Span):
        return value
    if isinstance(value, int | float) and not isinstance(value, bool):
        return {"low": value, "high": value}
    raise ValueError("a number or { low = …, high = … } is needed")


def _positive(span: Span) -> Span:
    if span.low <= 0:
        raise ValueError(f"must be greater than 0, not {span.low:g}")
    return span


def _not_negative(span: Span) -> Span:
    if span.low < 0:
        raise ValueError(f"must not be less than 0, not {span.low:g}")
    return span


Number = Annotated[Span, BeforeValidator(_as_span)]
Positive = Annotated[Number, AfterValidator(_positive)]
NotNegative = Annotated[Number, AfterValidator(_not_negative)]
Point = tuple[Number, Number]


def _fixed(value: float) -> Span:
    return Span(low=value, high=value)


class RobotSpec(Config):
    """Where the robot's centre starts."""

    x: Number = _fixed(0.0)
    y: Number = _fixed(0.0)
    yaw_deg: Number = _fixed(0.0)


class OperatorSpec(Config):
    """What the operator does; his legs and stride are drawn for each seed."""

    path: tuple[Point, ...] = Field(min_length=1)
    speed_mps: Positive = Span(low=0.4, high=0.7)
    waits_at_lead_m: Positive = _fixed(1.8)
    pauses_s: tuple[NotNegative, ...] = ()
    """Rest at each point of the path; missing ones are 0."""
    keeps_away_m: NotNegative = _fixed(0.4)
    patience_s: NotNegative = _fixed(4.0)
    leg_radius_m: Positive = Span(low=0.05, high=0.075)
    leg_separation_m: Positive = Span(low=0.2, high=0.32)
    step_length_m: Positive = Span(low=0.3, high=0.5)

    @model_validator(mode="after")
    def _pauses_fit(self) -> "OperatorSpec":
        if len(self.pauses_s) > len(self.path):
            raise ValueError(f"{len(self.pauses_s)} pauses_s for {len(self.path)} points of the path")
        return self


class WallSpec(Config):
    """A wall between two points."""

    from_: Point = Field(alias="from")
    to: Point


class BoxSpec(Config):
    """A box standing on the floor."""

    x: Number
    y: Number
    length: Positive
    width: Positive
    yaw_deg: Number = _fixed(0.0)
    height: Positive = _fixed(0.6)


class PostSpec(Config):
    """A round upright."""

    x: Number
    y: Number
    radius: Positive


class GestureSpec(Config):
    """A gesture of the operator."""

    at_s: NotNegative
    gesture: Literal["idle", "enable", "disable"]
    lasts_s: Positive = _fixed(2.0)


class BehaviourSpec(Config):
    """What an idle operator does with his hands, which may look like a gesture."""

    at_s: NotNegative
    does: Behaviour
    lasts_s: Positive = _fixed(3.0)


class SunSpec(Config):
    """Where the sun stands: counter-clockwise from straight ahead of the nominal robot, and above the horizon."""

    azimuth_deg: Number
    elevation_deg: Positive


class Scenario(Config):
    """A scenario file."""

    name: str = Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_-]*$")
    """Goes into the names of files: letters, digits, _ and -."""
    timeout_s: float = Field(default=90.0, gt=0)
    mirror: bool = False
    robot: RobotSpec = RobotSpec()
    operator: OperatorSpec
    wall: tuple[WallSpec, ...] = ()
    box: tuple[BoxSpec, ...] = ()
    post: tuple[PostSpec, ...] = ()
    light: Literal["indoor", "artificial", "sunlight", "overcast", "dim"] = "indoor"
    gestures: tuple[GestureSpec, ...] = ()
    behaviours: tuple[BehaviourSpec, ...] = ()
    surroundings: Surroundings | None = None
    """Without it the light tells: outdoors in sunlight and under clouds, else indoors."""
    sun: SunSpec | None = None
    """Without it, anywhere."""
    mask: bool | None = None
    """Whether the operator wears a surgical mask; without it, as chance has it."""
    camera: CameraKind = "plain"
    """``video`` takes time to adapt its exposure, blurs when it turns, is dazzled; and gestures vary."""

    @model_validator(mode="after")
    def _light_fits(self) -> "Scenario":
        daylight = self.light in ("sunlight", "overcast")
        if self.surroundings is not None and daylight != (self.surroundings != "indoor"):
            raise ValueError(f"light = '{self.light}' does not fit surroundings = '{self.surroundings}'")
        if self.sun is not None and not daylight:
            raise ValueError(f"a sun does not fit light = '{self.light}'")
        return self


def scenario_names() -> tuple[str, ...]:
    """The scenarios that come with the package, as the command line names them."""
    return tuple(sorted(path.stem for path in _FOLDER.glob("*.toml")))


def load_scenario(name_or_path: str) -> Scenario:
    """A scenario of the package by its name, or a file of the user's own (``*.toml``).

    Raises ConfigError for an unknown name, listing those that exist, and for a file that is missing or wrong.
    """
    if name_or_path.endswith(".toml"):
        return load_config(Scenario, Path(name_or_path))
    known = scenario_names()
    if name_or_path in known:
        return load_config(Scenario, _FOLDER / f"{name_or_path}.toml")
    everything = [*known, *PRACTICE_FAMILIES, PRACTICE_COURSE, PRACTICE_GESTURES]
    near = difflib.get_close_matches(name_or_path, everything, n=1)
    hint = f"did you mean '{near[0]}'? " if near else ""
    raise ConfigError(f"unknown scenario '{name_or_path}'; {hint}There are {', '.join(everything)}, or a file *.toml")


def layout_for(name_or_path: str, seed: int) -> Layout:
    """The world of a scenario, a scenario file or a practice family for ``seed``. Raises ConfigError."""
    if seed < 0:
        raise ConfigError(f"seed {seed}: seeds are 0 or greater")
    if name_or_path in PRACTICE_FAMILIES:
        return practice_layout(seed, PRACTICE_FAMILIES[name_or_path])
    if name_or_path == PRACTICE_COURSE:
        return course_layout(seed)
    if name_or_path == PRACTICE_GESTURES:
        return gesture_layout(seed)
    return draw(load_scenario(name_or_path), seed)


def draw(scenario: Scenario, seed: int) -> Layout:
    """The world of ``scenario`` for ``seed``; the same pair gives the same world.

    Raises ConfigError where things drawn stand in each other's way.
    """
    rng = generator(seed, Stream.LAYOUT)
    side = -1.0 if rng.random() < 0.5 and scenario.mirror else 1.0

    def point(spec: Point) -> tuple[float, float]:
        return spec[0].draw(rng), side * spec[1].draw(rng)

    def yaw(spec: Span) -> float:
        return side * math.radians(spec.draw(rng))

    robot = Pose2D(*point((scenario.robot.x, scenario.robot.y)), yaw(scenario.robot.yaw_deg))
    path = tuple(point(spec) for spec in scenario.operator.path)
    layout = Layout(
        name=scenario.name,
        seed=seed,
        timeout_s=scenario.timeout_s,
        robot=robot,
        operator=_plan(scenario.operator, path, robot, rng),
        walls=tuple(Wall(*point(spec.from_), *point(spec.to)) for spec in scenario.wall),
        boxes=tuple(
            Box(
                *point((spec.x, spec.y)),
                length_m=spec.length.draw(rng),
                width_m=spec.width.draw(rng),
                yaw_rad=yaw(spec.yaw_deg),
                height_m=spec.height.draw(rng),
            )
            for spec in scenario.box
        ),
        posts=tuple(Post(*point((spec.x, spec.y)), radius_m=spec.radius.draw(rng)) for spec in scenario.post),
        gestures=tuple(
            sorted(
                (
                    GestureEvent(spec.at_s.draw(rng), Gesture[spec.gesture.upper()], spec.lasts_s.draw(rng))
                    for spec in scenario.gestures
                ),
                key=lambda event: event.at_s,
            )
        ),
        light=scenario.light,
        behaviours=tuple(
            sorted(
                (
                    BehaviourEvent(spec.at_s.draw(rng), spec.does, spec.lasts_s.draw(rng))
                    for spec in scenario.behaviours
                ),
                key=lambda event: event.at_s,
            )
        ),
        surroundings=scenario.surroundings,
        sun=None
        if scenario.sun is None
        else Sun(yaw(scenario.sun.azimuth_deg), math.radians(scenario.sun.elevation_deg.draw(rng))),
        mask=scenario.mask,
        camera=scenario.camera,
    )
    if layout.camera == "video":
        manners = generator(seed, Stream.MANNERS)
        layout = replace(
            layout,
            gestures=with_manners(layout.gestures, manners),
            behaviours=with_manners(layout.behaviours, manners),
        )
    check_layout(layout)
    return layout


def _plan(
    spec: OperatorSpec, path: tuple[tuple[float, float], ...], robot: Pose2D, rng: np.random.Generator
) -> OperatorPlan:
    pauses = [pause.draw(rng) for pause in spec.pauses_s]
    return OperatorPlan(
        path_m=path,
        pauses_s=(*pauses, *[0.0] * (len(path) - len(pauses))),
        speed_mps=spec.speed_mps.draw(rng),
        waits_at_lead_m=spec.waits_at_lead_m.draw(rng),
        keeps_away_m=spec.keeps_away_m.draw(rng),
        patience_s=spec.patience_s.draw(rng),
        yaw_rad=math.atan2(robot.y_m - path[0][1], robot.x_m - path[0][0]),
        leg_radius_m=spec.leg_radius_m.draw(rng),
        leg_separation_m=spec.leg_separation_m.draw(rng),
        step_length_m=spec.step_length_m.draw(rng),
        first_phase_rad=2 * math.pi * float(rng.random()),
    )
