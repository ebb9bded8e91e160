"""Work on files that nobody waits for: takes are closed, listed and discarded, rings are written."""

from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor


class Clerk:
    """Does one thing after the other, in a thread of its own or, with ``at_once``, before ``do`` returns."""

    def __init__(self, at_once: bool) -> None:
        self._thread = None if at_once else ThreadPoolExecutor(1, "recording-clerk")
        self._under_way: list[Future[None]] = []

    @property
    def busy(self) -> bool:
        """Whether something is not done yet."""
        return any(not work.done() for work in self._under_way)

    def do(self, work: Callable[[], None]) -> None:
        """Do ``work`` after all that was asked for before."""
        if self._thread is None:
            work()
        else:
            self._under_way.append(self._thread.submit(work))

    def check(self) -> None:
        """Raise the first failure that was not raised yet."""
        done = [work for work in self._under_way if work.done()]
        self._under_way = [work for work in self._under_way if work not in done]
        failures = [failure for work in done if (failure := work.exception()) is not None]
        if failures:
            raise failures[0]

    def close(self) -> None:
        """Wait until all is done. Raises the first failure that was not raised yet."""
        if self._thread is not None:
            self._thread.shutdown(wait=True)
        self.check()
