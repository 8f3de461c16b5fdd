"""How fast are the second-order solvers? Time per grid point of both on the same problems, and the own kernel's growth with size.

python -m benchmarks.solver_speed        writes benchmarks/results/solver-speed.json and .md
"""

from __future__ import annotations

import argparse
import json
import platform
import statistics
import subprocess
import time
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks import problems
from planner.constraints.assemble import feedrate_problem
from planner.constraints.problem import FeedrateProblem
from planner.corners.bezier import BezierCorner
from planner.corners.smooth import round_corners
from planner.feedrate.reachability import Reachability
from planner.feedrate.solution import FeedrateSolver
from planner.feedrate.toppra_adapter import ToppraSolver
from planner.geometry.build import toolpath_from_program
from planner.nc.program import Program
from planner.path.samples import sample_path

COMMAND = "python -m benchmarks.solver_speed"
RESULTS = Path(__file__).resolve().parent / "results"
SOLVERS: tuple[FeedrateSolver, ...] = (Reachability(), ToppraSolver())
SEED = 20
SIZES = (10_000, 100_000, 1_000_000, 2_000_000)


def problem_of(program: Program) -> FeedrateProblem:
    machine = problems.machine()
    toolpath = toolpath_from_program(program, machine)
    return feedrate_problem(sample_path(round_corners(toolpath, machine, BezierCorner()), machine), machine)


def repeated(problem: FeedrateProblem, times: int) -> FeedrateProblem:
    """The same path again and again, one piece each: a long job with full stops."""
    points, pieces = len(problem), len(problem.piece) - 1
    lap = problem.s[-1] * np.arange(times)
    tiled = {
        name: np.tile(getattr(problem, name), (times, 1))
        for name in ("d1", "d2_left", "d2_right", "d3_left", "d3_right")
    } | {name: np.tile(getattr(problem, name), times) for name in ("feed_sq_max", "feed_sq_bound", "margin")}
    return FeedrateProblem(
        piece=np.append((problem.piece[:-1] + points * np.arange(times)[:, None]).ravel(), points * times),
        s=(problem.s + lap[:, None]).ravel(),
        axes=problem.axes,
        velocity=problem.velocity,
        acceleration=problem.acceleration,
        jerk=problem.jerk,
        bound_names=problem.bound_names,
        feed_sq_start=np.zeros(pieces * times),
        feed_sq_end=np.zeros(pieces * times),
        **tiled,
    )


def timed(call: Callable[[], Any], repeats: int) -> tuple[float, float]:
    """Median and worst processor time of a call [s], after one that is not counted: both solvers run on one core, and
    processor time does not see what else the machine does."""
    call()
    took = []
    for _ in range(repeats):
        began = time.process_time()
        call()
        took.append(time.process_time() - began)
    return statistics.median(took), max(took)


def compare(repeats: int) -> list[dict[str, Any]]:
    """Both solvers on every shared job and on a random walk in three dimensions."""
    jobs = problems.all_jobs()
    jobs["random walk"] = problems.random_polyline(np.random.default_rng(SEED), blocks=60)
    rows = []
    for name, program in jobs.items():
        problem = problem_of(program)
        for solver in SOLVERS:
            solution = solver.solve(problem)
            median, worst = timed(lambda s=solver, p=problem: s.solve(p), repeats)
            rows.append(
                {
                    "job": name,
                    "grid_points": len(problem),
                    "solver": repr(solver),
                    "status": solution.status.name,
                    "cycle_time_s": solution.cycle_time,
                    "median_us_per_point": 1e6 * median / len(problem),
                    "worst_us_per_point": 1e6 * worst / len(problem),
                }
            )
    return rows


def growth(repeats: int) -> list[dict[str, Any]]:
    """The own kernel on longer and longer jobs."""
    base = problem_of(problems.random_polyline(np.random.default_rng(SEED), blocks=60))
    rows = []
    for size in SIZES:
        problem = repeated(base, max(1, round(size / len(base))))
        median, worst = timed(lambda p=problem: Reachability().solve(p), repeats)
        rows.append(
            {
                "grid_points": len(problem),
                "median_s": median,
                "worst_s": worst,
                "median_us_per_point": 1e6 * median / len(problem),
            }
        )
    return rows


def table(report: dict[str, Any]) -> str:
    """The report as Markdown."""
    lines = [
        "# Speed of the second-order solvers (processor time)",
        "",
        f"Made by `{report['command']}` at commit {report['commit']}, seed {report['seed']}, {report['repeats']} repeats, "
        f"one core of {report['machine']}; {', '.join(f'{k} {v}' for k, v in report['versions'].items())}.",
        "",
        f"Reachability is {report['ratio_median']:.0f} times faster per grid point than toppra in the median over the jobs, "
        f"{report['ratio_worst']:.0f} times on the worst one (target: 30).",
        "",
        "| job | grid points | solver | cycle time [s] | median [us/point] | worst [us/point] |",
        "|---|--:|---|--:|--:|--:|",
    ]
    for row in report["comparison"]:
        lines.append(
            f"| {row['job']} | {row['grid_points']:,} | {row['solver']} | {row['cycle_time_s']:.6f} "
            f"| {row['median_us_per_point']:.3f} | {row['worst_us_per_point']:.3f} |"
        )
    lines += [
        "",
        "The own kernel on longer jobs:",
        "",
        "| grid points | median [s] | worst [s] | median [us/point] |",
    ]
    lines.append("|--:|--:|--:|--:|")
    for row in report["growth"]:
        lines.append(
            f"| {row['grid_points']:,} | {row['median_s']:.4f} | {row['worst_s']:.4f} | {row['median_us_per_point']:.3f} |"
        )
    return "\n".join(lines) + "\n"


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--repeats", type=int, default=5, help="timed runs of each solve")
    repeats = parser.parse_args().repeats
    comparison = compare(repeats)
    own, other = (
        np.array([row["median_us_per_point"] for row in comparison if row["solver"] == repr(solver)])
        for solver in SOLVERS
    )
    commit = subprocess.run(
        ["git", "rev-parse", "--short", "HEAD"], cwd=RESULTS.parent, capture_output=True, text=True
    )
    report = {
        "command": COMMAND,
        "commit": commit.stdout.strip() or "unknown",
        "seed": SEED,
        "repeats": repeats,
        "machine": f"{platform.system()} {platform.machine()}",
        "versions": {"python": platform.python_version()}
        | {name: version(name) for name in ("numpy", "numba", "toppra")},
        "ratio_median": float(np.median(other / own)),
        "ratio_worst": float((other / own).min()),
        "comparison": comparison,
        "growth": growth(repeats),
    }
    RESULTS.mkdir(exist_ok=True)
    (RESULTS / "solver-speed.json").write_text(json.dumps(report, indent=2) + "\n", encoding="utf-8")
    (RESULTS / "solver-speed.md").write_text(table(report), encoding="utf-8")
    print(table(report))


if __name__ == "__main__":
    main()
