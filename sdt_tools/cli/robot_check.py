"""``sdt robot check``: a driver held against the contract of its kind."""

from typing import TYPE_CHECKING, Annotated, Any

import typer

from sdt_tools.cli.console import JsonFlag, console, emit
from sdt_tools.errors import UsageError

if TYPE_CHECKING:
    from sdt_tools.robot.contract.verdict import Verdict

_STYLES = {"kept": "green", "broken": "bold red", "not judged": "yellow"}


def check(
    source: Annotated[str, typer.Argument(help="Name of an installed driver, as lms1xx, p3at, opencv, or KIND:NAME.")],
    setting: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="KEY=VALUE", help="A setting of the driver; repeat for more."),
    ] = None,
    seconds: Annotated[float, typer.Option(min=1.0, max=600.0, help="How long to listen to it.")] = 4.0,
    hz: Annotated[float | None, typer.Option(min=0.1, help="How often it is to give something.")] = None,
    unplug: Annotated[bool, typer.Option("--unplug", help="Ask you to unplug it, and time how it tells.")] = False,
    move: Annotated[
        bool, typer.Option("--move", help="Let a base move. Lift its wheels off the ground before you do.")
    ] = False,
    json_output: JsonFlag = False,
) -> None:
    """Hold a driver of a LiDAR, base or camera against what it has to promise, and print a verdict for each rule.

    It is for people who write drivers, and for new hardware. A base has its motors switched on, and moves only with
    --move. The exit code is 1 where a rule is broken.
    """
    from sdt_tools.robot.contract.check import Plan
    from sdt_tools.robot.contract.check import check as verdicts
    from sdt_tools.robot.contract.verdict import Outcome
    from sdt_tools.robot.plugins import Kind, device_named

    plugin = device_named(source)
    if move and plugin.kind is not Kind.BASE:
        raise UsageError(f"--move is for a base; {source} is a {plugin.kind.value}")
    options = {key: f"--set {key}" for key in plugin.config_model.model_fields}
    config = plugin.parse(_settings(setting or [], plugin.config_model), f"robot check {source}", options)
    ask = (lambda line: console.print(f"→ {line}", style="bold")) if unplug else None
    console.print(f"{plugin.kind.value} driver {plugin.name} of {plugin.package}, {plugin.device.__module__}")
    found = []
    for verdict in verdicts(plugin, config, Plan(seconds, hz, move, ask)):
        found.append(verdict)
        _print(verdict)
    counts = {outcome.value: sum(one.outcome is outcome for one in found) for outcome in Outcome}
    console.print(", ".join(f"{count} {name}" for name, count in counts.items()))
    if json_output:
        emit(
            {
                "source": plugin.name,
                "kind": plugin.kind.name.lower(),
                "package": plugin.package,
                "settings": config.model_dump(mode="json"),
                "verdicts": [{"rule": one.rule, "outcome": one.outcome.value, "seen": one.seen} for one in found],
                **{name.replace(" ", "_"): count for name, count in counts.items()},
            }
        )
    if counts[Outcome.BROKEN.value]:
        raise typer.Exit(1)


def _print(verdict: "Verdict") -> None:
    from rich.text import Text

    outcome = verdict.outcome.value
    console.print(
        Text.assemble((f"{outcome:<10}", _STYLES[outcome]), f"  {verdict.rule}: {verdict.seen}"), soft_wrap=True
    )


def _settings(texts: list[str], model: Any) -> dict[str, Any]:
    """``KEY=VALUE`` texts as a table; dots lead into tables within. A setting that is text stays text."""
    import tomllib

    table: dict[str, Any] = {}
    for text in texts:
        key, equals, value = text.partition("=")
        if not equals or not key:
            raise UsageError(f"--set '{text}': write KEY=VALUE, as host=192.168.0.1")
        field = model.model_fields.get(key)
        parsed: object = value
        if field is None or field.annotation is not str:
            try:
                parsed = tomllib.loads(f"value = {value}")["value"]
            except tomllib.TOMLDecodeError:
                parsed = value
        *above, last = key.split(".")
        place = table
        for step in above:
            inner = place.setdefault(step, {})
            if not isinstance(inner, dict):
                raise UsageError(f"--set '{text}': {step} is a value already")
            place = inner
        place[last] = parsed
    return table
