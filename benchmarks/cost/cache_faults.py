"""Two small kernels on the disk, in a way to keep them (first_run.py): what a process says that runs after something has happened to
them."""

from __future__ import annotations

import hashlib
import os
import pickle
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from benchmarks.record import ROOT
from planner.base import kernel_files

INNER = "from planner.base.kernels import njit\n\n@njit()\ndef share(x):\n    return x / 2.0\n"
OUTER = """from planner.base.kernels import njit
from inner import share

@njit()
def whole(x):
    return share(x) + share(x)
"""
USE = """
import inner, outer, warnings
with warnings.catch_warnings(record=True) as caught:
    warnings.simplefilter("always")
    found = outer.whole(ARGUMENT)
made = getattr(outer.whole, "whole", outer.whole)
print(f"{found:g}, " + ("compiled" if sum(made.stats.cache_misses.values()) else "loaded") + (", warned" if caught else ""))
"""
# Between the index that numba writes and the file that it names: two processes that write for the first time, each with other types.
WAITS = """
import time
from numba.core.caching import IndexDataCacheFile as of
index, data = of._save_index, of._save_data
def waits(own, seconds):
    time.sleep(seconds if "outer" in own._index_name else 0.0)
of._save_index = lambda own, overloads: (waits(own, BEFORE_INDEX), index(own, overloads))
of._save_data = lambda own, name, value: (waits(own, BEFORE_DATA), data(own, name, value))
"""
SKEWS = (("7", 3.0, 8.0), ("7.5", 6.0, 0.0))  # argument, seconds before the index, before the data
FAULTS = {
    "next": "the next process",
    "copied": "sources copied to another folder",
    "comment": "another comment in the file of an inner kernel",
    "changed": "another inner kernel (37 is right)",
    "processor": "another processor (NUMBA_CPU_NAME)",
    "places": "the folder cannot be written",
    "zeros": "zeros in the middle of each file",
    "half": "half of each file",
    "planted": "a folder that others can write, with code of theirs",
    "both": "two processes have kept it at once, for int and float (7.5 is right)",
}


class Planted:
    """Runs when it is unpickled: makes a folder."""

    def __init__(self, folder: Path):
        self._folder = str(folder)

    def __reduce__(self) -> tuple[object, tuple[str]]:
        return os.mkdir, (self._folder,)


def after_faults(prepared: str) -> dict[str, str]:
    """By the keys of `FAULTS`, what a process says: value, whether it compiled, and warnings; or how it ended."""
    said: dict[str, str] = {}
    with tempfile.TemporaryDirectory() as folder:
        here = Path(folder)
        sources, cache = _sources(here / "a"), here / "cache"

        def run(of: Path = sources, where: Path = cache, **more: str) -> str:
            return _ended(_started(prepared, of, where, "7.5", **more))

        def fresh() -> list[Path]:
            shutil.rmtree(cache, ignore_errors=True)
            run()
            return [path for path in cache.rglob("*") if path.suffix in (".kernel", ".nbc")]

        run()
        said["next"] = run()
        said["copied"] = run(of=_sources(here / "b"))
        fresh()
        (sources / "inner.py").write_text(INNER + "# the same\n", encoding="utf-8")
        said["comment"] = run()
        fresh()
        (sources / "inner.py").write_text(INNER.replace("x / 2.0", "x + 11.0"), encoding="utf-8")
        said["changed"] = run()
        _sources(sources)
        said["processor"] = run(NUMBA_CPU_NAME="x86-64")
        (here / "file").touch()
        said["places"] = run(where=here / "file" / "cache")
        for path in fresh():
            data = path.read_bytes()
            middle = len(data) // 2
            path.write_bytes(data[:middle] + bytes(512) + data[middle + 512 :])
        said["zeros"] = run()
        for path in fresh():
            path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
        said["half"] = run()
        for path in fresh():
            code = pickle.dumps(Planted(here / "ran"))
            rest = path.read_bytes()[32:64] + code
            path.write_bytes(hashlib.sha256(rest).digest() + rest if path.suffix == ".kernel" else code)
        for path in [cache, *cache.iterdir()]:
            path.chmod(0o777)
        said["planted"] = run() + (": their code has run" if (here / "ran").exists() else "")
        for path in Path(kernel_files.PACKAGE, "__pycache__", "kernels").glob("outer.whole*"):
            path.unlink()  # kept beside the sources of a checkout, for want of the folder that was named
        shutil.rmtree(cache)
        both = []
        for argument, index, data in SKEWS:
            waits = f"BEFORE_INDEX, BEFORE_DATA = {index}, {data}\n{WAITS}"
            both.append(_started(prepared, sources, cache, argument, waits))
        for one in both:
            one.communicate()
        said["both"] = run()
    return said


def _sources(folder: Path) -> Path:
    folder.mkdir(exist_ok=True)
    (folder / "inner.py").write_text(INNER, encoding="utf-8")
    (folder / "outer.py").write_text(OUTER, encoding="utf-8")
    return folder


def _started(
    prepared: str, sources: Path, cache: Path, argument: str, waits: str = "", **more: str
) -> subprocess.Popen[str]:
    """A process with its own folder of sources that calls the outer kernel."""
    paths = os.pathsep.join([str(sources), str(ROOT)])
    env = os.environ | {"PYTHONPATH": paths, "NUMBA_CACHE_DIR": str(cache), "PYTHONDONTWRITEBYTECODE": "1"}
    code = f"{prepared}\n{waits}{USE.replace('ARGUMENT', argument)}"
    pipe = subprocess.PIPE
    return subprocess.Popen(
        [sys.executable, "-c", code], cwd=sources, env=env | more, text=True, stdout=pipe, stderr=pipe
    )


def _ended(process: subprocess.Popen[str]) -> str:
    said, errors = process.communicate()
    if process.returncode < 0:
        return f"killed by signal {-process.returncode}"
    return said.strip() if process.returncode == 0 else errors.strip().split("\n")[-1][:70]
