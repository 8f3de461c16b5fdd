"""Compiled kernels from the disk without numba: its object code is linked by LLVM, and called by numba's C modules.

numba would first get ready to compile: it imports 160 modules and makes a compiler's objects for each kernel. What its object code asks
for is little: helpers written in C, the addresses of Python's exceptions, an environment for each function (constants, such as the
arguments of its exceptions), and a function that unpickles. All of it is in three C modules of numba, which are loaded by themselves,
and below. `Linker` follows numba's own `_load_global_helpers`, `initialize` and `set_env` (numba/core: base.py, runtime/nrt.py,
codegen.py).
"""

from __future__ import annotations

import builtins
import ctypes
import importlib.machinery
import importlib.util
import os
import pickle
import sys
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from types import SimpleNamespace
from typing import Any

from llvmlite import binding

from planner.base.kept import Kept

_MODULES = ("_dynfunc", "_helperlib", "core.runtime._nrt_python")  # of numba, written in C


@cache
def linker() -> Linker:
    """The one of this process."""
    return Linker()


class Linker:
    """Makes functions of object code."""

    def __init__(self) -> None:
        dynfunc, helpers, runtime = (_c_module(name) for name in _MODULES)
        self._make: Callable[..., Any] = dynfunc.make_function
        self._environment: Callable[..., Any] = dynfunc.Environment
        binding.add_symbol("_Py_NoneStruct", id(None))
        for module in (helpers, dynfunc):
            for name, address in module.c_helpers.items():
                binding.add_symbol(f"numba_{name}", address)
                if not binding.address_of_symbol(
                    name
                ):  # of C's mathematics, where the process does not show it
                    binding.add_symbol(name, address)
        for name, value in vars(builtins).items():
            if isinstance(value, type) and issubclass(value, BaseException):
                binding.add_symbol(f"PyExc_{name}", id(value))
        for name, address in runtime.c_helpers.items():
            binding.add_symbol(name if name.startswith("_") else f"NRT_{name}", address)
        binding.add_symbol("numba_unpickle", ctypes.cast(_unpickle, ctypes.c_void_p).value)
        _initialize()
        self._target = binding.Target.from_triple(binding.get_process_triple())
        self._engines: list[Any] = []

    def function(self, kernel: Kept, named: Callable[..., Any]) -> Callable[..., Any]:
        """The entry for Python of a kernel, made of this function. Raises RuntimeError if it cannot be linked."""
        engine = self._engine()
        engine.add_object_file(binding.ObjectFileRef.from_data(kernel.code))
        engine.finalize_object()
        made = []
        for name, module, constants in kernel.environments:
            address = engine.get_global_value_address(name)
            if address:
                loaded = sys.modules.get(module)
                environment = self._environment({"__name__": module} if loaded is None else vars(loaded))
                environment.consts[:] = constants
                _lasting.append(environment)  # machine code refers to it
                ctypes.c_void_p.from_address(address).value = id(environment)
                made.append(environment)
        entry = engine.get_function_address(kernel.entry)
        if not entry or not made:
            raise RuntimeError(f"no kernel {kernel.entry}")
        of = SimpleNamespace(__name__=named.__module__)
        return self._make(of, named.__name__, named.__doc__ or "", entry, made[0], self)

    def _engine(self) -> Any:
        """An engine of its own for every kernel: numba's names do not tell records of two and of nine axes apart, and of two functions
        of one name in an engine the first would be called for both."""
        machine = self._target.create_target_machine(jit=True)
        engine = binding.create_mcjit_compiler(binding.parse_assembly(""), machine)
        self._engines.append(engine)  # machine code lasts as long as its engine
        return engine


_lasting: list[Any] = []
_unpickled: dict[bytes, Any] = {}


@ctypes.PYFUNCTYPE(ctypes.py_object, ctypes.c_void_p, ctypes.c_int, ctypes.c_void_p)
def _unpickle(data: int, size: int, _: int) -> Any:
    """What numba's function of this kind does: the object that compiled code asks for, such as the class of a record it returns."""
    text = ctypes.string_at(data, size)
    if text not in _unpickled:
        _unpickled[text] = pickle.loads(text)
    return _unpickled[text]


def _initialize() -> None:
    with suppress(RuntimeError):  # llvmlite does that by itself, from version 0.45 on
        binding.initialize()
    binding.initialize_native_target()
    binding.initialize_native_asmprinter()


def _c_module(name: str) -> Any:
    """A C module of numba; if numba itself is imported, its own."""
    full = f"numba.{name}"
    if full in sys.modules:
        return sys.modules[full]
    package = importlib.util.find_spec("numba")
    if package is None or not package.submodule_search_locations:
        raise ImportError("numba is not installed")
    for folder in package.submodule_search_locations:
        for ending in importlib.machinery.EXTENSION_SUFFIXES:
            file = os.path.join(folder, *name.split(".")) + ending
            if os.path.exists(file):
                loader = importlib.machinery.ExtensionFileLoader(full, file)
                spec = importlib.util.spec_from_file_location(full, file, loader=loader)
                if spec is not None:
                    module = importlib.util.module_from_spec(spec)
                    loader.exec_module(module)
                    return module
    raise ImportError(f"no module {full}")
