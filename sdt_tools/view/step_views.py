"""Every view once more on the timeline ``error``: what was known at each error that can be stepped to."""

from collections.abc import Sequence

import numpy as np
import rerun as rr
from jaxtyping import Int64

from sdt_tools.view import entities
from sdt_tools.view.error_steps import draw_steps, numbered, stamps_of
from sdt_tools.view.map_view import send_robot
from sdt_tools.view.scan_view import send_motions
from sdt_tools.view.series import send_scalars
from sdt_tools.view.story import Story, picture_words_of, scan_words_of, send_operators
from sdt_tools.view.timeline import Changes, held, send
from sdt_tools.view.words import send_line


def draw_at_steps(stream: rr.RecordingStream, story: Story) -> None:
    """The list of errors, and at each of them arrows, words, lanes, curves, robot and operator; scans come later."""
    draw_steps(stream, story.steps, story.scans.stamps_ns)
    stamps_ns, steps = stamps_of(story.steps), numbered(story.steps)
    for entity, said_ns, names in _answers(story):
        send_motions(stream, entity, steps, _held(said_ns, names, stamps_ns), story.motions, story.notes.mount)
    for entity, said_ns, words in [*scan_words_of(story), *picture_words_of(story)]:
        send_line(stream, entity, steps, _held(said_ns, words, stamps_ns))
    for lane in story.lanes:
        send(stream, lane.entity, steps, rr.StateChange.columns(state=_state(lane.told, stamps_ns)))
    for track in story.models:
        rows = held(track.stamps_ns, stamps_ns)
        losses = np.where(rows >= 0, track.loss[np.maximum(rows, 0)], np.nan)
        send_scalars(stream, entities.loss(track.model), steps, losses)
    scans = held(story.scans.stamps_ns, stamps_ns)
    seen = np.flatnonzero(scans >= 0)
    send_scalars(stream, entities.FRONT_RANGE, steps.at(seen), story.scans.front_m[scans[seen]])
    bases = story.tracks.robot.at(stamps_ns).T if len(story.tracks.robot.stamps_ns) else np.empty((0, 3))
    known = np.isfinite(bases).all(axis=1)
    send_robot(stream, steps.at(np.flatnonzero(known)), bases[known])
    if len(story.tracks.operator.stamps_ns):
        send_operators(stream, story, steps, stamps_ns)


def _answers(story: Story) -> list[tuple[str, Int64[np.ndarray, "samples"], Sequence[str]]]:
    """What is drawn as an arrow: for each its entity, and what it says at which stamps."""
    answers = [
        (entities.scan_motion(track.model), track.stamps_ns, track.predicted)
        for track in story.models
        if not track.of_pictures
    ]
    return [(entities.SCAN_LABEL, story.labels.stamps_ns, story.labels.names), *answers]


def _held(said_ns: Int64[np.ndarray, "samples"], said: Sequence[str], at_ns: Int64[np.ndarray, "rows"]) -> list[str]:
    """What was said last, and still held, at each of ``at_ns``; empty where nothing."""
    return [said[row] if row >= 0 else "" for row in held(said_ns, at_ns).tolist()]


def _state(told: Changes, at_ns: Int64[np.ndarray, "rows"]) -> list[str]:
    """The state of a lane at each of ``at_ns``."""
    rows = np.searchsorted(told.stamps_ns, at_ns, side="right") - 1
    return [told.states[row] if row >= 0 else "" for row in rows.tolist()]
