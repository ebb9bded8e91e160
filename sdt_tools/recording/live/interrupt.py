"""Ctrl-C, SIGTERM and a terminal that hangs up: heard between two ticks instead of in the middle of a write."""

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Final

_POLITE: Final = (signal.SIGTERM, signal.SIGHUP)


class Interrupt:
    """Whether somebody wants the recording to end, and by which signal; or what has failed around it."""

    def __init__(self) -> None:
        self.signal: int | None = None
        self.failure: Exception | None = None
        """Raised by whoever records, at once: the screen that shows it has failed, say."""

    @property
    def requested(self) -> bool:
        """Whether it was asked for. Raises what has failed."""
        if self.failure is not None:
            raise self.failure
        return self.signal is not None


@contextmanager
def deferred_interrupt() -> Iterator[Interrupt]:
    """Within the block SIGINT, SIGTERM and SIGHUP only set ``signal``, to the first that came.

    A second Ctrl-C raises KeyboardInterrupt as ever; further SIGTERM and SIGHUP change nothing, for a terminal that
    closes sends several. SIGHUP stays ignored where it was (``nohup``). Signals reach the main thread only: in another
    one nothing is changed.
    """
    interrupt = Interrupt()
    if threading.current_thread() is not threading.main_thread():
        yield interrupt
        return

    before = {signal.SIGINT: signal.getsignal(signal.SIGINT) or signal.default_int_handler}
    for number in _POLITE:
        before[number] = signal.getsignal(number) or signal.SIG_DFL

    def heard(number: int, _frame: FrameType | None) -> None:
        interrupt.signal = interrupt.signal or number
        if number == signal.SIGINT:
            signal.signal(signal.SIGINT, before[signal.SIGINT])

    for number, handler in before.items():
        if number != signal.SIGHUP or handler is not signal.SIG_IGN:
            signal.signal(number, heard)
    try:
        yield interrupt
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
