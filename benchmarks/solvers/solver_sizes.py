"""Up to which size is each solver with jerk limits sensible? All of them on one kind of path, shorter and longer.

    python -m benchmarks.solvers.solver_sizes [--solvers NAME ...] [--sizes POINTS ...] [--most SECONDS]

The paths are quintic splines in 3 axes (random_paths.long_path), one piece from rest to rest, so that a piece is as long as the
problem: the worst case for solvers whose cost grows faster than the points. Times are processor times of one solve, after one that is
not counted. A solver that took more than `--most` seconds gets no larger path. Refusals by size (`points_max`) are switched off.
"""

from __future__ import annotations

import argparse
import dataclasses
import time
from typing import Any

from benchmarks.record import markdown, write_results
from benchmarks.solvers import copp_solver
from benchmarks.solvers.random_paths import long_path
from benchmarks.solvers.sequential_convex import ExactMotion, SequentialConvex
from planner.feedrate.solvers import OWN, THIRD_ORDER, ThirdOrderSolver

SIZES = (300, 1_000, 3_000, 10_000)
WARM_UP = 200  # points
MOST = 60.0  # [s]
NO_LIMIT = 10**9


def main() -> None:
    """Run what is asked for and write the results."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    every = _solvers()
    parser.add_argument("--solvers", nargs="*", choices=tuple(every), default=tuple(every))
    parser.add_argument("--sizes", nargs="*", type=int, default=SIZES)
    parser.add_argument("--most", type=float, default=MOST, help="seconds after which no larger path follows")
    options = parser.parse_args()
    solvers = {name: every[name] for name in (OWN, *options.solvers)}
    for solver in solvers.values():
        solver.solve(long_path(WARM_UP))
    rows: list[dict[str, Any]] = []
    for size in options.sizes:
        problem = long_path(size)
        for name, solver in list(solvers.items()):
            began = time.process_time()
            solution = solver.solve(problem)
            took = time.process_time() - began
            own = next((row["cycle_s"] for row in rows if row["solver"] == OWN and row["size"] == size), None)
            rows.append(
                {
                    "size": size,
                    "points": len(problem),
                    "solver": name,
                    "status": solution.status.value,
                    "sentence": solution.sentence,
                    "cycle_s": solution.cycle_time,
                    "to_own": solution.cycle_time / own - 1.0 if own else 0.0,
                    "took_s": took,
                    "iterations": solution.iterations,
                }
            )
            print(rows[-1], flush=True)
            if took > options.most:
                del solvers[name]
        write_results("solver-sizes", {"rows": rows}, _table(rows))


def _solvers() -> dict[str, ThirdOrderSolver]:
    """The planner's, and where it is installed the package copp."""
    others = {"sequential-convex": ExactMotion(solver=SequentialConvex())}
    found = {name: _unlimited(solver) for name, solver in (THIRD_ORDER | others).items()}
    if copp_solver.copp() is None:
        print(copp_solver.INSTALL, flush=True)
        return found
    return found | {"copp": copp_solver.CoppSocp(), "copp, LP": copp_solver.CoppSocp(linear=True)}


def _unlimited(solver: ThirdOrderSolver) -> ThirdOrderSolver:
    """The solver without its largest size."""
    if isinstance(solver, ExactMotion):
        return dataclasses.replace(solver, solver=dataclasses.replace(solver.solver, points_max=NO_LIMIT))
    if hasattr(solver, "points_max"):
        return dataclasses.replace(solver, points_max=NO_LIMIT)  # type: ignore[type-var]
    return solver


def _table(rows: list[dict[str, Any]]) -> str:
    columns = ["points", "solver", "status", "time [s]", "us per point", "iterations", "cycle time to own's"]
    lines = [
        [
            f"{row['points']:,}",
            row["solver"],
            row["status"],
            f"{row['took_s']:.3g}",
            f"{1e6 * row['took_s'] / row['points']:.0f}",
            f"{row['iterations']}",
            f"{row['to_own']:+.1e}",
        ]
        for row in rows
    ]
    return markdown(columns, lines)


if __name__ == "__main__":
    main()
