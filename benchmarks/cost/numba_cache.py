"""The planner's kernels compiled or kept in other ways, to be measured by first_run.py: each function is called before a kernel is
imported.

    numba    numba's njit(cache=True) and nothing of planner/base/compiling.py, in files of numba's that a class of
             CACHE_LOCATOR_CLASSES places and stamps
    lean     the same, loaded when the first kernel is called, without entries from C, and without numba's registries of what it
             can compile
    files    instructions linked into the kernels that call them, as in planner/base/compiling.py, in files of numba's
"""

from __future__ import annotations

import functools
import hashlib
import os
from pathlib import Path
from typing import Any

import numba
from numba.core import caching, config
from numba.core.runtime import rtsys

from planner.base import compiling, kernels


class Locator:
    """Where numba keeps a kernel, and the stamp of what it computes: all sources of kernels of its package."""

    def __init__(self, function: Any, file: str):
        self._function, self._py_file = function, file

    @classmethod
    def from_function(cls, function: Any, file: str) -> Locator:
        """numba asks for it for every function that is to be cached."""
        return cls(function, file)

    def ensure_cache_path(self) -> None:
        """Make the folder."""
        os.makedirs(self.get_cache_path(), exist_ok=True)

    def get_cache_path(self) -> str:
        """The folder."""
        return os.path.join(os.environ["NUMBA_CACHE_DIR"], "planner")

    def get_source_stamp(self) -> str:
        """What numba compares before it loads."""
        return stamp_of(self._py_file)

    def get_disambiguator(self) -> str:
        """Tells functions of one name apart."""
        return f"{self._function.__module__}-{self._function.__code__.co_firstlineno}"


def stamp_of(file: str) -> str:
    """A digest of all sources with kernels beside and below the package of a file."""
    package = Path(kernels.__file__).parents[1]
    return _stamp(package if package in Path(file).parents else Path(file).parent)


@functools.cache
def _stamp(folder: Path) -> str:
    sources = (path.read_bytes() for path in sorted(folder.rglob("*.py")))
    return hashlib.sha256(b"".join(text for text in sources if b"njit" in text)).hexdigest()


def plain() -> None:
    """Way `numba`."""
    compiling.choose_processor()
    _set(config, "CACHE_LOCATOR_CLASSES", f"{__name__}.Locator")
    _set(kernels, "njit", lambda *, cache=True, **settings: numba.njit(cache=cache, **settings))


def lean() -> None:
    """Way `lean`."""
    _set(config, "CACHE_LOCATOR_CLASSES", f"{__name__}.Locator")
    _set(kernels.Kernel, "part", property(lambda own: own.whole))
    _set(compiling, "KernelCache", lambda function, *_: _Lean(function))


def files() -> None:
    """Way `files`."""
    _set(config, "CACHE_LOCATOR_CLASSES", f"{__name__}.Locator")
    _set(compiling, "KernelCache", lambda function, *_: _Linked(function))


def _set(of: Any, name: str, value: Any) -> None:
    setattr(of, name, value)


class _Lean(caching.FunctionCache):
    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """As numba's, without `target_context.refresh()`."""
        rtsys.initialize(target_context)
        return self._load_overload(sig, target_context)


class _Trimmed(caching.CompileResultCacheImpl):
    def reduce(self, made: Any) -> Any:
        """Without the instructions, which nothing more is linked with."""
        return compiling._to_keep(made)


class _Linked(_Lean):
    _impl_class = _Trimmed

    def save_overload(self, sig: Any, made: Any) -> None:
        """With the environments of all that was linked."""
        for environment in made._find_referenced_environments():
            made.codegen.set_env(environment.env_name, environment)
        super().save_overload(sig, made)
