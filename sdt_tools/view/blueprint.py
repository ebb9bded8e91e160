"""How the views are laid out: what a recording does not have gets no room."""

from dataclasses import dataclass
from typing import Final

import rerun.blueprint as rrb

from sdt_tools.view import entities, palette
from sdt_tools.view.map_view import Bounds
from sdt_tools.view.timeline import ERROR, FRAME, TIME

LEGEND_LINES: Final = 10
"""A shorter legend leaves room below it."""


@dataclass(frozen=True)
class Content:
    """What there is to show.

    ``reach_m``: how far the scan is shown at first; ``pictures_first``: whether the
    camera is given the large place, not the scan; ``map_bounds``: None without odometry; ``errors``: whether there
    are some to step through, and ``stepping``: whether the view begins at the first of them.
    """

    reach_m: float
    legend_lines: int = 3
    camera: bool = False
    pictures_first: bool = False
    lanes: bool = False
    losses: bool = False
    log: bool = False
    errors: bool = False
    stepping: bool = False
    map_bounds: Bounds | None = None


def blueprint(content: Content) -> rrb.Blueprint:
    """The layout for ``content``: space above, time below."""
    scan, camera = _scan(content.reach_m), [_camera()] if content.camera else []
    large, small = (camera[0], [scan]) if camera and content.pictures_first else (scan, camera)
    side: list[rrb.View] = [*small, *([_map(content.map_bounds)] if content.map_bounds else [])]
    above: list[rrb.View | rrb.Container] = [
        large,
        _legend(content.legend_lines),
        *([rrb.Vertical(*side)] if side else []),
    ]
    curves = rrb.Vertical(*([_losses()] if content.losses else []), *_sensor(apart=not content.losses))
    below: list[tuple[rrb.View | rrb.Container, float]] = [(curves, 3.0)]
    below = [*([(_lanes(), 3.0)] if content.lanes else []), *below, *_words(content)]
    return rrb.Blueprint(
        rrb.Vertical(
            rrb.Horizontal(*above, column_shares=[6.0, 1.0, 3.5][: len(above)]),
            rrb.Horizontal(*(view for view, _ in below), column_shares=[share for _, share in below]),
            row_shares=[3, 2] if content.lanes else [2, 1],
        ),
        _time_panel(content),
        rrb.SelectionPanel(state="hidden"),
        rrb.BlueprintPanel(state="hidden"),
        auto_views=False,
        auto_layout=False,
    )


def _time_panel(content: Content) -> rrb.TimePanel:
    """Where one steps from error to error, it begins at the first and waits."""
    if content.errors and content.stepping:
        return rrb.TimePanel(timeline=ERROR, state="collapsed", play_state="paused", fps=1.0)
    return rrb.TimePanel(timeline=TIME, state="collapsed")


def _words(content: Content) -> list[tuple[rrb.View | rrb.Container, float]]:
    """The error of the moment above the list of all, the log behind the list; without errors, the log."""
    if not content.errors:
        return [(_log(), 2.0)] if content.log else []
    lists = rrb.Tabs(_errors(), *([_log()] if content.log else []))
    return [(rrb.Vertical(_this_error(), lists, row_shares=[2, 3]), 2.5)]


def _errors() -> rrb.TextLogView:
    columns = rrb.TextLogColumns(timeline_columns=[ERROR], text_log_columns=["Body"])
    return rrb.TextLogView(origin=entities.ERROR_LIST, name="Errors (a number leads to it)", columns=columns)


def _this_error() -> rrb.TextDocumentView:
    return rrb.TextDocumentView(origin=entities.ERROR_WORDS, name="This error")


def _scan(reach_m: float) -> rrb.Spatial2DView:
    return rrb.Spatial2DView(
        origin=entities.SCAN,
        name="Scan from above (ahead is up)",
        background=palette.BACKGROUND,
        visual_bounds=rrb.VisualBounds2D(x_range=[-reach_m, reach_m], y_range=[-reach_m, 0.4 * reach_m]),
    )


def _camera() -> rrb.Spatial2DView:
    return rrb.Spatial2DView(origin=entities.CAMERA, name="Camera")


def _map(bounds: Bounds) -> rrb.Spatial2DView:
    return rrb.Spatial2DView(
        origin=entities.MAP,
        name="Map (odometry)",
        background=palette.BACKGROUND,
        visual_bounds=rrb.VisualBounds2D(x_range=[bounds.left, bounds.right], y_range=[bounds.top, bounds.bottom]),
    )


def _lanes() -> rrb.StateTimelineView:
    return rrb.StateTimelineView(
        origin="/",
        contents=entities.LANES,
        name="Labels, predictions, tags",
        time_view=rrb.archetypes.TimeAxis(link="LinkToGlobal"),
    )


def _losses() -> rrb.TimeSeriesView:
    return _series("Loss (cross-entropy)", [f"{entities.LOSS}/**"])


def _sensor(apart: bool) -> list[rrb.TimeSeriesView]:
    """Range and speed; the share of codes in a view of its own, where there is room."""
    ahead = _series("Range ahead and speed", [entities.FRONT_RANGE, entities.SPEED])
    return [ahead, _series("Rays without a distance", [entities.CODE_SHARE])] if apart else [ahead]


def _series(name: str, contents: list[str]) -> rrb.TimeSeriesView:
    axis = rrb.archetypes.TimeAxis(link="LinkToGlobal")
    return rrb.TimeSeriesView(origin="/", contents=contents, name=name, axis_x=axis)


def _log() -> rrb.TextLogView:
    columns = rrb.TextLogColumns(timeline_columns=[FRAME], text_log_columns=["LogLevel", "Body"])
    return rrb.TextLogView(origin=entities.LOG, name="Log", columns=columns)


def _legend(lines: int) -> rrb.Spatial2DView:
    return rrb.Spatial2DView(
        origin=entities.LEGEND,
        name="Key",
        background=palette.BACKGROUND,
        visual_bounds=rrb.VisualBounds2D(x_range=[-1.0, 1.0], y_range=[0.0, max(lines, LEGEND_LINES)]),
    )
