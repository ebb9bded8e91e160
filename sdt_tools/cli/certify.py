"""``sdt certify``: what can be proved of a network in its safety domains."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from sdt_tools.cli.console import JsonFlag, console, emit

if TYPE_CHECKING:
    from sdt_tools.certify.certification import Certification
    from sdt_tools.certify.verdicts import CertifyConfig


def command(
    model: Annotated[Path, typer.Argument(metavar="MODEL", help="Checkpoint folder.")],
    level: Annotated[
        int | None, typer.Option(help="Safety level whose 240 domains are judged: 1 to 3 are the paper's, 4 to 20 m.")
    ] = None,
    domains: Annotated[Path | None, typer.Option(metavar="FILE", help="TOML file with domains of your own.")] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            help="Folder to make: ledger, counterexamples, certificate, figure. "
            "[analysis/certify/<model>-<level or file>]"
        ),
    ] = None,
    export: Annotated[
        Path | None, typer.Option(help="Folder to make for other verifiers: ONNX, VNN-LIB, instances.csv.")
    ] = None,
    restarts: Annotated[int, typer.Option(min=0, help="Searches a domain that is not certified; 0: bounds alone.")] = 4,
    steps: Annotated[int, typer.Option(min=1, help="Steps of each search.")] = 40,
    attack_certified: Annotated[
        bool, typer.Option("--attack-certified", help="Search certified domains too, to check the bounds.")
    ] = False,
    seed: Annotated[int, typer.Option(min=0, help="Scans that searches start from and errors are measured on.")] = 0,
    json_output: JsonFlag = False,
) -> None:
    """Judge each safety domain: certified (proved), violated (a scan in hand), unknown, or error."""
    from sdt_tools.certify.certification import certify_checkpoint
    from sdt_tools.certify.specification import specification_of
    from sdt_tools.cli.progress import progress_bar

    specification = specification_of(level, domains)
    config = _config(restarts, steps, attack_certified, seed)
    with progress_bar("judging") as progress:
        done = certify_checkpoint(model, specification, config, out, export, progress)
    if json_output:
        emit(_document(done))
    else:
        _show(done)


def _config(restarts: int, steps: int, attack_certified: bool, seed: int) -> "CertifyConfig":
    from sdt_tools.certify.verdicts import CertifyConfig
    from sdt_tools.errors import UsageError
    from sdt_tools.robustness.attacks import AttackConfig

    if restarts == 0 and attack_certified:
        raise UsageError("--attack-certified asks for searches, but --restarts 0 for none; leave one out")
    attack = AttackConfig(restarts=restarts, steps=steps, seed=seed) if restarts else None
    return CertifyConfig(attack=attack, attack_certified=attack_certified, seed=seed)


def _document(done: "Certification") -> dict[str, object]:
    from sdt_tools.certify.certification import FIGURE
    from sdt_tools.certify.ledger import CERTIFICATE, COUNTEREXAMPLES, LEDGER

    left_out = {"model_hash", "specification_hash", "file_hash", "code_version", "config"}
    check = done.export_check
    return {
        **done.certificate.model_dump(mode="json", exclude=left_out),
        "certificate": str(done.out / CERTIFICATE),
        "ledger": str(done.out / LEDGER),
        "counterexamples": str(done.out / COUNTEREXAMPLES),
        "figure": str(done.out / FIGURE),
        "export": None if check is None else {"folder": str(done.export), **vars(check)},
    }


def _show(done: "Certification") -> None:
    from rich.table import Table

    from sdt_tools.certify.certification import FIGURE
    from sdt_tools.certify.verdicts import Verdict

    told = done.certificate
    table = Table(told.model, told.specification)
    table.columns[1].justify = "right"
    table.add_row("domains", str(told.domains), end_section=True)
    for verdict, count in done.ledger.counts.items():
        table.add_row(verdict, f"{count} ({count / told.domains:.1%})", end_section=verdict is Verdict.ERROR)
    table.add_row("smallest margin", "none" if told.min_margin is None else f"{told.min_margin:.4g} logits")
    table.add_row("validation accuracy", _share(told.validation_accuracy))
    table.add_row("forward recall", _share(told.forward_recall))
    console.print(table)
    required = "" if told.required_margin is None else f"; a margin above {told.required_margin:.2g} logits certifies"
    console.print(f"judged in {told.seconds:.1f} s{required}")
    for reason in dict.fromkeys(verdict.error for verdict in done.ledger.verdicts if verdict.error):
        console.print(f"error: {reason}", style="bold red")
    console.print(f"certificate with {FIGURE}: {done.out}", soft_wrap=True)
    if done.export_check is not None:
        check = done.export_check
        console.print(
            f"export of {check.instances} domains, read back; logits within {check.max_logit_difference:.1g}, "
            f"{check.counterexamples} counterexamples confirmed: {done.export}",
            soft_wrap=True,
        )


def _share(value: float | None) -> str:
    return "not known" if value is None else f"{value:.1%}"
