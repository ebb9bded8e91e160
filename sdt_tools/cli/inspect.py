"""``sdt inspect``: what a recording holds, and whether it can be trusted."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from sdt_tools.cli.console import JsonFlag, console, emit, print_incomplete

if TYPE_CHECKING:
    from sdt_tools.recording.inspect import InspectReport


def command(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="The recording.")],
    full: Annotated[
        bool, typer.Option("--full", help="Count all messages again, and say where the file's own stats disagree.")
    ] = False,
    plot: Annotated[
        Path | None, typer.Option(metavar="PNG", help="Draw intervals, delay, drift and skew; it must not exist.")
    ] = None,
    json_output: JsonFlag = False,
) -> None:
    """List a recording's topics, rates, gaps, drops and metadata; say whether it is good, fair or poor, and why.

    Good: under 0.1 % of the sensors' messages are dropped or missing, none is 200 ms late, stamps jitter by under 20 %
    of the period, the delay to the host varies by under 50 ms and drifts by under 100 ppm, 99 % of the images have a
    scan within 20 ms. Poor: 1 %, 1 s, 50 %, 200 ms, 1000 ppm, 90 %; stamps that run backwards; damage. Fair: between.
    """
    from sdt_tools.cli.pictures import check_picture
    from sdt_tools.recording.inspect import draw_timing, inspect_recording

    if plot is not None:
        check_picture(plot, "--plot")
    report = inspect_recording(file, full)
    if plot is not None:
        draw_timing(report, plot)
    if json_output:
        emit(report.document() | ({} if plot is None else {"plot": str(plot)}))
    else:
        _print(report, plot)


def _print(report: "InspectReport", plot: Path | None) -> None:
    console.print(f"{report.path}: {report.duration_s:.2f} s, {report.messages} messages, {_size(report.size_bytes)}")
    _print_topics(report)
    _print_metadata(report)
    if report.foreign_topics:
        console.print(f"passed over: {', '.join(report.foreign_topics)}")
    print_incomplete([report.incomplete])
    for line in report.disagreements:
        console.print(f"disagreement: {line}", soft_wrap=True)
    _print_health(report)
    if plot is not None:
        console.print(f"drawn: {plot}", soft_wrap=True)


def _print_topics(report: "InspectReport") -> None:
    from rich.table import Column, Table

    topics = Table(Column("topic", no_wrap=True), Column("schema", overflow="fold"), "messages", "per second", "drops")
    timing = Table("topic", "gaps", "longest ms", "jitter ms", "delay ms", "drift ppm")
    for name, topic in report.topics.items():
        known = report.topic_document(name)
        hz = "" if topic.hz is None else f"{topic.hz:.2f}"
        topics.add_row(name, topic.schema, str(topic.count), hz, str(known["drops"]))
        if known.get("period_ms") is not None:
            measures = ("jitter_ms_p99", "delay_ms_p50", "drift_ppm")
            numbers = (_number(known[measure]) for measure in measures)
            timing.add_row(name, str(known["gaps"]), _number(known["max_gap_ms"]), *numbers)
    console.print(topics)
    if timing.row_count:
        console.print(timing)
    pairs = report.timing.pairs
    if pairs.skew is not None:
        p50_ms, p99_ms = pairs.skew.p50_ns / 1e6, pairs.skew.p99_ns / 1e6
        console.print(
            f"scans and images: {pairs.count} pairs, {p50_ms:.2f} ms apart (99 %: within {p99_ms:.2f} ms), "
            f"{pairs.unpaired} unpaired"
        )


def _print_metadata(report: "InspectReport") -> None:
    from rich.table import Table

    metadata = Table("metadata", "value")
    for name, value in {**report.session, **report.stats}.items():
        if value and not name.startswith(("count.", "timing.")):  # the tables above say it
            metadata.add_row(name, value)
    if metadata.row_count:
        console.print(metadata)


def _print_health(report: "InspectReport") -> None:
    from rich.text import Text

    colours = {"good": "green", "fair": "yellow", "poor": "red"}
    source = "counted from the messages" if report.counted else "by its own stats; --full counts again"
    console.print(Text.assemble((report.health, f"bold {colours[report.health]}"), f" ({source})"))
    for reason in report.reasons:
        console.print(f"  {reason.health}: {reason.text}", soft_wrap=True)


def _number(value: object) -> str:
    return f"{value:.2f}" if isinstance(value, float) else ""


def _size(size_bytes: int) -> str:
    return f"{size_bytes / 1e6:.1f} MB" if size_bytes >= 100_000 else f"{size_bytes / 1e3:.1f} kB"
