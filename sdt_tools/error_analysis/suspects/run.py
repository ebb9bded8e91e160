"""From files to a file of suspects."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from sdt_tools.error_analysis.suspects.find import SuspectReport, check_out, find_suspects, save_suspects
from sdt_tools.error_analysis.suspects.held_out import judge_held_out
from sdt_tools.error_analysis.suspects.options import SuspectOptions
from sdt_tools.error_analysis.suspects.sources import judged_by_predictions, scans_of_dataset, scans_of_recordings
from sdt_tools.errors import UsageError
from sdt_tools.labeling.vocabulary import LabelKind, journal_path
from sdt_tools.runs.unit import content_hash

StageProgress = Callable[[str, int, int], None]
"""Called with the stage, and what of it is done and in all."""


@dataclass(frozen=True)
class LabelSource:
    """Where labels come from: exactly one of a data set, recordings (with the folder of their labels), predictions."""

    dataset: Path | None = None
    recordings: Sequence[Path] = ()
    labels: Path = Path("labels")
    predictions: Sequence[Path] = ()
    model: str | None = None


def write_suspect_labels(
    source: LabelSource, options: SuspectOptions, out: Path, progress: StageProgress
) -> SuspectReport:
    """Look for suspects in ``source`` and write them to ``out`` (.csv or .parquet), with an account beside it (.json).

    Raises UsageError where it is not exactly one source, or nothing can be said of it, OutputExistsError, and what
    reading the source raises.
    """
    check_out(out)
    if sum((source.dataset is not None, bool(source.recordings), bool(source.predictions))) != 1:
        raise UsageError("name one source of labels: a data set, --recordings (with --labels), or --predictions")
    if source.predictions:
        judged = judged_by_predictions(source.predictions, source.model)
    else:
        scans = (
            scans_of_dataset(source.dataset)
            if source.dataset
            else scans_of_recordings(
                source.recordings, source.labels, options, lambda done, total: progress("reading", done, total)
            )
        )
        judged = judge_held_out(scans, options, lambda done, total: progress("training", done, total))
    report = find_suspects(judged, options)
    save_suspects(report, out, _inputs(source))
    return report


def _inputs(source: LabelSource) -> Mapping[str, str]:
    """Hashes of all that was read, by name."""
    journals = [journal_path(source.labels, path.stem, LabelKind.MOTION) for path in source.recordings]
    paths = [*([source.dataset] if source.dataset else []), *source.recordings, *journals, *source.predictions]
    return {str(path): content_hash(path) for path in paths}
