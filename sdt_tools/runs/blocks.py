"""Rows worked on in fixed blocks, by threads of this process.

The blocks depend on nothing but the number of rows, and each writes what no other writes: the result is the same,
bit by bit, for any number of workers. Gains come from work that releases the interpreter (compiled with ``nogil``, or
numpy over large arrays).
"""

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

from sdt_tools.runs.local import Progress


def usable_cores() -> int:
    """The cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def in_blocks(
    work: Callable[[slice], None],
    rows: int,
    block: int,
    workers: int | None = None,
    progress: Progress | None = None,
) -> None:
    """Call ``work`` with every block of ``rows``, in threads: one a core, or ``workers``.

    ``progress`` hears of the rows done. A failure, the first one's, or Ctrl-C ends it when the blocks at work are done.
    """
    blocks = [slice(start, min(start + block, rows)) for start in range(0, rows, block)]
    report = progress or _silent
    report(0, rows)
    with ThreadPoolExecutor(workers or usable_cores(), "blocks") as pool:
        futures = [pool.submit(work, one) for one in blocks]
        try:
            for one, future in zip(blocks, futures, strict=True):
                future.result()
                report(one.stop, rows)
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise


def _silent(done: int, rows: int) -> None:
    """Nobody listens."""
