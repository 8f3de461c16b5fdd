"""The campaign ends jobs that take too long, and does not count what compiling a kernel takes."""

from __future__ import annotations

import multiprocessing
import time
from unittest.mock import MagicMock

import numpy as np
import pytest

from benchmarks.campaign import Compiling, Worker, rows_of
from planner.base import kernel_files, kernels


@pytest.mark.slow
def test_a_job_that_takes_too_long_is_ended() -> None:
    rows = list(rows_of([20, 21], 1, np.inf, limit=-1.0))
    assert [row["outcome"] for row in rows] == ["too long", "too long"]


class _Busy(Worker):
    """A worker without a process, of a job that has taken so much."""

    spent = 0.0

    def used(self) -> float:
        return self.spent - self.before


def test_what_compiling_a_kernel_takes_is_not_counted() -> None:
    here, there = multiprocessing.Pipe()
    worker = _Busy(process=MagicMock(), ends=here, seed=3, began=time.monotonic())
    compiling = Compiling(there)
    compiling.begins(is_kept=True)
    assert worker.result(limit=10.0) is None
    worker.spent = 50.0
    assert worker.result(limit=10.0) is None
    there.send(45.0)
    assert worker.result(limit=10.0) is None
    worker.process.kill.assert_not_called()
    there.send({"seed": 3})
    assert worker.result(limit=10.0) == {"seed": 3}
    worker.spent = 60.0
    row = worker.result(limit=10.0)
    assert row is not None
    assert row["outcome"] == "too long"


def test_a_worker_tells_of_kernels_that_it_compiles() -> None:
    here, there = multiprocessing.Pipe()
    compiling = Compiling(there)
    kernel_files.at_compilation(compiling)
    try:

        @kernels.njit(cache=False)
        def twice(x: float) -> float:
            return 2.0 * x

        assert twice(3.0) == 6.0
    finally:
        kernel_files.at_compilation(None)
    assert here.recv() is None
    assert here.recv() == compiling.took
