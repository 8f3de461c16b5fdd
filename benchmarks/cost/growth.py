"""How time and memory grow with the length of a program: reliefs of a thousand to millions of blocks, planned and written.

    python -m benchmarks.cost.growth [--blocks N ...] [--method NAME] [--machine NAME] [--most SECONDS] [--threads N] [--no-files]
    [--again]

A relief is one run without a stop: rows of `PER_ROW` blocks of `STEP`, heights of random waves with kinks where they are cut off. Each
size is planned in a process of its own, as `planner plan -o` does it. Times are processor times, by stage and without the stages inside
a stage, on kernels that are compiled already (each process plans `WARM_UP` blocks first); wall time is told beside them. Memory is the
largest resident set of the process, and by how much it is above that of the warm process per block. The slope is the exponent of the
processor time between a size and the one before; below the table stands the one fitted to all sizes from `FITTED` blocks on. The next
size follows only if the one before took less than `--most` processor seconds.

Each size is written when it is done. A run that was cut off goes on where it ended: what the results hold of the same settings and
commit (the last one that changed the planner) is not run again, unless `--again` is given. Other rows stay until their size is run, and
no slope is told from them.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.record import RESULTS, markdown, write_results
from planner.base.threads import threads, use_threads

BLOCKS = (1_000, 3_000, 10_000, 30_000, 100_000, 300_000, 1_000_000, 2_000_000)
PER_ROW, STEP, ROW_STEP = 400, 0.3, 0.4  # blocks, [mm], [mm]
FEED = 6000  # [mm/min]
WAVES, HEIGHT, CUT_OFF = (
    12,
    0.4,
    0.8,
)  # waves, their height [mm], and above which height the relief is flatter [mm]
WARM_UP = 200  # blocks
MOST = 300.0  # [s]
FITTED = 10_000  # blocks: smaller jobs get rounds and a search that longer ones do not (planning/optimal/effort.py)
SETTINGS = ("method", "machine", "threads", "files", "commit")  # of a row, beside its number of blocks


def relief(blocks: int, seed: int = 3) -> str:
    """An NC program of a relief."""
    rng = np.random.default_rng(seed)
    amplitude = rng.normal(size=WAVES)
    number, phase = rng.uniform(0.05, 0.6, (WAVES, 2)), rng.uniform(0.0, 2.0 * np.pi, WAVES)
    lines = [f"G21 G90 G17 G94 F{FEED}"]
    for row in range(-(-blocks // PER_ROW)):
        x, y = np.arange(PER_ROW) * STEP, ROW_STEP * row
        x = x[::-1] if row % 2 else x
        angle = number[:, :1] * x + number[:, 1:] * y + phase[:, None]
        z = HEIGHT * (amplitude[:, None] * np.sin(angle)).sum(axis=0)
        z = np.where(z > CUT_OFF, CUT_OFF + 0.3 * (z - CUT_OFF), z)
        count = min(PER_ROW, blocks - row * PER_ROW)
        lines += [f"G1 X{a:.3f} Y{y:.3f} Z{b:.3f}" for a, b in zip(x[:count], z[:count], strict=True)]
    return "\n".join([*lines, "M2", ""])


class Clock:
    """Processor time by stage, without the stages inside it; a `progress` of `planner.plan`.

    took  : of all threads [s]
    alone : of the thread that calls, which waits while others work [s]
    """

    def __init__(self) -> None:
        self.took: dict[str, float] = {}
        self.alone: dict[str, float] = {}
        self._stack: list[str] = []
        self._last, self._last_alone = time.process_time(), time.thread_time()

    def __call__(self, stage: str, done: float) -> None:
        if not 0.0 < done < 1.0:
            self._count()
        if done == 0.0:
            self._stack.append(stage)
        elif done == 1.0 and stage in self._stack:
            while self._stack.pop() != stage:
                pass

    def _count(self) -> None:
        now, alone = time.process_time(), time.thread_time()
        stage = self._stack[-1] if self._stack else "else"
        self.took[stage] = self.took.get(stage, 0.0) + now - self._last
        self.alone[stage] = self.alone.get(stage, 0.0) + alone - self._last_alone
        self._last, self._last_alone = now, alone


def one(blocks: int, method: str, machine: str, *, files: bool) -> dict[str, Any]:
    """Plan one size in this process."""
    import planner
    from planner.report.export import write_plan

    with tempfile.TemporaryDirectory() as scratch:
        program = Path(scratch) / "relief.ngc"
        for size in (WARM_UP, blocks):
            program.write_text(relief(size))
            before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
            clock, began, wall = Clock(), time.process_time(), time.perf_counter()
            plan = planner.plan(program, machine, method=method, progress=clock)
            if files and plan.solved:
                clock("write", 0.0)
                write_plan(plan, Path(scratch) / "out", force=True)
                clock("write", 1.0)
        after = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return {
        "blocks": blocks,
        "method": method,
        "machine": machine,
        "threads": threads(),
        "files": files,
        "cpu_s": time.process_time() - began,
        "wall_s": time.perf_counter() - wall,
        "load": os.getloadavg()[0],
        "stages_s": clock.took,
        "peak_mb": after / 1e3,
        "kb_per_block": (after - before) / blocks,
        "points": plan.grid_points,
        "samples": len(plan.trajectory) if plan.trajectory is not None else 0,
        "cycle_s": plan.trajectory.cycle_time if plan.trajectory is not None else math.nan,
        "passed": plan.verdict is not None and plan.verdict.passed,
    }


def main() -> None:
    """Run what is asked for and write the results."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--blocks", nargs="*", type=int, default=BLOCKS)
    parser.add_argument("--method", default="optimal")
    parser.add_argument("--machine", default="mill")
    parser.add_argument(
        "--most", type=float, default=MOST, help="processor seconds after which no larger size follows"
    )
    parser.add_argument("--no-files", dest="files", action="store_false", help="plan only")
    parser.add_argument("--threads", type=int, default=None, help="one per core")
    parser.add_argument("--again", action="store_true", help="also what the results hold of this commit")
    parser.add_argument(
        "--one", action="store_true", help="print the result of the first size as JSON, in this process"
    )
    options = parser.parse_args()
    use_threads(options.threads)
    if options.one:
        print(json.dumps(one(options.blocks[0], options.method, options.machine, files=options.files)))
        return
    asked = {
        "method": options.method,
        "machine": options.machine,
        "threads": threads(),
        "files": options.files,
        "commit": planner_commit(),
    }
    rows = _before()
    for blocks in options.blocks:
        done = next((row for row in rows if row["blocks"] == blocks and _settings(row) == asked), None)
        if done is None or options.again:
            done = _run(blocks, asked)
            if done is None:
                break
            print({name: value for name, value in done.items() if name != "stages_s"}, flush=True)
            rows = sorted(
                [row for row in rows if row["blocks"] != blocks] + [done], key=lambda row: row["blocks"]
            )
            write_results("growth", {"rows": rows}, _table(rows, asked))
        if done["cpu_s"] > options.most:
            break


def planner_commit() -> str:
    """The last commit that changed the planner."""
    command = ["git", "log", "-1", "--format=%h", "--", "planner"]
    root = Path(__file__).parents[2]
    return subprocess.run(command, cwd=root, capture_output=True, text=True, check=False).stdout.strip()


def _before() -> list[dict[str, Any]]:
    """The rows of the results so far."""
    file = RESULTS / "growth.json"
    return list(json.loads(file.read_text())["rows"]) if file.exists() else []


def _settings(row: dict[str, Any]) -> dict[str, Any]:
    """What a row was planned with, and at which commit; None where it does not say."""
    return {name: row.get(name) for name in SETTINGS}


def _run(blocks: int, asked: dict[str, Any]) -> dict[str, Any] | None:
    """The row of one size, planned in a process of its own; None after an error, which is printed."""
    command = [sys.executable, "-m", "benchmarks.cost.growth", "--one", "--blocks", str(blocks)]
    command += [
        "--method",
        asked["method"],
        "--machine",
        asked["machine"],
        "--threads",
        str(asked["threads"]),
    ]
    command += [] if asked["files"] else ["--no-files"]
    ran = subprocess.run(command, capture_output=True, text=True, check=False)
    if ran.returncode:
        print(f"{blocks:,} blocks: {ran.stderr.strip().splitlines()[-1:] or ran.returncode}", flush=True)
        return None
    return {**json.loads(ran.stdout.splitlines()[-1]), "commit": asked["commit"]}


def fitted_slope(blocks: list[int], seconds: list[float]) -> float:
    """The exponent p of seconds = c blocks^p, by least squares of the logarithms; NaN for fewer than two sizes."""
    if len(blocks) < 2:
        return math.nan
    return float(np.polyfit(np.log(blocks), np.log(seconds), 1)[0])


def _table(rows: list[dict[str, Any]], asked: dict[str, Any]) -> str:
    stages = list(dict.fromkeys(name for row in rows for name in row["stages_s"]))
    columns = [
        "blocks",
        "CPU [s]",
        "wall [s]",
        "threads",
        "blocks/CPU s",
        "slope",
        *(f"{name} [s]" for name in stages),
        "peak [MB]",
    ]
    columns += ["kB/block", "grid points", "samples", "motion [s]", "passed", "load", "commit"]
    lines = []
    for k, row in enumerate(rows):
        pair = [one for one in rows[max(k - 1, 0) : k + 1] if _settings(one) == asked]
        slope = f"{_slope(pair):.2f}" if len(pair) == 2 else ""
        lines.append(
            [
                f"{row['blocks']:,}",
                f"{row['cpu_s']:.3g}",
                f"{row['wall_s']:.3g}" if "wall_s" in row else "",
                str(row.get("threads", "")),
                f"{row['blocks'] / row['cpu_s']:,.0f}",
                slope,
                *(f"{row['stages_s'].get(name, 0.0):.3g}" for name in stages),
                f"{row['peak_mb']:,.0f}",
                f"{row['kb_per_block']:.2f}",
                f"{row['points']:,}",
                f"{row['samples']:,}",
                f"{row['cycle_s']:.6g}",
                "yes" if row["passed"] else "no",
                f"{row['load']:.1f}" if "load" in row else "",
                row.get("commit", ""),
            ]
        )
    large = [row for row in rows if row["blocks"] >= FITTED and _settings(row) == asked]
    told = (
        f"\nFitted slope of CPU time from {FITTED:,} blocks on: {_slope(large):.2f}.\n"
        if len(large) > 1
        else ""
    )
    return markdown(columns, lines) + told


def _slope(rows: list[dict[str, Any]]) -> float:
    return fitted_slope([row["blocks"] for row in rows], [row["cpu_s"] for row in rows])


if __name__ == "__main__":
    main()
