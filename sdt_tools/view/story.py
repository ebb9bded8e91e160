"""Everything that is told of a recording besides its scans and images, gathered and drawn."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
import polars as pl
import rerun as rr
from jaxtyping import Int64

from sdt_tools.clock import SECOND_NS
from sdt_tools.config import MotionConfig
from sdt_tools.recording.reader import Recording
from sdt_tools.replay.tracks import Tracks, read_tracks
from sdt_tools.top_view import lidar_poses, seen_from
from sdt_tools.view import entities, palette
from sdt_tools.view.camera_view import send_signals, style_signals
from sdt_tools.view.decisions import Labels, ModelTrack, error_runs, labels_in, labels_of, models_of
from sdt_tools.view.error_steps import (
    ERROR_TAGS,
    ErrorStep,
    check_tags,
    error_steps,
    errors_elsewhere,
)
from sdt_tools.view.lanes import Lane, lanes_of, send_lanes
from sdt_tools.view.map_view import draw_way, send_robot, style_robot
from sdt_tools.view.notes import NOTE_TOPICS, Notes, read_notes
from sdt_tools.view.palette import Rgb
from sdt_tools.view.people import send_operator, style_operator
from sdt_tools.view.scan_view import BOLD, draw_furniture, send_motions, style_motion
from sdt_tools.view.series import send_losses, send_scalars, style_sensor_series
from sdt_tools.view.survey import Survey
from sdt_tools.view.timeline import Rows, changes, send, when
from sdt_tools.view.words import Line, draw_legend, picture_lines, scan_lines, send_words

LINE_HEIGHT: Final = 0.075
"""Height of a line beside the scan, as a share of the reach."""
PICTURE_LINE_HEIGHT: Final = 0.05
"""Height of a line in the picture, as a share of its width."""
TRUTH_NS: Final = SECOND_NS // 25
"""Poses are drawn 25 times a second at most."""


@dataclass(frozen=True, eq=False)
class Story:
    """What is known of a recording, besides scans and images themselves.

    ``steps`` are the errors to step through, and ``stepping`` whether that is what was asked for; ``elsewhere`` counts
    the like in other recordings.
    """

    scans: Survey
    tracks: Tracks
    notes: Notes
    labels: Labels
    labelled_gestures: Labels
    models: tuple[ModelTrack, ...]
    lanes: tuple[Lane, ...]
    motions: MotionConfig
    steps: tuple[ErrorStep, ...]
    stepping: bool
    elsewhere: Mapping[str, int]


def gather_story(
    source: Recording,
    scans: Survey,
    labels: pl.DataFrame | None,
    predictions: Sequence[pl.DataFrame],
    tags: Sequence[pl.DataFrame],
    step_tags: Collection[str],
    motions: MotionConfig,
) -> Story:
    """Gather what ``source`` says, and what ``labels``, ``predictions`` and ``tags`` say of it.

    ``labels`` are of scans, of pictures, or both. Errors with one of the tags ``step_tags`` (all without) can be
    stepped through. Raises UsageError where predictions or tags are given and none of them is about ``source``, and for
    the name of no tag.
    """
    check_tags(step_tags)
    wanted = step_tags or ERROR_TAGS
    tracks, notes = read_tracks(source), read_notes(source.messages(NOTE_TOPICS))
    given, gestures = labels_of(labels, palette.MOTIONS), labels_of(labels, palette.GESTURES)
    models = models_of(source.recording_id, predictions, tags, given, gestures)
    if labels is None:
        given, gestures = labels_in(models, of_pictures=False), labels_in(models, of_pictures=True)
    lanes = lanes_of(tracks, notes, given, gestures, models)
    return Story(
        scans=scans,
        tracks=tracks,
        notes=notes,
        labels=given,
        labelled_gestures=gestures,
        models=models,
        lanes=tuple(lanes),
        motions=motions,
        steps=error_steps(source.recording_id, tags, wanted),
        stepping=bool(step_tags),
        elsewhere=errors_elsewhere(source.recording_id, tags, wanted),
    )


def has_log(story: Story) -> bool:
    """Whether there is anything to say in words."""
    return bool(story.notes.log) or any(error_runs(track) for track in story.models)


def has_losses(story: Story) -> bool:
    """Whether any model's loss is known."""
    return any(bool(np.isfinite(track.loss).any()) for track in story.models)


def scan_words_of(story: Story) -> list[Line]:
    """What is said beside the scan."""
    return scan_lines(story.labels, story.models)


def picture_words_of(story: Story) -> list[Line]:
    """What is said in the picture."""
    return picture_lines(story.labelled_gestures, story.models)


def legend(story: Story) -> dict[str, Rgb]:
    """The colours that occur, by what they stand for."""
    statuses = {status for track in story.models if not track.of_pictures for status in track.statuses()}
    entries = {f"scan: {name}": color for name, color in palette.STATUSES.items() if name in statuses}
    if not statuses:
        entries["scan"] = palette.STATUSES[palette.UNLABELED]
    if story.labels.names:
        entries["label"] = palette.LABEL
    entries |= {track.model: palette.model_color(number) for number, track in enumerate(story.models)}
    if len(story.tracks.operator.stamps_ns):
        entries["operator (truth)"] = palette.OPERATOR
    return entries | {"safety zone, 0.2 m": palette.ZONE, "no distance": palette.CODE}


def draw_story(stream: rr.RecordingStream, story: Story) -> None:
    """Log all of ``story``."""
    stamps_ns = story.scans.stamps_ns
    draw_furniture(stream, story.notes.mount, story.scans.reach_m)
    draw_legend(stream, legend(story))
    reach_m, width_px = story.scans.reach_m, story.notes.image_width_px
    send_words(stream, scan_words_of(story), (-0.7 * reach_m, -0.96 * reach_m), LINE_HEIGHT * reach_m, stamps_ns)
    below_truth = (0.5 * width_px, 12.0 + PICTURE_LINE_HEIGHT * width_px)
    send_words(stream, picture_words_of(story), below_truth, PICTURE_LINE_HEIGHT * width_px, stamps_ns)
    send_lanes(stream, story.lanes, stamps_ns)
    send_losses(stream, story.models, stamps_ns)
    _draw_curves(stream, story)
    _draw_motions(stream, story)
    _draw_truth(stream, story)
    _draw_log(stream, story)


def _draw_curves(stream: rr.RecordingStream, story: Story) -> None:
    scans, commands = story.scans, story.tracks.commands
    style_sensor_series(stream)
    rows = when(scans.stamps_ns, scans.stamps_ns)
    send_scalars(stream, entities.FRONT_RANGE, rows, scans.front_m)
    send_scalars(stream, entities.CODE_SHARE, rows, scans.codes_percent)
    speeds_mps = np.array([command.twist.linear_mps for command in commands], np.float64)
    send_scalars(stream, entities.SPEED, when(_stamps([c.stamp_ns for c in commands]), scans.stamps_ns), speeds_mps)


def _draw_motions(stream: rr.RecordingStream, story: Story) -> None:
    """The arrows: the label broad and below, the models in their order on top of it."""
    arrows = [(entities.SCAN_LABEL, story.labels.stamps_ns, story.labels.names, palette.LABEL, 2.0 * BOLD)]
    for number, track in enumerate(story.models):
        if track.of_pictures:
            continue
        entity = entities.scan_motion(track.model)
        arrows.append((entity, track.stamps_ns, track.predicted, palette.model_color(number), BOLD))
    for order, (entity, stamps_ns, names, color, radius) in enumerate(arrows):
        style_motion(stream, entity, color, radius, 12.0 + order)
        told = changes(stamps_ns, names)
        rows = when(told.stamps_ns, story.scans.stamps_ns)
        send_motions(stream, entity, rows, told.states, story.motions, story.notes.mount)


def _draw_truth(stream: rr.RecordingStream, story: Story) -> None:
    """Where robot and operator were, and what he signalled, as far as it is known."""
    robot, operator, scan_ns = story.tracks.robot, story.tracks.operator, story.scans.stamps_ns
    robot_ns, operator_ns = _thinned(robot.stamps_ns), _thinned(operator.stamps_ns)
    if len(robot_ns):
        draw_way(stream, entities.MAP_ROBOT_WAY, robot, palette.QUIET)
        style_robot(stream)
        send_robot(stream, when(robot_ns, scan_ns), robot.at(robot_ns).T)
    if len(operator_ns):
        draw_way(stream, entities.MAP_OPERATOR_WAY, operator, palette.OPERATOR)
        style_operator(stream, entities.MAP_OPERATOR)
        style_operator(stream, entities.SCAN_OPERATOR)
        send_operators(stream, story, when(operator_ns, scan_ns), operator_ns)
    if story.notes.signals:
        signals = story.notes.signals
        style_signals(stream, story.notes.image_width_px)
        send_signals(stream, when(_stamps([signal.stamp_ns for signal in signals]), scan_ns), signals)


def send_operators(stream: rr.RecordingStream, story: Story, rows: Rows, stamps_ns: Int64[np.ndarray, "rows"]) -> None:
    """The operator in the map and in the scan, where he is known at ``stamps_ns``."""
    bases, poses = story.tracks.robot.at(stamps_ns).T, story.tracks.operator.at(stamps_ns).T
    there = np.isfinite(poses).all(axis=1)
    known = there & np.isfinite(bases).all(axis=1)
    seen = seen_from(lidar_poses(bases[known], story.notes.mount), poses[known])
    send_operator(stream, entities.MAP_OPERATOR, rows.at(there), poses[there])
    send_operator(stream, entities.SCAN_OPERATOR, rows.at(known), seen)


def _thinned(stamps_ns: Int64[np.ndarray, "all"]) -> Int64[np.ndarray, "some"]:
    """One stamp in so many that they are no denser than ``TRUTH_NS``."""
    if len(stamps_ns) < 2:
        return stamps_ns
    return stamps_ns[:: max(1, int(TRUTH_NS // max(1, int(np.median(np.diff(stamps_ns))))))]


def _draw_log(stream: rr.RecordingStream, story: Story) -> None:
    """The session log, and each model's errors in words."""
    entries = story.notes.log
    columns = rr.TextLog.columns(
        text=[entry.text for entry in entries], level=[palette.LOG_LEVELS[entry.level] for entry in entries]
    )
    rows = when(_stamps([entry.stamp_ns for entry in entries]), story.scans.stamps_ns)
    send(stream, entities.SESSION_LOG, rows, columns)
    for track in story.models:
        runs = error_runs(track)
        columns = rr.TextLog.columns(
            text=[f"{track.model} {run.text()}" for run in runs], level=[rr.TextLogLevel.WARN] * len(runs)
        )
        rows = when(_stamps([run.stamp_ns for run in runs]), story.scans.stamps_ns)
        send(stream, entities.error_log(track.model), rows, columns)


def _stamps(values: list[int]) -> Int64[np.ndarray, "rows"]:
    return np.array(values, np.int64)
