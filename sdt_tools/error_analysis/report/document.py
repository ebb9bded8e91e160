"""What an error analysis found, as one document for people and machines."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from sdt_tools.error_analysis.conditions.confirmation import Verdict
from sdt_tools.error_analysis.definitions import ErrorOptions, Tag
from sdt_tools.error_analysis.epsilon import Epsilon
from sdt_tools.error_analysis.explain import Explanation
from sdt_tools.error_analysis.labelled import LabelledFrames
from sdt_tools.recording.incomplete import Incomplete
from sdt_tools.replay.predictions import PredictionKind
from sdt_tools.statistics import wilson


@dataclass(frozen=True)
class Share:
    """A count of frames, as a share of all, with its 95 % Wilson interval."""

    count: int
    share: float
    low: float
    high: float


@dataclass(frozen=True)
class ConfirmedCondition:
    """A condition that holds: the verdict of the confirming recordings, and what it covers in all of them."""

    verdict: Verdict
    frames: int
    errors: int

    def document(self) -> dict[str, object]:
        """As a part of the report."""
        return {**_verdict_document(self.verdict), "frames": self.frames, "errors": self.errors}


@dataclass(frozen=True)
class ErrorReport:
    """Counts, conditions and options of one analysis.

    ``rejected`` are conditions that were found but not confirmed. ``note`` says why nothing can be confirmed, where
    that is so; ``warnings`` what to be careful with; ``incomplete`` recordings were cut off or are damaged.
    """

    model: str
    kind: PredictionKind
    recordings: int
    frames: int
    errors: int
    tags: Mapping[Tag, Share]
    definition1_transient: int
    conditions: tuple[ConfirmedCondition, ...]
    rejected: tuple[Verdict, ...]
    features: tuple[str, ...]
    unavailable: tuple[str, ...]
    note: str
    epsilon: Epsilon
    options: ErrorOptions
    warnings: tuple[str, ...]
    incomplete: tuple[Incomplete, ...] = ()

    def document(self) -> dict[str, object]:
        """The report as JSON-ready values."""
        return {
            "model": self.model,
            "kind": str(self.kind),
            "recordings": self.recordings,
            "frames": self.frames,
            "errors": self.errors,
            "tags": {str(tag): share.count for tag, share in self.tags.items()},
            "shares": {str(tag): vars(share) for tag, share in self.tags.items()},
            "definition1_transient": self.definition1_transient,
            "conditions": [condition.document() for condition in self.conditions],
            "rejected_conditions": [
                {**_verdict_document(verdict), "reason": verdict.reason} for verdict in self.rejected
            ],
            "condition_note": self.note,
            "features": list(self.features),
            "features_unavailable": list(self.unavailable),
            "epsilon_m": self.epsilon.value if self.epsilon.measure.neighbourhood == "scan" else None,
            "epsilon": _epsilon_document(self.epsilon),
            "options": self.options.model_dump(mode="json"),
            "warnings": list(self.warnings),
            "truncated": any(recording.truncated for recording in self.incomplete),
            "incomplete": [recording.document() for recording in self.incomplete],
        }


def summarise(
    frames: LabelledFrames, explanation: Explanation, options: ErrorOptions, incomplete: tuple[Incomplete, ...] = ()
) -> ErrorReport:
    """Count what ``explanation`` says of ``frames``."""
    search, tagged = explanation.search, explanation.tagged
    total = len(frames.loss)
    return ErrorReport(
        model=str(frames.table["model"][0]),
        kind=frames.kind,
        recordings=frames.recordings,
        frames=total,
        errors=int(frames.wrong.sum()),
        tags={tag: _share(tagged.count(tag), total) for tag in Tag},
        definition1_transient=int(tagged.transient_by_definition.sum()),
        conditions=tuple(
            ConfirmedCondition(verdict, int(inside.sum()), int((inside & frames.wrong).sum()))
            for verdict, inside in zip(search.confirmed, search.inside, strict=True)
        ),
        rejected=tuple(verdict for verdict in search.verdicts if not verdict.confirmed),
        features=search.features,
        unavailable=search.unavailable,
        note=search.note,
        epsilon=explanation.epsilon,
        options=options,
        warnings=tuple(_warnings(frames, explanation)),
        incomplete=incomplete,
    )


def _warnings(frames: LabelledFrames, explanation: Explanation) -> list[str]:
    warnings = [explanation.epsilon.warning] if explanation.epsilon.warning else []
    if frames.wrong.any() and not explanation.tagged.neighbours[frames.wrong].any():
        warnings.append(
            f"no error frame has a neighbour within ε = {explanation.epsilon.text}, so none is transient; "
            f"a larger {explanation.epsilon.measure.option} or denser labels would tell"
        )
    return warnings


def _share(count: int, total: int) -> Share:
    low, high = wilson(count, total)
    return Share(count, count / total, low, high)


def _verdict_document(verdict: Verdict) -> dict[str, object]:
    return {
        "text": verdict.condition.text,
        "support": verdict.support,
        "mean_loss_in": verdict.mean_loss_in,
        "mean_loss_out": verdict.mean_loss_out,
        "p_adjusted": verdict.p_adjusted,
        "effect": verdict.effect,
        "effect_interval": verdict.effect_interval,
        "recordings": verdict.recordings,
    }


def _epsilon_document(epsilon: Epsilon) -> dict[str, object]:
    return {
        "value": epsilon.value,
        "neighbourhood": epsilon.measure.neighbourhood,
        "unit": epsilon.measure.unit,
        "source": epsilon.source,
        "successive_within": _within(epsilon.successive, epsilon.value),
        "unrelated_within": _within(epsilon.unrelated, epsilon.value),
        "unrelated_percentile_1": epsilon.unrelated_limit,
    }


def _within(distances: np.ndarray, epsilon: float) -> float | None:
    """Share of distances up to ε; None without any."""
    return float(np.mean(distances <= epsilon)) if distances.size else None
