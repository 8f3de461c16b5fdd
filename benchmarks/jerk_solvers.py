"""How good and how fast are the solvers with jerk limits? All of them on the same problems, in one run.

    python -m benchmarks.jerk_solvers [--only random copp curves growth] [--count N] [--solvers NAME ...] [--name RESULT]

    random   random_paths.random_path: 2 to 6 axes, 200 to 2000 points, jerk from tight to loose
    copp     random_paths.copp_spline: 7 axes, 1001 points, the test that the authors of copp publish
    curves   butterfly and trident at three jerk limits
    growth   the own kernel on paths of 1e3 to 1e6 points, each in a process of its own, so that peak memory is the path's

Times are processor times of `solve`, after one solve that is not counted and loads everything. Gaps are to ipopt's cycle time on the
same grid. ipopt, fatrop and the own kernel have one transcription, constant jerk in time on every interval (where the feed's bound
acts, ipopt's row between two points is a little stricter than the own kernel's); SequentialConvex ("convex") and copp have another,
where the acceleration goes along a given shape over arc length, so that part of their gap is the transcription. The worst ratio to a
limit at a grid point is that of the first three; copp's, with its own jerk, is in its sentence in the JSON file. Every problem's
results are written at once to benchmarks/results/jerk-solvers.json and .md.
"""

from __future__ import annotations

import argparse
import itertools
import multiprocessing
import statistics
import time
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks import copp_solver
from benchmarks.random_paths import COPP_TIME, copp_spline, long_path, nurbs, random_path
from benchmarks.record import markdown, write_results
from planner.constraints.problem import FeedrateProblem
from planner.feedrate.jerk.solver import JerkLimited
from planner.feedrate.reference.nlp import JerkLimitedNLP
from planner.feedrate.reference.sequential_convex import SequentialConvex
from planner.feedrate.solution import FeedrateSolver, constraint_ratios

REFERENCE = "ipopt"
SOLVERS: dict[str, FeedrateSolver] = {
    "own": JerkLimited(),
    REFERENCE: JerkLimitedNLP(),
    "fatrop": JerkLimitedNLP(solver="fatrop"),
    "convex": SequentialConvex(),
    "copp": copp_solver.CoppSocp(),
    "copp, 1 pass": copp_solver.CoppSocp(passes=1),
    "copp, LP": copp_solver.CoppSocp(linear=True),
}
CONSTANT_JERK = ("own", REFERENCE, "fatrop")  # on every interval; `constraint_ratios` reads these
QUICK = ("own", "copp", "copp, 1 pass")  # fast enough to be timed several times
REPEATS = 3  # of the quick ones; the median counts
SLOW, SLOW_COUNT = (
    ("fatrop", "convex"),
    20,
)  # ten to twenty seconds each: they get so many random problems of each kind
POINTS_MAX = {"fatrop": 1010}  # building its interface takes time that grows with the square of the points
COUNT = 100  # of the random problems
CURVES = [("trident", 300), ("trident", 1000), ("butterfly", 1000), ("butterfly", 2000)]
CURVE_JERKS = (2e4, 2e5, 2e6)  # [mm/s3]
WARM_UP = 200  # points of the path that every solver solves first
SIZES = (1_000, 10_000, 100_000, 1_000_000)
SETS = ("random", "copp", "curves", "growth")


@dataclass(frozen=True, kw_only=True)
class Row:
    """One solver on one problem; times are NaN where there is no solution."""

    set: str
    problem: str
    points: int
    axes: int
    solver: str
    status: str
    sentence: str
    cycle_s: float
    gap: float | None  # to the reference on the same problem [-]
    worst_limit: float | None  # at the grid points [-]
    us_per_point: float
    iterations: int


def main() -> None:
    """Run what is asked for and write the results."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--only", nargs="*", choices=SETS, default=SETS)
    parser.add_argument("--count", type=int, default=COUNT, help="random problems of each kind")
    parser.add_argument("--solvers", nargs="*", choices=tuple(SOLVERS), default=tuple(SOLVERS))
    parser.add_argument("--name", default="jerk-solvers", help="of the result")
    options = parser.parse_args()
    asked = [name for name in SOLVERS if name in options.solvers]
    missing = copp_solver.copp() is None and any(name.startswith("copp") for name in asked)
    if missing:
        print(copp_solver.INSTALL, flush=True)
        asked = [name for name in asked if not name.startswith("copp")]
    for name in asked:
        SOLVERS[name].solve(random_path(0, WARM_UP))
    notes = [copp_solver.INSTALL] if missing else []
    rows: list[Row] = []
    growth: list[dict[str, Any]] = []
    for kind, number, name, problem in _problems(options.only, options.count):
        able = [own for own in asked if own not in SLOW or number < SLOW_COUNT]
        rows += _compare(kind, name, problem, able)
        _write(options.name, rows, growth, notes)
    if "growth" in options.only:
        for size in SIZES:
            growth.append(_in_own_process(size))
            print(growth[-1], flush=True)
            _write(options.name, rows, growth, notes)


def _problems(kinds: list[str], count: int) -> Iterator[tuple[str, int, str, FeedrateProblem]]:
    """Set, number in it, name and problem of everything but growth."""
    if "random" in kinds:
        for seed in range(count):
            yield "random", seed, f"random {seed}", random_path(seed)
    if "copp" in kinds:
        for seed in range(count):
            yield "copp", seed, f"copp {seed}", copp_spline(seed)
    if "curves" in kinds:
        for number, ((name, points), jerk) in enumerate(itertools.product(CURVES, CURVE_JERKS)):
            yield "curves", number, f"{name} {points}, jerk {jerk:g}", nurbs(name, points, jerk)


def _compare(kind: str, name: str, problem: FeedrateProblem, solvers: list[str]) -> list[Row]:
    """All solvers on one problem."""
    rows = []
    reference = None
    for solver in sorted(solvers, key=lambda own: own != REFERENCE):
        if len(problem) > POINTS_MAX.get(solver, len(problem)):
            continue
        took = []
        for _ in range(REPEATS if solver in QUICK else 1):
            began = time.process_time()
            solution = SOLVERS[solver].solve(problem)
            took.append(time.process_time() - began)
        if solver == REFERENCE and solution.solved:
            reference = solution.cycle_time
        exact = solution.solved and solver in CONSTANT_JERK
        row = Row(
            set=kind,
            problem=name,
            points=len(problem),
            axes=len(problem.axes),
            solver=solver,
            status=solution.status.value,
            sentence=solution.sentence,
            cycle_s=solution.cycle_time,
            gap=solution.cycle_time / reference - 1.0 if reference and solution.solved else None,
            worst_limit=float(constraint_ratios(problem, solution)[0].max()) if exact else None,
            us_per_point=1e6 * statistics.median(took) / len(problem),
            iterations=solution.iterations,
        )
        rows.append(row)
        gap = "" if row.gap is None else f" gap {row.gap:+.2e}"
        print(
            f"{name}, {row.points} points, {solver}: {row.status}, {row.cycle_s:.6f} s{gap}, "
            f"{row.us_per_point:.0f} us per point, {row.iterations} iterations",
            flush=True,
        )
    return rows


def _in_own_process(size: int) -> dict[str, Any]:
    """The own kernel on one long path."""
    context = multiprocessing.get_context("spawn")
    receive, send = context.Pipe(duplex=False)
    process = context.Process(target=_grow, args=(send, random_path(0, WARM_UP), long_path(size)))
    process.start()
    send.close()
    try:
        found: dict[str, Any] = receive.recv()
    except EOFError:
        process.join()
        found = {"points": size, "status": f"the process ended with {process.exitcode}"}
    process.join()
    return found


def _grow(pipe: Connection, warm_up: FeedrateProblem, problem: FeedrateProblem) -> None:
    """Solve a long path once, after a small one; peak memory before and after the solve [GB]."""
    solver = JerkLimited()
    solver.solve(warm_up)
    before = _peak_memory()
    began = time.process_time()
    solution = solver.solve(problem)
    took = time.process_time() - began
    peak = _peak_memory()
    ratio = float(constraint_ratios(problem, solution)[0].max()) if solution.solved else None
    pipe.send(
        {
            "points": len(problem),
            "status": solution.status.value,
            "sentence": solution.sentence,
            "cycle_s": solution.cycle_time,
            "worst_limit": ratio,
            "took_s": took,
            "us_per_point": 1e6 * took / len(problem),
            "iterations": solution.iterations,
            "problem_gb": before,
            "peak_gb": peak,
        }
    )


def _peak_memory() -> float:
    """Of this process since its program began [GB]; ru_maxrss would count what its parent had at that moment. Linux only."""
    status = Path("/proc/self/status").read_text(encoding="ascii")
    return float(status.split("VmHWM:")[1].split()[0]) / 1e6


def _write(name: str, rows: list[Row], growth: list[dict[str, Any]], notes: list[str]) -> None:
    """Everything so far: a kill loses nothing."""
    data = {
        "solvers": {key: repr(solver) for key, solver in SOLVERS.items()},
        "notes": notes,
        "rows": [asdict(row) for row in rows],
        "growth": growth,
    }
    text = "".join(f"{note}\n\n" for note in notes) + _summary(rows) + _details(rows) + _growth(growth)
    write_results(name, data, text)


def _summary(rows: list[Row]) -> str:
    """A table of each set: how many are solved, how fast, how good."""
    text = ""
    for kind in dict.fromkeys(row.set for row in rows):
        lines = []
        for solver in SOLVERS:
            own = [row for row in rows if row.set == kind and row.solver == solver]
            if not own:
                continue
            solved = [row for row in own if np.isfinite(row.cycle_s)]
            gaps = [row.gap for row in own if row.gap is not None]
            speed = [row.us_per_point for row in own]
            worst = [row.worst_limit for row in own if row.worst_limit is not None]
            lines.append(
                [
                    solver,
                    f"{sum(row.status == 'optimal' for row in own)} + {sum(row.status == 'acceptable' for row in own)} of {len(own)}",
                    f"{statistics.mean(row.cycle_s for row in solved):.4f}" if solved else "",
                    f"{statistics.median(gaps):+.1e}" if gaps else "",
                    f"{min(gaps):+.1e} .. {max(gaps):+.1e}" if gaps else "",
                    f"{max(worst):.7f}" if worst else "",
                    f"{statistics.median(speed):.1f}",
                    f"{max(speed):.1f}",
                    f"{statistics.median(row.iterations for row in own):.0f}",
                    f"{max(row.iterations for row in own)}",
                ]
            )
        columns = [
            "solver", "optimal + acceptable", "mean cycle [s]", "gap, median", "gap, range", "worst limit",
            "us per point, median", "worst", "iterations, median", "most",
        ]  # fmt: skip
        text += f"## {kind}\n\n{markdown(columns, lines)}\n"
        if kind == "copp":
            text += f"Published by copp for TOPP3-SOCP with one pass: mean cycle time {COPP_TIME:.4f} s on 100 such splines.\n\n"
    return text


def _details(rows: list[Row]) -> str:
    """Every curve, and every problem of the other sets that a solver did not solve to optimality."""
    shown = [row for row in rows if row.set == "curves" or row.status != "optimal"]
    shown = [row for row in shown if row.solver != "copp, 1 pass" or row.set == "curves"]
    if not shown:
        return ""
    lines = [
        [
            row.problem,
            f"{row.points}",
            row.solver,
            f"{row.cycle_s:.6f}",
            "" if row.gap is None else f"{row.gap:+.2e}",
            f"{row.us_per_point:.1f}",
            f"{row.iterations}",
            row.status if row.status == "optimal" else f"{row.status}: {row.sentence}",
        ]
        for row in shown
    ]
    columns = ["problem", "points", "solver", "cycle [s]", "gap", "us per point", "iterations", "status"]
    return f"## curves, and what was not solved to optimality\n\n{markdown(columns, lines)}\n"


def _growth(growth: list[dict[str, Any]]) -> str:
    """The own kernel on long paths."""
    if not growth:
        return ""
    lines = [
        [
            f"{row['points']:,}",
            f"{row['took_s']:.2f}",
            f"{row['us_per_point']:.2f}",
            f"{row['iterations']}",
            f"{row['cycle_s']:.4f}",
            f"{row['worst_limit']:.7f}" if row["worst_limit"] else "",
            f"{row['problem_gb']:.2f}, {row['peak_gb']:.2f}",
            row["status"],
        ]
        if "took_s" in row
        else [f"{row['points']:,}", *[""] * 6, row["status"]]
        for row in growth
    ]
    columns = [
        "points", "solve [s]", "us per point", "iterations", "cycle [s]", "worst limit",
        "memory before, peak [GB]", "status",
    ]  # fmt: skip
    return f"## own kernel on long paths of 3 axes\n\n{markdown(columns, lines)}"


if __name__ == "__main__":
    main()
