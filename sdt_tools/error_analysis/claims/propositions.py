"""The two Propositions, checked on the data at hand.

They are statements of logic, so a check can only fail where definitions or code differ from the paper's; that is what
it is for. The rules: supported where every case agrees, contradicted where one does not, undecided without a case.

- Proposition 1: adversarial training is safety-domain training with balls around the samples as domains and no other
  data. For samples of the recordings, scans are drawn and searched in each ball; the mean of the worst losses by the
  one criterion (Eq. 5, cross-entropy) and the other (Eq. 6, λ = 1, without samples) must be the same, and the scans
  must lie in the domains.
- Proposition 2: a transient error is a conditional error of one point, its complement the frames within ε (Definition 3
  over these); a systematic error is the limit case, the domain of all data with an empty complement.
"""

from typing import Final

import numpy as np
import torch
from jaxtyping import Float32, Int64

from sdt_tools.error_analysis.claims.options import ClaimOptions
from sdt_tools.error_analysis.claims.verdict import ClaimVerdict, Finding, undecided
from sdt_tools.error_analysis.definitions import is_conditional, is_systematic, is_transient, is_wrong
from sdt_tools.error_analysis.distance import rms_m
from sdt_tools.error_analysis.labelled import LabelledFrames
from sdt_tools.error_analysis.resampling import UNKNOWN, Estimate
from sdt_tools.frames import MotionClass
from sdt_tools.models.follow_net import FollowNet
from sdt_tools.models.loaded import one_torch_thread
from sdt_tools.robustness.boxes import in_any_box
from sdt_tools.training.inner import set_losses
from sdt_tools.training.safety import adversarial_domains

PROPOSITION_1: Final = "proposition_1"
TRANSIENT: Final = "proposition_2_transient"
SYSTEMATIC: Final = "proposition_2_systematic"
STATEMENTS: Final = {
    PROPOSITION_1: "Adversarial training is safety-domain training with balls around the samples as domains.",
    TRANSIENT: "A transient error is a conditional error of one point.",
    SYSTEMATIC: "A systematic error is a conditional error of all data, its complement empty.",
}
PICTURE: Final = "propositions.png"
NO_SCANS: Final = "needs the scans of the frames; add --recordings"
_SAMPLES: Final = 64
_DRAWN: Final = 16
_STEPS: Final = 5
_BLOCK: Final = 8192
"""Frames measured at a time."""
_RELATIVE: Final = 1e-4
"""The two are computed by other sums in float32."""


def judge_proposition_1(
    network: FollowNet,
    name: str,
    scans_m: Float32[np.ndarray, "frames rays"],
    labels: Int64[np.ndarray, "frames"],
    options: ClaimOptions,
) -> ClaimVerdict:
    """``scans_m`` are code-resolved scans and ``labels`` their motion classes; some of them are taken."""
    rng = np.random.default_rng(options.seed)
    rows = rng.choice(len(scans_m), min(_SAMPLES, len(scans_m)), replace=False)
    adversarial, safety, members = [], [], []
    with one_torch_thread():
        for row in rows:
            scan, label = scans_m[row], MotionClass(int(labels[row]))
            tried = _in_ball(network, scan, int(label), options, rng)
            (domain,) = adversarial_domains(scan[None], labels[row][None], options.ball_m)
            members.append(bool(in_any_box(tried, domain).all()))
            with torch.inference_mode():
                logits = network(torch.from_numpy(tried))
                target = torch.full((len(tried),), int(label))
                adversarial.append(float(torch.nn.functional.cross_entropy(logits, target, reduction="none").max()))
                safety.append(float(set_losses(logits, domain.allowed).max()))
    first, second = float(np.mean(adversarial)), float(np.mean(safety))
    apart = float(np.max(np.abs(np.array(adversarial) - np.array(safety)) / np.maximum(np.abs(adversarial), 1e-3)))
    agrees = apart <= _RELATIVE and all(members)
    return ClaimVerdict(
        claim=PROPOSITION_1,
        about=name,
        statement=STATEMENTS[PROPOSITION_1],
        finding=Finding.SUPPORTED if agrees else Finding.CONTRADICTED,
        reason=f"criteria {first:.4f} and {second:.4f} nats over {len(rows)} balls of {options.ball_m:g} m",
        measure="largest relative difference of the two criteria over samples",
        estimate=Estimate(apart, UNKNOWN.low, UNKNOWN.high),
        frames=len(rows),
        recordings=0,
        picture=PICTURE,
        numbers={
            "adversarial": adversarial,
            "safety_domain": safety,
            "all_in_domains": all(members),
            "ball_m": options.ball_m,
        },
    )


def _in_ball(
    network: FollowNet,
    scan_m: Float32[np.ndarray, "rays"],
    label: int,
    options: ClaimOptions,
    rng: np.random.Generator,
) -> Float32[np.ndarray, "tried rays"]:
    """Scans of the ball around ``scan_m``, of ranges that exist: drawn ones, and a walk up the cross-entropy."""
    drawn = scan_m + rng.uniform(-options.ball_m, options.ball_m, (_DRAWN, len(scan_m)))
    low, high = np.maximum(scan_m - options.ball_m, 0.0), scan_m + options.ball_m
    walk = torch.from_numpy(scan_m[None].copy())
    walked = []
    for _ in range(_STEPS):
        walk = walk.detach().requires_grad_()
        loss = torch.nn.functional.cross_entropy(network(walk), torch.tensor([label]))
        (slope,) = torch.autograd.grad(loss, walk)
        stepped = walk.detach().numpy() + 0.4 * options.ball_m * slope.sign().numpy()
        walk = torch.from_numpy(_shrunk(np.clip(stepped, low, high), scan_m))
        walked.append(walk.numpy())
    return np.concatenate([_shrunk(np.clip(drawn, low, high), scan_m), *walked])


def _shrunk(scans_m: np.ndarray, centre_m: Float32[np.ndarray, "rays"]) -> Float32[np.ndarray, "tried rays"]:
    """A hair nearer to the centre, so that rounding to float32 leaves no scan outside its ball."""
    shrunk: Float32[np.ndarray, "tried rays"] = (centre_m + (scans_m - centre_m) * (1.0 - 1e-4)).astype(np.float32)
    return shrunk


def judge_transients(
    frames: LabelledFrames,
    name: str,
    situations: Float32[np.ndarray, "frames rays"],
    epsilon_m: float,
    options: ClaimOptions,
) -> ClaimVerdict:
    """Looks at all neighbours of some errors, by brute force; those that Definition 1 calls transient are cases."""
    rng = np.random.default_rng(options.seed)
    rows = rng.permutation(np.flatnonzero(frames.wrong))[: options.errors_looked_at]
    agree = 0
    cases: list[int] = []
    neighbours: list[int] = []
    for row, near in zip(rows.tolist(), _neighbours(situations, rows, epsilon_m), strict=True):
        right = np.array([int(frames.right[near].sum())])
        if not is_transient(np.array([True]), np.array([len(near)]), right)[0]:
            continue
        loss = np.concatenate([frames.loss[[row]], frames.loss[near]])
        cases.append(row)
        neighbours.append(len(near))
        agree += is_conditional(loss, np.arange(len(loss)) == 0, options.errors.eta)
    statement = STATEMENTS[TRANSIENT]
    if not cases:
        return undecided(TRANSIENT, name, statement, f"none of {len(rows)} errors is transient", frames=len(rows))
    return ClaimVerdict(
        claim=TRANSIENT,
        about=name,
        statement=statement,
        finding=Finding.SUPPORTED if agree == len(cases) else Finding.CONTRADICTED,
        reason=f"{agree} of {len(cases)} transient errors (of {len(rows)} errors looked at)",
        measure="share of transient errors that fulfil Definition 3 as one point",
        estimate=Estimate(agree / len(cases), UNKNOWN.low, UNKNOWN.high),
        frames=len(cases),
        recordings=int(np.unique(frames.recording[cases]).size),
        picture=PICTURE,
        numbers={"epsilon_m": epsilon_m, "neighbours": neighbours, "looked_at": len(rows)},
    )


def _neighbours(
    situations: Float32[np.ndarray, "frames rays"], rows: Int64[np.ndarray, "errors"], epsilon_m: float
) -> list[Int64[np.ndarray, "near"]]:
    """The frames within ε of each of some rows, exact copies left out: all pairs are measured, those in reach twice."""
    found: list[list[Int64[np.ndarray, "near"]]] = [[] for _ in rows]
    queries = situations[rows].astype(np.float64)
    lengths = np.einsum("ij,ij->i", queries, queries)
    reach = (epsilon_m**2 + 1e-6) * situations.shape[1]
    for start in range(0, len(situations), _BLOCK):
        block = situations[start : start + _BLOCK].astype(np.float64)
        squares = lengths[:, None] + np.einsum("ij,ij->i", block, block) - 2.0 * queries @ block.T
        for query, candidates in enumerate(squares <= reach):
            near = start + np.flatnonzero(candidates)
            distance_m = rms_m(situations[near], np.repeat(situations[rows[query]][None], len(near), axis=0))
            found[query].append(near[(distance_m > 0.0) & (distance_m <= epsilon_m)])
    return [np.concatenate(parts) for parts in found]


def judge_systematic(frames: LabelledFrames, name: str, options: ClaimOptions) -> ClaimVerdict:
    """Selections that are systematically wrong; where the data have none, the wrong frames are taken for one.

    Definition 3 asks for a mean outside, which an empty complement does not have: the limit case is that the mean loss
    inside is above η, and nothing is outside.
    """
    eta = options.errors.eta
    found: list[tuple[str, np.ndarray]] = []
    for selection in ("scenario", "recording"):
        values = frames.table[selection].fill_null("").to_numpy()
        for value in np.unique(values):
            rows = values == value
            if rows.sum() >= options.errors.min_selection_frames and is_systematic(frames.loss[rows], eta):
                found.append((f"{selection} = {value}", rows))
    own = len(found)
    if not found and frames.wrong.any():
        found = [("the wrong frames alone", frames.wrong)]
    statement = STATEMENTS[SYSTEMATIC]
    if not found:
        return undecided(SYSTEMATIC, name, statement, "no frame is wrong", frames=len(frames.loss))
    agree, losses = 0, []
    for _, rows in found:
        data = frames.loss[rows]
        everything = np.ones(len(data), bool)
        losses.append(float(data.mean()))
        limit_case = bool(is_wrong(np.array([data.mean()]), eta)[0]) and not is_conditional(data, everything, eta)
        agree += is_systematic(data, eta) and limit_case
    words = f"{own} of the data" if own else "none in the data: the wrong frames alone are taken for one"
    return ClaimVerdict(
        claim=SYSTEMATIC,
        about=name,
        statement=statement,
        finding=Finding.SUPPORTED if agree == len(found) else Finding.CONTRADICTED,
        reason=f"{agree} of {len(found)} systematic selections ({words})",
        measure="share of systematic selections that are the limit case",
        estimate=Estimate(agree / len(found), UNKNOWN.low, UNKNOWN.high),
        frames=int(sum(rows.sum() for _, rows in found)),
        recordings=int(np.unique(frames.recording[np.any([rows for _, rows in found], axis=0)]).size),
        picture=PICTURE,
        numbers={"selections": [text for text, _ in found], "mean_losses": losses, "in_data": own},
    )
