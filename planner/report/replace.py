"""Output files that take their place when all of them are written, `summary.json` last.

The files of a run are written into a hidden directory inside the output directory, forced to disk, and
renamed into their places, first those of `OUTPUTS` in their order; files of the run before that the new one
lacks go in between. A kill before the renames leaves the old set, after them the new one, and between two of them whole
files of two runs, which can be seen: the `run_id` of the trajectory is then not that of `summary.json`, or
one of the two is missing.

Nothing is replaced or removed that a run did not write: `summary.json` vouches for its files by their
SHA-256, and a file that stands alone is known by how it begins. A lock on the directory makes a second run
wait, and what is hidden there under the lock is the leftover of a killed run. Windows and file systems
without such locks do without.
"""

import contextlib
import hashlib
import itertools
import json
import os
import re
import shutil
import sys
import tempfile
import uuid
from collections.abc import Container, Iterable, Iterator
from pathlib import Path

from planner.base.errors import InputError

if sys.platform != "win32":
    import fcntl

SUMMARY = "summary.json"
CSV_METADATA = "trajectory.meta.json"
FEED_CAPS = "feed-caps.csv"
# Names that a run may write beside those of the program, in the order in which they take their places.
OUTPUTS = (
    *(CSV_METADATA, FEED_CAPS, "trajectory.parquet", "trajectory.csv", "trajectory.npz"),
    *("planned.ngc", "toolpath.png", "profiles.png", "report.html"),
)
# The program among the files of a run. Those that it calls have any names: they are replaced, and never removed.
PROGRAM = re.compile(r"program\.\w{1,8}")
PAGE_MARK = '<meta name="generator" content="feedrate-planner">'
PULSES = ("t", "axis", "direction", "count", "line")
CSV_HEADS = (PULSES, ("method", "outcome", "cycle_time_s", "ratio_to_best"))
JSON_KEYS = ({"best", "methods", "versions"}, {"program", "method", "steps"})  # of comparisons and traces
HIDDEN = ".planner-" + 12 * "[0-9a-f]"  # pattern of the names of temporaries

# Of this process, and directories that go unless something is in them.
_temporaries: dict[int, list[Path]] = {}


def remove_temporaries() -> None:
    """Remove files that are only partly written, before the process ends without unwinding."""
    for places in [*_temporaries.values()]:
        _remove(places)


def _remove(places: Iterable[Path]) -> None:
    for place in reversed([*places]):
        with contextlib.suppress(OSError):
            if not place.is_dir():
                place.unlink()
            elif place.match(HIDDEN):
                shutil.rmtree(place)
            else:
                place.rmdir()


@contextlib.contextmanager
def _writing(place: Path) -> Iterator[list[Path]]:
    """A list whose places are removed at the end, however it ends; an OSError is raised as an InputError
    about `place`."""
    temporaries: list[Path] = []
    _temporaries[id(temporaries)] = temporaries
    try:
        yield temporaries
    except OSError as fault:
        raise InputError(f"cannot be written: {fault.strerror or fault}", source=str(place)) from fault
    finally:
        _remove(temporaries)
        del _temporaries[id(temporaries)]


@contextlib.contextmanager
def replacing(directory: Path, *, kept: Container[str] = (), force: bool = False) -> Iterator[Path]:
    """A context in which files of a run are written into an empty directory; at its end they take their
    places in `directory`.

    kept  : names of files of the earlier run that stay although the new run lacks them
    force : replace files that no run wrote, too

    One of the files is `summary.json`, with `checksums` of the others. After an exception `directory` is as
    before, unless the system refused one of the renames: then, as after a kill there, it has files of two
    runs.

    Raises InputError if `directory` cannot be written, or if a file is in the way that no run wrote.
    """
    check_output(directory, (), force=force)
    with _writing(directory) as temporaries:
        for missing in _missing(directory):
            temporaries.append(missing)
            missing.mkdir(exist_ok=True)
        with _locked(directory):
            vouched = _vouched(directory)
            _remove(directory.glob(HIDDEN + "/"))
            new = directory / _hidden_name()
            temporaries.append(new)
            new.mkdir()
            yield new
            names = os.listdir(new)
            for name in names:
                _sync(new / name)
            _refuse_foreign(directory, names, vouched, force)
            others = {*names, *filter(PROGRAM.fullmatch, (name for name, _ in vouched))} - {*OUTPUTS, SUMMARY}
            for name in (*OUTPUTS, *sorted(others), SUMMARY):
                if name == SUMMARY:
                    _sync(directory)
                if name in names:
                    os.replace(new / name, directory / name)
                elif name not in kept and _is_ours(directory / name, vouched):
                    (directory / name).unlink()
            _sync(directory)


@contextlib.contextmanager
def replacing_file(path: Path) -> Iterator[Path]:
    """The same for one file: yields the place of a new file to write, which takes the place of `path` at the
    end.

    After an exception `path` is as before. Raises InputError if it cannot be written.
    """
    with _writing(path) as temporaries:
        path.parent.mkdir(parents=True, exist_ok=True)
        temporaries.append(path.with_name(_hidden_name() + path.suffix))
        yield temporaries[0]
        _sync(temporaries[0])
        os.replace(temporaries[0], path)


def check_output(directory: Path, names: Iterable[str], *, force: bool = False) -> None:
    """Raise InputError if a directory cannot be written, or if one of `names` in it exists, no run wrote it,
    and `force` is not set."""
    with _writing(directory):
        if directory.exists() and not directory.is_dir():
            raise InputError("cannot be written: is a file, not a directory", source=str(directory))
        missing = _missing(directory)
        there = missing[0].parent if missing else directory
        if not os.access(there, os.W_OK):
            raise InputError(f"cannot be written: no permission to write in {there}", source=str(directory))
        if missing:  # whether one can be made there (not below /proc)
            try:
                os.rmdir(tempfile.mkdtemp(dir=there))
            except OSError:
                said = f"cannot be written: no directory can be made in {there}; give another one"
                raise InputError(said, source=str(directory)) from None
        _refuse_foreign(directory, names, _vouched(directory), force)


def check_file(
    path: Path, inputs: Iterable[Path] = (), *, suffixes: tuple[str, ...] = (), force: bool = False
) -> None:
    """Raise InputError if a file cannot be written: for another suffix than `suffixes`, a directory, an
    input, or a file that no command wrote while `force` is not set."""
    if suffixes and path.suffix not in suffixes:
        raise InputError(f"unknown format '{path.suffix}'; there are {', '.join(suffixes)}", source=str(path))
    with _writing(path):
        if path.is_dir():
            raise InputError("cannot be written: is a directory", source=str(path))
        if path.parent.exists() and not path.parent.is_dir():
            raise InputError(f"cannot be written: {path.parent} is no directory", source=str(path))
        refuse_inputs([path], inputs)
        if os.path.lexists(path) and not force and not (path.is_file() and _stands_alone(path)):
            raise InputError(
                "was not written by planner, and is not overwritten; give another name, or --force",
                source=str(path),
            )


def write_whole(path: Path, text: str) -> None:
    """Write a file, the whole of it or nothing. Raises InputError if it cannot be written."""
    with replacing_file(path) as new:
        new.write_text(text, encoding="utf-8")


def write_new(file: Path, text: bytes, *, force: bool | None = None) -> None:
    """Write a file that is not there yet, the whole of it or nothing. Raises InputError if it is there, or cannot be
    written.

    force : write over one that is there; None where the command has no such option
    """
    try:
        if force and file.is_file():
            with replacing_file(file) as new:
                new.write_bytes(text)
            return
        with file.open("wb" if force else "xb") as stream:
            try:
                stream.write(text)
                stream.flush()
            except OSError:
                if file.is_file():  # and no device
                    file.unlink()
                raise
    except FileExistsError:
        remedy = "give another name" if force is None else "give another name or --force"
        raise InputError(f"exists already and is not overwritten; {remedy}", source=str(file)) from None
    except OSError as fault:
        raise InputError(f"cannot be written: {fault.strerror}", source=str(file)) from fault


def _stands_alone(path: Path) -> bool:
    """Whether a file is a page, a comparison, a trace or pulses, by its content."""
    with path.open("rb") as stream:
        start = stream.read(500)
    match path.suffix:
        case ".csv":
            return start.startswith(tuple(",".join(head).encode() for head in CSV_HEADS))
        case ".parquet":
            from pyarrow import parquet

            with contextlib.suppress(OSError, ValueError), path.open("rb") as stream:
                return tuple(parquet.read_schema(stream).names) == PULSES
        case ".json":
            with contextlib.suppress(ValueError, RecursionError, TypeError):
                names = set(json.loads(path.read_bytes()))
                return any(names >= keys for keys in JSON_KEYS)
        case _:
            return PAGE_MARK.encode() in start
    return False


def refuse_inputs(outputs: Iterable[Path], inputs: Iterable[Path]) -> None:
    """Raise InputError if one of the files to write is among the files that are read."""
    for output, given in itertools.product(outputs, [*inputs]):
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
    place = directory.resolve()
    return [one for one in (*reversed(place.parents), place) if not one.exists()]


def _vouched(directory: Path) -> set[tuple[str, str]]:
    """Names and checksums of what runs wrote into `directory`, as their summaries say, themselves
    included."""
    vouched: set[tuple[str, str]] = set()
    for file in (directory / SUMMARY, *directory.glob(f"{HIDDEN}/{SUMMARY}")):
        with contextlib.suppress(OSError, ValueError, RecursionError, KeyError, TypeError, AttributeError):
            said = json.loads(file.read_bytes())
            if isinstance(said["run_id"], str):
                vouched |= {*said["sha256"].items(), (SUMMARY, _sha256(file))}
    return vouched


def is_ours(file: Path) -> bool:
    """Whether a run wrote a file, as the summary beside it says."""
    return _is_ours(file, _vouched(file.parent))


def _is_ours(file: Path, vouched: set[tuple[str, str]]) -> bool:
    return file.is_file() and not file.is_symlink() and (file.name, _sha256(file)) in vouched


def _refuse_foreign(
    directory: Path, names: Iterable[str], vouched: set[tuple[str, str]], force: bool
) -> None:
    for name in names:
        file = directory / name
        if file.is_dir() and not file.is_symlink():
            raise InputError("cannot be written: is a directory", source=str(file))
        if not force and os.path.lexists(file) and not _is_ours(file, vouched):
            raise InputError(
                "was not written by planner, or changed since, and is not overwritten; give another directory, or --force",
                source=str(file),
            )


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


def _sync(place: Path) -> None:
    """Force a file, or the names in a directory, to disk; a directory where the system can. Windows does so
    through handles that may write only."""
    names = place.is_dir()
    with contextlib.suppress(*[OSError] * names):
        handle = os.open(place, os.O_RDONLY if names else os.O_RDWR)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)
