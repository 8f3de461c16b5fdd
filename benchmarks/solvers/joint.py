"""Geometry and feed together: what method `tube` finds beyond the feed along splines, and whether its start matters.

    python -m benchmarks.solvers.joint

The jobs are those of issue trackers and papers that the other benchmarks use: pentagon, zig-zag, circle and star spiral of
jobs/problems.py on the built-in `mill` and on the machine of jobs/problems.py, the bracket, and windows of real programs of
../shared where these are there; random jobs are those of joint_campaign.py. Results: benchmarks/results/joint.json and .md.
"""

from __future__ import annotations

import re
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

import planner
from benchmarks.jobs import problems
from benchmarks.record import markdown, write_results
from planner.base.errors import PlannerError
from planner.machine import Machine
from planner.nc.program import Program
from planner.planning.methods.optimal import OptimalMethod
from planner.planning.methods.tube import TubeMethod

SHARED = Path(__file__).resolve().parents[2] / "shared" / "nc"
# File, first motion block, blocks, feed [mm/s].
WINDOWS = {
    "stellabee1, 121 blocks": ("LinuxCNC__linuxcnc__stellabee1.ngc", 18158, 121),
    "trochoidal, 300 blocks": ("LinuxCNC__linuxcnc__trochoidal.ngc", 200, 300),
    "vcarve, 300 blocks": ("CauldronDevelopmentLLC__CAMotics__vcarve.ngc", 1000, 300),
}
BRACKET = Path(planner.__file__).parent / "examples" / "bracket.ngc"
# Settings of `optimal`, without the search that its default ends with, from whose motions it may begin.
STARTS = {
    "splines": OptimalMethod(corner="spline"),
    "coarse grid": OptimalMethod(effort="quick", corner="spline"),
}


def window(name: str, machine: Machine) -> Program:
    """Consecutive blocks of a program as a job of its own, as straight lines from its first point at rest."""
    file, first, count = WINDOWS[name]
    program = planner.read_program(SHARED / file, machine)
    points = np.asarray(program.end)[first - 1 : first + count, :3]
    feed = float(program.feed[first])
    return problems.polyline(
        points - points[0], feed=feed if np.isfinite(feed) else problems.FEED, source=name
    )


def relief(blocks: int) -> Program:
    """A generated relief of steps of 0.3 mm, 400 a row, one run without stops."""
    rng = np.random.default_rng(3)
    amplitude, wave, phase = rng.normal(size=12), rng.uniform(0.05, 0.6, (12, 2)), rng.uniform(0, 6.28, 12)
    n = np.arange(blocks + 1)
    row, column = n // 400, n % 400
    x, y = 0.3 * np.where(row % 2, 399 - column, column), 0.4 * row
    z = 0.4 * (amplitude * np.sin(wave[:, 0] * x[:, None] + wave[:, 1] * y[:, None] + phase)).sum(axis=1)
    z = np.where(z > 0.8, 0.8 + 0.3 * (z - 0.8), z)
    points = np.round(np.stack([x, y, z], axis=1), 3)
    return problems.polyline(points - points[0], source=f"relief of {blocks}")


def jobs() -> dict[str, tuple[Callable[[], Program], Machine]]:
    """The named jobs and their machines."""
    mill, peers = planner.load_machine("mill"), problems.machine()
    made: dict[str, tuple[Callable[[], Program], Machine]] = {
        "pentagon, mill": (problems.pentagon, mill),
        "zig-zag, mill": (problems.zigzag, mill),
        "bracket, mill": (lambda: planner.read_program(BRACKET, mill), mill),
        "relief of 1,000, mill": (lambda: relief(1000), mill),
        "pentagon, peers": (problems.pentagon, peers),
        "zig-zag, peers": (problems.zigzag, peers),
        "circle, peers": (problems.chord_circle, peers),
        "spiral of 1,000, peers": (problems.star_spiral, peers),
        "relief of 1,000, peers": (lambda: relief(1000), peers),
    }
    if SHARED.exists():
        for name in WINDOWS:
            made[f"{name}, mill"] = (lambda name=name: window(name, mill), mill)  # type: ignore[misc]
    return made


def measured(program: Program, machine: Machine) -> dict[str, Any]:
    """Cycle times [s], verdicts and CPU seconds from each start."""
    row: dict[str, Any] = {"blocks": len(program.kind)}
    for name, start in STARTS.items():
        began = time.process_time()
        try:
            plan = TubeMethod(start=start).plan(program, machine)
        except PlannerError as fault:
            row[name] = {"sentence": str(fault)}
            continue
        kept = re.search(r"on ([0-9.e-]+) of the time no faster", plan.sentence)
        took = re.search(r"its start \(.*\) took ([0-9.e-]+) s", plan.sentence)
        row[name] = {
            "start_s": float(took[1]) if took else None,
            "cycle_time_s": plan.trajectory.cycle_time if plan.trajectory is not None else None,
            "passed": plan.verdict is not None and plan.verdict.passed,
            "kept": 1.0 if "stays on" in plan.sentence else float(kept[1]) if kept else 0.0,
            "cpu_s": time.process_time() - began,
            "points": plan.grid_points,
            "sentence": plan.sentence,
        }
    return row


def main() -> None:
    """Run the jobs and write the table."""
    made = jobs()
    first, machine = next(iter(made.values()))
    measured(first(), machine)  # kernels are loaded
    rows: dict[str, Any] = {}
    for name, (make, machine) in made.items():
        rows[name] = measured(make(), machine)
        print(name, rows[name], flush=True)
    write_results("joint", {"jobs": rows}, _table(rows))


def _table(rows: dict[str, Any]) -> str:
    columns = ["job", "blocks"]
    for name in STARTS:
        columns += [f"`optimal`, {name} [s]", "tube [s]", "start kept on", "CPU [s]"]
    text = "Cycle times of the start and of what method `tube` (solver own) finds from it; * the verdict failed. CPU seconds are of\n"
    text += "the whole plan.\n\n"
    return text + markdown(columns, [[name, *_cells(row)] for name, row in rows.items()])


def _cells(row: dict[str, Any]) -> list[str]:
    cells = [str(row["blocks"])]
    for name in STARTS:
        found = row[name]
        if found.get("cycle_time_s") is None:
            cells += [found["sentence"][:40], "", "", ""]
            continue
        start = f"{found['start_s']:.5g}" if found["start_s"] else ""
        fault = "" if found["passed"] else " *"
        cells += [
            start,
            f"{found['cycle_time_s']:.5g}{fault}",
            f"{found['kept']:.0%}",
            f"{found['cpu_s']:.1f}",
        ]
    return cells


if __name__ == "__main__":
    main()
