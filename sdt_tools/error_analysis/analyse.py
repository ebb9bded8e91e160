"""From a predictions file and its recordings to a folder that says why frames are wrong."""

import json
import os
import shutil
from collections.abc import Sequence
from pathlib import Path
from typing import Final

from sdt_tools.error_analysis.definitions import ErrorOptions
from sdt_tools.error_analysis.explain import explain
from sdt_tools.error_analysis.featured import read_features
from sdt_tools.error_analysis.labelled import LabelledFrames, load_labelled
from sdt_tools.error_analysis.recorded import find_recordings, incomplete_among, read_situations
from sdt_tools.error_analysis.report.document import ErrorReport, summarise
from sdt_tools.error_analysis.report.examples import draw_examples
from sdt_tools.error_analysis.report.figures import epsilon_figure, save_png, tags_figure
from sdt_tools.error_analysis.report.page import Sources, render_page
from sdt_tools.error_analysis.report.tags_file import tag_table, write_tags
from sdt_tools.error_analysis.spaces import Space, TimeSpace, feature_space, scan_space
from sdt_tools.error_analysis.suited import suited_options
from sdt_tools.errors import OutputExistsError
from sdt_tools.recording.incomplete import Incomplete
from sdt_tools.replay.predictions import kind_of, scan_predictions
from sdt_tools.runs.code import code_version
from sdt_tools.runs.local import Progress
from sdt_tools.runs.unit import content_hash

TAGS: Final = "tags.parquet"
REPORT: Final = "errors.json"
PAGE: Final = "report.html"
EPSILON_FIGURE: Final = "epsilon.png"
TAGS_FIGURE: Final = "tags.png"


def analyse_errors(
    predictions: Path,
    recordings: Sequence[Path],
    options: ErrorOptions,
    out: Path,
    model: str | None = None,
    progress: Progress | None = None,
    found_at: Path | None = None,
) -> ErrorReport:
    """Tag every labelled frame of ``predictions`` and write the folder ``out``: tags, report, page, two figures.

    ``recordings`` are MCAP files or folders of them, from which scans and pictures are read again; ``model`` is needed
    where the predictions are of several. ``found_at`` is where the folder will lie for good, for the commands in the
    page; without, ``out``. ``progress`` hears of recordings read, then of error frames compared. While it works it
    needs disk beside ``out``: 2.2 kB a scan, for pictures 4 bytes a feature. Raises UsageError for predictions that
    cannot be analysed, RecordingError for recordings that are missing or others, OutputExistsError, SdtError without
    that room.
    """
    if out.exists():
        raise OutputExistsError(out)
    options = suited_options(options, kind_of(scan_predictions([predictions]).collect_schema().names()))
    frames = load_labelled(predictions, options, model)
    paths = find_recordings(frames, recordings)
    space, incomplete = _space(frames, predictions, paths, options, out.parent, progress)
    explanation = explain(frames, space, options, progress)
    report = summarise(frames, explanation, options, incomplete)
    examples = draw_examples(frames, explanation, space, paths, options)
    inputs = {"predictions": content_hash(predictions), "recordings": {path.stem: content_hash(path) for path in paths}}
    document = {**report.document(), "code_version": code_version(), "inputs": inputs}
    sources = Sources(predictions, found_at or out, TAGS)
    scratch = out.with_name(f".{out.name}.{os.getpid()}.part")
    shutil.rmtree(scratch, ignore_errors=True)
    scratch.mkdir(parents=True)
    try:
        write_tags(tag_table(frames, explanation), scratch / TAGS, document)
        (scratch / REPORT).write_text(json.dumps(document, indent=2, ensure_ascii=False) + "\n", "utf-8")
        page = render_page(report, frames, explanation, examples, sources, document)
        (scratch / PAGE).write_text(page, "utf-8")
        save_png(epsilon_figure(report.epsilon), scratch / EPSILON_FIGURE)
        save_png(tags_figure(report), scratch / TAGS_FIGURE)
        scratch.rename(out)
    finally:
        shutil.rmtree(scratch, ignore_errors=True)
    return report


def _space(
    frames: LabelledFrames,
    predictions: Path,
    paths: Sequence[Path],
    options: ErrorOptions,
    scratch: Path,
    progress: Progress | None,
) -> tuple[Space, tuple[Incomplete, ...]]:
    """Where the frames lie, as the options say, and the recordings that are cut off or damaged."""
    if options.neighbourhood == "scan":
        scans, incomplete = read_situations(frames, paths, options, progress, scratch)
        return scan_space(scans), incomplete
    if options.neighbourhood == "feature":
        return feature_space(read_features(frames, predictions, scratch)), incomplete_among(paths)
    return TimeSpace(frames.recording, frames.stamp_ns), incomplete_among(paths)
