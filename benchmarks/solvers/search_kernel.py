"""What the search kernel takes per step and iteration: one thread, on the windows that plans of some jobs ask for.

    python -m benchmarks.solvers.search_kernel [--job NAME ...] [--windows N] [--passes N]    into results/search-kernel.json and .md

Every window that a plan asks for is written down. The longest ones are then solved again, processor seconds, the least of some
passes: on single numbers; four of the same side by side in lanes, where none waits for another; and one of
these groups with a single window in it; none where none can be in lanes (joint/window_solver.py). Reading
windows into the kernel's memory and back is in all of it. The same is told of the longest windows of `SHORT` steps at most, whose
group takes less memory: so many bytes a step and window.
"""

from __future__ import annotations

import argparse
import math
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import planner
from benchmarks.cost.growth import relief
from benchmarks.jobs import problems
from benchmarks.record import markdown, write_results
from planner.base.lanes import WIDTH
from planner.base.threads import use_threads
from planner.joint import groups
from planner.joint.group import group_of
from planner.joint.memory import work_of
from planner.joint.window_solver import Asked, kind_of, solve_windows
from planner.machine import Machine, load_machine
from planner.nc.program import Program
from planner.nc.reader import parse_program, read_program

SHORT = 250  # steps
EXAMPLE = Path(planner.__file__).parent / "examples" / "bracket.ngc"


def jobs() -> dict[str, Callable[[], tuple[Program, Machine]]]:
    """Program and machine of each job."""
    mill = load_machine("mill")
    return {
        "zig-zag, lines": lambda: (problems.zigzag(200), mill),
        "relief 2,000": lambda: (parse_program(relief(2_000), mill), mill),
        "arcs": lambda: (problems.arcs(), problems.machine()),
        "bracket": lambda: (read_program(str(EXAMPLE), mill), mill),
        "five axes": lambda: (problems.five_points(), problems.five_points_machine()),
    }


def copy_of(asked: Asked) -> Asked:
    """The same window to be solved once more."""
    window = asked.window
    fresh = {name: getattr(window, name).copy() for name in ("x", "u", "place")}
    return asked._replace(window=window._replace(**fresh))


def windows_of(program: Program, machine: Machine) -> list[Asked]:
    """The windows that a plan asks for, as they were asked for."""
    seen, usual = list[Asked](), groups.solve_windows

    def solve(asked: list[Asked], width: int) -> Any:
        seen.extend(copy_of(one) for one in asked)
        return usual(asked, width)

    groups.solve_windows = solve
    try:
        planner.plan(program, machine)
    finally:
        groups.solve_windows = usual
    return seen


def least(asked: list[Asked], width: int, passes: int) -> float:
    """Processor seconds per step and iteration of windows that are solved `width` at a time, the least of some passes [s]."""
    took = []
    for turn in range(passes + 1):
        copies = [copy_of(one) for one in asked]
        began = time.process_time()
        solved = solve_windows(copies, width)
        seconds = time.process_time() - began
        work = sum(len(one.window.u) * each.iterations for one, each in zip(asked, solved, strict=True))
        if turn:  # the first one may compile
            took.append(seconds / work)
    return min(took)


def bytes_of(asked: Asked) -> float:
    """Memory of a group of windows like this one, per step and window [B]."""
    sizes, group, motion, _, _ = group_of([asked.window] * WIDTH, [asked.tuning] * WIDTH, WIDTH)
    arrays = [*group, *motion, *work_of(sizes, group)]
    # tangents of lines are their drifts
    kept = {one.__array_interface__["data"][0]: one.nbytes for one in arrays}
    return sum(kept.values()) / (sizes.steps * WIDTH)


def mean(values: list[float]) -> float:
    """Of these; NaN of none."""
    return sum(values) / len(values) if values else math.nan


def measured(name: str, windows: int, passes: int) -> dict[str, Any]:
    """One job."""
    use_threads(1)
    seen = windows_of(*jobs()[name]())
    longest = sorted(seen, key=lambda one: -len(one.window.u))[:windows]
    straight = [one for one in longest if kind_of(one) is not None]
    single = 1e6 * mean([least([one], 1, passes) for one in longest])
    lanes = 1e6 * mean([least([one] * WIDTH, WIDTH, passes) for one in straight])
    alone = 1e6 * mean([least([one], WIDTH, passes) for one in straight])
    short = [one for one in seen if kind_of(one) is not None and len(one.window.u) <= SHORT]
    short = sorted(short, key=lambda one: -len(one.window.u))[:windows]
    of_short = 1e6 * mean([least([one] * WIDTH, WIDTH, passes) for one in short])
    return {
        "job": name,
        "axes": longest[0].window.u.shape[1] - 1,
        "windows": len(seen),
        "steps": len(longest[0].window.u),
        "us_lanes": lanes,
        "us_alone": alone,
        "us_single": single,
        "us_short": of_short,
        "bytes": bytes_of(straight[0]) if straight else math.nan,
    }


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--job", nargs="+", default=list(jobs()), choices=list(jobs()))
    parser.add_argument("--windows", type=int, default=4, help="of the longest, how many are solved again")
    parser.add_argument("--passes", type=int, default=3)
    asked = parser.parse_args()
    rows = []
    for name in asked.job:
        rows.append(measured(name, asked.windows, asked.passes))
        print(rows[-1], flush=True)
    columns = [
        "job",
        "axes",
        "windows",
        "steps of the longest",
        "us, single numbers",
        "us, four in lanes",
        "us, one in lanes",
        f"us, four in lanes, of {SHORT} steps at most",
        "bytes a step",
    ]
    table = [
        [
            row["job"],
            str(row["axes"]),
            f"{row['windows']:,}",
            f"{row['steps']:,}",
            *(
                "-" if math.isnan(row[name]) else f"{row[name]:{form}}"
                for name, form in (
                    *((f"us_{kind}", ".2f") for kind in ("single", "lanes", "alone", "short")),
                    ("bytes", ",.0f"),
                )
            ),
        ]
        for row in rows
    ]
    write_results("search-kernel", {"rows": rows}, markdown(columns, table))


if __name__ == "__main__":
    main()
