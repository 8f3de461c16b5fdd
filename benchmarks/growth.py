"""How time and memory grow with the length of a program: reliefs of a thousand to millions of blocks, planned and written.

    python -m benchmarks.growth [--blocks N ...] [--method NAME] [--machine NAME] [--most SECONDS] [--no-files]

A relief is one run without a stop: rows of `PER_ROW` blocks of `STEP`, heights of random waves with kinks where they are cut off. Each
size is planned in a process of its own, as `planner plan -o` does it. Times are processor times, by stage and without the stages inside
a stage, on kernels that are compiled already (each process plans `WARM_UP` blocks first). Memory is the largest resident set of the
process, and by how much it is above that of the warm process per block. The slope is the exponent of the time between a size and the
one before; the largest size follows only if the one before took less than `--most` seconds.
"""

from __future__ import annotations

import argparse
import json
import math
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.record import markdown, write_results

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
    """Processor time by stage, without the stages inside it; a `progress` of `planner.plan`."""

    def __init__(self) -> None:
        self.took: dict[str, float] = {}
        self._stack: list[str] = []
        self._last = time.process_time()

    def __call__(self, stage: str, done: float) -> None:
        if not 0.0 < done < 1.0:
            self._count()
        if done == 0.0:
            self._stack.append(stage)
        elif done == 1.0 and stage in self._stack:
            while self._stack.pop() != stage:
                pass

    def _count(self) -> None:
        now = time.process_time()
        stage = self._stack[-1] if self._stack else "else"
        self.took[stage] = self.took.get(stage, 0.0) + now - self._last
        self._last = now


def one(blocks: int, method: str, machine: str, *, files: bool) -> dict[str, Any]:
    """Plan one size in this process."""
    import planner
    from planner.report.export import write_plan

    with tempfile.TemporaryDirectory() as scratch:
        program = Path(scratch) / "relief.ngc"
        for size in (WARM_UP, blocks):
            program.write_text(relief(size))
            before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
            clock, began = Clock(), time.process_time()
            plan = planner.plan(program, machine, method=method, progress=clock)
            if files and plan.solved:
                clock("write", 0.0)
                write_plan(plan, Path(scratch) / "out", force=True)
                clock("write", 1.0)
        after = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return {
        "blocks": blocks,
        "cpu_s": time.process_time() - began,
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
    parser.add_argument(
        "--one", action="store_true", help="print the result of the first size as JSON, in this process"
    )
    options = parser.parse_args()
    if options.one:
        print(json.dumps(one(options.blocks[0], options.method, options.machine, files=options.files)))
        return
    rows: list[dict[str, Any]] = []
    for blocks in options.blocks:
        command = [sys.executable, "-m", "benchmarks.growth", "--one", "--blocks", str(blocks)]
        command += ["--method", options.method, "--machine", options.machine] + ["--no-files"] * (
            not options.files
        )
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode:
            print(
                f"{blocks:,} blocks: {done.stderr.strip().splitlines()[-1:] or done.returncode}", flush=True
            )
            break
        rows.append(json.loads(done.stdout.splitlines()[-1]))
        print({name: value for name, value in rows[-1].items() if name != "stages_s"}, flush=True)
        write_results("growth", {"rows": rows}, _table(rows))
        if rows[-1]["cpu_s"] > options.most:
            break


def _table(rows: list[dict[str, Any]]) -> str:
    stages = list(dict.fromkeys(name for row in rows for name in row["stages_s"]))
    columns = ["blocks", "CPU [s]", "blocks/s", "slope", *(f"{name} [s]" for name in stages), "peak [MB]"]
    columns += ["kB/block", "grid points", "samples", "motion [s]", "passed"]
    lines = []
    for k, row in enumerate(rows):
        before = rows[k - 1] if k else None
        slope = (
            f"{math.log(row['cpu_s'] / before['cpu_s']) / math.log(row['blocks'] / before['blocks']):.2f}"
            if before
            else ""
        )
        lines.append(
            [
                f"{row['blocks']:,}",
                f"{row['cpu_s']:.3g}",
                f"{row['blocks'] / row['cpu_s']:,.0f}",
                slope,
                *(f"{row['stages_s'].get(name, 0.0):.3g}" for name in stages),
                f"{row['peak_mb']:,.0f}",
                f"{row['kb_per_block']:.2f}",
                f"{row['points']:,}",
                f"{row['samples']:,}",
                f"{row['cycle_s']:.6g}",
                "yes" if row["passed"] else "no",
            ]
        )
    return markdown(columns, lines)


if __name__ == "__main__":
    main()
