"""A set of output files that appears as a whole: a kill at any moment leaves the old set or the new one.

The files are first written into a hidden directory beside the output directory and forced to disk. Then

* a directory that does not exist yet is made by one rename;
* an existing one is *exchanged* with the new one by one system call (Linux `renameat2`, RENAME_EXCHANGE).
  Whatever else it holds is hard-linked into the new directory before, so that files that are not ours stay as
  they are.

Either way one atomic step separates "all old" from "all new", and files of the old set that the new one
lacks (another format, no pictures) go in the same step.

Some directories cannot be exchanged: mount points, the current directory (the shell in it would be left in a
deleted one), directories that hold directories (which cannot be hard-linked), systems other than Linux. There
the files are renamed into place one by one, `summary.json` last. Each file is then still old or new as a
whole; a kill in the fraction of a millisecond between two renames leaves files of two runs, whose `run_id`
differ.

A killed run leaves its hidden directory behind; the next run with the same output directory removes it. A
file lock, which the kernel releases with the process, tells it from the directory of a run that is still at
work.
"""

from __future__ import annotations

import contextlib
import ctypes
import os
import shutil
import sys
import uuid
from collections.abc import Collection, Iterator
from pathlib import Path

from planner.errors import InputError

if sys.platform != "win32":
    import fcntl

LAST = "summary.json"  # renamed last where the directory cannot be exchanged: who finds it finds the rest
_RENAME_EXCHANGE = 2  # linux/fs.h
_AT_FDCWD = -100  # fcntl.h


@contextlib.contextmanager
def replacing(directory: Path, previous: Collection[str] = ()) -> Iterator[Path]:
    """Give an empty directory to write into; when the block ends well, its files take their place in
    `directory`.

    previous : names of files of an earlier set in `directory`, to vanish where the new set lacks them

    After an exception `directory` is as before. Raises OSError where it cannot be written.
    """
    directory = directory.resolve()
    directory.parent.mkdir(parents=True, exist_ok=True)
    if directory.exists() and not directory.is_dir():
        raise NotADirectoryError(20, "is a file, not a directory", str(directory))
    exchangeable = _exchangeable(directory)
    place, prefix = (
        (directory.parent, f".{directory.name}.planner-") if exchangeable else (directory, ".planner-")
    )
    _remove_leftovers(place, prefix)
    new, lock = _make_locked(place, prefix)
    try:
        yield new
        for file in new.iterdir():
            _sync(file)
        if not (exchangeable and _take_place(new, directory, previous)):
            _rename_each(new, directory, previous)
    finally:
        shutil.rmtree(new, ignore_errors=True)
        if lock is not None:
            os.close(lock)


@contextlib.contextmanager
def replacing_file(path: Path) -> Iterator[Path]:
    """The same for one file: give the place of a new one to write; when the block ends well, it takes the place of `path`.

    After an exception `path` is as before. Raises InputError where it cannot be written.
    """
    new = path.with_name(f".{path.name}.planner-{uuid.uuid4().hex[:12]}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        yield new
        _sync(new)
        new.replace(path)
    except OSError as fault:
        raise InputError(f"cannot be written: {fault.strerror or fault}", source=str(path)) from fault
    finally:
        new.unlink(missing_ok=True)


def _exchangeable(directory: Path) -> bool:
    if not os.access(directory.parent, os.W_OK):
        return False
    if not directory.exists():
        return True
    here = Path.cwd()
    if sys.platform != "linux" or directory.is_mount() or here == directory or directory in here.parents:
        return False
    return all(entry.is_symlink() or entry.is_file() for entry in list(os.scandir(directory)))


def _take_place(new: Path, directory: Path, previous: Collection[str]) -> bool:
    """Put `new` in the place of `directory` in one step; False, and nothing changed, if that fails."""
    ours = {*previous, *os.listdir(new)}
    try:
        if not directory.exists():
            _sync(new)
            new.rename(directory)
        else:
            for entry in list(os.scandir(directory)):
                if entry.name not in ours:
                    os.link(entry.path, new / entry.name, follow_symlinks=False)
            shutil.copystat(directory, new)
            _sync(new)
            _exchange(new, directory)
    except OSError:
        return False
    _sync(directory.parent)
    if new.exists():  # now the old directory: what others put there since it was linked moves on
        for entry in list(os.scandir(new)):
            home = directory / entry.name
            if entry.name not in ours and not (home.exists() and entry.inode() == home.lstat().st_ino):
                os.replace(entry.path, home)
    return True


def _rename_each(new: Path, directory: Path, previous: Collection[str]) -> None:
    names = sorted(os.listdir(new), key=lambda name: (name == LAST, name))
    directory.mkdir(exist_ok=True)
    for name in names:
        os.replace(new / name, directory / name)
    for name in set(previous) - set(names):
        (directory / name).unlink(missing_ok=True)
    _sync(directory)


def _exchange(a: Path, b: Path) -> None:
    """Exchange two directory entries atomically. Raises OSError where kernel or file system cannot."""
    libc = ctypes.CDLL(None, use_errno=True)
    if not hasattr(libc, "renameat2"):
        raise OSError("this C library has no renameat2")
    if libc.renameat2(_AT_FDCWD, os.fsencode(a), _AT_FDCWD, os.fsencode(b), _RENAME_EXCHANGE) != 0:
        code = ctypes.get_errno()
        raise OSError(code, os.strerror(code), str(b))


def _make_locked(place: Path, prefix: str) -> tuple[Path, int | None]:
    """Make and lock a new directory; once more if another run took it for a leftover in between."""
    while True:
        new = place / f"{prefix}{uuid.uuid4().hex[:12]}"
        new.mkdir(parents=True)
        if sys.platform == "win32":
            return new, None
        try:
            lock = os.open(new, os.O_RDONLY)
        except FileNotFoundError:
            continue
        fcntl.flock(lock, fcntl.LOCK_EX)
        if new.exists():
            return new, lock
        os.close(lock)


def _remove_leftovers(place: Path, prefix: str) -> None:
    if sys.platform == "win32" or not place.is_dir():
        return
    for entry in place.iterdir():
        if entry.name.startswith(prefix) and entry.is_dir() and not entry.is_symlink():
            with contextlib.suppress(OSError):  # another user's, or gone by now
                lock = os.open(entry, os.O_RDONLY)
                try:
                    fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
                    shutil.rmtree(entry)
                finally:
                    os.close(lock)


def _sync(path: Path) -> None:
    """Force a file or directory to disk, as far as the system can."""
    if sys.platform == "win32" and path.is_dir():
        return
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    except OSError:  # file systems without fsync on directories
        if not path.is_dir():
            raise
    finally:
        os.close(handle)
