"""The demonstration's report: Markdown for people, with its figures beside it."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from sdt_tools.demo.config import DemoConfig
from sdt_tools.demo.summary import DemoSummary
from sdt_tools.statistics import wilson


def write_report(
    path: Path,
    config: DemoConfig,
    summary: DemoSummary,
    figures: Mapping[str, Path],
    trained: Mapping[str, Any],
    tagged: Mapping[str, Any],
) -> None:
    """Write the report; figures, and the page about errors, are linked relative to it."""
    links = {name: figure.relative_to(path.parent) for name, figure in figures.items()}
    sections = [
        _opening(config, summary),
        _training(summary, trained, links["curve"]),
        _closed_loop(config, summary, links["runs"]),
        _errors(tagged, links["tags"], links["epsilon"], links["page"]),
        _looking(path.parent, summary),
    ]
    path.write_text("\n\n".join(sections) + "\n", encoding="utf-8")


def _opening(config: DemoConfig, summary: DemoSummary) -> str:
    return f"""# From recordings to reasons

{summary.recordings} recordings of the scene were made with the expert at the wheel, {config.camera_recordings} of them
with a camera: {summary.frames:,} scans, {summary.dropped_frames} dropped. Every decision was labelled with what the
expert would have done. A plain (level 0) follow network was trained on {summary.train_frames:,} of the labelled scans,
driven in closed loop, and replayed over recordings that it had not learnt from. Seed {config.seed}; one run."""


def _training(summary: DemoSummary, trained: Mapping[str, Any], curve: Path) -> str:
    low, high = wilson(round(summary.val_accuracy * summary.val_frames), summary.val_frames)
    recalls = "\n".join(f"| {name} | {share:.1%} |" for name, share in trained["val_recall"].items())
    return f"""## Training

| | frames | accuracy |
|---|---:|---:|
| training | {summary.train_frames:,} | {summary.train_accuracy:.1%} |
| validation, other recordings | {summary.val_frames:,} | {summary.val_accuracy:.1%} |

Frames of one recording are alike, so the Wilson interval of the validation accuracy, {low:.1%} to {high:.1%}, is
narrower than what other recordings would show. Forward recall: {summary.val_forward_recall:.1%}.

| class | share of its validation frames that is answered with it |
|---|---:|
{recalls}

![Learning curve]({curve})"""


def _closed_loop(config: DemoConfig, summary: DemoSummary, runs: Path) -> str:
    rows = [_driven("the network", summary.closed_loop[config.scenario])]
    rows += [_driven(name, scenarios[config.scenario]) for name, scenarios in summary.baselines.items()]
    table = "\n".join(rows)
    first = config.first_reported_seed
    return f"""## Closed loop

Scenario `{config.scenario}`, seeds {first} to {first + config.closed_loop_runs - 1}, which neither training nor tuning
uses; {summary.real_time_factor:.0f} times real time. Success: no contact, the operator never lost for more than 3 s,
and in front of him within 10 s of the end of his path. Constant answers are the baselines that must fail.

| driver | ok | 95 % interval |
|---|---:|---:|
{table}

![Driven paths]({runs})"""


def _driven(name: str, result: Mapping[str, Any]) -> str:
    low, high = result["wilson"]
    return f"| {name} | {result['ok']} of {result['runs']} | {low:.0%} to {high:.0%} |"


def _errors(tagged: Mapping[str, Any], tags: Path, epsilon: Path, page: Path) -> str:
    shares = "\n".join(
        f"| {name} | {share['count']:,} | {share['share']:.2%} | {share['low']:.2%} to {share['high']:.2%} |"
        for name, share in tagged["shares"].items()
    )
    conditions = "\n".join(_condition(condition) for condition in tagged["conditions"])
    nothing = "No condition was confirmed." + (f" {tagged['note']}" if tagged.get("note") else "")
    found = f"| condition | frames | mean loss inside | outside | p |\n|---|---:|---:|---:|---:|\n{conditions}"
    return f"""## Why frames are wrong

{tagged["frames"]:,} labelled frames of {tagged["recordings"]} recordings were replayed; {tagged["errors"]:,} are wrong.
The whole account, with examples: [{page.name}]({page}).

| tag | frames | share | 95 % interval |
|---|---:|---:|---:|
{shares}

Conditions are found on one half of the recordings and confirmed on the other, of which loss and p are.

{found if conditions else nothing}

![Tags]({tags})

![Neighbourhood]({epsilon})

{chr(10).join(f"- {warning}" for warning in tagged["warnings"])}"""


def _condition(condition: Mapping[str, Any]) -> str:
    return (
        f"| `{condition['text']}` | {condition['frames']:,} | {condition['mean_loss_in']:.2f} "
        f"| {condition['mean_loss_out']:.2f} | {condition['p_adjusted']:.3f} |"
    )


def _looking(folder: Path, summary: DemoSummary) -> str:
    return f"""## Look

    rerun {Path(summary.rrd).relative_to(folder)}

shows the first recording with a camera: the scan from above, coloured by whether the network is right, the safety zone,
the camera, the operator's true place, lanes of label, prediction and tag, and the loss."""
