"""Compiled kernels from the disk, without what only compiling needs.

numba gets ready to compile before it looks for a kernel on the disk: it imports what it knows of Python and NumPy, and SciPy's linear
algebra with it (0.5 s). With a kernel it imports the modules of all functions compiled into it, and it reads, beside the machine code,
the form that other kernels are compiled from (three quarters of the time of loading). All of this is put off here until something is
compiled.

What is used of numba here has no documented interface. Where one of the names is missing kernels are loaded as numba does it.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from typing import Any

# Of numba's library of machine code.
_USED = (
    "_unserialize",
    "enable_object_caching",
    "_set_compiled_object",
    "_finalize_final_module",
    "_get_module_for_linking",
    "get_pointer_to_function",
)


def load_kernel(kept: Any, signature: Any, context: Any) -> Any:
    """The compiled kernel of a signature, or None if the disk has none.

    kept    : numba's cache of the kernel
    context : numba's target context
    """
    quick = _quick_library()
    if quick is None or not hasattr(kept, "_load_overload"):  # numba's cache where nothing can be kept
        return kept.load_overload(signature, context)
    from numba.core.runtime import rtsys

    rtsys.initialize(context)
    with kept._guard_against_spurious_io_errors(), _read_as(quick, context.codegen()), _no_imports():
        return kept._load_overload(signature, context)
    return None  # after an error that the guard has taken


@contextmanager
def _read_as(quick: Any, generator: Any) -> Iterator[None]:
    """numba's code generator makes libraries of the class `quick`."""
    usual = generator._library_class
    generator._library_class = quick
    try:
        yield
    finally:
        generator._library_class = usual


@contextmanager
def _no_imports() -> Iterator[None]:
    """Environments are made without importing their modules.

    An environment is what compiled code knows of Python: constants, among them those of its exceptions, and the variables of its
    module, which only code with Python objects reads. The module's name is enough to write the environment to the disk again.
    """
    from numba.core import environment

    def rebuilt(module: str, constants: list[Any], name: str) -> Any:
        found = environment.lookup_environment(name)
        if found is None:
            loaded = sys.modules.get(module)
            found = environment.Environment({"__name__": module} if loaded is None else vars(loaded))
            found.consts[:] = constants
            found.env_name = name
            environment.Environment._memo[name] = found
        return found

    usual = environment._rebuild_env
    environment._rebuild_env = rebuilt
    try:
        yield
    finally:
        environment._rebuild_env = usual


@cache
def _quick_library() -> Any:
    """The class of libraries that are read quickly; None if numba is not as it is known here."""
    try:
        from numba.core.caching import Cache
        from numba.core.codegen import JITCodeLibrary, ll
        from numba.core.environment import Environment, _rebuild_env, lookup_environment  # noqa: F401
        from numba.core.runtime import rtsys
    except ImportError:
        return None
    known = (
        all(hasattr(Cache, name) for name in ("_load_overload", "_guard_against_spurious_io_errors"))
        and all(hasattr(JITCodeLibrary, name) for name in _USED)
        and hasattr(rtsys, "initialize")
        and hasattr(Environment, "_memo")
    )
    if not known:
        return None

    class QuickLibrary(JITCodeLibrary):
        """Machine code; LLVM's form of it (bitcode) is read when another kernel is compiled from it."""

        _bitcode: bytes | None = None

        @classmethod
        def _unserialize(cls, codegen: Any, state: Any) -> Any:
            name, kind, data = state
            if kind != "object":
                return super()._unserialize(codegen, state)
            library = cls(codegen, name)
            library.enable_object_caching()
            machine_code, library._bitcode = data
            library._set_compiled_object(machine_code)
            library._finalize_final_module()
            return library

        def _get_module_for_linking(self) -> Any:
            if self._bitcode is not None:
                self._shared_module = ll.parse_bitcode(self._bitcode)
                self._codegen._engine._load_defined_symbols(self._shared_module)
                self._bitcode = None
            return super()._get_module_for_linking()

        def get_pointer_to_function(self, name: str) -> int:
            if self._bitcode is None:
                return int(super().get_pointer_to_function(name))
            return int(self._codegen._engine.get_function_address(name))

    return QuickLibrary
