"""numba's `njit` for the planner's kernels, in place of `from numba import njit`.

A kernel is a function that is compiled when it is first called with arguments of some types (compiling.py),
and kept on the disk (kernel_files.py), with a digest of what it computes. numba is imported when the first
kernel is called.

A kernel that cannot be kept, because no directory can be written or the disk is full, is compiled again by
the next run, which takes a minute for all of them, and is nothing to fail for: one warning says so.
"""

import ast
import functools
import hashlib
import inspect
import os
import threading
from collections.abc import Callable
from functools import cached_property
from pathlib import Path
from types import CodeType, FunctionType, ModuleType
from typing import Any

# What a compiler may do to the arithmetic of a kernel that says so: multiply and add in one instruction.
CONTRACT = {"contract"}
_WITH_DOCSTRING = ast.Module | ast.ClassDef | ast.FunctionDef
_TOLD_BY_REPR = (bool, int, float, complex, str, bytes, range, type(None), type(...))


def content_of(function: FunctionType, settings: dict[str, Any]) -> bytes:
    """A digest of what the kernel of a function computes: its bytecode, settings and the values that it uses,
    and those of every kernel that it calls; docstrings and comments compute nothing."""
    seen = {id(function)}

    def of(value: Any) -> str:
        if isinstance(value, Kernel):
            return value.content.hex()
        if isinstance(value, FunctionType):
            if id(value) in seen:  # it calls itself
                return value.__qualname__
            seen.add(id(value))
            return of_function(value)
        if isinstance(value, ModuleType):
            return value.__name__
        # one of numba's intrinsics (lanes.py): it belongs together with all of its file
        if hasattr(value, "_defn"):
            return text_of(value._defn.__code__.co_filename)
        if isinstance(value, type):
            return f"{value.__module__}.{value.__qualname__} {getattr(value, '_fields', '')}"
        if isinstance(value, tuple | list):
            return repr([of(one) for one in value])
        if isinstance(value, frozenset | set):
            return repr(sorted(of(one) for one in value))
        if isinstance(value, CodeType):
            return repr((value.co_code, [of(one) for one in value.co_consts], value.co_names))
        if type(value).__module__ == "numpy" and hasattr(value, "tobytes"):
            return repr((value.dtype, value.shape, value.tobytes()))
        return repr(value) if isinstance(value, _TOLD_BY_REPR) else f"{type(value)}"

    def of_function(function: FunctionType) -> str:
        code, known = function.__code__, function.__globals__
        if function.__doc__ is not None and code.co_consts[0] == function.__doc__:
            code = code.replace(co_consts=(None, *code.co_consts[1:]))
        names = sorted(_names_in(code))
        uses = [(name, of(known[name])) for name in names if name in known]
        for module in [known[name] for name in names if isinstance(known.get(name), ModuleType)]:
            inside = [(name, vars(module)[name]) for name in names if name in vars(module)]
            uses += [(n, of(value)) for n, value in inside if isinstance(value, (Kernel, *_TOLD_BY_REPR))]
        enclosed = inspect.getclosurevars(function).nonlocals  # values of the functions around it
        around = [(name, of(value)) for name, value in sorted(enclosed.items())]
        return repr((of(code), code.co_varnames, code.co_argcount, uses, around, of(function.__defaults__)))

    options = sorted((name, of(value)) for name, value in settings.items())
    return hashlib.sha256(f"{of_function(function)} {options}".encode()).digest()


@functools.cache
def text_of(file: str) -> str:
    """A digest of a source file without its words."""
    tree = ast.parse(Path(file).read_bytes())
    for node in ast.walk(tree):
        if isinstance(node, _WITH_DOCSTRING) and ast.get_docstring(node) is not None:
            del node.body[0]
    return hashlib.sha256(ast.dump(tree).encode()).hexdigest()


def _names_in(code: CodeType) -> set[str]:
    """The names of globals and attributes in a function and those inside it."""
    inner = (part for part in code.co_consts if isinstance(part, CodeType))
    return set(code.co_names).union(*map(_names_in, inner))


_one_at_a_time = threading.RLock()


def njit(*, cache: bool = True, **settings: Any) -> Callable[[Callable[..., Any]], Any]:
    """`numba.njit` with these settings, as a decorator; with `cache` kernels are kept on disk if possible."""

    def made(function: Callable[..., Any]) -> Any:
        if os.environ.get("NUMBA_DISABLE_JIT", "0") not in ("", "0"):
            return function
        return Kernel(function, settings, cache)

    return made


class Kernel:
    """A compiled function."""

    py_func: Any  # the function of Python

    def __init__(self, function: Any, settings: dict[str, Any], cache: bool):
        functools.update_wrapper(self, function)
        self.py_func = function
        self._settings, self._cache = settings, cache

    def __call__(self, *args: Any, **named: Any) -> Any:
        return self.whole(*args, **named)

    @cached_property
    def content(self) -> bytes:
        """A digest of what it computes; itself inside, a kernel is known by its name."""
        vars(self)["content"] = self.py_func.__qualname__.encode()
        return content_of(self.py_func, self._settings)

    @cached_property
    def whole(self) -> Any:
        """numba's dispatcher of it for Python."""
        from planner.base.compiling import KernelCache, whole

        with _one_at_a_time:  # or threads that call it first would each compile it
            if "whole" not in vars(self):
                cache = KernelCache(self.py_func, self.content if self._cache else None)
                vars(self)["whole"] = whole(self.py_func, self._settings, cache)
            return vars(self)["whole"]

    @cached_property
    def part(self) -> Any:
        """numba's dispatcher of it for other kernels."""
        from planner.base.compiling import part

        return part(self.py_func, self._settings)

    @property
    def _numba_type_(self) -> Any:
        """numba's type of it, when another kernel calls it."""
        return self.part._numba_type_
