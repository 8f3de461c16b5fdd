"""What the installation, the first run and the next ones take, in four ways to compile kernels and keep them.

And what becomes of kernels on the disk that are changed, damaged or not to be trusted:

    python -m benchmarks.cost.first_run [--ways planner,numba,lean,files]     into results/first-run.json and .md

`planner` is planner/base/compiling.py: what a user gets. The others are in numba_cache.py. Each begins with an empty
NUMBA_CACHE_DIR, which setup.py's two programs fill side by side (planner/commands/ahead.py); then come a first run of the bracket and
next ones, on one thread. CPU seconds are those of all processes. Faults are those of cache_faults.py.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from benchmarks.cost.cache_faults import FAULTS, after_faults
from benchmarks.record import ROOT, markdown, write_results

WAYS = {"planner": "", "numba": "plain", "lean": "lean", "files": "files"}  # functions of numba_cache.py
PLAN = ("plan", "planner/examples/bracket.ngc", "--threads", "1", "--quiet", "--json")
NEXT = 5  # runs; the median counts
ROWS = {
    "install_wall": "installation, both programs side by side: wall s",
    "install_cpu": "CPU s",
    "kernels": "kernels (files of machine code)",
    "megabytes": "MB",
    "first_cpu": "first run of the bracket: CPU s",
    "further": "kernels that it adds",
    "next_cpu": "next run: CPU s",
    "version_cpu": "planner --version: CPU s",
    "cycle_time": "cycle time of the bracket s",
}


def prepared(way: str) -> str:
    """Python statements that make a process use this way."""
    return f"from benchmarks.cost import numba_cache; numba_cache.{WAYS[way]}(); " if WAYS[way] else ""


def measured(way: str) -> dict[str, Any]:
    """The values of `ROWS`."""
    with tempfile.TemporaryDirectory() as folder:
        cache = Path(folder) / "cache"

        def started(module: str, *words: str) -> subprocess.Popen[str]:
            code = f"import runpy, sys; {prepared(way)}sys.argv = {['', *words]}; runpy.run_module({module!r}, run_name='__main__')"
            env = os.environ | {"NUMBA_CACHE_DIR": str(cache), "OMP_NUM_THREADS": "1"}
            return subprocess.Popen(
                [sys.executable, "-c", code], cwd=ROOT, env=env, text=True, stdout=subprocess.PIPE
            )

        def run(*words: str) -> tuple[float, str]:
            before = cpu_of_children()
            text, _ = started("planner", *words).communicate()
            return cpu_of_children() - before, text

        def files() -> list[Path]:
            return [*cache.rglob("*.kernel"), *cache.rglob("*.nbc")]

        begun, before = time.perf_counter(), cpu_of_children()
        both = [started("planner.commands.ahead", *words) for words in ((), ("corners",))]
        failed = [one.returncode for one in both if one.communicate() and one.returncode]
        if failed:
            raise RuntimeError(f"{way}: the installation ended with {failed}")
        row = {"install_wall": time.perf_counter() - begun, "install_cpu": cpu_of_children() - before}
        row["kernels"], row["megabytes"] = len(files()), sum(of.stat().st_size for of in files()) / 1e6
        row["first_cpu"], _ = run(*PLAN)
        row["further"] = len(files()) - row["kernels"]
        further = [run(*PLAN) for _ in range(NEXT)]
        row["next_cpu"] = statistics.median(cpu for cpu, _ in further)
        row["version_cpu"] = statistics.median(run("--version")[0] for _ in range(NEXT))
        row["cycle_time"] = json.loads(further[-1][1])["cycle_time_s"]
    return row


def cpu_of_children() -> float:
    """CPU seconds of all processes that have ended below this one."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--ways", default=",".join(WAYS))
    ways = parser.parse_args().ways.split(",")
    columns: dict[str, dict[str, Any]] = {}
    for way in ways:
        columns[way] = {"faults": after_faults(prepared(way))}
        print(way, columns[way], flush=True)
    for way in ways:
        columns[way] |= measured(way)
        print(way, columns[way], flush=True)
    table = [
        [title, *(_text(columns[way][key], 6 if key == "cycle_time" else 2) for way in ways)]
        for key, title in ROWS.items()
    ]
    table += [[title, *(columns[way]["faults"][key] for way in ways)] for key, title in FAULTS.items()]
    write_results("first-run", {"ways": columns}, markdown(["", *ways], table))


def _text(value: float, digits: int) -> str:
    return str(value) if isinstance(value, int) else f"{value:.{digits}f}"


if __name__ == "__main__":
    main()
