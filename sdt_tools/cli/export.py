"""``sdt export``: recordings in other formats."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from sdt_tools.cli.console import JsonFlag, console, emit, print_messages

if TYPE_CHECKING:
    from sdt_tools.recording.exchange.summary import ExportSummary

app = typer.Typer(no_args_is_help=True, help="Write recordings in other formats; `sdt import` reads them back.")

RecordingArgument = Annotated[Path, typer.Argument(metavar="FILE", help="The recording.")]


@app.callback()
def export() -> None:
    """Write recordings in other formats; `sdt import` reads them back."""


@app.command("ros2")
def ros2(
    file: RecordingArgument,
    out: Annotated[
        Path,
        typer.Option(help="What to write, must not exist: a single file if it ends in .mcap, else a bag's folder."),
    ],
    json_output: JsonFlag = False,
) -> None:
    """Write a ROS 2 bag in MCAP that `ros2 bag`, RViz and Foxglove read.

    Ranges become float32: whole millimetres come back equal, others to seven digits. Commands go out as TwistStamped
    and, with all that is known of them, as a message of our own; so does the operator's state. Everything else has
    a standard message. Stamps are kept to the nanosecond.
    """
    from sdt_tools.recording.exchange.ros2.exporting import export_ros2

    _report(export_ros2(file, out), json_output)


@app.command("parquet")
def parquet(
    file: RecordingArgument,
    out: Annotated[Path, typer.Option(help="The folder to write; it must not exist.")],
    json_output: JsonFlag = False,
) -> None:
    """Write a folder with one Parquet file a topic and a manifest: every stamp and number keeps its bits."""
    from sdt_tools.recording.exchange.parquet.exporting import export_parquet

    _report(export_parquet(file, out), json_output)


def _report(summary: "ExportSummary", json_output: bool) -> None:
    if json_output:
        emit(summary.document())
        return
    print_messages(summary.path, summary.messages)
    for topic, count in summary.left_out.items():
        console.print(f"left out: {topic}, {count} messages, is no topic of ours")
    if summary.truncated:
        console.print("the recording was cut off; what could be read went out; `sdt repair` finishes it")
    for damage in summary.damage:
        console.print(damage.text, soft_wrap=True)
