"""Kinds of faults at the kernels that are kept (benchmarks/faults/kinds.py has the others)."""

from __future__ import annotations

import hashlib
import os
import pickle
import random
import shutil
import signal
import subprocess
import time
from pathlib import Path
from typing import Any

from benchmarks.faults.bench import Bench, after, ended, mounted
from planner.base.kernel_files import PACKAGE

STOP = ("plan", "a.ngc", "-o", "out", "-q", "--method", "stop")
COMPILING = 12.0  # in which it is ended: about as long as compiling what `STOP` needs takes [s]
DIGEST = hashlib.sha256().digest_size
STRANGER = 54321  # a user that is not there
# A command, and then the kernels that it has used.
USED = """
from planner.base.kernel_files import used
from planner.cli import app
app(standalone_mode=False)
print(*used(), sep=chr(10))
"""
NO_HOME = ("HOME", "XDG_", "MPL", "NUMBA_CACHE_DIR")  # variables that say where files may be kept


def with_cache(cache: Path, **more: str) -> dict[str, str]:
    """The environment in which kernels are kept there, and nowhere else."""
    return os.environ | {"NUMBA_CACHE_DIR": str(cache)} | more


def warm(bench: Bench) -> Path:
    """A cache with all kernels of `STOP`, copied once from where these lie."""
    cache = bench.folder / "warm"
    if not cache.exists():
        end, said = ended(bench.start(*STOP, of=USED))
        assert end == 0, said
        (cache / "planner").mkdir(parents=True)
        for line in said.splitlines():
            if line.endswith(".kernel"):
                shutil.copy(line, cache / "planner")
    return cache


def unsound(cache: Path) -> list[str]:
    """Files of a cache that are no kernels, or not what was written."""
    found = []
    for path in sorted(cache.rglob("*")):
        whole = path.read_bytes() if path.is_file() else None
        if whole is not None and (
            path.suffix != ".kernel" or hashlib.sha256(whole[DIGEST:]).digest() != whole[:DIGEST]
        ):
            found.append(f"in the cache: {path.name}")
    return found


def compiling(bench: Bench, rng: random.Random) -> dict[str, Any]:
    """Ctrl-C or kill -9 while kernels are compiled: what is kept is whole, and the next run goes on from there."""
    cache = bench.folder / "cold"
    shutil.rmtree(cache, ignore_errors=True)
    sent = rng.choice([signal.SIGINT, signal.SIGKILL])
    process = bench.start(*STOP, env=with_cache(cache))
    after(process, rng.uniform(0.0, COMPILING))
    process.send_signal(sent)
    end = ended(process)
    wrong = (
        [] if sent == signal.SIGKILL else unsound(cache)
    )  # what is killed may leave a part under another name
    again = bench.run(*STOP, env=with_cache(cache))
    row = bench.row([end, again], (0, 130, -signal.SIGINT, -signal.SIGKILL), sent=sent.name)
    wrong += [] if again[0] == 0 else [f"the next run ends with {again[0]}"]
    return row | {"wrong": row["wrong"] + wrong}


def first_runs(bench: Bench, rng: random.Random) -> dict[str, Any]:
    """Two first runs at once, into one cache and one folder."""
    cache = bench.folder / "cold"
    shutil.rmtree(cache, ignore_errors=True)
    first = bench.start(*STOP, env=with_cache(cache))
    time.sleep(rng.uniform(0.0, 2.0) * bench.takes)
    second = bench.start(*STOP, env=with_cache(cache))
    row = bench.row([ended(first), ended(second)], (0,))
    return row | {"wrong": row["wrong"] + unsound(cache)}


def damaged(bench: Bench, rng: random.Random) -> dict[str, Any]:
    """Kernels that a disk, a crash or a person has changed: they are compiled anew, and the motion is the same."""
    cache = bench.folder / "damaged"
    shutil.rmtree(cache, ignore_errors=True)
    shutil.copytree(warm(bench), cache)
    kernels = sorted(cache.rglob("*.kernel"))
    how = rng.choice(["bit", "zeros", "cut", "empty", "another's", "longer"])
    for path in rng.sample(kernels, rng.choice([1, 1, 3])):
        _damage(path, how, kernels, rng)
    before = (
        (bench.folder / "warm.csv").read_bytes()
        if (bench.folder / "warm.csv").exists()
        else _setpoints(bench)
    )
    end = bench.run(*STOP, "--format", "csv", env=with_cache(cache))
    now = (bench.out / "trajectory.csv").read_bytes() if end[0] == 0 else b""
    row = bench.row([end], (0,), how=how)
    return row | {"wrong": row["wrong"] + unsound(cache) + ([] if now == before else ["another motion"])}


def _setpoints(bench: Bench) -> bytes:
    """Those of the warm cache, kept beside."""
    end, said = bench.run(*STOP, "--format", "csv", env=with_cache(warm(bench)))
    assert end == 0, said
    shutil.copy(bench.out / "trajectory.csv", bench.folder / "warm.csv")
    return (bench.folder / "warm.csv").read_bytes()


def _damage(path: Path, how: str, kernels: list[Path], rng: random.Random) -> None:
    whole = bytearray(path.read_bytes())
    at = rng.randrange(len(whole))
    if how == "bit":
        whole[at] ^= 1 << rng.randrange(8)
    elif how == "zeros":
        whole[at : at + 512] = bytes(len(whole[at : at + 512]))
    elif how == "cut":
        del whole[at:]
    elif how == "empty":
        whole.clear()
    elif how == "longer":
        whole += bytes(rng.randrange(1, 4096))
    else:
        whole = bytearray(rng.choice([other for other in kernels if other != path]).read_bytes())
    path.write_bytes(whole)


class _Planted:
    """Leaves a file where it is unpickled."""

    def __init__(self, mark: Path) -> None:
        self.mark = mark

    def __reduce__(self) -> tuple[Any, ...]:
        return os.mkdir, (str(self.mark),)


def planted(bench: Bench, rng: random.Random) -> dict[str, Any]:
    """Kernels that somebody else may have put there, with a right checksum and code of their own: they are not run."""
    cache, mark = bench.folder / "planted", bench.folder / "was-run"
    shutil.rmtree(cache, ignore_errors=True)
    shutil.copytree(warm(bench), cache)
    for path in cache.rglob("*.kernel"):
        rest = path.read_bytes()[DIGEST : 2 * DIGEST] + pickle.dumps(_Planted(mark))
        path.write_bytes(hashlib.sha256(rest).digest() + rest)
    how = rng.choice(["all may write", "another's folder", "another's files", "relative"])
    environment = with_cache(cache)
    if how == "all may write":
        for path in (cache, *cache.rglob("*")):
            path.chmod(0o777)
    elif how == "relative":
        environment["NUMBA_CACHE_DIR"] = cache.name
    elif os.geteuid() == 0:
        for path in (cache, *cache.rglob("*")) if how == "another's folder" else cache.rglob("*.kernel"):
            os.chown(path, STRANGER, STRANGER)
    else:
        how = "all may write"
        cache.chmod(0o777)
    end = bench.run(*STOP, env=environment)
    row = bench.row([end], (0,), how=how)
    ran = ["code of a planted kernel was run"] if mark.exists() else []
    if mark.exists():
        mark.rmdir()
    return row | {"wrong": row["wrong"] + ran}


def no_room(bench: Bench, rng: random.Random) -> dict[str, Any]:
    """Kernels are missing, and the disk where they are to be kept is full: they are compiled, one warning says it, and no part is
    left there."""
    place = bench.folder / "full"
    with mounted(place, "size=16m") as there:
        shutil.rmtree(place / "planner", ignore_errors=True)
        shutil.copytree(warm(bench) / "planner", place / "planner")
        missing = rng.sample(sorted(place.rglob("*.kernel")), 2)
        for path in missing:
            path.unlink()
        if there:
            _fill(place / "planner" / "filling", rng.choice([0, 1, 8]) << 10)
        end = bench.run(*STOP, env=with_cache(place))
        (place / "planner" / "filling").unlink(missing_ok=True)
        wrong = unsound(place)
        shutil.rmtree(place / "planner")
    row = bench.row([end], (0,), mounted=there, missing=[path.name for path in missing])
    if there and end[1].count("cannot be kept") != 1:
        wrong.append(f"said: {end[1][-300:]}")
    return row | {"wrong": row["wrong"] + wrong}


def _fill(file: Path, room: int) -> None:
    """All but so many bytes of a disk."""
    with open(file, "wb", buffering=0) as opened:
        try:
            while True:
                opened.write(bytes(4096))
        except OSError:
            opened.truncate(max(opened.tell() - room, 0))


def read_only_package(bench: Bench, rng: random.Random) -> dict[str, Any]:
    """A package that nobody can write, on a system without a home: it plans, also where a kernel is missing."""
    place, kernels = bench.folder / "package", Path("planner/kernels")
    with mounted(place, "size=64m") as there:
        ignored = shutil.ignore_patterns("__pycache__", "kernels")
        shutil.copytree(PACKAGE, place / "planner", ignore=ignored, dirs_exist_ok=True)
        shutil.copytree(warm(bench) / "planner", place / kernels, dirs_exist_ok=True)
        missing = rng.random() < 0.5
        if missing:
            rng.choice(sorted((place / kernels).iterdir())).unlink()
        if there:
            subprocess.run(["mount", "-o", "remount,ro", str(place)], check=True)
        environment = {name: value for name, value in os.environ.items() if not name.startswith(NO_HOME)}
        environment |= {"PYTHONPATH": str(place), "HOME": "/proc/self"}
        end = bench.run(*STOP, env=environment)
        if not there:
            shutil.rmtree(place)
    row = bench.row([end], (0,), mounted=there, missing=missing)
    told = [] if ("cannot be kept" in end[1]) == (missing and there) else [f"said: {end[1][-300:]}"]
    return row | {"wrong": row["wrong"] + told}
