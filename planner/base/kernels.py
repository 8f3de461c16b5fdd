"""numba's `njit` for the planner's kernels: `from planner.base.kernels import njit` instead of `from numba import njit`.

A kernel is a function that is compiled when it is first called with arguments of some types, and kept on the disk (kept.py). From
then on it comes from there without numba, which takes longer to import than a small plan to make (linking.py). How a kernel is compiled
is in compiling.py.

A kernel that cannot be kept, because no directory can be written or the disk is full, is compiled again by the next run, which takes a
minute for all of them, and is nothing to fail for: one warning says so. With a version of numba or on a system that the tests have not
run with, kernels are numba's own, and kept where numba keeps them.
"""

from __future__ import annotations

import functools
import inspect
import os
import sys
import threading
import warnings
from collections.abc import Callable, Hashable
from functools import cached_property
from typing import Any

import numpy as np

from planner.base import kept
from planner.base.kept import KernelCacheWarning

FIRST, LAST = (0, 68), (0, 68)  # versions of numba that the tests have run with
PLATFORM = "linux"  # where they have
# What numba's type of an array depends on besides its dtype and dimensions: bits of `flags.num` for contiguous in C's order, if not in
# that then in Fortran's, aligned, writable.
_IN_C_S = 0x0001
_LAYOUT_IN_C_S = _IN_C_S | 0x0100 | 0x0400
_LAYOUT = _LAYOUT_IN_C_S | 0x0002
# Arguments whose type says all of numba's type; numbers of NumPy's are told by their dtype.
_SCALARS: dict[type, str] = {float: "f8", int: "i8", bool: "?", type(None): "none", str: "str"}

_warned = False
_files: set[str] = set()
_one_at_a_time = threading.RLock()


class Compilation:
    """Who is told of kernels that are compiled: `begins` with True for one that is kept for the next run, and `ends`."""

    def begins(self, is_kept: bool) -> None:
        """A kernel is about to be compiled."""

    def ends(self) -> None:
        """It is compiled."""


_listener = Compilation()


def at_compilation(listener: Compilation | None) -> None:
    """Tell the listener of kernels that are compiled from now on; None for nobody."""
    global _listener
    _listener = listener or Compilation()


def compilation() -> Compilation:
    """Who is told."""
    return _listener


def files_used() -> list[str]:
    """The files of all kernels that this process has loaded or written, sorted."""
    return sorted(_files)


def known_numba() -> bool:
    """Whether numba is of a version that the tests have run with, on a system where they have."""
    if not sys.platform.startswith(PLATFORM):
        return False
    return FIRST <= tuple(int(part) for part in kept.numba_version().split(".")[:2]) <= LAST


def njit(*, cache: bool = True, **settings: Any) -> Callable[[Callable[..., Any]], Any]:
    """`numba.njit` with these settings, as a decorator; with `cache` kernels are kept on disk where that is possible."""

    def made(function: Callable[..., Any]) -> Any:
        if os.environ.get("NUMBA_DISABLE_JIT", "0") not in ("", "0"):
            return function
        if known_numba():
            return Kernel(function, settings, cache)
        return _numba_s_own(function, settings, cache)

    return made


class Kernel:
    """A compiled function."""

    py_func: Any  # the function of Python

    def __init__(self, function: Any, settings: dict[str, Any], cache: bool):
        functools.update_wrapper(self, function)
        self.py_func = function
        self.compiled = self.loaded = 0  # for how many types of arguments: here, and before
        self._settings, self._cache = settings, cache
        self._made: dict[Hashable, Callable[..., Any]] = {}
        self._arguments = function.__code__.co_argcount

    def __call__(self, *args: Any, **named: Any) -> Any:
        if named or len(args) != self._arguments:
            bound = inspect.signature(self.py_func).bind(*args, **named)
            bound.apply_defaults()
            args = bound.args
        kind = tuple([_kind(value) for value in args])
        found = self._made.get(kind)
        if found is None:
            found = self._found(args, kind)
        return found(*args)

    def _found(self, args: tuple[Any, ...], kind: tuple[Hashable, ...]) -> Callable[..., Any]:
        """The compiled function for arguments of a kind, from the disk if it is there."""
        with _one_at_a_time:
            if kind in self._made:
                return self._made[kind]
            if _other in _flat(kind):
                return self.dispatcher  # numba knows what these are, or says that it does not
            where = kept.place(self.py_func, self.content, kind) if self._cache else None
            found = self._loaded(where) if where is not None else None
            if found is None:
                _listener.begins(where is not None and _can_be_kept)
                found = self._compiled(args, where)
                _listener.ends()
            self._made[kind] = found
            return found

    def _loaded(self, where: kept.KernelName) -> Callable[..., Any] | None:
        found = kept.read(where)
        if found is None:
            return None
        kernel, file = found
        try:
            from planner.base.linking import linker

            linked = linker().function(kernel, self.py_func)
        except Exception:  # whatever it is, the kernel can be compiled
            return None
        self.loaded += 1
        _files.add(file)
        return linked

    def _compiled(self, args: tuple[Any, ...], where: kept.KernelName | None) -> Callable[..., Any]:
        from planner.base.compiling import compiled, to_keep

        made = compiled(self.dispatcher, args)
        self.compiled += 1
        if where is not None:
            try:
                _files.add(kept.write(where, to_keep(made)))
            except OSError as fault:
                _warn(fault)
        return made.entry_point

    @cached_property
    def content(self) -> bytes:
        """A digest of what it computes; itself inside, a kernel is known by its name."""
        vars(self)["content"] = self.py_func.__qualname__.encode()
        return kept.content_of(self.py_func, self._settings, _content)

    @cached_property
    def dispatcher(self) -> Any:
        """numba's object that compiles it."""
        from planner.base.compiling import root

        return root(self.py_func, self._settings)

    @property
    def _numba_type_(self) -> Any:
        """numba's type of it, when another kernel calls it."""
        from planner.base.compiling import type_inside

        return type_inside(self)


def _content(value: Any) -> bytes | None:
    return value.content if isinstance(value, Kernel) else None


class _Other:
    """The kind of an argument whose numba type is not known here."""


_other = _Other()


def _kind(value: Any) -> Hashable:
    """What numba's type of an argument depends on."""
    of = type(value)
    if of is np.ndarray:
        flags = value.flags.num
        return value.dtype, value.ndim, flags & (_LAYOUT_IN_C_S if flags & _IN_C_S else _LAYOUT)
    if of in _SCALARS:
        return _SCALARS[of]
    if isinstance(value, tuple):
        parts = tuple([_kind(part) for part in value])
        return parts if of is tuple else (of, parts)
    if isinstance(value, np.generic):
        return value.dtype
    return _other


def _flat(kind: Hashable) -> list[Hashable]:
    return [part for own in kind for part in _flat(own)] if isinstance(kind, tuple) else [kind]


def _numba_s_own(function: Callable[..., Any], settings: dict[str, Any], cache: bool) -> Any:
    import numba

    try:
        return numba.njit(cache=cache, **settings)(function)
    except RuntimeError as fault:  # no directory can be written
        _warn(fault)
        return numba.njit(**settings)(function)


_can_be_kept = True


def _warn(fault: Exception) -> None:
    global _warned, _can_be_kept
    _can_be_kept = False
    if not _warned:
        _warned = True
        said = getattr(fault, "strerror", None) or str(fault).partition(" for file ")[0]
        warnings.warn(
            f"compiled kernels cannot be kept ({said}): they are compiled again by every run, which takes a minute; "
            "set NUMBA_CACHE_DIR to a directory that can be written",
            KernelCacheWarning,
            stacklevel=3,
        )
