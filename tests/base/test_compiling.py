"""How kernels are compiled: the results and the errors are numba's, and numba is left as it was."""

from __future__ import annotations

import operator
import subprocess
import sys
from pathlib import Path

import numba
import numpy as np
import pytest
from numba.core import errors, registry, targetconfig, types
from numba.core.compiler import Flags
from numba.core.types import functions

from planner.base import compiling
from planner.base.kernels import njit

pytestmark = pytest.mark.skipif(not compiling.known_numba(), reason="another version of numba")
ROOT = Path(__file__).resolve().parents[2]


@njit(cache=False)
def share(x, n):
    if n < 0:
        raise ValueError("negative")
    if n == 7:
        raise ValueError(f"seven is {n}")
    return x[n] / n


@njit(cache=False)
def twice(x, n):
    return 2.0 * share(x, n)


@njit(cache=False)
def nonsense(x):
    return x + "text"


def state_of_numba() -> list[object]:
    settings = targetconfig.TargetConfig
    owners = (functions.BaseFunction.get_call_type, settings.__eq__, settings.__hash__)
    return [*owners, registry.cpu_target.target_context.codegen()._library_class]


def test_numba_is_as_it_was_after_a_kernel_and_after_a_fault() -> None:
    before = state_of_numba()
    assert njit(cache=False)(lambda x: x + 1)(1) == 2
    with pytest.raises(errors.TypingError):
        nonsense(1.0)
    assert state_of_numba() == before
    assert numba.njit(lambda x: x + 1)(1) == 2


def test_results_and_exceptions_of_a_kernel_inside_another() -> None:
    x = np.ones(9)
    assert (twice(x, 2), share(x, 2)) == (1.0, 0.5)
    for kernel in (twice, share):
        for n, fault, text in (
            (-1, ValueError, "negative"),
            (7, ValueError, "seven is 7"),
            (0, ZeroDivisionError, "division by zero"),
        ):
            with pytest.raises(fault, match=text):
                kernel(x, n)


def test_a_kernel_inside_a_function_of_numba_s_own() -> None:
    @numba.njit
    def outside(x: np.ndarray) -> float:
        return share(x, 4) + twice(x, 4)

    assert outside(np.ones(9)) == 0.75


def test_a_number_as_an_argument_is_no_other_kernel() -> None:
    @njit(cache=False)
    def sum_of(x: np.ndarray, n: int) -> float:
        return share(x, 1) + share(x, 2) + share(x, n=4) + share(x, n)

    before = len(share.inside_others.overloads)
    assert sum_of(np.ones(9), 4) == 2.0
    assert len(share.inside_others.overloads) <= max(before, 1)


SOURCE = """
from planner.base.kernels import njit

@njit()
def share(x, n):
    if n == 7:
        raise ValueError(f"seven is {n}")
    return x / n

@njit()
def twice(x, n):
    return 2.0 * share(x, n)
"""
USE = """
import sys; sys.path.insert(0, sys.argv[1]); import inner
print(inner.twice(3.0, 2))
try: inner.twice(3.0, 7)
except ValueError as fault: print(fault)
print(sum(inner.twice.stats.cache_hits.values()), len(inner.share.overloads))
"""


def test_only_the_root_is_kept_and_its_errors_with_it(tmp_path: Path) -> None:
    (tmp_path / "inner.py").write_text(SOURCE, encoding="utf-8")
    for hits in (0, 1):
        command = [sys.executable, "-c", USE, str(tmp_path)]
        done = subprocess.run(command, capture_output=True, text=True, check=True, cwd=ROOT)
        assert done.stdout.split("\n")[:-1] == ["3.0", "seven is 7", f"{hits} 0"]
    assert [file.name.partition("-")[0] for file in tmp_path.rglob("*.nbc")] == ["inner.twice"]


def test_signatures_are_those_that_numba_finds_and_depend_on_the_settings() -> None:
    context = registry.cpu_target.typing_context
    context.refresh()
    add = context.resolve_value_type(operator.add)
    array = types.Array(types.float64, 1, "C")
    for args in ((types.int64, types.float64), (types.intp, types.intp), (array, types.float64)):
        with targetconfig.ConfigStack().enter(Flags()):
            found = [compiling._call_type(add, context, args, {}) for _ in range(2)]
            assert found[0] is found[1]
            assert found[0] == compiling._numba_s_call_type(add, context, args, {})
    other = Flags()
    other.error_model = "numpy"
    known = len(compiling._by_function[add])
    with targetconfig.ConfigStack().enter(other):
        compiling._call_type(add, context, (types.int64, types.float64), {})
    assert len(compiling._by_function[add]) == known + 1


def test_equal_settings_are_equal_and_hash_equal() -> None:
    given, defaults, others = Flags(), Flags(), Flags()
    given.nrt = defaults.nrt  # its default, set
    others.nrt = not defaults.nrt
    for a, b in ((given, defaults), (defaults, defaults), (others, defaults), (others, Flags(others))):
        assert compiling._same_settings(a, b) == (a == b)
        assert a != b or compiling._hash_of_settings(a) == compiling._hash_of_settings(b)
    assert given == defaults != others


def test_another_version_of_numba_compiles_as_it_does(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(numba, "__version__", "1.0.0rc1")
    assert not compiling.known_numba()
    plain = njit(cache=False)(twice.py_func)
    assert not hasattr(plain, "inside_others")
    assert plain(np.ones(9), 2) == 1.0
