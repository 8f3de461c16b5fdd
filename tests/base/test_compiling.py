"""How kernels are compiled: the results and the errors are numba's, and numba is left as it was."""

from __future__ import annotations

import operator

import numba
import numpy as np
import pytest
from numba.core import errors, registry, targetconfig, types
from numba.core.compiler import Flags
from numba.core.types import functions

from planner.base import compiling, kept, kernels
from planner.base.kernels import njit

pytestmark = pytest.mark.skipif(not kernels.known_numba(), reason="another version of numba")


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
    context = registry.cpu_target.target_context
    wrappers = [getattr(type(context), name) for name in compiling.WRAPPERS]
    return [*owners, *wrappers, context.codegen(), context.codegen()._library_class]


@njit(cache=False)
def spread(x):
    return np.arange(x).sum() + np.empty(int(x)).shape[0] * 0.5


@pytest.mark.slow
def test_a_function_of_numba_s_own_is_of_use_outside_after_a_kernel_had_it() -> None:
    """Its library is one without entries."""
    assert spread(4) == 8.0

    @numba.njit
    def outside(x: int) -> float:
        return np.empty(x).shape[0] + np.arange(x).sum()

    assert outside(4) == 10


def test_numba_is_as_it_was_after_a_kernel_and_after_a_fault() -> None:
    before = state_of_numba()
    assert njit(cache=False)(lambda x: x + 1)(1) == 2
    with pytest.raises(errors.TypingError):
        nonsense(1.0)
    assert state_of_numba() == before
    assert numba.njit(lambda x: x + 1)(1) == 2


@pytest.mark.slow
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

    before = len(share.dispatcher.inside_others.overloads)
    assert sum_of(np.ones(9), 4) == 2.0
    assert len(share.dispatcher.inside_others.overloads) <= max(before, 1)


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
    monkeypatch.setattr(kept, "numba_version", lambda: "1.0.0rc1")
    assert not kernels.known_numba()
    plain = njit(cache=False)(twice.py_func)
    assert not isinstance(plain, kernels.Kernel)
    assert plain(np.ones(9), 2) == 1.0
