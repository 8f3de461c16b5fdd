"""A five-axis program with the tool centre point on, planned at the tip and judged in the joints.

    python -m benchmarks.judge.tool_point PROGRAM [-m MACHINE] [--limit SECONDS] [--effort EFFORT]

Each method plans in a process of its own, which is ended at the limit: that is its outcome then. The program is LinuxCNC's
impeller-7bl-xyzac.ngc (M428 on its line 4), the machine mill-xyzac-trt.toml beside it.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import planner
from benchmarks.record import markdown, write_results
from planner.verifier import Verdict

MACHINE = Path(__file__).parents[1] / "programs" / "mill-xyzac-trt.toml"
METHODS = ("second-order", "optimal")
LIMIT = 720.0  # [s]
SHARES_SHOWN = 5


def main() -> None:
    """Plan with all methods, or with one in this process; write results/tool-point.json and .md."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("program", type=Path)
    parser.add_argument("-m", "--machine", default=str(MACHINE))
    parser.add_argument("--limit", type=float, default=LIMIT)
    parser.add_argument("--effort", default="normal")
    parser.add_argument("--one", choices=METHODS, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.one:
        print(json.dumps(_planned(options.program, options.machine, options.one, options.effort)))
        return
    rows = [_apart(options, method) for method in METHODS]
    text = _table(rows)
    print(text)
    write_results("tool-point", {"program": options.program.name, "methods": rows}, text)


def _apart(options: argparse.Namespace, method: str) -> dict[str, Any]:
    """A plan in a process of its own, in numbers."""
    command = [
        sys.executable,
        "-m",
        "benchmarks.judge.tool_point",
        str(options.program),
        "-m",
        options.machine,
    ]
    command += ["--one", method, "--effort", options.effort]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=options.limit, check=False)
    except subprocess.TimeoutExpired:
        return {"method": method, "outcome": f"ended after {options.limit:g} s"}
    if done.returncode:
        return {"method": method, "outcome": done.stderr.strip().splitlines()[-1]}
    found: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    return found


def _planned(program: Path, machine: str, method: str, effort: str) -> dict[str, Any]:
    began = time.perf_counter()
    plan = planner.plan(program, machine, method=method, effort=effort)
    seconds = time.perf_counter() - began
    if plan.verdict is None:
        return {"method": method, "outcome": plan.sentence, "planning_s": seconds}
    return {
        "method": method,
        "outcome": "passed" if plan.verdict.passed else "failed",
        "cycle_time_s": plan.cycle_time,
        "stop_time_s": plan.stop_time,
        "blocks": len(plan.program),
        "setpoints": len(plan.trajectory or ()),
        "grid_points": plan.grid_points,
        "planning_s": seconds,
        "timings_s": plan.timings,
        "contour_error_mm": plan.verdict.contour_error_mm,
        "tip_error_mm": plan.verdict.linear_error_mm,
        "angle_error_deg": plan.verdict.angle_error_deg,
        "shares": _shares(plan.verdict),
        "held_by": [] if plan.grid is None else plan.grid.ranked()[:SHARES_SHOWN],
        "faults": plan.verdict.sentences[:3],
        "notes": plan.notes,
    }


def _shares(verdict: Verdict) -> dict[str, float]:
    """The largest share of each limit that the joints use."""
    return {name: check.ratio for name, check in verdict.limits.items() if check.limited}


def _table(rows: list[dict[str, Any]]) -> str:
    columns = [
        "method",
        "verdict",
        "motion [s]",
        "a stop at every block [s]",
        "tip error [µm]",
        "angle error [°]",
        "planning [s]",
    ]
    lines = []
    for row in rows:
        found = [row["method"], row["outcome"]]
        if "cycle_time_s" in row:
            tip, angle = row["tip_error_mm"], row["angle_error_deg"]
            found += [
                f"{row['cycle_time_s']:,.2f}",
                f"{row['stop_time_s']:,.1f}",
                "-" if tip is None else f"{1e3 * tip:.2f}",
                "-" if angle is None else f"{angle:.4f}",
                f"{row['planning_s']:.0f}",
            ]
        lines.append(found + [""] * (len(columns) - len(found)))
    text = markdown(columns, lines)
    for row in rows:
        if "shares" in row:
            most = sorted(row["shares"].items(), key=lambda pair: -pair[1])
            text += f"\nLargest shares of the limits, {row['method']}: "
            text += ", ".join(f"{name} {share:.4f}" for name, share in most) + "\n"
    return text


if __name__ == "__main__":
    main()
