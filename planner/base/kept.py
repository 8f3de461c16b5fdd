"""Where compiled kernels lie on the disk, and by what name: what a kernel computes.

A kernel's name there is made of its own bytecode and settings, of the values of all constants that it uses, and of the same of every
kernel that it calls; further of the types of its arguments, of the processor, and of the versions of Python and numba. So a kernel is
compiled again when it, or one that it calls in another file, computes something else, and not when a comment changes, a file is
copied or gets a new date. Versions that are older than `OTHERS_KEPT` are removed when a new one is written.

A file ends with the SHA-256 of what is before: what a disk, a crash or another program has changed is not there, and is compiled
anew. It says nothing of who wrote the file: kernels come only from where nobody else can write (own_folders.py).
"""

from __future__ import annotations

import hashlib
import inspect
import os
import pickle
import re
import sys
import time
import warnings
from collections.abc import Callable, Iterable
from functools import cache
from types import CodeType, FunctionType, ModuleType
from typing import Any, NamedTuple

from planner.base.own_folders import fault_of, fault_of_file
from planner.base.processor import processor

FORMAT = 1  # of the files
# Other versions of a kernel are kept so long [s], 30 days: they may be of another processor or checkout that shares the folder.
OTHERS_KEPT = 30 * 86_400.0
_CACHE = "NUMBA_CACHE_DIR"
PACKAGE = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
_NOT_OF_CODE = {
    _CACHE,
    "NUMBA_NUM_THREADS",
}  # numba's variables that machine code does not depend on
_DIGEST = hashlib.sha256().digest_size


class KernelCacheWarning(UserWarning):
    """Compiled kernels cannot be kept, or not where they were to be."""


class Kept(NamedTuple):
    """A kernel as it lies on the disk.

    entry        : name of its entry for Python in the object code
    environments : names, modules and constants of what the code knows of Python
    code         : object code
    """

    entry: str
    environments: list[tuple[str, str, list[Any]]]
    code: bytes


class KernelName(NamedTuple):
    """A file name without its folder: what stays the same when a kernel changes, and what does not.

    single : whether no other kernel has the same first part, as those have that are made by one function
    """

    kernel: str
    version: str
    single: bool

    @property
    def name(self) -> str:
        """Of its file."""
        return f"{self.kernel}.{self.version}.kernel"


def place(function: FunctionType, content: bytes, arguments: object) -> KernelName:
    """The file name of the kernel of a function with this `content_of`, for arguments of these types."""
    where = f"{function.__module__.rpartition('.')[2]}.{function.__qualname__}"
    of = hashlib.sha256(repr((function.__module__, arguments, sys.implementation.cache_tag)).encode())
    version = hashlib.sha256(content + _surroundings())
    named = re.sub(r"[^\w.]", "", where)[:80]
    single = "<" not in function.__qualname__
    return KernelName(f"{named}-{of.hexdigest()[:12]}", version.hexdigest()[:24], single)


def read(where: KernelName) -> tuple[Kept, str] | None:
    """The kernel of this name and its file, or None: what is damaged, or may be somebody else's, is not there."""
    for folder in (*folders(), *([] if fault_of(installed()) else [installed()])):
        name = os.path.join(folder, where.name)
        try:
            with open(name, "rb") as file:
                if fault_of_file(os.fstat(file.fileno())):
                    continue
                content = file.read()
            code, digest = content[:-_DIGEST], content[-_DIGEST:]
            if hashlib.sha256(code).digest() == digest:
                return Kept(*pickle.loads(code)), name
        except Exception:  # whatever it is, the kernel can be compiled
            continue
    return None


def write(where: KernelName, kernel: Kept) -> str:
    """Keep a kernel, in place of its old versions; returns its file. Raises OSError if it can be written nowhere."""
    faults: list[OSError] = []
    code = pickle.dumps(tuple(kernel), protocol=pickle.HIGHEST_PROTOCOL)
    for folder in folders():
        written = os.path.join(folder, where.name)
        part = f"{written}.{os.getpid()}"
        try:
            os.makedirs(folder, mode=0o755, exist_ok=True)
            try:
                with open(part, "wb") as file:
                    file.write(code + hashlib.sha256(code).digest())
                    file.flush()
                    os.fsync(file.fileno())  # or a power failure could leave the name without the content
                os.replace(part, written)
            except BaseException:
                _remove([part])
                raise
        except OSError as fault:
            faults.append(fault)
            continue
        if not where.single:
            return written
        same = [
            name for name in os.listdir(folder) if name.startswith(f"{where.kernel}.") and name != where.name
        ]
        _remove(os.path.join(folder, name) for name in same if _is_old(os.path.join(folder, name)))
        return written
    raise faults[0] if faults else OSError("there is no folder that is yours alone")


def folders() -> list[str]:
    """Where kernels are kept, the first one first: the directory that NUMBA_CACHE_DIR names; else beside the sources of a checkout, or
    the user's cache directory. An installation gets no further files: who removes it removes all of it.

    Folders that others can write are left out (own_folders.py); one that NUMBA_CACHE_DIR names with a warning.
    """
    named = os.environ.get(_CACHE)
    if named:
        folder = os.path.join(named, "planner")
        fault = fault_of(folder)
        if not fault:
            return [folder]
        _say_once(f"{_CACHE}: {folder} {fault}; compiled kernels are neither read nor kept there")
    checkout = os.path.isfile(os.path.join(os.path.dirname(PACKAGE), "pyproject.toml"))
    beside = [os.path.join(PACKAGE, "__pycache__", "kernels")] if checkout else []
    found = [*beside, *(os.path.join(folder, "planner", "kernels") for folder in _of_user())]
    return [folder for folder in found if not fault_of(folder)]


def _of_user() -> list[str]:
    """The user's cache directory. A relative one in XDG_CACHE_HOME counts as none, as its specification says."""
    if sys.platform == "win32":
        return [os.environ.get("LOCALAPPDATA") or os.path.expanduser(r"~\AppData\Local")]
    if sys.platform == "darwin":
        return [os.path.expanduser("~/Library/Caches")]
    named = os.environ.get("XDG_CACHE_HOME", "")
    return [named if os.path.isabs(named) else os.path.expanduser("~/.cache")]


@cache
def _say_once(sentence: str) -> None:
    warnings.warn(sentence, KernelCacheWarning, stacklevel=4)


def installed() -> str:
    """Where those lie that came with the installation (setup.py)."""
    return os.path.join(PACKAGE, "kernels")


def _is_old(file: str) -> bool:
    try:
        return time.time() - os.path.getmtime(file) > OTHERS_KEPT
    except OSError:  # another process has removed it
        return False


def _remove(files: Iterable[str]) -> None:
    for file in files:
        try:
            os.remove(file)
        except OSError:  # another process has removed it
            continue


@cache
def _surroundings() -> bytes:
    """What machine code depends on besides the kernel."""
    from llvmlite import binding

    settings = sorted(
        item for item in os.environ.items() if item[0].startswith("NUMBA_") and item[0] not in _NOT_OF_CODE
    )
    known = (
        FORMAT,
        sys.implementation.cache_tag,
        binding.get_process_triple(),
        numba_version().split(".")[:2],
        *processor(),
        settings,
    )
    return repr(known).encode()


@cache
def numba_version() -> str:
    """The version of numba that is installed; it need not be imported for that."""
    from importlib.metadata import version

    return version("numba")


def content_of(
    function: FunctionType, settings: dict[str, Any], called: Callable[[Any], bytes | None]
) -> bytes:
    """A digest of what the kernel of a function computes.

    called : the digest of a value, if that is a kernel; else None
    """
    found, seen = hashlib.sha256(), {id(function)}

    def of(value: Any) -> str:
        kernel = called(value)
        if kernel is not None:
            return kernel.hex()
        if isinstance(value, FunctionType):
            if id(value) in seen:  # it calls itself
                return value.__qualname__
            seen.add(id(value))
            return code_of(value)
        if isinstance(value, ModuleType):
            return value.__name__
        if isinstance(value, type):
            return f"{value.__module__}.{value.__qualname__} {getattr(value, '_fields', '')}"
        if isinstance(value, tuple | list):
            return repr([of(part) for part in value])
        if isinstance(value, frozenset | set):
            return repr(sorted(of(part) for part in value))
        if isinstance(value, CodeType):
            return repr((value.co_code, [of(part) for part in value.co_consts], value.co_names))
        if type(value).__module__ == "numpy" and hasattr(value, "tobytes"):
            return repr((value.dtype, value.shape, value.tobytes()))
        return repr(value) if _told_by_repr(value) else f"{type(value)}"

    def code_of(function: FunctionType) -> str:
        code, known = function.__code__, function.__globals__
        names = sorted(_names_in(code))
        used = [(name, of(known[name])) for name in names if name in known]
        for module in [known[name] for name in names if isinstance(known.get(name), ModuleType)]:
            inside = [(name, vars(module)[name]) for name in names if name in vars(module)]
            used += [(name, of(value)) for name, value in inside if called(value) or _told_by_repr(value)]
        closed = inspect.getclosurevars(function).nonlocals  # values of the functions around it
        enclosed = [of(closed[name]) for name in code.co_freevars if name in closed]
        return repr((of(code), code.co_varnames, code.co_argcount, used, enclosed, of(function.__defaults__)))

    found.update(code_of(function).encode())
    found.update(repr(sorted((name, of(value)) for name, value in settings.items())).encode())
    return found.digest()


def _told_by_repr(value: Any) -> bool:
    return (
        value is None
        or value is Ellipsis
        or isinstance(value, bool | int | float | complex | str | bytes | range)
    )


def _names_in(code: CodeType) -> set[str]:
    """The names of globals and attributes in a function and those inside it."""
    names = set(code.co_names)
    for part in code.co_consts:
        if isinstance(part, CodeType):
            names |= _names_in(part)
    return names
