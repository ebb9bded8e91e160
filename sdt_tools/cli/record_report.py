"""What ``sdt record`` says of a recording."""

import re
from pathlib import Path
from typing import TYPE_CHECKING, Final

from sdt_tools.cli.console import console
from sdt_tools.errors import UsageError

if TYPE_CHECKING:
    from sdt_tools.recording.live.outcome import RecordingSummary

KEYS_HELP: Final = (
    "Keys with --session at a terminal: space pauses and resumes, n ends the take and starts the next, k keeps it and "
    "stops, x discards it (or the last one) to the trash, m marks the moment, s saves what --keep-last holds, q quits."
)


def seconds_of(text: str) -> float:
    """The seconds in ``30s``, ``2min`` or ``30``. Raises UsageError for anything else."""
    found = re.fullmatch(r"(\d+(?:\.\d+)?)\s*(s|min)?", text.strip())
    seconds = float(found[1]) * (60 if found[2] == "min" else 1) if found else 0.0
    if seconds <= 0:
        raise UsageError(f"--keep-last {text}: no length of time; write it as 30s or 2min")
    return seconds


def recording_document(out: Path, summary: "RecordingSummary") -> dict[str, object]:
    """The recording for machines."""
    return {
        "out": str(out),
        "recording_id": summary.recording_id,
        "seconds": summary.seconds,
        "wall_s": round(summary.wall_s, 3),
        "real_time_factor": round(summary.real_time_factor, 2),
        "ending": summary.ending,
        "interrupted": summary.interrupted,
        "frames": dict(summary.frames),
        "dropped": dict(summary.dropped),
        "missing": dict(summary.missing),
        "missed_deadlines": summary.missed_deadlines,
        "decisions": summary.decisions,
        "forced_decisions": summary.forced,
        "size_bytes": summary.size_bytes,
    }


def print_recording(out: Path, summary: "RecordingSummary") -> None:
    """The recording for people."""
    from rich.table import Table

    table = Table("topic", "messages", "per second", "dropped", "missing")
    for topic, count in summary.frames.items():
        rate = f"{count / summary.seconds:.1f}" if summary.seconds > 0 else ""
        lost = (str(summary.dropped.get(topic, "")), str(summary.missing.get(topic, "")))
        table.add_row(topic, str(count), rate, *lost)
    console.print(table)
    ending = {
        "time": "",
        "source": "; the scenario ended",
        "interrupted": "; you stopped it, the file is whole",
        "terminated": "; SIGTERM stopped it, the file is whole",
        "hangup": "; its terminal hung up, the file is whole",
        "disk": "; its disk is nearly full: it was ended while there was room for a whole file",
    }.get(summary.ending, "")
    late = f", {summary.missed_deadlines} deadlines missed" if summary.missed_deadlines else ""
    console.print(
        f"{out}: {summary.seconds:.1f} s in {summary.wall_s:.1f} s ({summary.real_time_factor:.0f} times real time), "
        f"{summary.size_bytes / 1e6:.1f} MB{late}{ending}"
    )
