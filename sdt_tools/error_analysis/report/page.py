"""The report as one HTML file: for people who ask why, without anything outside the file."""

import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Final

import jinja2
import polars as pl
from markupsafe import Markup

from sdt_tools.clock import SECOND_NS
from sdt_tools.error_analysis.conditions.predicates import Condition, Features, Predicate, features_of
from sdt_tools.error_analysis.definitions import ERROR_TAGS, Tag
from sdt_tools.error_analysis.explain import Explanation
from sdt_tools.error_analysis.labelled import LabelledFrames
from sdt_tools.error_analysis.report.breakdown import parts_by
from sdt_tools.error_analysis.report.document import ErrorReport
from sdt_tools.error_analysis.report.examples import Example
from sdt_tools.error_analysis.report.figures import TAG_COLOURS, as_svg, bound_figure, epsilon_figure
from sdt_tools.error_analysis.report.scan_drawing import furniture, hits_path, motion_path, operator_place
from sdt_tools.error_analysis.report.strips import HEIGHT, WIDTH, strip_of
from sdt_tools.error_analysis.report.words import condition_in_words, verdict_in_words

MOST_STRIPS: Final = 40
"""Recordings that are shown one by one: those with the most errors."""


@dataclass(frozen=True)
class Sources:
    """Where things lie, as ``sdt view`` is told: the predictions, and the analysis itself when it is written."""

    predictions: Path
    analysis: Path
    tags_file: str

    def view_command(self, example: Example) -> str:
        """The command that shows ``example``."""
        words = ["sdt", "view", example.path, "--predictions", self.predictions, "--errors", self.analysis]
        return shlex.join([*map(str, words), "--tag", str(example.tag), "--at", str(example.stamp_ns), "--open"])


def render_page(
    report: ErrorReport,
    frames: LabelledFrames,
    explanation: Explanation,
    examples: Mapping[Tag, Sequence[Example]],
    sources: Sources,
    made_from: Mapping[str, object],
) -> str:
    """The whole page; ``made_from`` is told at its end."""
    tagged = frames.table.select("recording", "stamp_ns", "scenario", "label").with_columns(
        pl.Series("tag", [str(tag) for tag in explanation.tagged.tag], dtype=pl.String)
    )
    recordings = sorted(parts_by("recording", tagged), key=lambda part: (-part.errors, part.name))
    own = tagged.filter(pl.col("recording").is_in([part.name for part in recordings[:MOST_STRIPS]]))
    by_name = {str(name): rows for (name,), rows in own.group_by("recording", maintain_order=True)}
    named = [p.feature for found in report.conditions for p in found.verdict.condition.predicates]
    features = features_of(frames.table, tuple(dict.fromkeys(named)))
    return (
        _environment()
        .get_template("report.html.j2")
        .render(
            report=report,
            tags=[(str(tag), report.tags[tag]) for tag in Tag],
            widest=max([report.tags[tag].high for tag in ERROR_TAGS] + [0.01]),
            epsilon_svg=Markup(as_svg(epsilon_figure(report.epsilon), "epsilon")),  # noqa: S704 - drawn here
            bounds={
                number: _bounds(number, condition.verdict.condition, features, frames)
                for number, condition in enumerate(report.conditions, start=1)
            },
            parts={"scenario": parts_by("scenario", tagged), "right answer": parts_by("label", tagged)},
            strips=[strip_of(part, by_name[part.name]) for part in recordings[:MOST_STRIPS] if part.errors],
            strip_size=(WIDTH, HEIGHT),
            recordings=recordings,
            examples=examples,
            furniture=furniture(),
            view_command=sources.view_command,
            tags_file=sources.tags_file,
            colours={str(tag): colour for tag, colour in TAG_COLOURS.items()},
            options=_flat(report.options.model_dump(mode="json")),
            made_from=made_from,
        )
    )


def _environment() -> jinja2.Environment:
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("sdt_tools.error_analysis.report"),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {
        "percent": _percent,
        "words": lambda name: str(name).replace("_", " "),
        "in_words": condition_in_words,
        "verdict": verdict_in_words,
        "hits": hits_path,
        "motion": motion_path,
        "clock": _clock,
    }
    environment.globals["operator_place"] = operator_place
    return environment


def _percent(share: float) -> str:
    """Shares with as many digits as they deserve."""
    return f"{100.0 * share:.0f} %" if share in {0.0, 1.0} else f"{100.0 * share:.{2 if share < 0.01 else 1}f} %"


def _clock(stamp_ns: int) -> str:
    """A stamp as people read it."""
    moment = datetime.fromtimestamp(stamp_ns // SECOND_NS, UTC)
    return f"{moment:%Y-%m-%d %H:%M:%S}.{stamp_ns % SECOND_NS // 1_000_000:03d}"


def _bounds(number: int, condition: Condition, features: Features, frames: LabelledFrames) -> list[Markup]:
    """A picture for each bound: the errors over its feature, among the frames that the rest of the condition holds."""
    pictures = []
    for place, predicate in enumerate(condition.predicates):
        if not predicate.is_bound or predicate.feature not in features.numeric:
            continue
        others = _without_feature(condition, predicate).mask(features)
        values = features.numeric[predicate.feature][others]
        figure = bound_figure(predicate, values, frames.wrong[others])
        pictures.append(Markup(as_svg(figure, f"bound-{number}-{place}")))  # noqa: S704 - drawn here
    return pictures


def _without_feature(condition: Condition, predicate: Predicate) -> Condition:
    return Condition(tuple(other for other in condition.predicates if other.feature != predicate.feature))


def _flat(options: Mapping[str, object], prefix: str = "") -> dict[str, str]:
    """Options by their dotted names, as a configuration file says them."""
    flat: dict[str, str] = {}
    for name, value in options.items():
        if isinstance(value, Mapping):
            flat |= _flat(value, f"{prefix}{name}.")
        else:
            flat[f"{prefix}{name}"] = ", ".join(map(str, value)) if isinstance(value, list) else str(value)
    return flat
