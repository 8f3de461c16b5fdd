"""What the jerk-limited solver takes per grid point, and where: one thread, on paths of some 1,000 to 100,000 points.

    python -m benchmarks.solvers.jerk_kernel [--job NAME ...] [--passes N] [--against TREE]      into results/jerk-kernel.json and .md

A job is a program laid under splines and sampled as `optimal` does it; only `JerkLimited.solve` is timed, on a problem that is there
already: processor seconds, the least of some passes. The parts are those of the solver's Python functions, timed around each call. An
iteration's cost is that of `minimise_time` divided by the intervals of all windows times their iterations; the overlap is how many
intervals were solved for one of the path. With `--against` another tree of this project, each pass is run there too, in turns and in a
process of its own, and the ratios of the two are in the table.
"""

from __future__ import annotations

import argparse
import importlib
import json
import os
import subprocess
import sys
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

from benchmarks.cost.growth import relief
from benchmarks.jobs import problems
from benchmarks.record import ROOT, markdown, write_results
from planner.base.threads import use_threads
from planner.corners.bezier import BezierCorner
from planner.corners.smooth import round_corners
from planner.feedrate.constraints.assemble import feedrate_problem
from planner.feedrate.constraints.problem import FeedrateProblem
from planner.feedrate.grid import refine_for_jerk
from planner.feedrate.jerk.solver import JerkLimited
from planner.feedrate.sampling.samples import sample_path
from planner.geometry.build import toolpath_from_program
from planner.machine import Machine, load_machine
from planner.nc.program import Program
from planner.nc.reader import parse_program, read_program
from planner.planning.optimal.geometry import splined_with_stops
from planner.smoothing.spline_path import with_spline

# Parts of a solve: functions of Python by module, timed around each call.
PARTS = {
    "start": (
        "planner.feedrate.jerk.window",
        ("envelope", "envelope_profile", "plain_start", "slower_by", "jerk_of"),
    ),
    "track": ("planner.feedrate.jerk.window", ("track",)),
    "blocks": ("planner.feedrate.jerk.layout", ("_fill", "_jumps")),
    "result": ("planner.feedrate.jerk.window", ("_found",)),
    "iterate": ("planner.feedrate.jerk.window", ("minimise_time",)),
}


def jobs() -> dict[str, Callable[[], tuple[Program, Machine, float]]]:
    """Program, machine and resolution of the grid of each job."""
    mill = load_machine("mill")
    bracket = str(ROOT / "planner" / "examples" / "bracket.ngc")
    return {
        "bracket": lambda: (read_program(bracket, mill), mill, 2e-4),
        "spiral": lambda: (problems.star_spiral(), problems.machine(), 2e-4),
        "relief 2,000": lambda: (parse_program(relief(2_000), mill), mill, 5e-4),
        "relief 10,000": lambda: (parse_program(relief(10_000), mill), mill, 2e-3),
    }


def problem_of(program: Program, machine: Machine, resolution: float) -> FeedrateProblem:
    """The third-order problem of a program under splines."""
    toolpath = toolpath_from_program(program, machine)
    rounded = round_corners(toolpath, machine, BezierCorner(), blend_tangents=True)
    rounded, shape = splined_with_stops(rounded, machine, True)
    samples = sample_path(with_spline(rounded, shape), machine, resolution, third_order=True)
    return feedrate_problem(refine_for_jerk(samples, machine), machine, measured=True)


def measured(name: str, passes: int) -> dict[str, Any]:
    """One job: counts, and the least processor seconds of the solve and of its parts."""
    problem = problem_of(*jobs()[name]())
    use_threads(1)
    solver, clock = JerkLimited(), _Clock()
    solution = solver.solve(problem)
    rows = []
    for _ in range(passes):
        began = time.process_time()
        solver.solve(problem)
        rows.append(time.process_time() - began)
    with clock:
        solver.solve(problem)
    points = len(problem)
    return {
        "job": name,
        "points": points,
        "axes": len(problem.axes),
        "cycle_time": solution.cycle_time,
        "us_per_point": 1e6 * min(rows) / points,
        "windows": solution.effort["windows"],
        "iterations": clock.iterations / solution.effort["windows"],
        "overlap": clock.intervals / points,
        "us_per_interval_iteration": 1e6 * clock.took["iterate"] / clock.work,
        "share": {part: took / sum(clock.took.values()) for part, took in clock.took.items()},
    }


class _Clock:
    """Processor seconds of `PARTS` and counts of windows, as a context."""

    def __init__(self) -> None:
        self.took = dict.fromkeys([*PARTS, "else"], 0.0)
        self.iterations = self.intervals = self.work = 0
        self._usual: list[tuple[Any, str, Any]] = []

    def __enter__(self) -> None:
        for part, (module, names) in PARTS.items():
            owner = importlib.import_module(module)
            for name in names:
                if hasattr(owner, name):
                    usual = getattr(owner, name)
                    self._usual.append((owner, name, usual))
                    setattr(owner, name, partial(self._timed, part, usual))
        self._began = time.process_time()

    def __exit__(self, *_: object) -> None:
        self.took["else"] = time.process_time() - self._began - sum(self.took.values())
        for owner, name, usual in self._usual:
            setattr(owner, name, usual)

    def _timed(self, part: str, usual: Callable[..., Any], *args: Any) -> Any:
        began = time.process_time()
        found = usual(*args)
        self.took[part] += time.process_time() - began
        if part == "iterate":
            self.iterations += found[1]
            self.intervals += args[0].n
            self.work += args[0].n * found[1]
        return found


def elsewhere(tree: Path, name: str, passes: int) -> dict[str, Any]:
    """The same in a process of another tree, with this script."""
    code = f"import json; from benchmarks.solvers.jerk_kernel import measured; print(json.dumps(measured({name!r}, {passes})))"
    env = os.environ | {"PYTHONPATH": str(tree)}
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=tree, env=env, capture_output=True, text=True, check=True
    )
    return json.loads(done.stdout.splitlines()[-1])


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--job", nargs="+", default=list(jobs()), choices=list(jobs()))
    parser.add_argument("--passes", type=int, default=5)
    parser.add_argument("--against", type=Path, help="another tree of this project, with this script in it")
    asked = parser.parse_args()
    rows = []
    for name in asked.job:
        here = elsewhere(ROOT, name, asked.passes)
        if asked.against is not None:
            there = elsewhere(asked.against.resolve(), name, asked.passes)
            again = elsewhere(ROOT, name, asked.passes)
            here = min(here, again, key=lambda row: row["us_per_point"])
            here["ratio"] = here["us_per_point"] / there["us_per_point"]
            here["slower_motion"] = here["cycle_time"] / there["cycle_time"] - 1.0
        rows.append(here)
        print(here, flush=True)
    table = [
        [
            row["job"],
            f"{row['points']:,}",
            f"{row['us_per_point']:.2f}",
            f"{row['ratio']:.2f}" if "ratio" in row else "",
            f"{row['slower_motion']:+.1e}" if "ratio" in row else "",
            f"{row['iterations']:.1f}",
            f"{row['overlap']:.3f}",
            f"{row['us_per_interval_iteration']:.3f}",
            *(f"{row['share'][part]:.0%}" for part in [*PARTS, "else"]),
        ]
        for row in rows
    ]
    columns = [
        "job",
        "points",
        "us per point",
        "ratio",
        "motion",
        "iterations",
        "overlap",
        "us per iteration",
        *PARTS,
        "else",
    ]
    write_results(
        "jerk-kernel", {"against": str(asked.against or ""), "rows": rows}, markdown(columns, table)
    )


if __name__ == "__main__":
    main()
