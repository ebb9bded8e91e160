"""Progress bars on stderr."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TaskID,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)

from sdt_tools.cli.console import console

_COLUMNS = (
    TextColumn("{task.description}"),
    BarColumn(),
    MofNCompleteColumn(),
    TimeElapsedColumn(),
    TextColumn("eta"),
    TimeRemainingColumn(),
)


@contextmanager
def progress_bar(what: str) -> Iterator[Callable[[int, int], None]]:
    """A function to call with (done, total); the bar goes when the block ends, and shows on terminals only."""
    with Progress(*_COLUMNS, console=console, transient=True, disable=not console.is_terminal) as bar:
        task = bar.add_task(what, total=None)
        yield lambda done, total: bar.update(task, completed=done, total=total)


@contextmanager
def epoch_bar(epochs: int) -> Iterator[Callable[[int, str], None]]:
    """A function to call with an epoch that is done and what came of it; there may be more of them than planned."""
    columns = (TextColumn("epoch"), MofNCompleteColumn(), BarColumn(), *_COLUMNS[:1], *_COLUMNS[3:])
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as bar:
        task = bar.add_task("", total=epochs)
        yield lambda epoch, text: bar.update(task, completed=epoch, total=max(epochs, epoch), description=text)


@contextmanager
def says_where_to_go_on(out: Path) -> Iterator[None]:
    """When the training of ``out`` is interrupted, where its state is kept."""
    from sdt_tools.training.snapshot import unfinished

    try:
        yield
    except KeyboardInterrupt:
        if unfinished(out).exists():
            console.print(f"the state is in {unfinished(out)}; the same command goes on from there", soft_wrap=True)
        raise


@contextmanager
def stage_progress() -> Iterator[Callable[[str, int, int], None]]:
    """A function to call with (stage, done, total): one bar a stage, full when the next begins; else its name alone."""
    with Progress(*_COLUMNS, console=console, disable=not console.is_terminal) as bar:
        tasks: dict[str, TaskID] = {}

        def report(stage: str, done: int, total: int) -> None:
            if stage not in tasks:
                _fill(bar, tasks)
                tasks[stage] = bar.add_task(stage)
                if not console.is_terminal:
                    console.print(stage)
            bar.update(tasks[stage], completed=done, total=total)

        yield report
        _fill(bar, tasks)


def _fill(bar: Progress, tasks: dict[str, TaskID]) -> None:
    for task in bar.tasks:
        if task.id in tasks.values():
            bar.update(task.id, completed=task.total)
