"""``sdt doctor``: what this computer has of all that is needed."""

from pathlib import Path
from typing import Annotated

import typer

from sdt_tools.cli.console import JsonFlag, console, emit

_STYLES = {"ok": "green", "warn": "yellow", "fail": "bold red"}


def command(
    lidar: Annotated[
        str, typer.Option(metavar="HOST[:PORT]", help="Where the LMS1xx is; else 192.168.0.1 is tried.")
    ] = "",
    base: Annotated[
        str, typer.Option(metavar="PORT", help="Where the P3-AT is: a serial port, or socket://HOST:PORT.")
    ] = "",
    baud: Annotated[int, typer.Option(min=1, help="Baud of the base's serial port.")] = 9600,
    camera: Annotated[
        str, typer.Option(metavar="SRC", help="A camera's number, device, file or URL; else all devices are tried.")
    ] = "",
    folder: Annotated[Path, typer.Option("--dir", help="Where recordings are to land.")] = Path("recordings"),
    json_output: JsonFlag = False,
) -> None:
    """Look at what is installed and plugged in, and say of each thing whether it is well, and if not, what to do.

    It takes some ten seconds and changes nothing: the LiDAR keeps its settings, the base its motors off. The text holds
    no user's name, so that it can be pasted into a report. The exit code is 1 where a device that was asked for by
    name fails.
    """
    from sdt_tools.doctor.finding import Level
    from sdt_tools.doctor.probes import Asked, examine, failed

    asked = Asked(lidar, base, baud, camera, str(folder))
    with console.status("looking …"):
        findings = examine(asked)
    if json_output:
        counts = {level.value: sum(one.level is level for one in findings) for level in Level}
        emit({"findings": [one.document() for one in findings], **counts})
    else:
        for finding in findings:
            line = finding.line()
            width = len(finding.level.value)
            console.print(line[:width], style=_STYLES[finding.level], end="")
            console.print(line[width:], soft_wrap=True)
    if failed(findings, asked):
        raise typer.Exit(1)
