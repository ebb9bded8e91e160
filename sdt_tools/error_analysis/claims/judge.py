"""From predictions and checkpoints to a folder with a verdict on every claim of the paper."""

import json
import os
import shutil
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
import polars as pl
from jaxtyping import Float32

from sdt_tools.error_analysis.claims.adversarial import judge_adversarial
from sdt_tools.error_analysis.claims.document import claims_markdown, claims_table
from sdt_tools.error_analysis.claims.figures import draw_claims
from sdt_tools.error_analysis.claims.implication import judge_implication
from sdt_tools.error_analysis.claims.locality import Correlogram, correlogram
from sdt_tools.error_analysis.claims.material import Material, Network, gather, read_network
from sdt_tools.error_analysis.claims.nested import judge_nested_frames, judge_nested_scenarios, runs_of
from sdt_tools.error_analysis.claims.options import ClaimOptions
from sdt_tools.error_analysis.claims.premises import situations_sample
from sdt_tools.error_analysis.claims.profile import judge_conditional, judge_forward
from sdt_tools.error_analysis.claims.propositions import (
    NO_SCANS,
    PROPOSITION_1,
    STATEMENTS,
    TRANSIENT,
    judge_proposition_1,
    judge_systematic,
    judge_transients,
)
from sdt_tools.error_analysis.claims.theorem import judge_theorem
from sdt_tools.error_analysis.claims.verdict import ClaimVerdict, undecided
from sdt_tools.error_analysis.epsilon import estimate_epsilon
from sdt_tools.error_analysis.recorded import find_recordings, read_situations
from sdt_tools.error_analysis.side_by_side import KEYS, load_side_by_side
from sdt_tools.error_analysis.spaces import scan_space
from sdt_tools.errors import OutputExistsError, UsageError
from sdt_tools.frames import MAX_RANGE_M, MotionClass
from sdt_tools.models.checkpoint import load_checkpoint
from sdt_tools.models.checkpoint_folder import VISION_KIND
from sdt_tools.recording.incomplete import Incomplete
from sdt_tools.replay.predictions import PredictionKind, kind_of, scan_predictions
from sdt_tools.runs.code import code_version
from sdt_tools.runs.local import Progress
from sdt_tools.runs.unit import content_hash

VERDICTS: Final = "claims.json"
TABLE: Final = "claims.parquet"
REPORT: Final = "claims.md"


@dataclass(frozen=True)
class Sources:
    """What claims are judged on.

    ``predictions``: files of `sdt replay` over the same recordings, with labels. ``models``: the checkpoints that made
    them. ``evaluations``: tables of closed-loop runs. ``tags``: tag tables, or folders of `sdt errors` that hold one.
    ``recordings``: MCAP files or folders of them. ``adversarial``: names of models that were trained adversarially.
    """

    predictions: tuple[Path, ...]
    models: tuple[Path, ...]
    evaluations: tuple[Path, ...] = ()
    tags: tuple[Path, ...] = ()
    recordings: tuple[Path, ...] = ()
    adversarial: tuple[str, ...] = ()


@dataclass(frozen=True)
class ClaimReport:
    """All verdicts, on what they rest, and the options; ``incomplete`` recordings were cut off or are damaged."""

    verdicts: tuple[ClaimVerdict, ...]
    summary: Mapping[str, Any]
    options: ClaimOptions
    incomplete: tuple[Incomplete, ...]

    def document(self) -> dict[str, Any]:
        """As JSON-ready values."""
        return {
            "claims": [verdict.document() for verdict in self.verdicts],
            **self.summary,
            "incomplete": [recording.document() for recording in self.incomplete],
            "options": self.options.model_dump(mode="json"),
        }


def judge_claims(sources: Sources, options: ClaimOptions, out: Path, progress: Progress | None = None) -> ClaimReport:
    """Judge every claim and write the folder ``out``: claims.json, claims.parquet, claims.md and the pictures.

    Of vision networks, whose predictions are answers to pictures, there are the two claims about adversarial training.

    Raises UsageError for predictions that do not fit together or with the models, CheckpointError, RecordingError,
    OutputExistsError.
    """
    if out.exists():
        raise OutputExistsError(out)
    if not sources.models:
        raise UsageError("no checkpoint given; name those that made the predictions with --model")
    networks = {folder: read_network(folder) for folder in sources.models}
    kind = kind_of(scan_predictions(sources.predictions).collect_schema().names())
    _check_kind(networks.values(), kind)
    by_name = {network.name: network for network in networks.values()}
    if len(by_name) < len(networks):
        raise UsageError("two checkpoints have the same name, by which predictions tell them; rename one")
    frames = load_side_by_side(sources.predictions, tuple(by_name))
    material = gather(list(networks.values()), frames, options)
    tags = _read_tags(sources.tags)
    adversarial = tuple(
        dict.fromkeys((*sources.adversarial, *(one.name for one in material.networks if one.adversarial)))
    )
    for name in adversarial:
        if name not in frames.models:
            raise UsageError(
                f"--adversarial {name}: no predictions of such a model; there are {', '.join(frames.models)}"
            )
    of_errors = judge_adversarial(frames, adversarial, tags, options)
    if kind is PredictionKind.PICTURES:
        report = ClaimReport(tuple(of_errors), _summary(material), options, ())
        _write(report, None, sources, out)
        return report
    runs = _read_runs(sources.evaluations)
    scans, incomplete = _read_scans(material, sources.recordings, options, progress)
    locality = None if scans is None else _locality(material, scans, options)
    verdicts = (
        *judge_theorem(material, sources.predictions, locality, options),
        *judge_implication(material, locality, options),
        *judge_nested_scenarios(material, runs, options),
        *judge_nested_frames(material, options),
        *judge_conditional(material, tags, options, progress),
        *judge_forward(material, options),
        *of_errors,
        *_judge_propositions(material, scans, options),
    )
    report = ClaimReport(verdicts, _summary(material), options, incomplete)
    _write(report, locality, sources, out)
    return report


def _check_kind(networks: Iterable[Network], kind: PredictionKind) -> None:
    """Raises UsageError for a network that cannot have made predictions of ``kind``."""
    for network in networks:
        if (network.kind == VISION_KIND) is not (kind is PredictionKind.PICTURES):
            raise UsageError(f"{network.folder}: cannot have made these predictions, which are answers to {kind}")


def _read_tags(places: Sequence[Path]) -> dict[str, pl.DataFrame]:
    """Tag tables by model. Raises UsageError for files that are none."""
    by_model: dict[str, pl.DataFrame] = {}
    for place in places:
        path = place / "tags.parquet" if place.is_dir() else place
        try:
            table = pl.read_parquet(path)
        except (pl.exceptions.PolarsError, OSError) as error:
            raise UsageError(
                f"{path}: not a table of tags ({str(error).splitlines()[0]}); make it with `sdt errors`"
            ) from None
        lacking = {"model", "tag", *KEYS} - set(table.columns)
        if lacking:
            raise UsageError(
                f"{path}: not a table of tags: it lacks {', '.join(sorted(lacking))}; make it with `sdt errors`"
            )
        for (model,), rows in table.group_by("model"):
            if str(model) in by_model:
                raise UsageError(f"{path}: '{model}' was tagged twice; give one table for each model")
            by_model[str(model)] = rows.select(*KEYS, "tag")
    return by_model


def _read_runs(paths: Sequence[Path]) -> pl.DataFrame | None:
    tables = []
    for path in paths:
        try:
            tables.append(runs_of(pl.read_parquet(path), str(path)))
        except (pl.exceptions.PolarsError, OSError) as error:
            raise UsageError(f"{path}: not a table of runs ({str(error).splitlines()[0]})") from None
    return pl.concat(tables) if tables else None


def _read_scans(
    material: Material, recordings: Sequence[Path], options: ClaimOptions, progress: Progress | None
) -> tuple[Float32[np.ndarray, "frames rays"] | None, tuple[Incomplete, ...]]:
    """The code-resolved scans of all frames, as far as the sensor sees, and which recordings are cut off or damaged.

    None without recordings.
    """
    if not recordings:
        return None, ()
    frames = material.labelled(0, options)
    unclipped = options.errors.model_copy(update={"clip_m": MAX_RANGE_M})
    return read_situations(frames, find_recordings(frames, recordings), unclipped, progress)


def _locality(material: Material, scans: Float32[np.ndarray, "frames rays"], options: ClaimOptions) -> Correlogram:
    """Over the losses of the strictest level's networks."""
    rows, sample = situations_sample(scans, options)
    level = (material.certified_levels or material.levels)[-1]
    loss = material.mean_loss(level, options.loss)[rows]
    return correlogram(sample, loss, material.frames.recording[rows], material.draws[:, :200])


def _judge_propositions(
    material: Material, scans: Float32[np.ndarray, "frames rays"] | None, options: ClaimOptions
) -> list[ClaimVerdict]:
    """Of the network with the fewest errors, whose lone errors are not lost among others."""
    place = int(material.frames.wrong.sum(axis=1).argmin())
    network = material.networks[place]
    frames = material.labelled(place, options)
    systematic = judge_systematic(frames, network.name, options)
    if scans is None:
        missing = [undecided(claim, network.name, STATEMENTS[claim], NO_SCANS) for claim in (PROPOSITION_1, TRANSIENT)]
        return [*missing, systematic]
    situations = np.minimum(scans, np.float32(options.errors.clip_m))
    epsilon = estimate_epsilon(scan_space(situations), frames.recording, frames.stamp_ns, options.errors)
    places = {motion.label: int(motion) for motion in MotionClass}
    labels = np.array([places[label] for label in frames.table["label"]])
    loaded = load_checkpoint(network.folder)
    return [
        judge_proposition_1(loaded.network, network.name, scans, labels, options),
        judge_transients(frames, network.name, situations, epsilon.value, options),
        systematic,
    ]


def _summary(material: Material) -> dict[str, Any]:
    """What the verdicts rest on."""
    frames = material.frames
    return {
        "frames": len(frames.recording),
        "recordings": frames.recordings,
        "scenarios": dict(frames.table["scenario"].fill_null("unknown").value_counts(sort=True).iter_rows()),
        "networks": [
            {
                "name": network.name,
                "level": network.level,
                "seed": network.seed,
                "delta": network.delta,
                "bound": network.bound,
                "train_loss": network.train_loss,
                "accuracy": float(1.0 - frames.wrong[place].mean()),
            }
            for place, network in enumerate(material.networks)
        ],
        "left_out": [vars(one) for one in frames.mismatches if one.without_partner or one.other_label],
    }


def _write(report: ClaimReport, locality: Correlogram | None, sources: Sources, out: Path) -> None:
    """Write the folder whole, or not at all."""
    inputs = {
        "predictions": [content_hash(path) for path in sources.predictions],
        "models": {path.resolve().name: content_hash(path) for path in sources.models},
        "evaluations": [content_hash(path) for path in sources.evaluations],
        "tags": [content_hash(path) for path in sources.tags],
    }
    document = {**report.document(), "code_version": code_version(), "inputs": inputs}
    scratch = out.with_name(f".{out.name}.{os.getpid()}.part")
    shutil.rmtree(scratch, ignore_errors=True)
    scratch.mkdir(parents=True)
    try:
        pictures = draw_claims(report.verdicts, locality, scratch)
        (scratch / VERDICTS).write_text(json.dumps(document, indent=2, ensure_ascii=False) + "\n", "utf-8")
        claims_table(report.verdicts).write_parquet(scratch / TABLE)
        (scratch / REPORT).write_text(claims_markdown(report.verdicts, report.summary, pictures), "utf-8")
        scratch.rename(out)
    finally:
        shutil.rmtree(scratch, ignore_errors=True)
