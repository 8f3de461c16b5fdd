"""Adaptive clearing: is every run searched, and the default method faster than the first splines, the closed form and less effort?

    python -m benchmarks.judge.clearing [--passes N] [--seeds FIRST LAST] [--machine NAME]      into results/clearing.md and .json

CAM systems write such programs: hundreds of short passes of chords, each a run of its own, linked by small lifts; coordinates rounded
to 1 um, some points twice, some chords of a few um. Each program is planned with method `kinematic`, with effort "quick" and with the
defaults; the motion with which the search by default began is that along the first splines. A run that is not searched, or not to the
end, is said by the plan. Rows that are there are not made again by the same commit of the planner.
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.record import RESULTS, markdown, planner_state, write_results

ROWS = RESULTS / "clearing.json"
WAYS: dict[str, dict[str, Any]] = {
    "kinematic": {"method": "kinematic"},
    "quick": {"effort": "quick"},
    "default": {},
}
STOCK, DEPTH, LIFT = (
    30.0,
    -4.0,
    0.4,
)  # half the side of what is cleared, where it is cut, and how far a link is above that [mm]
RADIUS, SWEEP, CHORD = (2.0, 8.0), (0.4, 3.5), (0.04, 0.2)  # of a pass [mm], [rad], [mm]
BREATH = 0.04  # by which share of it the radius changes along a pass [-]
TWICE, TINY, TINY_STEP = 0.03, 0.02, 0.002  # shares of points that come twice, and once more so far away [mm]
PLUNGE, FEED = 350, 900  # [mm/min]


def clearing(passes: int, seed: int) -> str:
    """An NC program of so many passes."""
    rng = np.random.default_rng(seed)
    lines = ["G21 G90 G17 G94", "S9000 M3", "G0 Z5"]
    for _ in range(passes):
        center, radius, begin = (
            rng.uniform(-STOCK, STOCK, 2),
            rng.uniform(*RADIUS),
            rng.uniform(0.0, 2.0 * np.pi),
        )
        sweep = rng.uniform(*SWEEP) * rng.choice([-1.0, 1.0])
        angle = begin + np.linspace(0.0, sweep, max(int(abs(sweep) * radius / rng.uniform(*CHORD)), 3) + 1)
        far = radius * (1.0 + BREATH * np.cos(3.0 * (angle - begin)))
        points = center + far[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
        x, y = points[0]
        lines += [f"G0 X{x:.3f} Y{y:.3f} Z{DEPTH + LIFT:.3f}", f"G1 Z{DEPTH:.3f} F{PLUNGE}", f"F{FEED}"]
        for x, y in points[1:]:
            lines.append(f"G1 X{x:.3f} Y{y:.3f}")
            if rng.random() < TWICE:
                lines.append(f"G1 X{x:.3f} Y{y:.3f}")
            if rng.random() < TINY:
                dx, dy = rng.uniform(-TINY_STEP, TINY_STEP, 2)
                lines.append(f"G1 X{x + dx:.3f} Y{y + dy:.3f}")
        lines.append(f"G0 Z{DEPTH + LIFT:.3f}")
    return "\n".join([*lines, "G0 Z5", "M5", "M2", ""])


def planned(passes: int, seed: int, machine: str) -> dict[str, Any]:
    """The row of one program: cycle times [s], verdicts and processor seconds of the ways."""
    import planner
    from planner.feedrate.solution import Status
    from planner.planning.job.trace import Trace

    row: dict[str, Any] = {"passes": passes, "seed": seed, "machine": machine, "commit": planner_state()}
    with tempfile.TemporaryDirectory() as folder:
        program = Path(folder) / "clearing.ngc"
        program.write_text(clearing(passes, seed), encoding="utf-8")
        for way, settings in WAYS.items():
            began, trace = time.process_time(), Trace()
            plan = planner.plan(program, machine, log=trace, **settings).require()
            assert plan.verdict is not None
            row[way] = {
                "time": plan.cycle_time,
                "passed": plan.verdict.passed,
                "cpu": round(time.process_time() - began, 1),
                "said": plan.sentence,
                "first": max(
                    (step.before or 0.0 for step in trace.steps if step.name == "search"), default=0.0
                ),
                "whole": plan.status is Status.OPTIMAL,
            }
            row["blocks"] = len(plan.program)
    return row


OTHERS = ("first splines", "kinematic", "quick")  # motions beside the default's


def _others(row: dict[str, Any]) -> list[float]:
    """Times of the motions beside the default's [s], in the order of OTHERS; 0 where a row has none."""
    return [row["default"].get("first", 0.0), *(row[way]["time"] for way in OTHERS[1:])]


def table(rows: list[dict[str, Any]]) -> str:
    """What is written to results/clearing.md."""
    columns = ["passes", "seed", "blocks", *(f"{way} [s]" for way in WAYS)]
    columns += [*(f"{other} / default - 1" for other in OTHERS), "searched", "passed", "CPU [s]", "commit"]
    lines = [
        [
            *(f"{row[name]:,}" for name in ("passes", "seed", "blocks")),
            *(f"{row[way]['time']:.4f}" for way in WAYS),
            *(f"{time / row['default']['time'] - 1.0:+.1e}" if time else "" for time in _others(row)),
            {True: "every run", False: "not every run", None: ""}[row["default"].get("whole")],
            "all" if all(row[way]["passed"] for way in WAYS) else "not all",
            ", ".join(f"{row[way]['cpu']:g}" for way in WAYS),
            row["commit"],
        ]
        for row in rows
    ]
    return markdown(columns, lines)


def main() -> None:
    """Plan what is asked for; rows are written as they are made."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.judge.clearing")
    parser.add_argument("--passes", type=int, default=400)
    parser.add_argument("--seeds", type=int, nargs=2, default=(1, 20))
    parser.add_argument("--machine", default="mill")
    options = parser.parse_args()
    rows = json.loads(ROWS.read_text(encoding="utf-8"))["rows"] if ROWS.exists() else []
    state = planner_state()
    for seed in range(options.seeds[0], options.seeds[1] + 1):
        what = (options.passes, seed, options.machine)
        if any(
            (*(row[name] for name in ("passes", "seed", "machine")), row["commit"]) == (*what, state)
            for row in rows
        ):
            continue
        made = planned(*what)
        rows = [row for row in rows if (row["passes"], row["seed"], row["machine"]) != what] + [made]
        rows.sort(key=lambda row: (row["passes"], row["seed"]))
        write_results("clearing", {"rows": rows}, table(rows))


if __name__ == "__main__":
    main()
