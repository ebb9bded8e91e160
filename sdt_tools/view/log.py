"""A whole recording as one .rrd: scans, camera, truth, labels, predictions and tags on one timeline."""

import time
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
import polars as pl
import rerun as rr
from jaxtyping import Int64

from sdt_tools.config import MotionConfig
from sdt_tools.errors import OutputExistsError, UsageError
from sdt_tools.frames import RAYS, CameraImage
from sdt_tools.recording.incomplete import Incomplete, incomplete
from sdt_tools.recording.messages.topics import CAMERA_IMAGE
from sdt_tools.recording.reader import Recording
from sdt_tools.view.blueprint import Content, blueprint
from sdt_tools.view.camera_view import send_images
from sdt_tools.view.decisions import NOTHING_JUDGED, judge
from sdt_tools.view.error_steps import ErrorStep, numbered, scans_at, stamps_of
from sdt_tools.view.map_view import draw_surroundings, map_bounds
from sdt_tools.view.palette import UNLABELED
from sdt_tools.view.rrd_file import RrdFile
from sdt_tools.view.scan_view import send_scans, style_scans
from sdt_tools.view.step_views import draw_at_steps
from sdt_tools.view.story import Story, draw_story, gather_story, has_log, has_losses, legend
from sdt_tools.view.survey import survey
from sdt_tools.view.timeline import held, when

SCANS_AT_ONCE: Final = 512
IMAGES_AT_ONCE: Final = 64
SCANS_ON_MAP: Final = 150


@dataclass(frozen=True)
class ViewSummary:
    """What went into an .rrd. ``lanes`` are entities; an ``incomplete`` recording is shown as far as it goes.

    ``errors`` are those to step through, in the order of their numbers; ``errors_elsewhere`` counts the like in other
    recordings.
    """

    out: Path
    recording_id: str
    scans: int
    scans_shown: int
    images: int
    models: tuple[str, ...]
    lanes: tuple[str, ...]
    errors: tuple[ErrorStep, ...]
    errors_elsewhere: Mapping[str, int]
    incomplete: Incomplete | None
    seconds: float

    @property
    def truncated(self) -> bool:
        """Whether the recording was cut off."""
        return self.incomplete is not None and self.incomplete.truncated


def write_rrd(
    recording: Path,
    out: Path,
    *,
    labels: pl.DataFrame | None = None,
    predictions: Sequence[pl.DataFrame] = (),
    tags: Sequence[pl.DataFrame] = (),
    step_tags: Collection[str] = (),
    every: int = 1,
    motions: MotionConfig | None = None,
) -> ViewSummary:
    """Write ``recording`` with all that is known of it to ``out``, its layout inside.

    ``labels`` are resolved (stamp_ns, label), of scans, of pictures, or both; ``predictions`` and ``tags`` have the
    columns of prediction files and of tag files, of any number of models and recordings: rows of other recordings are
    passed over. The first follow network colours the scans; what vision networks answer stands in the picture. Errors
    with one of the tags ``step_tags`` can be stepped through, and the view begins at the first; without, all errors
    can, and it begins with the recording. ``every`` shows one scan in so many; ``motions`` shapes the arrows.

    Raises OutputExistsError; UsageError for ``every`` below 1 and for predictions or tags of which none is about
    ``recording``; RecordingError where there is nothing to read; RunError where the disk does not take it all.
    """
    began = time.perf_counter()
    if every < 1:
        raise UsageError(f"every = {every}; show every scan with 1, one in five with 5")
    if out.exists():
        raise OutputExistsError(out)
    with Recording.open(recording) as source:
        scans = survey(source.scan_batches(SCANS_AT_ONCE))
        story = gather_story(source, scans, labels, predictions, tags, step_tags, motions or MotionConfig())
        out.parent.mkdir(parents=True, exist_ok=True)
        partial = out.with_name(f".{out.name}.partial")
        try:
            shown, images = _write(partial, out.stem, source, story, every)
            partial.replace(out)
        finally:
            partial.unlink(missing_ok=True)
        return ViewSummary(
            out=out,
            recording_id=source.recording_id,
            scans=len(scans.stamps_ns),
            scans_shown=shown,
            images=images,
            models=tuple(track.model for track in story.models),
            lanes=tuple(lane.entity for lane in story.lanes),
            errors=story.steps,
            errors_elsewhere=story.elsewhere,
            incomplete=incomplete(source),
            seconds=time.perf_counter() - began,
        )


def _write(path: Path, name: str, source: Recording, story: Story, every: int) -> tuple[int, int]:
    """Log all of it to ``path``; returns how many scans and images.

    A viewer keeps one layout an application, so each file is one: opened beside others, it keeps its own.
    """
    layout = blueprint(_content(source, story))
    with RrdFile(path, f"sdt {name}", f"{source.recording_id}/{name}", layout) as file:
        file.stream.send_recording_name(source.stem)
        draw_story(file.stream, story)
        if story.steps:
            draw_at_steps(file.stream, story)
        return _draw_scans(file.stream, source, story, every), _draw_images(file.stream, source, story)


def _content(source: Recording, story: Story) -> Content:
    robot, operator = story.tracks.robot, story.tracks.operator
    return Content(
        reach_m=story.scans.reach_m,
        legend_lines=len(legend(story)),
        camera=CAMERA_IMAGE in source.topics,
        pictures_first=bool(story.models) and all(track.of_pictures for track in story.models),
        lanes=bool(story.lanes),
        losses=has_losses(story),
        log=has_log(story),
        errors=bool(story.steps),
        stepping=story.stepping,
        map_bounds=map_bounds([robot, operator]) if len(robot.stamps_ns) else None,
    )


def _draw_scans(stream: rr.RecordingStream, source: Recording, story: Story, every: int) -> int:
    """One scan in ``every``, and those of errors; a few, spread over the recording, go into the map."""
    scan_ns, reach_m = story.scans.stamps_ns, story.scans.reach_m
    steps_ns, steps = _scans_of_steps(story), numbered(story.steps)
    judged = next((judge(track) for track in story.models if not track.of_pictures), NOTHING_JUDGED)
    on_map = np.unique(np.linspace(0, max(0, len(scan_ns) - 1), SCANS_ON_MAP).astype(np.int64))
    kept_ns, kept_m = [np.empty(0, np.int64)], [np.empty((0, RAYS))]
    style_scans(stream)
    seen = shown = 0
    for batch in source.scan_batches(SCANS_AT_ONCE):
        numbers = np.arange(seen, seen + len(batch))
        chosen, kept = numbers % every == 0, np.isin(numbers, on_map)
        rows = when(batch.stamps_ns[chosen], scan_ns)
        send_scans(stream, rows, batch.ranges_m[chosen], judged.at(rows.stamps_ns), reach_m)
        found, ranges_m = scans_at(batch.stamps_ns, batch.ranges_m, steps_ns)
        send_scans(stream, steps.at(found), ranges_m, _colours_of_steps(story, found.tolist()), reach_m)
        kept_ns.append(batch.stamps_ns[kept])
        kept_m.append(batch.ranges_m[kept])
        seen, shown = seen + len(batch), shown + len(rows)
    robot, mount = story.tracks.robot, story.notes.mount
    draw_surroundings(stream, np.concatenate(kept_m), np.concatenate(kept_ns), robot, mount)
    return shown


def _scans_of_steps(story: Story) -> Int64[np.ndarray, "steps"]:
    """The stamp of the scan that goes with each step: the newest, which for a follow network is its own."""
    stamps_ns, scan_ns = stamps_of(story.steps), story.scans.stamps_ns
    rows = held(scan_ns, stamps_ns)
    return np.where(rows >= 0, scan_ns[rows], -1) if len(scan_ns) else np.full(len(stamps_ns), -1)


def _colours_of_steps(story: Story, steps: Sequence[int]) -> list[str]:
    """What the scan of each step is coloured after: the error, where it is one of scans."""
    of_pictures = {track.model for track in story.models if track.of_pictures}
    return [UNLABELED if story.steps[n].model in of_pictures else story.steps[n].tag for n in steps]


def _draw_images(stream: rr.RecordingStream, source: Recording, story: Story) -> int:
    """All images, some at a time."""
    count = 0
    waiting: list[CameraImage] = []
    for received in source.messages([CAMERA_IMAGE]):
        assert isinstance(received.message, CameraImage)
        waiting.append(received.message)
        count += 1
        if len(waiting) == IMAGES_AT_ONCE:
            _send_waiting(stream, waiting, story)
            waiting = []
    _send_waiting(stream, waiting, story)
    return count


def _send_waiting(stream: rr.RecordingStream, images: list[CameraImage], story: Story) -> None:
    """Some images; those taken in the last moment before an error are shown with it too."""
    stamps_ns = np.array([image.stamp_ns for image in images], np.int64)
    send_images(stream, when(stamps_ns, story.scans.stamps_ns), images)
    seen = held(stamps_ns, stamps_of(story.steps))
    known = np.flatnonzero(seen >= 0)
    send_images(stream, numbered(story.steps).at(known), [images[number] for number in seen[known].tolist()])
