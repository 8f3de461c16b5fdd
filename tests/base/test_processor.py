"""The processor that kernels are compiled for."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from llvmlite import binding

from planner.base.processor import LEVELS, Processor, processor

LEVEL = "x86-64-v3"


@pytest.fixture(autouse=True)
def _asked_anew(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    for name in ("NUMBA_CPU_NAME", "NUMBA_CPU_FEATURES"):
        monkeypatch.delenv(name, raising=False)
    processor.cache_clear()
    yield
    processor.cache_clear()


def here(monkeypatch: pytest.MonkeyPatch, without: str = "") -> binding.targets.FeatureMap:
    """Let this processor have the features of the level and some more, without one of them."""
    has = binding.targets.FeatureMap({name: name != without for name in [*LEVELS[LEVEL], "sse4a"]})
    monkeypatch.setattr(binding, "get_host_cpu_features", lambda: has)
    return has


def test_a_processor_of_a_level_is_taken_for_that_level(monkeypatch: pytest.MonkeyPatch) -> None:
    here(monkeypatch)
    assert processor() == Processor(LEVEL, "")


@pytest.mark.parametrize("without", LEVELS[LEVEL])
def test_one_that_lacks_a_feature_is_taken_as_it_is(monkeypatch: pytest.MonkeyPatch, without: str) -> None:
    has = here(monkeypatch, without)
    assert processor() == Processor(binding.get_host_cpu_name(), has.flatten())
    assert f"-{without}" in processor().features.split(",")


def test_variables_say_otherwise(monkeypatch: pytest.MonkeyPatch) -> None:
    here(monkeypatch)
    monkeypatch.setenv("NUMBA_CPU_NAME", "generic")
    assert processor() == Processor("generic", "")
    processor.cache_clear()
    monkeypatch.setenv("NUMBA_CPU_FEATURES", "+avx")
    assert processor() == Processor("generic", "+avx")


def test_llvm_gives_a_level_the_features_listed() -> None:
    """What is compiled for a level asks for no feature that is not looked for: a loop of fused steps runs where AVX2 and FMA are."""
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
    for name in (LEVEL, "x86-64"):
        codes[name] = target.create_target_machine(cpu=name).emit_assembly(binding.parse_assembly(module))
    assert "vfmadd" in codes[LEVEL]
    assert "ymm" in codes[LEVEL]
    assert "zmm" not in codes[LEVEL]
    assert "vfmadd" not in codes["x86-64"]
