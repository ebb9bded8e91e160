"""The parts of the report: each against what a person would count or measure."""

import re
import xml.etree.ElementTree as ET

import numpy as np
import polars as pl
import pytest

from sdt_tools.error_analysis.conditions.predicates import Condition, Predicate
from sdt_tools.error_analysis.epsilon import Epsilon
from sdt_tools.error_analysis.nearest import nearest_frames
from sdt_tools.error_analysis.report.breakdown import parts_by
from sdt_tools.error_analysis.report.figures import as_svg, bound_figure, epsilon_figure
from sdt_tools.error_analysis.report.scan_drawing import hits_path, motion_path, operator_place
from sdt_tools.error_analysis.report.strips import HEIGHT, SMALLEST, WIDTH, strip_of
from sdt_tools.error_analysis.report.words import condition_in_words
from sdt_tools.error_analysis.spaces import MEASURES
from sdt_tools.frames import RAYS
from sdt_tools.statistics import wilson


def test_the_nearest_frames_are_those_of_brute_force() -> None:
    rng = np.random.default_rng(0)
    scans = rng.uniform(0.3, 2.5, (300, 41)).astype(np.float32)
    scans[7] = scans[3]  # an exact copy is no neighbour
    rows = np.array([3, 50, 299])
    exact = np.sqrt(((scans[rows, None].astype(np.float64) - scans[None]) ** 2).mean(axis=2))
    epsilon_m = float(np.quantile(exact, 0.02))
    for row, distances, near in zip(rows, exact, nearest_frames(scans, rows, epsilon_m, 4), strict=True):
        order = [other for other in np.argsort(distances) if 0 < distances[other] <= epsilon_m][:4]
        assert [one.row for one in near] == order
        assert [one.distance for one in near] == pytest.approx(distances[order].tolist(), abs=1e-6)
        assert row not in order


def test_a_recording_shorter_than_what_is_asked_for_has_few_neighbours() -> None:
    scans = np.array([[1.0, 1.0], [1.0, 1.1], [9.0, 9.0]], np.float32)
    assert [[one.row for one in near] for near in nearest_frames(scans, np.array([0]), 0.5, 4)] == [[1]]


def tagged(tags: list[str], **columns: list[str | None]) -> pl.DataFrame:
    return pl.DataFrame({"stamp_ns": np.arange(len(tags)) * 10**8, "tag": tags, **columns})


def test_parts_are_counted_and_the_worst_comes_first() -> None:
    frames = tagged(
        ["correct", "transient", "correct", "isolated", "isolated"], scenario=["plain", "plain", "plain", "gate", None]
    )
    gate, unknown, plain = parts_by("scenario", frames)
    assert (gate.name, gate.frames, gate.errors) == ("gate", 1, 1)
    assert unknown.name == "not known"
    assert (plain.frames, plain.errors, plain.share, plain.tags["transient"]) == (3, 1, pytest.approx(1 / 3), 1)
    assert (plain.low, plain.high) == wilson(1, 3)


def test_a_strip_shows_a_column_where_the_error_was() -> None:
    frames = tagged(["transient"] + ["correct"] * 98 + ["isolated"], scenario=["plain"] * 100)
    (part,) = parts_by("scenario", frames)
    strip = strip_of(part, frames)
    assert strip.seconds == pytest.approx(9.9)
    assert strip.paths == {"transient": f"M0.5 {HEIGHT}v-{HEIGHT}", "isolated": f"M{WIDTH - 1}.5 {HEIGHT}v-{HEIGHT}"}


def test_a_single_error_among_many_is_still_seen() -> None:
    frames = tagged(["transient"] + ["correct"] * 99_999, scenario=["plain"] * 100_000)
    (part,) = parts_by("scenario", frames)
    assert strip_of(part, frames).paths == {"transient": f"M0.5 {HEIGHT}v-{SMALLEST:.3g}"}


@pytest.mark.parametrize(
    ("predicates", "words"),
    [
        (
            (Predicate("front_range_m", "<", 0.62), Predicate("motion", "=", "left_forward")),
            "the nearest thing ahead is less than 0.62 m away and the right answer is left forward",
        ),
        ((Predicate("|operator_bearing_rad|", ">=", np.pi / 6),), "the operator is at least 30° off straight ahead"),
        ((Predicate("invalid_share", ">=", 0.1),), "at least 10 % of the rays have no distance"),
        ((Predicate("in_level_3", "=", "true"),), "the scan lies inside a safety domain of level 3"),
        ((Predicate("wind_mps", "<", 3.0),), "wind_mps < 3"),
    ],
)
def test_conditions_are_said_in_words(predicates: tuple[Predicate, ...], words: str) -> None:
    assert condition_in_words(Condition(predicates)) == words


def test_a_scan_is_drawn_ahead_up_in_centimetres() -> None:
    ranges_m = np.zeros(RAYS)
    ranges_m[270], ranges_m[450], ranges_m[90] = 1.5, 2.0, 19.0  # ahead, left, and too far to the right
    assert sorted(hits_path(ranges_m).split("M")[1:]) == ["-200 0h0", "0 -150h0"]


def test_an_arrow_is_drawn_for_motions_alone() -> None:
    assert motion_path("forward").startswith("M0 20L")  # the base's centre stands 19.7 cm behind the LiDAR
    assert motion_path("enable") == ""


def test_the_operator_is_drawn_where_he_is_known_and_near() -> None:
    assert operator_place(1.0, np.pi / 2) == (-100, 0)
    assert operator_place(None, 0.0) is None
    assert operator_place(9.0, 0.0) is None


def test_pictures_in_the_page_take_its_colours() -> None:
    epsilon = Epsilon(0.2, MEASURES["scan"], "given", np.array([0.1, 0.15]), np.array([0.9]), "")
    values, wrong = np.linspace(0.0, 2.0, 100), np.linspace(0.0, 2.0, 100) < 0.5
    for figure in (epsilon_figure(epsilon), bound_figure(Predicate("front_range_m", "<", 0.5), values, wrong)):
        text = as_svg(figure, "here")
        assert ET.fromstring(text).tag.endswith("svg")  # noqa: S314 - drawn here
        assert set(re.findall(r'(?: id="|url\(#|href="#)([a-z]+)-', text)) == {"here"}
        assert "currentColor" in text
        assert "#010203" not in text


def test_epsilon_is_drawn_without_any_pair() -> None:
    epsilon = Epsilon(0.2, MEASURES["scan"], "given", np.empty(0), np.empty(0), "")
    assert "ε = 0.2 m" in as_svg(epsilon_figure(epsilon), "here")
