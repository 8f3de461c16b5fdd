"""numba's `njit` with a cache that may fail: `from planner.base.kernels import njit` instead of `from numba import njit`.

Compiled kernels are kept on disk, beside the package or, where that is read-only, in the user's cache directory. numba refuses to start
where neither can be written, and fails where the disk is full. A kernel that cannot be kept is compiled again by the next run, which
takes a minute for all of them, and is nothing to fail for: one warning says so.

How a kernel is compiled is in compiling.py. numba itself is imported with the first kernel.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from functools import cached_property
from typing import Any

from planner.base.loading import load_kernel

# What reading an index raises that another version of the package has written: it names the classes of the kernels' arguments, and
# those may have gone since. numba reads the whole index before it looks whether it is out of date.
_OUT_OF_DATE = (AttributeError, ImportError)

_told: Callable[[bool], None] | None = None
_warned = False


class KernelCacheWarning(UserWarning):
    """Compiled kernels cannot be kept."""


def at_compilation(tell: Callable[[bool], None] | None) -> None:
    """Call `tell` whenever a kernel is about to be compiled, with True if it is kept for the next run; None for no more calls."""
    global _told
    _told = tell


def njit(*, cache: bool = True, **settings: Any) -> Callable[[Callable[..., Any]], Any]:
    """`numba.njit` with these settings, as a decorator; with `cache` kernels are kept on disk where that is possible."""
    from planner.base.compiling import root

    def compiled(function: Callable[..., Any]) -> Any:
        dispatcher = root(function, settings)
        if cache and hasattr(dispatcher, "enable_caching"):  # a plain function with NUMBA_DISABLE_JIT
            dispatcher._cache = _Cache(function)
        return dispatcher

    return compiled


class _Cache:
    """The cache of one kernel: numba's, without its OSErrors, and made when the kernel is first called: a plan calls 30 of 190, and
    numba tries for each whether its directory can be written."""

    def __init__(self, function: Callable[..., Any]):
        self._function = function

    @cached_property
    def _numba_s(self) -> Any:
        from numba.core.caching import FunctionCache, NullCache

        try:
            return FunctionCache(self._function)
        except (RuntimeError, OSError) as fault:  # "no locator available"
            _warn(fault)
            return NullCache()

    @cached_property
    def _kept(self) -> bool:
        return type(self._numba_s).__name__ != "NullCache"

    def load_overload(self, signature: Any, context: Any) -> Any:
        try:
            found = load_kernel(self._numba_s, signature, context)
        except (OSError, EOFError) as fault:
            self._failed(fault)
            found = None
        except _OUT_OF_DATE:
            found = None
            self._forget()
        if found is None and _told is not None:
            _told(self._kept)
        return found

    def save_overload(self, signature: Any, made: Any) -> None:
        try:
            self._numba_s.save_overload(signature, made)
        except (OSError, *_OUT_OF_DATE) as fault:
            self._failed(fault)

    def _forget(self) -> None:
        """Empty the index of a kernel."""
        try:
            self._numba_s.flush()
        except OSError as fault:
            self._failed(fault)

    def _failed(self, fault: Exception) -> None:
        self._kept = False
        _warn(fault)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._numba_s, name)


def _warn(fault: Exception) -> None:
    global _warned
    if not _warned:
        _warned = True
        said = getattr(fault, "strerror", None) or str(fault).partition(" for file ")[0]
        warnings.warn(
            f"compiled kernels cannot be kept ({said}): they are compiled again by every run, which takes a minute; "
            "set NUMBA_CACHE_DIR to a directory that can be written",
            KernelCacheWarning,
            stacklevel=3,
        )
