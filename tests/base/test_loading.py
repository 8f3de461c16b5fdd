"""Kernels that come from the disk do what those do that were compiled, also inside others that are compiled now."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

KERNELS = """
import numpy as np
from planner.base.kernels import njit

@njit(cache=True)
def root(x):
    if x < 0.0:
        raise ValueError("negative", 3)
    found = np.empty(1)
    found[0] = np.sqrt(x)
    return found[0]

@njit(cache=True)
def twice(x):
    return 2.0 * root(x)

@njit(cache=True)
def four_times(x):
    return 2.0 * twice(x)
"""
USE = """
import sys
import kernels_of_test as made

def fault(kernel):
    try:
        kernel(-1.0)
    except ValueError as error:
        return error.args

for name in sys.argv[1:]:
    kernel = getattr(made, name)
    hits = kernel(4.0), fault(kernel), sum(kernel.stats.cache_hits.values())
    print(name, *hits, "numba.np.arraymath" in sys.modules)
"""


@pytest.fixture
def use(tmp_path: Path) -> Callable[..., list[str]]:
    """Run kernels by name in a process of its own: lines of value, exception, loads from the disk, and whether numba could compile."""
    (tmp_path / "kernels_of_test.py").write_text(KERNELS)
    (tmp_path / "use.py").write_text(USE)

    def run(*names: str) -> list[str]:
        done = subprocess.run(
            [sys.executable, str(tmp_path / "use.py"), *names], capture_output=True, text=True, check=False
        )
        assert done.returncode == 0, done.stderr
        return done.stdout.splitlines()

    return run


def test_a_kernel_from_the_disk_and_one_that_is_compiled_from_it(use: Callable[..., list[str]]) -> None:
    wrong = "('negative', 3)"
    assert use("twice") == [f"twice 4.0 {wrong} 0 True"]
    # from the disk: the same value and the same exception, and nothing that only compiling needs; then one compiled from it
    assert use("twice", "four_times") == [f"twice 4.0 {wrong} 1 False", f"four_times 8.0 {wrong} 0 True"]
    # and that from the disk, without the other
    assert use("four_times") == [f"four_times 8.0 {wrong} 1 False"]
