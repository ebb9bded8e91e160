"""States as coloured lanes over time: labels, predictions, tags, mode, gesture, commands."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
import rerun as rr
from jaxtyping import Int64

from sdt_tools.replay.tracks import Tracks
from sdt_tools.view import entities, palette
from sdt_tools.view.decisions import Labels, ModelTrack, judge
from sdt_tools.view.notes import Notes
from sdt_tools.view.palette import Rgb
from sdt_tools.view.timeline import Changes, changes, send, when

SIGNAL_HOLD_NS: Final = 2_500_000_000
"""What the operator signals is told when it changes and once a second."""


@dataclass(frozen=True)
class Lane:
    """One lane: its entity, its states over time, and their colours."""

    entity: str
    told: Changes
    colors: Mapping[str, Rgb]


def lanes_of(
    tracks: Tracks, notes: Notes, labels: Labels, labelled_gestures: Labels, models: Sequence[ModelTrack]
) -> list[Lane]:
    """All lanes that have something to show."""
    commands, signals = tracks.commands, notes.signals
    command_ns = np.array([command.stamp_ns for command in commands], np.int64)
    signal_ns = np.array([signal.stamp_ns for signal in signals], np.int64)
    lanes = [
        Lane(entities.LANE_LABEL, changes(labels.stamps_ns, labels.names), palette.MOTIONS),
        Lane(
            entities.LANE_GESTURE_LABEL,
            changes(labelled_gestures.stamps_ns, labelled_gestures.names),
            palette.GESTURES,
        ),
    ]
    for track in models:
        predicted, judged = changes(track.stamps_ns, track.predicted), judge(track)
        lanes.append(Lane(entities.lane_predicted(track.model), predicted, palette.ANSWERS))
        lanes.append(Lane(entities.lane_tag(track.model), changes(judged.stamps_ns, judged.statuses), palette.STATUSES))
    gestures = changes(signal_ns, [signal.gesture.label for signal in signals], SIGNAL_HOLD_NS)
    motions = changes(command_ns, [command.motion.label for command in commands])
    modes = changes(command_ns, [command.mode.label for command in commands])
    lanes.append(Lane(entities.LANE_GESTURE, gestures, palette.GESTURES))
    lanes.append(Lane(entities.LANE_COMMAND, motions, palette.MOTIONS))
    lanes.append(Lane(entities.LANE_MODE, modes, palette.MODES))
    return [lane for lane in lanes if lane.told.states]


def send_lanes(stream: rr.RecordingStream, lanes: Sequence[Lane], scan_stamps_ns: Int64[np.ndarray, "scans"]) -> None:
    """Log ``lanes``."""
    for lane in lanes:
        style_lane(stream, lane.entity, lane.colors)
        rows = when(lane.told.stamps_ns, scan_stamps_ns)
        send(stream, lane.entity, rows, rr.StateChange.columns(state=lane.told.states))


def style_lane(stream: rr.RecordingStream, entity: str, colors: Mapping[str, Rgb]) -> None:
    """The colours of a lane's states."""
    names = [name.replace("_", " ") for name in colors]
    style = rr.StateConfiguration(values=list(colors), labels=names, colors=palette.packed(colors.values()))
    stream.log(entity, style, static=True, strict=True)
