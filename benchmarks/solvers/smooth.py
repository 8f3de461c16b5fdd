"""What less jerk costs: `smooth` of method `optimal` from 0 to 0.3, on jobs that run at their feed and on others.

    python -m benchmarks.solvers.smooth

The jobs are those of joint.py. Of each: cycle time, and the RMS of the setpoints' jerk as a share of the limits, both relative to
smooth = 0. Results: benchmarks/results/smooth.json and .md.
"""

from __future__ import annotations

import numpy as np

import planner
from benchmarks.jobs.searched import jobs
from benchmarks.record import markdown, write_results

WEIGHTS = (0.0, 0.003, 0.01, 0.03, 0.1, 0.3)
TEXT = (
    "Cycle time and RMS jerk over its limits without `--smooth`; then, by its weight, how much more time the motion takes, and its\n"
    "RMS jerk over that without.\n\n"
)
NAMES = ("pentagon, mill", "zig-zag, mill", "pentagon, peers", "circle, peers")


def measured(plan: planner.Plan) -> tuple[float, float]:
    """Cycle time [s] and RMS jerk as a share of the limits [-]."""
    seen = plan.require().trajectory
    limits = plan.machine.limits("jerk", plan.toolpath.axes)
    return seen.cycle_time, float(np.sqrt(np.mean((seen.jerk / limits) ** 2)))


def main() -> None:
    rows: list[list[str]] = []
    for name, (program, machine) in jobs().items():
        if name not in NAMES:
            continue
        made = [measured(planner.plan(program(), machine, smooth=weight)) for weight in WEIGHTS]
        (time, jerk), cells = made[0], []
        for slower, less in made[1:]:
            cells.append(f"+{100.0 * (slower / time - 1.0):.2g} %, {less / jerk:.2f}")
        rows.append([name, f"{time:.6g}", f"{jerk:.3f}", *cells])
        print(*rows[-1], flush=True)
    columns = ["job", "time [s]", "RMS jerk [-]", *(f"{weight:g}" for weight in WEIGHTS[1:])]
    write_results("smooth", {"columns": columns, "rows": rows}, TEXT + markdown(columns, rows))


if __name__ == "__main__":
    main()
