"""A terminal that goes away while an app is on it: noticed at once, and no reason for the app to fail."""

import select
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import Final, TextIO

from textual.drivers.linux_driver import LinuxDriver

_LOOK_MS: Final = 100


class _Lasting:
    """A stream to which writing does nothing once its terminal has gone."""

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream
        self._gone = False

    def write(self, text: str) -> int:
        if not self._gone:
            try:
                return self._stream.write(text)
            except (OSError, ValueError):
                self._gone = True
        return len(text)

    def flush(self) -> None:
        if not self._gone:
            try:
                self._stream.flush()
            except (OSError, ValueError):
                self._gone = True

    def fileno(self) -> int:
        return self._stream.fileno()

    def isatty(self) -> bool:
        return self._stream.isatty()


class LastingDriver(LinuxDriver):
    """Textual's driver, for an app that has something to end in order when its terminal is gone.

    A terminal that hangs up sends SIGCONT to whoever is in its foreground, stopped or not. Textual would begin to read
    keys once more, beside the thread that reads or after the app has ended, and nothing would end that second thread.
    """

    _suspended = False

    def __init__(self, *arguments: object, **options: object) -> None:
        super().__init__(*arguments, **options)  # type: ignore[arg-type]
        self._file: TextIO = _Lasting(self._file)  # type: ignore[assignment]

    def _sigtstp_application(self, *arguments: object) -> None:
        """Stop."""
        self._suspended = True
        super()._sigtstp_application(*arguments)

    def _sigcont_application(self, *arguments: object) -> None:
        """Go on after a stop, and only then."""
        if self._suspended:
            self._suspended = False
            super()._sigcont_application(*arguments)

    def run_input_thread(self) -> None:
        """Keys, until the terminal is gone."""
        with suppress(OSError):
            super().run_input_thread()


@contextmanager
def hangup_watched(gone: Callable[[], None], descriptor: int = 0) -> Iterator[None]:
    """Within the block ``gone`` is called, in a thread, when the terminal behind ``descriptor`` hangs up.

    SIGHUP tells of it too, but not everyone who runs in a terminal gets
    the signal.
    """
    poll = select.poll()
    poll.register(descriptor, 0)  # a hang-up is always told
    ended = threading.Event()

    def watch() -> None:
        while not ended.is_set():
            try:
                if poll.poll(_LOOK_MS):
                    gone()
                    return
            except OSError:
                return

    watcher = threading.Thread(target=watch, name="hangup", daemon=True)
    watcher.start()
    try:
        yield
    finally:
        ended.set()
        watcher.join()
