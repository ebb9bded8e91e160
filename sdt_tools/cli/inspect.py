"""``sdt inspect``: what a recording holds."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from sdt_tools.cli.console import JsonFlag, console, emit

if TYPE_CHECKING:
    from sdt_tools.recording.inspect import InspectReport


def command(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="The recording.")],
    json_output: JsonFlag = False,
) -> None:
    """List a recording's topics, counts, rates, duration and metadata; say whether it was cut off."""
    from sdt_tools.recording.inspect import inspect_recording

    report = inspect_recording(file)
    if json_output:
        emit(report.document())
    else:
        _print(report)


def _print(report: "InspectReport") -> None:
    from rich.markup import escape
    from rich.table import Table

    console.print(f"{report.path}: {report.duration_s:.2f} s, {report.messages} messages, {_size(report.size_bytes)}")
    topics = Table("topic", "schema", "messages", "per second")
    for topic in report.topics.values():
        topics.add_row(topic.topic, topic.schema, str(topic.count), "" if topic.hz is None else f"{topic.hz:.2f}")
    console.print(topics)
    metadata = Table("metadata", "value")
    for name, value in {**report.session, **report.stats}.items():
        if value:
            metadata.add_row(name, escape(value))
    if metadata.row_count:
        console.print(metadata)
    if report.foreign_topics:
        console.print(f"passed over: {', '.join(report.foreign_topics)}")
    if report.truncated:
        console.print("cut off: the file has no end; what is listed is what can be read")
    for damage in report.damage:
        console.print(f"damaged: from {damage.start_ns} to {damage.end_ns} ns: {damage.reason}")


def _size(size_bytes: int) -> str:
    return f"{size_bytes / 1e6:.1f} MB" if size_bytes >= 100_000 else f"{size_bytes / 1e3:.1f} kB"
