"""What ``sdt drive robot`` says at the end."""

from collections.abc import Mapping
from pathlib import Path

from sdt_tools.cli.console import console
from sdt_tools.cli.drive_report import (
    ENDINGS,
    latency_document,
    print_histogram,
    reading_latency,
)
from sdt_tools.control.controller import VisionDecision
from sdt_tools.control.robot.drive import RobotRun


def robot_drive_document(
    driven: RobotRun, decisions: list[VisionDecision], record: Path | None
) -> Mapping[str, object]:
    """The drive as JSON. ``scan_to_command`` ends when the command is on the wire to the base."""
    summary = driven.summary
    return {
        "ending": summary.ending,
        "seconds": summary.seconds,
        "wall_s": round(summary.wall_s, 3),
        "decisions": summary.decisions,
        "missed_deadlines": summary.missed_deadlines,
        "scan_to_command": latency_document(summary.latency),
        "vision": latency_document(reading_latency(decisions)) | {"unreadable": driven.unreadable},
        "switches": [one.after.label for one in decisions if one.switches],
        "recording": None if record is None else str(record),
    }


def print_robot_drive(driven: RobotRun, decisions: list[VisionDecision], record: Path | None) -> None:
    """The drive for people."""
    summary = driven.summary
    late = f", {summary.missed_deadlines} deadlines missed" if summary.missed_deadlines else ""
    console.print(
        f"{summary.seconds:.1f} s, {summary.decisions} decisions{late}; {ENDINGS.get(summary.ending, summary.ending)}"
    )
    print_histogram("from a scan's arrival to its command on the wire", summary.latency)
    if decisions:
        print_histogram("reading a picture", reading_latency(decisions))
        console.print(f"{sum(one.switches for one in decisions)} changes of mode")
    if record is not None:
        console.print(f"recorded; look at it with: sdt view {record} --open", soft_wrap=True)
