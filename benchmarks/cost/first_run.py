"""What the first run on a machine takes: a ten-line program with no kernel compiled yet.

    python -m benchmarks.cost.first_run [--methods optimal,second-order,...] [--ways ...]     into results/first-run.json and .md

Every run is `planner plan` in a new process with an empty NUMBA_CACHE_DIR, in one of two ways:

    numba       every kernel as numba compiles it by itself
    planner     as planner/base/compiling.py has it: what a user gets

CPU seconds are those of all its processes. Kernels are counted by what lies in the cache afterwards: a kernel for arguments of two
kinds counts twice.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from benchmarks.record import markdown, write_results

PROGRAM = "G21 G90 G17\nG64 P0.02\nG1 X20 F3000\nX40 Y10\nX60\nX70 Y30\nX50 Y50\nX20 Y40\nX0 Y20\nM2\n"
METHODS = ("optimal", "second-order", "kinematic", "fir", "stop")
WAYS = {
    "numba": "import planner.base.kernels as kernels; kernels.Kernel.part = property(lambda own: own.whole); ",
    "planner": "",
}
COMMAND = "from planner.cli import main; main()"


def first_run(method: str, way: str) -> dict[str, Any]:
    """One run with an empty cache: seconds, kernels, the exit code, and seconds of the next run."""
    with tempfile.TemporaryDirectory() as folder:
        job = Path(folder) / "ten.ngc"
        job.write_text(PROGRAM, encoding="utf-8")
        env = {**os.environ, "NUMBA_CACHE_DIR": str(Path(folder) / "cache")}
        command = [
            sys.executable,
            "-c",
            WAYS[way] + COMMAND,
            "plan",
            str(job),
            "--method",
            method,
            "--quiet",
            "--json",
        ]
        row: dict[str, Any] = {"method": method, "way": way}
        for run in ("first", "next"):
            before, began = cpu_of_children(), time.perf_counter()
            done = subprocess.run(command, env=env, capture_output=True, text=True, check=False)
            row[f"{run}_wall"], row[f"{run}_cpu"] = time.perf_counter() - began, cpu_of_children() - before
            if run == "first":
                row["kernels"] = len([*Path(folder).rglob("*.kernel"), *Path(folder).rglob("*.nbc")])
                row["exit"] = done.returncode
                row["cycle_time"] = json.loads(done.stdout)["cycle_time_s"]
    return row


def cpu_of_children() -> float:
    """CPU seconds of all processes that have ended below this one."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--methods", default=",".join(METHODS))
    parser.add_argument("--ways", default=",".join(WAYS))
    asked = parser.parse_args()
    rows = []
    for method in asked.methods.split(","):
        for way in asked.ways.split(","):
            rows.append(row := first_run(method, way))
            print(row, flush=True)
    columns = ["method", "way", "kernels", "wall s", "CPU s", "next run: wall s", "CPU s", "cycle time s"]
    table = [
        [
            row["method"],
            row["way"],
            str(row["kernels"]),
            *(f"{row[key]:.1f}" for key in ("first_wall", "first_cpu", "next_wall", "next_cpu")),
            f"{row['cycle_time']:.6f}",
        ]
        for row in rows
    ]
    write_results("first-run", {"program": PROGRAM, "rows": rows}, markdown(columns, table))


if __name__ == "__main__":
    main()
