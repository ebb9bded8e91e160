"""What errors of adversarially trained vision networks are like: transient, and uniform over scenarios.

Any model can be asked: the claims are judged of the models named, and of those whose checkpoint says that they were
trained on balls around their samples.

The rules, fixed before data were looked at; units are recordings.

- *Transient*: the number that decides is the share of errors tagged transient. Supported where its interval lies above
  ``most``, contradicted where it lies below. Needs tags.
- *Uniform*: the number that decides is the farthest ratio of a scenario's error rate to that of all frames, as a factor
  ≥ 1. Whether scenarios differ at all is asked by permutation: recordings, with all their frames, are dealt to
  scenarios anew, and the χ² of errors by scenario is compared. Contradicted where p ≤ ``alpha``. Supported where p is
  above it and every scenario's interval lies within ``uniform_factor``; no test can show equality, so a bound on the
  difference must.
"""

from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np
import polars as pl
from jaxtyping import Float64, Int64

from sdt_tools.error_analysis.claims.options import ClaimOptions
from sdt_tools.error_analysis.claims.verdict import ClaimVerdict, Finding, at_least, reason_of, undecided
from sdt_tools.error_analysis.definitions import Tag
from sdt_tools.error_analysis.resampling import draw_units, estimate, ratio, sum_by_unit
from sdt_tools.error_analysis.side_by_side import KEYS, SideBySide

TRANSIENT: Final = "transient"
UNIFORM: Final = "uniform"
STATEMENTS: Final = {
    TRANSIENT: "Errors of adversarially trained vision networks are transient.",
    UNIFORM: "Errors of adversarially trained vision networks are spread evenly over scenarios.",
}
PICTURE: Final = "uniform.png"
NOT_GIVEN: Final = "no adversarially trained network among the predictions; name one with --adversarial"


def judge_adversarial(
    frames: SideBySide, models: Sequence[str], tags: Mapping[str, pl.DataFrame], options: ClaimOptions
) -> list[ClaimVerdict]:
    """Both claims for each of ``models``; ``tags`` are tag tables by model."""
    if not models:
        return [undecided(claim, "", STATEMENTS[claim], NOT_GIVEN) for claim in (TRANSIENT, UNIFORM)]
    draws = draw_units(frames.recordings, options.resamples, options.seed)
    verdicts = []
    for model in models:
        verdicts.append(_judge_transient(frames, model, tags.get(model), draws, options))
        verdicts.append(_judge_uniform(frames, model, draws, options))
    return verdicts


def _judge_transient(
    frames: SideBySide,
    model: str,
    tags: pl.DataFrame | None,
    draws: Int64[np.ndarray, "recordings draws"],
    options: ClaimOptions,
) -> ClaimVerdict:
    wrong = frames.wrong[frames.models.index(model)]
    errors = int(wrong.sum())
    statement = STATEMENTS[TRANSIENT]
    if tags is None:
        return undecided(TRANSIENT, model, statement, "its errors are not tagged; add --tags", frames=errors)
    recordings = int(np.unique(frames.recording[wrong]).size)
    if recordings < options.min_recordings:
        reason = f"{errors} errors in {recordings} recordings"
        return undecided(TRANSIENT, model, statement, reason, frames=errors, recordings=recordings)
    rows = frames.table.select(KEYS).join(tags, on=KEYS, how="left", maintain_order="left")["tag"]
    shares = {}
    for tag in (each for each in Tag if each is not Tag.CORRECT):
        tagged = (rows == tag.value).fill_null(value=False).to_numpy() & wrong
        sums = sum_by_unit(np.array([tagged, wrong], dtype=np.float64), frames.recording, frames.recordings)
        shares[tag] = estimate(sums, ratio, draws)
    finding = at_least(shares[Tag.TRANSIENT], options.most)
    return ClaimVerdict(
        claim=TRANSIENT,
        about=model,
        statement=statement,
        finding=finding,
        reason=f"{shares[Tag.TRANSIENT].value:.0%} of errors; "
        + reason_of(finding, f"more than {options.most:.0%}", f"less than {options.most:.0%}"),
        measure="share of errors that are transient",
        estimate=shares[Tag.TRANSIENT],
        frames=errors,
        recordings=recordings,
        picture=PICTURE,
        numbers={"shares": {str(tag): share.document() for tag, share in shares.items()}},
    )


def _judge_uniform(
    frames: SideBySide, model: str, draws: Int64[np.ndarray, "recordings draws"], options: ClaimOptions
) -> ClaimVerdict:
    wrong = frames.wrong[frames.models.index(model)].astype(np.float64)
    statement = STATEMENTS[UNIFORM]
    first = np.flatnonzero(np.diff(frames.recording, prepend=-1))
    scenario = frames.table["scenario"].fill_null("")[first].to_numpy()
    sums = sum_by_unit(np.array([wrong, np.ones_like(wrong)]), frames.recording, frames.recordings)
    names, counts = np.unique(scenario, return_counts=True)
    errors = int(wrong.sum())
    if len(names) < 2 or frames.recordings < options.min_recordings or errors == 0 or counts.min() < 2:
        reason = (
            f"{errors} errors in {frames.recordings} recordings of {len(names)} scenarios; "
            "needs two scenarios with two recordings each, and errors"
        )
        return undecided(UNIFORM, model, statement, reason, frames=errors, recordings=frames.recordings)
    ratios = {}
    for name in names:
        parts = np.concatenate([sums * (scenario == name), sums])
        ratios[str(name)] = estimate(parts, _ratio_to_all, draws)
    farthest = max(ratios.values(), key=lambda one: abs(np.log(max(one.value, 1e-9))))
    p_value = permutation_p(sums, scenario, options.permutations, options.seed)
    limit = np.log(options.uniform_factor)
    within = all(
        one.low > 0.0 and np.isfinite(one.high) and abs(np.log(one.low)) < limit and abs(np.log(one.high)) < limit
        for one in ratios.values()
    )
    finding = Finding.CONTRADICTED if p_value <= options.alpha else Finding.SUPPORTED if within else Finding.UNDECIDED
    words = {
        Finding.CONTRADICTED: "scenarios differ by more than chance",
        Finding.SUPPORTED: f"every scenario within a factor of {options.uniform_factor:g}",
        Finding.UNDECIDED: f"no difference shown, but one beyond a factor of {options.uniform_factor:g} is possible",
    }
    return ClaimVerdict(
        claim=UNIFORM,
        about=model,
        statement=statement,
        finding=finding,
        reason=f"{words[finding]} (p = {p_value:.3g})",
        measure="farthest ratio of a scenario's error rate to that of all",
        estimate=farthest,
        frames=errors,
        recordings=frames.recordings,
        picture=PICTURE,
        numbers={
            "p_value": p_value,
            "ratios": {name: one.document() for name, one in ratios.items()},
            "recordings": dict(zip(names.tolist(), counts.tolist(), strict=True)),
        },
    )


def permutation_p(
    sums: Float64[np.ndarray, "2 recordings"], scenario: np.ndarray, permutations: int, seed: int
) -> float:
    """p-value of the χ² of errors by scenario when recordings (errors, frames) are dealt to scenarios anew."""
    rng = np.random.default_rng(seed)
    member = (scenario[None] == np.unique(scenario)[:, None]).astype(np.float64)
    observed = _chi_square(sums, member)
    dealt = [_chi_square(sums[:, rng.permutation(sums.shape[1])], member) for _ in range(permutations)]
    return float(1 + np.sum(np.array(dealt) >= observed - 1e-9)) / (permutations + 1)


def _chi_square(
    sums: Float64[np.ndarray, "2 recordings"], member: Float64[np.ndarray, "scenarios recordings"]
) -> float:
    errors, frames = member @ sums[0], member @ sums[1]
    rate = errors.sum() / frames.sum()
    expected = frames * rate
    return float(np.sum((errors - expected) ** 2 / np.maximum(expected * (1.0 - rate), 1e-12)))


def _ratio_to_all(totals: np.ndarray) -> np.ndarray:
    """Error rate of a part over that of all."""
    result: np.ndarray = (totals[0] / totals[1]) / (totals[2] / totals[3])
    return result
