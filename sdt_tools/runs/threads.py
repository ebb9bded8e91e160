"""One thread a process."""

import os

THREAD_VARIABLES = (
    "MKL_NUM_THREADS",
    "NUMBA_NUM_THREADS",
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "OPENCV_FOR_THREADS_NUM",
    "POLARS_MAX_THREADS",
)


def use_one_thread() -> None:
    """Keep this process to one thread: two on a busy machine can be twenty times slower than one.

    Numeric libraries read these variables when they are first imported, so this goes before them.
    """
    for variable in THREAD_VARIABLES:
        os.environ[variable] = "1"
