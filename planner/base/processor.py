"""For which processor kernels are compiled: for a level of the architecture, not for the one processor that is here.

A kernel is then the same instructions on every machine of that level, so that plans agree there to the last bit as far as kernels make
them, and kernels that were compiled at installation or lie in a wheel are of use elsewhere. Level 3 of x86-64 (AVX2, FMA: since 2013)
has what the solvers gain by. Where the processor is of no level listed here, kernels are compiled for it and its features.
"""

from __future__ import annotations

import os
from functools import cache
from typing import NamedTuple

# What LLVM calls the features of a level beyond those of every x86-64 (x86-64 psABI, table 3.1).
LEVELS = {
    "x86-64-v3": (
        "cx16",
        "sahf",
        "popcnt",
        "sse3",
        "ssse3",
        "sse4.1",
        "sse4.2",
        "avx",
        "avx2",
        "bmi",
        "bmi2",
        "f16c",
        "fma",
        "lzcnt",
        "movbe",
        "xsave",
    )
}


class Processor(NamedTuple):
    """As LLVM knows it.

    name     : of the processor or level
    features : further features, "+avx2,-sse4a"; none for a level
    """

    name: str
    features: str


@cache
def processor() -> Processor:
    """The processor that kernels are compiled for: a level, or what numba's variables NUMBA_CPU_... say, or the one that is here."""
    from llvmlite import binding

    has = binding.get_host_cpu_features()
    named, featured = os.environ.get("NUMBA_CPU_NAME"), os.environ.get("NUMBA_CPU_FEATURES")
    if named is None and featured is None:
        for level, wanted in LEVELS.items():
            if all(has.get(feature) for feature in wanted):
                return Processor(level, "")
    if featured is None:
        featured = "" if named == "generic" else has.flatten()
    return Processor(named or binding.get_host_cpu_name(), featured)
