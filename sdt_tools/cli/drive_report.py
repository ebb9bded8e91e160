"""What ``sdt drive`` says while it drives, and at the end."""

from pathlib import Path
from typing import TYPE_CHECKING, Final

from sdt_tools.cli.console import console
from sdt_tools.clock import SECOND_NS
from sdt_tools.control.controller import VisionDecision
from sdt_tools.control.latency import BINS_MS, Latency, latency_of
from sdt_tools.control.scene_drive import SceneDrive
from sdt_tools.evaluation.outcome import SuccessConfig
from sdt_tools.evaluation.vision.commands import ModeTally, tally_modes
from sdt_tools.evaluation.vision.whole_run import WholeConfig, WholeRunJudge, WholeVerdict
from sdt_tools.frames import Gesture, LogEntry, LogLevel, OperatorState, Received
from sdt_tools.scene.gestures import first_mode
from sdt_tools.scene.source import SceneSource

if TYPE_CHECKING:
    from collections.abc import Mapping

_BAR: Final = 40
_ENDINGS: Final = {"time": "its time was up", "source": "the scenario ended", "stopped": "you ended it"}
_STYLES: Final = {LogLevel.WARNING: "yellow", LogLevel.ERROR: "red"}


class Telling:
    """Says what happens as it happens: the session log, and the operator's gestures. Implements Observer."""

    def __init__(self, start_ns: int) -> None:
        self._start_ns = start_ns
        self._gesture = Gesture.IDLE

    def observe(self, received: Received) -> None:
        """Say it."""
        message = received.message
        if isinstance(message, LogEntry):
            self._say(message.stamp_ns, f"{message.text}", _STYLES.get(message.level, ""))
        elif isinstance(message, OperatorState) and message.gesture is not self._gesture:
            self._gesture = message.gesture
            shows = "nothing more" if message.gesture is Gesture.IDLE else message.gesture.label
            self._say(message.stamp_ns, f"the operator shows {shows}", "dim")

    def close(self) -> None:
        """Nothing is open."""

    def _say(self, stamp_ns: int, text: str, style: str) -> None:
        seconds = (stamp_ns - self._start_ns) / SECOND_NS
        console.print(f"{seconds:7.1f} s  {text}", style=style, soft_wrap=True)


class Witness:
    """Keeps what the vision network decided, and judges the run by the scene's truth."""

    def __init__(self) -> None:
        self.decisions: list[VisionDecision] = []
        self._judge: WholeRunJudge | None = None

    def watch(self, source: SceneSource) -> WholeRunJudge:
        """Look at a scene that is about to begin."""
        self._judge = WholeRunJudge(source.world, SuccessConfig(), WholeConfig())
        return self._judge

    def tally(self, driven: SceneDrive) -> ModeTally:
        """What became of the operator's gestures."""
        world = driven.source.world
        first = first_mode(world.layout.gestures)
        return tally_modes(self.decisions, world.gestures, driven.source.start_ns, world.time_s, first)

    def verdict(self, tally: ModeTally) -> WholeVerdict:
        """Whether the whole controller did its work, as far as it was driven."""
        assert self._judge is not None
        return self._judge.verdict(tally)


def drive_document(driven: SceneDrive, witness: Witness, record: Path | None) -> "Mapping[str, object]":
    """The drive as JSON."""
    summary, tally = driven.summary, witness.tally(driven)
    verdict = witness.verdict(tally)
    return {
        "ending": summary.ending,
        "seconds": summary.seconds,
        "wall_s": round(summary.wall_s, 3),
        "decisions": summary.decisions,
        "missed_deadlines": summary.missed_deadlines,
        "scan_to_command": _latency(summary.latency),
        "vision": _latency(_reading(witness.decisions)) | {"unreadable": driven.unreadable},
        "switches": [_switch(one, driven.source.start_ns) for one in witness.decisions if one.switches],
        "mode_errors": len(tally.errors),
        "commands": tally.commands,
        "moot": tally.moot,
        "missed": len(tally.missed),
        "reactions_s": list(tally.reactions_s),
        "outcome": verdict.outcome,
        "reason": verdict.reason,
        "recording": None if record is None else str(record),
    }


def print_drive(driven: SceneDrive, witness: Witness, record: Path | None) -> None:
    """The drive for people."""
    summary, tally = driven.summary, witness.tally(driven)
    verdict = witness.verdict(tally)
    late = f", {summary.missed_deadlines} deadlines missed" if summary.missed_deadlines else ""
    console.print(
        f"{summary.seconds:.1f} s in {summary.wall_s:.1f} s, {summary.decisions} decisions{late}; "
        f"{_ENDINGS.get(summary.ending, summary.ending)}"
    )
    _histogram("from scan to command", summary.latency)
    if witness.decisions:
        _histogram("reading a picture", _reading(witness.decisions))
        reactions = ", ".join(f"{seconds:.2f} s" for seconds in tally.reactions_s)
        console.print(
            f"{tally.commands} commands, {len(tally.missed)} missed, {tally.moot} moot"
            + (f"; heard after {reactions}" if reactions else "")
            + f"; {len(tally.errors)} mode errors"
        )
    console.print(f"{verdict.outcome}: {verdict.reason}", style="green" if verdict.outcome == "ok" else "yellow")
    if record is not None:
        console.print(f"recorded; look at it with: sdt view {record} --open", soft_wrap=True)


def _reading(decisions: "list[VisionDecision]") -> Latency:
    return latency_of([one.took_s for one in decisions])


def _latency(latency: Latency) -> dict[str, object]:
    bounds = [None if bound == float("inf") else bound for bound in BINS_MS]
    return {**vars(latency), "histogram": {"bounds_ms": bounds, "counts": list(latency.histogram)}}


def _switch(one: VisionDecision, start_ns: int) -> dict[str, object]:
    return {"time_s": round((one.stamp_ns - start_ns) / SECOND_NS, 3), "mode": one.after.label}


def _histogram(what: str, latency: Latency) -> None:
    """Quantiles, and a bar for each bin from the first to the last that holds any."""
    if latency.count == 0:
        return
    console.print(
        f"{what}: p50 {latency.p50_ms:.2f}, p95 {latency.p95_ms:.2f}, p99 {latency.p99_ms:.2f}, "
        f"max {latency.max_ms:.2f} ms ({latency.count})"
    )
    held = [number for number, count in enumerate(latency.histogram) if count]
    most = max(latency.histogram)
    for number in range(held[0], held[-1] + 1):
        low, high, count = BINS_MS[number], BINS_MS[number + 1], latency.histogram[number]
        bounds = f"{low:g} or more" if high == float("inf") else f"{low:g} to {high:g}"
        bar = "█" * max(round(_BAR * count / most), 1 if count else 0)
        console.print(f"  {bounds:>12} ms {bar:<{_BAR}} {count}", style="dim")
