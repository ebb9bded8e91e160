"""Units mapped over processes of this machine: one thread each, one process a core."""

import multiprocessing
import multiprocessing.connection
import os
import signal
import threading
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from pathlib import Path

from sdt_tools.runs.threads import use_one_thread
from sdt_tools.runs.unit import Unit, execute, finished

Progress = Callable[[int, int], None]
"""Called with (units done, units in all) at the start and whenever one more is done."""


def run_units(units: Sequence[Unit], root: Path, workers: int = 1, progress: Progress | None = None) -> list[Path]:
    """Execute ``units`` and return their folders, in the order given.

    Finished units are skipped. With one worker the work is done in this process. A failure stops what has not begun
    and is raised; what is finished stays finished. Interruption likewise.
    """
    names = [unit.name for unit in units]
    if len(set(names)) != len(names):
        raise ValueError("two units of one name")
    report = progress or _silent
    open_units = [unit for unit in units if not finished(unit, root)]
    done = len(units) - len(open_units)
    report(done, len(units))
    root.mkdir(parents=True, exist_ok=True)
    if workers <= 1 or len(open_units) <= 1:
        for unit in open_units:
            execute(unit, root)
            done += 1
            report(done, len(units))
    else:
        _run_in_processes(open_units, root, workers, lambda finished_now: report(done + finished_now, len(units)))
    return [root / name for name in names]


def _run_in_processes(units: Sequence[Unit], root: Path, workers: int, report: Callable[[int], None]) -> None:
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(min(workers, len(units)), mp_context=context, initializer=_begin_worker) as pool:
        pending: set[Future[Path]] = {pool.submit(execute, unit, root) for unit in units}
        finished_now = 0
        try:
            while pending:
                done, pending = wait(pending, return_when=FIRST_COMPLETED)
                for future in done:
                    future.result()
                finished_now += len(done)
                report(finished_now)
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            for worker in multiprocessing.active_children():
                worker.terminate()
            raise


def _begin_worker() -> None:
    """One thread of work; Ctrl-C is the parent's to hear, who then ends its workers. However he dies, they follow."""
    use_one_thread()
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    assert parent is not None, "only workers wait for a parent"
    multiprocessing.connection.wait([parent.sentinel])
    os._exit(1)


def _silent(_done: int, _total: int) -> None:
    """Report nothing."""
