"""How numba compiles a kernel, and finds it on the disk again.

Each kernel is two of numba's dispatchers. The `whole` is what Python calls: it is optimised with everything
that it calls, turned into machine code and kept on the disk. The `part` is what other kernels call, and is no
more than instructions for them: as it comes, numba would optimise it by itself, turn it into machine code and
make entries for Python and C, none of which would be used, and would compile it once more for every number
that an argument is somewhere. That would be about half of the time that all takes.

Code is made for a level of the architecture, not for the one processor that is here, so that plans agree on
every machine of that level to the last bit as far as kernels make them, and kernels that come with an
installation are of use elsewhere. Level 3 of x86-64 (AVX2, FMA: since 2013) has what the solvers gain by. It
is set as numba's own setting, and holds for all that the process compiles.
"""

from __future__ import annotations

import itertools
import os
import pickle
from collections.abc import Callable
from typing import Any

import numba
from llvmlite import binding
from numba.core import bytecode, caching, codegen, compiler, config, serialize, types
from numba.core.runtime import rtsys

from planner.base import kernel_files
from planner.base.kernel_files import KernelFile

LEVEL = "x86-64-v3"
# What LLVM calls the features of the level beyond those of every x86-64 (x86-64 psABI, table 3.1).
FEATURES = "cx16 sahf popcnt sse3 ssse3 sse4.1 sse4.2 avx avx2 bmi bmi2 f16c fma lzcnt movbe xsave"

# numba tells functions in machine code apart by a number that begins at 1 in every process, and has one name
# for records of two and of nine axes: a third process would load two functions of one name.
bytecode.FunctionIdentity._unique_ids = itertools.count(int.from_bytes(os.urandom(6)))


def choose_processor() -> None:
    """Set the level as numba's processor, unless NUMBA_CPU_... say another or this one has not all of it."""
    settings: Any = config  # made by numba of its variables
    if settings.CPU_NAME is None and settings.CPU_FEATURES is None:
        here = binding.get_host_cpu_features()
        if all(here.get(feature) for feature in FEATURES.split()):
            settings.CPU_NAME, settings.CPU_FEATURES = LEVEL, ""


choose_processor()


class _NoEnvironment:
    """In place of numba's code generator for a part: the Python objects that its code uses, such as the text
    of an exception, are set in the wholes that it becomes a piece of."""

    @staticmethod
    def set_env(name: str, environment: Any) -> None:
        pass


class _PartLibrary(codegen.JITCodeLibrary):
    """Instructions to be linked: each function by itself is simplified, as numba does it, and that is all."""

    codegen = _NoEnvironment()

    def _optimize_final_module(self) -> None:
        pass

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._finalized = True

    def get_pointer_to_function(self, name: str) -> int:
        self._ensure_finalized()
        return 0


class _PartCompiler(compiler.Compiler):
    """numba's compiler, for parts."""

    def define_pipelines(self) -> Any:
        state = self.state
        state.library = _PartLibrary(state.targetctx.codegen(), state.func_id.func_qualname)
        return super().define_pipelines()


def part(function: Callable[..., Any], settings: dict[str, Any]) -> Any:
    """The dispatcher that other kernels call."""
    entries = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
    made = numba.njit(pipeline_class=_PartCompiler, **{**settings, **entries})(function)
    numba_s = made.get_call_template

    def of_any_value(args: Any, kws: Any) -> Any:
        named = {name: types.unliteral(of) for name, of in kws.items()}
        return numba_s([types.unliteral(of) for of in args], named)

    made.get_call_template = of_any_value
    return made


def whole(function: Callable[..., Any], settings: dict[str, Any], cache: KernelCache) -> Any:
    """The dispatcher that Python calls."""
    made = numba.njit(**{"no_cfunc_wrapper": True, **settings})(function)
    made._cache = cache
    return made


class KernelCache(caching.NullCache):
    """numba's cache of a whole, in files with a checksum from safe folders (kernel_files.py), for a function
    of Python whose `content_of` is known; None for one that is not kept."""

    def __init__(self, function: Any, content: bytes | None):
        self._function, self._content = function, content

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """The code that was compiled for these types; None if there is nothing, or nothing of use."""
        rtsys.initialize(target_context)  # all that machine code needs; compiling has numba load more
        kept = None if self._content is None else kernel_files.read(self._file(sig, target_context.codegen()))
        if kept is not None:
            try:
                made = compiler.CompileResult._rebuild(target_context, *pickle.loads(kept))
                if made.signature.args == tuple(sig):
                    return made
            except Exception:  # whatever it is, the kernel can be compiled
                pass
        kernel_files.compilation().begins(self._content is not None and kernel_files.can_be_kept())
        return None

    def save_overload(self, sig: Any, made: Any) -> None:
        """Keep what was compiled for these types."""
        for environment in made._find_referenced_environments():
            made.codegen.set_env(environment.env_name, environment)
        kernel_files.compilation().ends()
        if self._content is not None:
            try:
                kernel_files.write(self._file(sig, made.codegen), serialize.dumps(_to_keep(made)))
            except OSError as fault:
                kernel_files.warn_once(fault)

    def _file(self, sig: Any, generator: Any) -> KernelFile:
        given = {k: v for k, v in os.environ.items() if k.startswith("NUMBA_") and k not in _NOT_OF_CODE}
        settings = sorted(given.items())
        types_and_tools = repr((tuple(sig), generator.magic_tuple(), numba.__version__, settings))
        assert self._content is not None
        return kernel_files.place(self._function, self._content, types_and_tools)


def _to_keep(made: Any) -> tuple[Any, ...]:
    """The part of a whole that numba pickles, without what is for being linked into others and for people to
    read, and without environments that have nothing in them, of numba's own functions, whose modules would be
    imported for that."""
    (name, kind, (code, _)), *others, _, reload_init, environments = made._reduce()
    entry = f'define void @"{made.fndesc.llvm_cpython_wrapper_name}"() {{ ret void }}'
    library = name, kind, (code, binding.parse_assembly(entry).as_bitcode())
    return library, *others, "", reload_init, tuple(of for of in environments if of.consts)


# numba's variables that machine code does not depend on.
_NOT_OF_CODE = {"NUMBA_CACHE_DIR", "NUMBA_NUM_THREADS"}
