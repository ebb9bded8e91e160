"""The self-test: many trials of planting and finding, over processes, and the counts of all of them."""

import json
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final

from sdt_tools.error_analysis.definitions import ErrorOptions
from sdt_tools.error_analysis.labelled import load_labelled
from sdt_tools.error_analysis.recorded import find_recordings, read_situations
from sdt_tools.error_analysis.selftest.chance import NULLS
from sdt_tools.error_analysis.selftest.material import Material, keep
from sdt_tools.error_analysis.selftest.trials import OUTCOME, condition_trial, null_trial, tag_trial
from sdt_tools.errors import UsageError
from sdt_tools.replay.predictions import PredictionKind
from sdt_tools.runs.local import Progress, run_units
from sdt_tools.runs.unit import Unit

TRIALS_A_TAG_TRIAL: Final = 5
"""Tags are judged frame by frame, thousands in a trial, so one trial in so many is enough."""
NULL_TRIALS_A_TRIAL: Final = 2
"""Of each kind of null data: rare events need more trials."""

Outcome = Mapping[str, Any]


@dataclass(frozen=True)
class Score:
    """Of one kind of error over all trials: frames planted, tagged as such, and both."""

    planted: int
    tagged: int
    both: int

    def document(self) -> dict[str, object]:
        """Precision and recall, null where nothing was tagged or planted."""
        return {
            "precision": self.both / self.tagged if self.tagged else None,
            "recall": self.both / self.planted if self.planted else None,
            "planted": self.planted,
            "tagged": self.tagged,
        }


@dataclass(frozen=True)
class ConditionScore:
    """Of conditions planted over all trials: how many were reported with the right features, and the right bounds."""

    planted: int
    features_right: int
    bounds_right: int


@dataclass(frozen=True)
class SelfTest:
    """What a self-test counted.

    ``false``: reported conditions most of whose frames lie outside planted ones; ``other``: reported conditions about
    planted frames in other words. ``missed`` tells planted conditions that were not found as planted, with what was
    reported instead. ``null``: of each kind the trials, and those in which a condition was reported.
    """

    seed: int
    trials: int
    alone: Mapping[str, Score]
    mixed: Mapping[str, Score]
    sharp: ConditionScore
    blurred: ConditionScore
    false: int
    other: int
    missed: tuple[Mapping[str, object], ...]
    null: Mapping[str, tuple[int, int]]
    seconds: float
    options: ErrorOptions

    def document(self) -> dict[str, object]:
        """As JSON-ready values."""
        return {
            "seed": self.seed,
            "trials": self.trials,
            "alone": {kind: score.document() for kind, score in self.alone.items()},
            "mixed": {kind: score.document() for kind, score in self.mixed.items()},
            "conditions": {
                "planted": self.sharp.planted + self.blurred.planted,
                "features_right": self.sharp.features_right + self.blurred.features_right,
                "bounds_right": self.sharp.bounds_right + self.blurred.bounds_right,
                "false": self.false,
                "other": self.other,
                "sharp": vars(self.sharp),
                "blurred": vars(self.blurred),
                "missed": list(self.missed),
            },
            "null": {
                kind: {"trials": trials, "with_false_condition": false} for kind, (trials, false) in self.null.items()
            },
            "seconds": round(self.seconds, 1),
            "options": self.options.model_dump(mode="json"),
        }


def run_selftest(
    options: ErrorOptions,
    seed: int,
    trials: int,
    null: bool,
    workers: int = 1,
    material: Material | None = None,
    progress: Progress | None = None,
) -> SelfTest:
    """Trials of planted conditions, a fifth as many of tags, and, with ``null``, twice as many of each sort of chance.

    The same seed and material give the same counts, however many ``workers``. Raises UsageError where errors cannot be
    planted into the ``material`` (synthetic drives unless given).
    """
    started = time.monotonic()
    context = {"material": material or Material(), "options": options}
    sorts: dict[str, list[Unit]] = {
        "tags": _units("tags", tag_trial, -(-trials // TRIALS_A_TAG_TRIAL), seed, context),
        "conditions": _units("conditions", condition_trial, trials, seed, context),
    }
    for kind in NULLS if null else ():
        sorts[kind] = _units(kind, null_trial, NULL_TRIALS_A_TRIAL * trials, seed, {**context, "kind": kind})
    units = [unit for sort in sorts.values() for unit in sort]
    with TemporaryDirectory(prefix="sdt-selftest-") as scratch:
        folders = iter(run_units(units, Path(scratch), workers, progress))
        outcomes = {sort: [_read(next(folders)) for _ in units_of_it] for sort, units_of_it in sorts.items()}
    judged = [one for outcome in outcomes["conditions"] for one in outcome["planted"]]
    return SelfTest(
        seed=seed,
        trials=trials,
        alone=_scores([outcome["alone"] for outcome in outcomes["tags"]]),
        mixed=_scores([outcome["mixed"] for outcome in outcomes["tags"]]),
        sharp=_condition_score([one for one in judged if one["sharp"]]),
        blurred=_condition_score([one for one in judged if not one["sharp"]]),
        false=sum(outcome["false"] for outcome in outcomes["conditions"]),
        other=sum(outcome["other"] for outcome in outcomes["conditions"]),
        missed=tuple(_missed(outcomes["conditions"])),
        null={kind: (len(outcomes[kind]), sum(bool(o["found"]) for o in outcomes[kind])) for kind in NULLS if null},
        seconds=time.monotonic() - started,
        options=options,
    )


def keep_predictions(
    predictions: Path,
    recordings: Sequence[Path],
    options: ErrorOptions,
    folder: Path,
    model: str | None = None,
    progress: Progress | None = None,
) -> Material:
    """The labelled frames of ``predictions`` as material, laid down in ``folder`` with the scans of ``recordings``.

    Raises UsageError and RecordingError as an analysis of them does.
    """
    frames = load_labelled(predictions, options, model)
    if frames.kind is not PredictionKind.SCANS:
        raise UsageError(f"{predictions}: answers to pictures; errors are planted into those to scans")
    scans, _ = read_situations(frames, find_recordings(frames, recordings), options, progress)
    return keep(frames, scans, folder)


def _units(
    name: str, function: Callable[..., None], count: int, seed: int, context: Mapping[str, object]
) -> list[Unit]:
    return [Unit(f"{name}-{trial}", function, {"seed": seed, "trial": trial}, context) for trial in range(count)]


def _read(folder: Path) -> Outcome:
    outcome: Outcome = json.loads((folder / OUTCOME).read_text(encoding="utf-8"))
    return outcome


def _scores(counts: Sequence[Mapping[str, Mapping[str, int]]]) -> dict[str, Score]:
    return {
        kind: Score(*(sum(one[kind][what] for one in counts) for what in ("planted", "tagged", "both")))
        for kind in (counts[0] if counts else ())
    }


def _condition_score(judged: Sequence[Outcome]) -> ConditionScore:
    right = [sum(bool(one[what]) for one in judged) for what in ("features_right", "bounds_right")]
    return ConditionScore(len(judged), *right)


def _missed(outcomes: Sequence[Outcome]) -> list[Mapping[str, object]]:
    return [
        {"trial": trial, "planted": one["text"], "sharp": one["sharp"], "found": outcome["found"]}
        for trial, outcome in enumerate(outcomes)
        for one in outcome["planted"]
        if not one["bounds_right"]
    ]
