"""Runs of the whole controller kept as recordings."""

from pathlib import Path

from sdt_tools.clock import SECOND_NS
from sdt_tools.evaluation.saving import SaveRuns, Told, write_run
from sdt_tools.evaluation.vision.run import VisionRun
from sdt_tools.evaluation.vision.whole_run import WholeOutcome
from sdt_tools.frames import LogEntry, LogLevel, Received
from sdt_tools.scene.layout import Layout


class KeptMessages:
    """Holds what passes in a run until it is known whether it is kept. Implements Observer."""

    def __init__(self) -> None:
        self.messages: list[Received] = []

    def observe(self, received: Received) -> None:
        """One more."""
        self.messages.append(received)

    def close(self) -> None:
        """It is the writer's now."""


def keep_run(
    folder: Path, layout: Layout, driver: str, kept: KeptMessages, run: VisionRun, keep: SaveRuns, config_toml: str
) -> str | None:
    """Write ``run``, if runs of its outcome are kept, its mode errors marked in the log; the recording's name."""
    failed = run.verdict.outcome is not WholeOutcome.OK
    if keep is SaveRuns.NONE or (keep is SaveRuns.FAILED and not failed):
        return None
    start_ns = kept.messages[0].received_ns
    marks = []
    for error in run.tally.errors:
        at_ns = start_ns + round(error.time_s * SECOND_NS)
        what = f"mode error: {error.mode.label}, not commanded"
        marks.append(Received(at_ns, LogEntry(at_ns, LogLevel.WARNING, what, "evaluation")))
    messages = sorted([*kept.messages, *marks], key=lambda received: received.received_ns)
    name = f"{driver.replace(':', '-')}_{layout.name}_{layout.seed}_{run.verdict.outcome}.mcap"
    told = Told(driver, run.verdict.outcome.value, run.verdict.reason, failed)
    write_run(folder / name, layout, messages, told, config_toml)
    return name
