"""How kernels are compiled: the results and the errors are numba's, and what numba compiles besides is as it was."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import numba
import numpy as np
import pytest
from llvmlite import binding
from numba.core import config, errors

from planner.base import compiling
from planner.base.kernels import njit


@njit(cache=False)
def share(x, n):
    if n < 0:
        raise ValueError("negative")
    if n == 7:
        # a text made here failed in whole runs of the suite, and never alone (numba 0.68); no kernel of planner/ makes one
        raise ValueError("seven is", n)
    return x[n] / n


@njit(cache=False)
def twice(x, n):
    return 2.0 * share(x, n)


@njit(cache=False)
def nonsense(x):
    return x + "text"


@njit(cache=False)
def spread(x):
    return np.arange(x).sum() + np.empty(int(x)).shape[0] * 0.5


@pytest.mark.slow
def test_a_function_of_numba_s_own_is_of_use_outside_after_a_kernel_had_it() -> None:
    assert spread(4) == 8.0

    @numba.njit
    def outside(x: int) -> float:
        return np.empty(x).shape[0] + np.arange(x).sum()

    assert outside(4) == 10


@pytest.mark.slow
def test_results_and_exceptions_of_a_kernel_inside_another() -> None:
    x = np.ones(9)
    assert (twice(x, 2), share(x, 2)) == (1.0, 0.5)
    for kernel in (twice, share):
        for n, fault, text in (
            (-1, ValueError, "negative"),
            (7, ValueError, "seven is', 7"),
            (0, ZeroDivisionError, "division by zero"),
        ):
            with pytest.raises(fault, match=text):
                kernel(x, n)


def test_a_kernel_that_numba_cannot_compile_is_its_error() -> None:
    with pytest.raises(errors.TypingError):
        nonsense(1.0)


def test_a_kernel_inside_a_function_of_numba_s_own() -> None:
    @numba.njit
    def outside(x: np.ndarray) -> float:
        return share(x, 4) + twice(x, 4)

    assert outside(np.ones(9)) == 0.75


def test_a_number_as_an_argument_is_no_other_kernel() -> None:
    @njit(cache=False)
    def sum_of(x: np.ndarray, n: int) -> float:
        return share(x, 1) + share(x, 2) + share(x, n=4) + share(x, n)

    before = len(share.part.overloads)
    assert sum_of(np.ones(9), 4) == 2.0
    assert len(share.part.overloads) <= max(before, 1)


def test_a_part_is_no_machine_code() -> None:
    """Or every kernel would be made twice: for itself, and as a piece of those that call it."""
    assert twice(np.ones(9), 3) == 2.0 / 3.0
    (made,) = share.part.overloads.values()
    assert made.library.get_pointer_to_function(made.fndesc.llvm_func_name) == 0


def test_threads_that_call_a_kernel_first_compile_it_once() -> None:
    @njit(cache=False, nogil=True)
    def third(x):
        return x / 3.0

    with ThreadPoolExecutor(8) as pool:
        assert set(pool.map(third, [6.0] * 16)) == {2.0}
        assert len(set(pool.map(lambda _: id(third.whole), range(16)))) == 1
    assert sum(third.whole.stats.cache_misses.values()) == 1


def test_code_is_for_a_level_of_the_architecture_that_the_processor_has(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    here = binding.get_host_cpu_features()
    for has in (True, False):
        monkeypatch.setattr(config, "CPU_NAME", None)
        monkeypatch.setattr(config, "CPU_FEATURES", None)
        features = dict(here) | dict.fromkeys(compiling.FEATURES.split(), True) | {"avx2": has}
        monkeypatch.setattr(binding, "get_host_cpu_features", lambda of=features: of)
        compiling.choose_processor()
        assert ((compiling.LEVEL, "") if has else (None, None)) == (config.CPU_NAME, config.CPU_FEATURES)
    monkeypatch.setattr(config, "CPU_NAME", "generic")  # as NUMBA_CPU_NAME says
    compiling.choose_processor()
    assert config.CPU_NAME == "generic"


def test_llvm_gives_the_level_the_features_that_are_looked_for() -> None:
    """What is compiled for it asks for no others: a loop of fused steps runs where AVX2 and FMA are."""
    if not binding.get_process_triple().startswith("x86_64"):
        pytest.skip("levels of x86-64")
    module = """
    define <4 x double> @fused(<4 x double> %a, <4 x double> %b, <4 x double> %c) {
      %r = call <4 x double> @llvm.fma.v4f64(<4 x double> %a, <4 x double> %b, <4 x double> %c)
      ret <4 x double> %r
    }
    declare <4 x double> @llvm.fma.v4f64(<4 x double>, <4 x double>, <4 x double>)
    """
    binding.initialize_native_target()
    binding.initialize_native_asmprinter()
    target = binding.Target.from_triple(binding.get_process_triple())
    codes = {}
    for name in (compiling.LEVEL, "x86-64"):
        codes[name] = target.create_target_machine(cpu=name).emit_assembly(binding.parse_assembly(module))
    level = codes[compiling.LEVEL]
    assert "vfmadd" in level
    assert "ymm" in level
    assert "zmm" not in level
    assert "vfmadd" not in codes["x86-64"]
