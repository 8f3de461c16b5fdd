"""Output files that take their place when all of them are written, `summary.json` last.

The files of a run are written into a hidden directory inside the output directory and forced to disk. Then each is renamed into
its place: the trajectory first, the rest, and `summary.json` last; files of the run before that the new one lacks (another format,
no pictures) go in between. The output directory itself stays what it is: owner, group, mode, mount point.

A kill before the renames leaves the old set, after them the new one. A kill between two renames, which take a fraction of a
millisecond, leaves files of two runs, each of them whole. That can be seen: the `run_id` of the trajectory is then not that of
`summary.json`, or one of the two is missing.

Nothing is replaced or removed that a run did not write. `summary.json` names its files with their SHA-256; a file under one of the
names of `OUTPUTS` whose content it vouches for is ours. Anything else stands in the way, unless the user says `--force`.

A lock on the output directory, which the kernel releases with the process, makes a second run into the same directory wait; a hidden
directory found under the lock is the leftover of a killed run, and removed. Its `summary.json` vouches for files too: some of them may
be in place already. Windows and file systems without such locks do without.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import shutil
import stat
import sys
import uuid
from collections.abc import Callable, Container, Iterable, Iterator
from pathlib import Path
from typing import Any

from planner.base.errors import InputError

if sys.platform != "win32":
    import fcntl

SUMMARY = "summary.json"
CSV_METADATA = "trajectory.meta.json"
OUTPUTS = (
    CSV_METADATA,
    "trajectory.parquet",
    "trajectory.csv",
    "trajectory.npz",
    "planned.ngc",
    "program.ngc",
    "program.json",
    "toolpath.png",
    "profiles.png",
    "report.html",
    SUMMARY,
)  # every name that a run may write, in the order in which they take their places
HIDDEN = ".planner-" + 12 * "[0-9a-f]"  # pattern of the names of temporaries

_undo: list[Callable[[], object]] = []  # what removes the temporaries of this process


def remove_temporaries() -> None:
    """Remove files that are only partly written, before the process ends without unwinding."""
    for step in reversed(_undo):
        with contextlib.suppress(OSError):
            step()


@contextlib.contextmanager
def _undone(step: Callable[[], object]) -> Iterator[None]:
    """Run `step` when the block ends, however it ends; an OSError of the step is passed over."""
    _undo.append(step)
    try:
        yield
    finally:
        with contextlib.suppress(OSError):
            step()
        _undo.remove(step)


@contextlib.contextmanager
def replacing(directory: Path, *, kept: Container[str] = (), force: bool = False) -> Iterator[Path]:
    """A context in which files of a run are written into an empty directory; at its end they take their places in `directory`.

    kept  : names of files of the earlier run that stay although the new run lacks them
    force : replace files that no run wrote, too

    One of the files is `summary.json`, with `checksums` of the others. After an exception `directory` is as before.

    Raises InputError if `directory` cannot be written, or if a file is in the way that no run wrote.
    """
    with contextlib.ExitStack() as stack:
        try:
            check_output(directory, (), force=force)
            for missing in _missing(directory):
                missing.mkdir(exist_ok=True)
                stack.enter_context(_undone(missing.rmdir))  # goes only if it is empty
            stack.enter_context(_locked(directory))
            vouched = _vouched(directory)
            for leftover in directory.glob(HIDDEN + "/"):
                shutil.rmtree(leftover, ignore_errors=True)
            new = directory / _hidden_name()
            stack.enter_context(_undone(lambda: shutil.rmtree(new, ignore_errors=True)))
            new.mkdir()
        except OSError as fault:
            raise _cannot_be_written(directory, fault) from fault
        try:
            yield new
            for file in new.iterdir():
                _sync(file)
        except OSError as fault:
            raise _cannot_be_written(directory, fault, "; what was there stays") from fault
        names = sorted(os.listdir(new), key=OUTPUTS.index)
        _refuse_foreign(directory, names, vouched, force)
        stale = [
            name
            for name in OUTPUTS
            if name not in names and name not in kept and _is_ours(directory / name, vouched)
        ]
        _take_places(new, directory, names, stale)


@contextlib.contextmanager
def replacing_file(path: Path) -> Iterator[Path]:
    """The same for one file: yields the place of a new file to write, which takes the place of `path` at the end.

    After an exception `path` is as before. Raises InputError if it cannot be written.
    """
    new = path.with_name(_hidden_name() + path.suffix)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with _undone(new.unlink):
            yield new
            _sync(new)
            os.replace(new, path)
    except OSError as fault:
        raise _cannot_be_written(path, fault) from fault


def check_output(directory: Path, names: Iterable[str], *, force: bool = False) -> None:
    """Raise InputError if a directory cannot be written, or if one of `names` in it exists, no run wrote it, and `force` is not set."""
    try:
        if directory.exists() and not directory.is_dir():
            raise InputError("cannot be written: is a file, not a directory", source=str(directory))
        missing = _missing(directory)
        there = missing[0].parent if missing else directory
        if not os.access(there, os.W_OK):
            raise InputError(f"cannot be written: no permission to write in {there}", source=str(directory))
        _refuse_foreign(directory, names, _vouched(directory), force)
    except OSError as fault:
        raise _cannot_be_written(directory, fault) from fault


def check_file(
    path: Path, inputs: Iterable[Path], written_by_us: Callable[[Path], bool], *, force: bool = False
) -> None:
    """Raise InputError if a file cannot be written: a directory, an input, or a file of another kind while `force` is not set.

    written_by_us : says whether a file is of the kind that is to be written
    """
    try:
        if path.is_dir():
            raise InputError("cannot be written: is a directory", source=str(path))
        if path.parent.exists() and not path.parent.is_dir():
            raise InputError(f"cannot be written: {path.parent} is no directory", source=str(path))
        refuse_inputs([path], inputs)
        if os.path.lexists(path) and not force and not (path.is_file() and written_by_us(path)):
            raise InputError(
                "was not written by planner, and is not overwritten; give another name, or --force",
                source=str(path),
            )
    except OSError as fault:
        raise _cannot_be_written(path, fault) from fault


def starts_with(path: Path, line: str) -> bool:
    """Whether the first line of a file is `line`."""
    start = (line + "\n").encode()
    with path.open("rb") as stream:
        return stream.read(len(start)) == start


def refuse_inputs(outputs: Iterable[Path], inputs: Iterable[Path]) -> None:
    """Raise InputError if one of the files to write is among the files that are read."""
    for output in outputs:
        for given in inputs:
            with contextlib.suppress(OSError):
                if output.samefile(given):
                    raise InputError(
                        "is read as input and would be overwritten; write elsewhere", source=str(output)
                    )


def checksums(directory: Path) -> dict[str, str]:
    """SHA-256 of every file of a directory, by name."""
    return {file.name: _sha256(file) for file in sorted(directory.iterdir())}


def _hidden_name() -> str:
    return f".planner-{uuid.uuid4().hex[:12]}"


def _missing(directory: Path) -> list[Path]:
    """The directories to make for `directory` to exist, the outermost first."""
    missing: list[Path] = []
    place = directory.resolve()
    while not place.exists():
        missing.insert(0, place)
        place = place.parent
    return missing


def _vouched(directory: Path) -> dict[str, set[str]]:
    """The checksums of what runs wrote into `directory`, by name, as their summaries say."""
    vouched: dict[str, set[str]] = {}
    for file in (directory / SUMMARY, *directory.glob(f"{HIDDEN}/{SUMMARY}")):
        for name, checksum in _recorded(file).items():
            vouched.setdefault(name, set()).add(str(checksum))
    return vouched


def _recorded(summary: Path) -> dict[str, Any]:
    """The checksums in a summary, with its own; none if it is not one that a run wrote."""
    try:
        said = json.loads(summary.read_bytes())
        if isinstance(said["run_id"], str) and isinstance(said["sha256"], dict):
            return {**said["sha256"], SUMMARY: _sha256(summary)}
    except (OSError, ValueError, RecursionError, KeyError, TypeError):
        pass
    return {}


def _is_ours(file: Path, vouched: dict[str, set[str]]) -> bool:
    try:
        return stat.S_ISREG(file.lstat().st_mode) and _sha256(file) in vouched.get(file.name, ())
    except OSError:
        return False


def _refuse_foreign(directory: Path, names: Iterable[str], vouched: dict[str, set[str]], force: bool) -> None:
    for name in names:
        file = directory / name
        if file.is_dir() and not file.is_symlink():
            raise InputError("cannot be written: is a directory", source=str(file))
        if not force and os.path.lexists(file) and not _is_ours(file, vouched):
            raise InputError(
                "was not written by planner, or changed since, and is not overwritten; give another directory, or --force",
                source=str(file),
            )


def _take_places(new: Path, directory: Path, names: list[str], stale: list[str]) -> None:
    changed = False
    try:
        for name in sorted({*names, *stale}, key=OUTPUTS.index):
            if name == SUMMARY:
                _sync_directory(directory)
            if name in names:
                os.replace(new / name, directory / name)
            else:
                (directory / name).unlink()
            changed = True
        _sync_directory(directory)
    except OSError as fault:
        said = "; it holds files of two runs now, which their run_id tells apart" if changed else ""
        raise _cannot_be_written(directory, fault, said) from fault


def _cannot_be_written(place: Path, fault: OSError, more: str = "") -> InputError:
    return InputError(f"cannot be written: {fault.strerror or fault}{more}", source=str(place))


def _sha256(file: Path) -> str:
    with file.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


@contextlib.contextmanager
def _locked(directory: Path) -> Iterator[None]:
    """Hold a lock on a directory, and wait until it is free."""
    if sys.platform == "win32":
        yield
        return
    handle = os.open(directory, os.O_RDONLY)
    try:
        with contextlib.suppress(OSError):  # file systems without locks
            fcntl.flock(handle, fcntl.LOCK_EX)
        yield
    finally:
        os.close(handle)


def _sync(file: Path) -> None:
    """Force a file to disk. Windows does so through handles that may write only."""
    with file.open("r+b") as stream:
        os.fsync(stream.fileno())


def _sync_directory(directory: Path) -> None:
    """Force the names in a directory to disk, where the system can."""
    if sys.platform == "win32":
        return
    handle = os.open(directory, os.O_RDONLY)
    try:
        with contextlib.suppress(OSError):  # file systems without fsync on directories
            os.fsync(handle)
    finally:
        os.close(handle)
