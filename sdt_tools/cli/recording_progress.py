"""The progress of a recording on stderr: time, messages a second by topic, size, what was lost."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress

from rich.progress import BarColumn, Progress, Task, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from rich.text import Text

from sdt_tools.cli.console import console
from sdt_tools.recording.live.disk import disk_words
from sdt_tools.recording.live.outcome import RecordingProgress
from sdt_tools.recording.messages.topics import CAMERA_IMAGE, LIDAR_SCAN

_SHOWN = {LIDAR_SCAN: "scans", CAMERA_IMAGE: "images"}


class _Remaining(TimeRemainingColumn):
    """The time that is left; nothing where nobody knows the end."""

    def render(self, task: Task) -> Text:
        """As ``eta 0:00:12``."""
        return Text() if task.total is None else Text("eta ") + super().render(task)


@contextmanager
def recording_progress(what: str) -> Iterator[Callable[[RecordingProgress], None]]:
    """A function to call as the recording goes on; the line goes when the block ends."""
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.fields[state]}"),
        TimeElapsedColumn(),
        _Remaining(),
    )
    bar = Progress(*columns, console=console, transient=True, disable=not console.is_terminal)
    task = bar.add_task(what, total=None, state="")
    bar.start()
    try:
        yield lambda now: bar.update(task, completed=now.recorded_s, total=now.total_s, state=describe(now))
    finally:
        with suppress(OSError):  # a terminal that has hung up
            bar.stop()


def describe(now: RecordingProgress) -> str:
    """One line, as in ``12.4 s, 1900 scans/s, 3.1 MB, disk 3.2 h``; rates are those of the wall clock."""
    wall_s = max(now.wall_s, 1e-9)
    rates = [f"{now.counts[topic] / wall_s:.0f} {word}/s" for topic, word in _SHOWN.items() if topic in now.counts]
    state = [now.state] if now.state else []
    lost = [f"{now.dropped} dropped"] if now.dropped else []
    missing = [f"{now.missing} missing"] if now.missing else []
    late = [f"{now.missed_deadlines} late"] if now.missed_deadlines else []
    size = [f"{now.recorded_s:.1f} s", *rates, f"{now.size_bytes / 1e6:.1f} MB"] if now.size_bytes else []
    disk = [] if now.disk_left_s is None else [disk_words(now.disk_left_s)]
    return ", ".join([*state, *size, *lost, *missing, *late, *disk])
