"""A digest of what a kernel computes: its bytecode, settings and the values that it uses, and those of every kernel that it calls."""

from __future__ import annotations

import hashlib
import inspect
from collections.abc import Callable
from types import CodeType, FunctionType, ModuleType
from typing import Any

_TOLD_BY_REPR = (bool, int, float, complex, str, bytes, range, type(None), type(...))


def content_of(
    function: FunctionType, settings: dict[str, Any], called: Callable[[Any], bytes | None]
) -> bytes:
    """A digest of what the kernel of a function computes.

    called : the digest of a value, if that is a kernel; else None
    """
    seen = {id(function)}

    def of(value: Any) -> str:
        kernel = called(value)
        if kernel is not None:
            return kernel.hex()
        if isinstance(value, FunctionType):
            if id(value) in seen:  # it calls itself
                return value.__qualname__
            seen.add(id(value))
            return of_function(value)
        if isinstance(value, ModuleType):
            return value.__name__
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
        names = sorted(_names_in(code))
        uses = [(name, of(known[name])) for name in names if name in known]
        for module in [known[name] for name in names if isinstance(known.get(name), ModuleType)]:
            inside = [(name, vars(module)[name]) for name in names if name in vars(module)]
            uses += [
                (n, of(value)) for n, value in inside if called(value) or isinstance(value, _TOLD_BY_REPR)
            ]
        enclosed = sorted(
            inspect.getclosurevars(function).nonlocals.items()
        )  # values of the functions around it
        around = [(name, of(value)) for name, value in enclosed]
        return repr((of(code), code.co_varnames, code.co_argcount, uses, around, of(function.__defaults__)))

    options = sorted((name, of(value)) for name, value in settings.items())
    return hashlib.sha256(f"{of_function(function)} {options}".encode()).digest()


def _names_in(code: CodeType) -> set[str]:
    """The names of globals and attributes in a function and those inside it."""
    inner = (part for part in code.co_consts if isinstance(part, CodeType))
    return set(code.co_names).union(*map(_names_in, inner))
