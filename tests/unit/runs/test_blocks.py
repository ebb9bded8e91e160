import threading

import numpy as np
import pytest

from sdt_tools.runs.blocks import in_blocks


@pytest.mark.parametrize("workers", [1, 3, None])
def test_every_row_is_worked_on_once(workers: int | None) -> None:
    seen = np.zeros(1003, np.int64)

    def work(block: slice) -> None:
        seen[block] += 1

    heard: list[tuple[int, int]] = []
    in_blocks(work, len(seen), 100, workers, lambda done, rows: heard.append((done, rows)))
    assert (seen == 1).all()
    assert (heard[0], heard[-1]) == ((0, 1003), (1003, 1003))
    assert heard == sorted(heard)


def test_no_rows_are_no_work() -> None:
    in_blocks(pytest.fail, 0, 10)


def test_a_failure_is_raised_and_ends_what_has_not_begun() -> None:
    begun: list[int] = []

    def work(block: slice) -> None:
        begun.append(block.start)
        if block.start == 0:
            raise ValueError("the first block")
        threading.Event().wait(0.02)

    with pytest.raises(ValueError, match="the first block"):
        in_blocks(work, 500, 1, workers=1)
    assert len(begun) < 500
    assert not [thread for thread in threading.enumerate() if thread.name.startswith("blocks")]
