"""Where compiled kernels lie on the disk.

A file is named by a kernel's function, the types of its arguments, the processor and the versions of Python
and numba, and holds a digest of what the kernel computes (kernels.py). A kernel is compiled again, and takes
the place of its file, when it or one that it calls in another file computes something else, and not when a
comment changes, a file is copied or gets a new date.

A file begins with the SHA-256 of what is behind: what a disk, a crash or another program has changed is not
there, and is compiled anew. It says nothing of who wrote the file: kernels, which are machine code, come only
from folders where nobody else can put something. Such a folder is named by an absolute path, or it would be
one of the folder that a program was downloaded to; it and its parents belong to this user, to root, or to the
owner of this package, whose code runs already; and no others can write them, unless the owner alone can take
away what is in them (the sticky bit of /tmp). Symbolic links are followed, and what they lie in is looked at
as well. Windows has other means than owners and modes, and gives everybody a folder of their own: there the
path alone is looked at.
"""

import hashlib
import os
import re
import stat
import sys
import warnings
from functools import cache
from pathlib import Path
from types import FunctionType
from typing import NamedTuple


def fault_of(folder: str) -> str:
    """Why files of this folder, which need not be there yet, must not be run; empty if they may."""
    if not os.path.isabs(folder):
        return "is not an absolute path"
    if not hasattr(os, "geteuid"):
        return ""
    for start in {folder, os.path.realpath(folder)}:
        for path in (start, *map(str, Path(start).parents)):
            try:
                said = fault_of_file(os.stat(path), sticky=path != start)
            except FileNotFoundError:  # to be made, by this user
                continue
            except OSError as fault:
                said = f"cannot be looked at ({fault.strerror})"
            if said:
                return said if path == folder else f"is in {path}, which {said}"
    return ""


def fault_of_file(found: os.stat_result, *, sticky: bool = False) -> str:
    """Why what this was said of may be somebody else's, in words after its name; empty if it is not.

    sticky : whether others may write a folder in which they can take away nothing that is not theirs
    """
    if not hasattr(os, "geteuid"):
        return ""
    if found.st_uid not in {0, os.geteuid(), _owner_of_package()}:
        return f"belongs to user {found.st_uid}"
    if sticky and found.st_mode & stat.S_ISVTX:
        return ""
    if found.st_mode & stat.S_IWOTH:
        return "can be written by all users"
    if found.st_mode & stat.S_IWGRP and found.st_gid != 0 and found.st_gid != _private_group():
        return f"can be written by group {found.st_gid}"
    return ""


@cache
def _owner_of_package() -> int:
    return os.stat(__file__).st_uid


@cache
def _private_group() -> int | None:
    """The group that is this user's alone, as many systems give everybody one; None without one."""
    import grp
    import pwd

    try:
        user = pwd.getpwuid(os.geteuid())
        group = grp.getgrgid(user.pw_gid)
    except KeyError:
        return None
    return user.pw_gid if group.gr_name == user.pw_name and set(group.gr_mem) <= {user.pw_name} else None


PACKAGE = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
_DIGEST = hashlib.sha256().digest_size
_used: set[str] = set()


class KernelCacheWarning(UserWarning):
    """Compiled kernels cannot be kept, or not where they were to be."""


class Compilation:
    """Who is told of kernels being compiled: `begins` with True for one that is kept, and `ends`."""

    def begins(self, is_kept: bool) -> None:
        """A kernel is about to be compiled."""

    def ends(self) -> None:
        """It is compiled."""


_listener = Compilation()
_fails = False


def at_compilation(listener: Compilation | None) -> None:
    """Tell the listener of kernels that are compiled from now on; None for nobody."""
    global _listener
    _listener = listener or Compilation()


def compilation() -> Compilation:
    """Who is told."""
    return _listener


def can_be_kept() -> bool:
    """Whether no kernel has failed to be written."""
    return not _fails


def warn_once(fault: OSError) -> None:
    """Say that kernels cannot be written, the first time."""
    global _fails
    if not _fails:
        _fails = True
        warnings.warn(
            f"compiled kernels cannot be kept ({fault.strerror or fault}): they are compiled again by every run, which takes a minute; "
            "set NUMBA_CACHE_DIR to a directory that can be written",
            KernelCacheWarning,
            stacklevel=3,
        )


class KernelFile(NamedTuple):
    """The name of a kernel's file without its folder, and the digest of what the kernel computes."""

    name: str
    content: bytes


def place(function: FunctionType, content: bytes, types_and_tools: str) -> KernelFile:
    """The file of the kernel of a function, for arguments of some types, compiled by some tools."""
    several = content if "<" in function.__qualname__ else b""  # functions made by one function have one name
    of = repr((function.__module__, types_and_tools, sys.implementation.cache_tag, several))
    named = re.sub(r"[^\w.]", "", f"{function.__module__.rpartition('.')[2]}.{function.__qualname__}")[:80]
    return KernelFile(f"{named}-{hashlib.sha256(of.encode()).hexdigest()[:16]}.kernel", content)


def read(file: KernelFile) -> bytes | None:
    """The kernel in it, or None: what is damaged, of another content or somebody else's is not there."""
    for folder in (*folders(), *([] if fault_of(installed()) else [installed()])):
        path = os.path.join(folder, file.name)
        try:
            with open(path, "rb") as opened:
                if fault_of_file(os.fstat(opened.fileno())):
                    continue
                whole = opened.read()
        except OSError:
            continue
        checksum, rest = whole[:_DIGEST], whole[_DIGEST:]
        if hashlib.sha256(rest).digest() == checksum and rest[:_DIGEST] == file.content:
            _used.add(path)
            return rest[_DIGEST:]
    return None


def write(file: KernelFile, kernel: bytes) -> str:
    """Keep a kernel under its name; returns the path. Raises OSError if it can be written nowhere."""
    faults: list[OSError] = []
    rest = file.content + kernel
    for folder in folders():
        path = os.path.join(folder, file.name)
        part = f"{path}.{os.getpid()}"
        try:
            os.makedirs(folder, mode=0o755, exist_ok=True)
            try:
                with open(part, "wb") as opened:
                    opened.write(hashlib.sha256(rest).digest() + rest)
                    opened.flush()
                    os.fsync(opened.fileno())  # or a power failure could leave the name without the content
                os.replace(part, path)
            finally:  # Ctrl-C too
                if os.path.exists(part):
                    os.remove(part)
        except OSError as fault:
            faults.append(fault)
            continue
        _used.add(path)
        return path
    raise faults[0] if faults else OSError("there is no folder that is yours alone")


def used() -> list[str]:
    """The paths of all kernels that this process has read or written, sorted."""
    return sorted(_used)


def folders() -> list[str]:
    """Where kernels are kept, the first one first: the directory that NUMBA_CACHE_DIR names; else beside the
    sources of a checkout, or the user's cache directory. An installation gets no further files: who removes
    it removes all of it. Folders that others can write are left out; one that NUMBA_CACHE_DIR names with a
    warning."""
    named = os.environ.get("NUMBA_CACHE_DIR")
    if named:
        folder = os.path.join(named, "planner")
        fault = fault_of(folder)
        if not fault:
            return [folder]
        _say_once(f"NUMBA_CACHE_DIR: {folder} {fault}; compiled kernels are neither read nor kept there")
    places = [os.path.join(_of_user(), "planner", "kernels")]
    if os.path.isfile(os.path.join(os.path.dirname(PACKAGE), "pyproject.toml")):
        places.insert(0, os.path.join(PACKAGE, "__pycache__", "kernels"))
    return [folder for folder in places if not fault_of(folder)]


def _of_user() -> str:
    """The user's cache directory; a relative XDG_CACHE_HOME counts as none, as its specification says."""
    if sys.platform == "win32":
        return os.environ.get("LOCALAPPDATA") or os.path.expanduser(r"~\AppData\Local")
    if sys.platform == "darwin":
        return os.path.expanduser("~/Library/Caches")
    named = os.environ.get("XDG_CACHE_HOME", "")
    return named if os.path.isabs(named) else os.path.expanduser("~/.cache")


@cache
def _say_once(sentence: str) -> None:
    warnings.warn(sentence, KernelCacheWarning, stacklevel=4)


def installed() -> str:
    """Where those lie that came with the installation (setup.py)."""
    return os.path.join(PACKAGE, "kernels")
