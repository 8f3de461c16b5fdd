"""An S-shaped five-axis test piece in the manner of ISO 10791-7, planned, judged in the joints and at the tip.

    python -m benchmarks.five_axis [--points N]

The piece is a ruled surface between two S-shaped curves, milled by the flank: the tip runs along the lower one, the tool along the
rulings, which lean to one side, pass the vertical in the middle and lean to the other. It is generated here from the formulas of
`s_piece`; the standard's control points are not copied. Then the joint-space problem of its final path (three linear joints through the
kinematics, two rotary ones) is solved by each solver: motion and time on the same grid.
"""

from __future__ import annotations

import argparse
import dataclasses
import time
from typing import Any

import numpy as np

import planner
from benchmarks.copp_solver import CoppSocp, copp
from benchmarks.record import write_results
from planner.base.arrays import FloatArray
from planner.constraints.assemble import feedrate_problem
from planner.corners.smooth import round_corners
from planner.feedrate.jerk.solver import JerkLimited
from planner.feedrate.reachability import Reachability
from planner.feedrate.toppra_adapter import ToppraSolver
from planner.geometry.build import toolpath_from_program
from planner.kinematics import at_tip, kinematics_of
from planner.kinematics.setpoints import joint_setpoints
from planner.kinematics.tip_path import tip_path
from planner.machine import Machine
from planner.optimal.geometry import corner_shape, splined_with_stops
from planner.path.samples import sample_path
from planner.smoothing.spline_path import with_spline
from planner.verify.joints import verify_joints

LENGTH, WIDTH, LEAN = 160.0, 30.0, 0.25  # of the S, half of its width [mm], largest lean of the rulings [rad]
FEED, TOLERANCE = 150.0, 0.01  # [mm/s], [mm]


def machine() -> Machine:
    """A tilting rotary table with a tool of 80 mm."""

    def limits(velocity: float, acceleration: float, jerk: float) -> dict[str, float]:
        return {"velocity": velocity, "acceleration": acceleration, "jerk": jerk}

    return Machine(
        name="trunnion",
        dt=0.001,
        tolerance=TOLERANCE,
        axes={
            "x": limits(400.0, 4000.0, 80000.0),
            "y": limits(400.0, 4000.0, 80000.0),
            "z": limits(300.0, 3000.0, 60000.0),
            "a": limits(120.0, 1200.0, 24000.0),
            "c": limits(240.0, 2400.0, 48000.0),
        },
        kinematics={"type": "xyzac-trt", "z_rot_point": -60.0, "z_offset": 20.0, "tool_length": 80.0},
    )


def s_piece(points: int) -> tuple[FloatArray, FloatArray]:
    """(n, 3) tips [mm] and (n, 3) directions of the tool for n = `points`."""
    t = np.linspace(-1.0, 1.0, points)
    x, y = 0.5 * LENGTH * t, WIDTH * np.sin(np.pi * t)
    slope = WIDTH * np.pi * np.cos(np.pi * t) / (0.5 * LENGTH)
    across = np.stack([-slope, np.ones(points)], axis=1) / np.hypot(1.0, slope)[:, None]
    lean = LEAN * np.sin(0.5 * np.pi * t)
    direction = np.stack([np.sin(lean) * across[:, 0], np.sin(lean) * across[:, 1], np.cos(lean)], axis=1)
    return np.stack([x, y, 5.0 * t**2], axis=1), direction


def solvers_on_the_path(program: planner.Program, on_tip: Machine) -> list[dict[str, Any]]:
    """Motion and time of each solver on the first splines' grid."""
    toolpath = toolpath_from_program(program, on_tip, None)
    given = round_corners(toolpath, on_tip, corner_shape("auto", on_tip, toolpath), blend_tangents=True)
    rounded, splines = splined_with_stops(given, on_tip, True)
    problem = feedrate_problem(sample_path(with_spline(rounded, splines), on_tip, third_order=True), on_tip)
    known: list[tuple[str, Any, bool]] = [
        ("own, no jerk limits", Reachability(), False),
        ("toppra", ToppraSolver(), False),
        ("own, jerk limits", JerkLimited(), True),
    ]
    if copp() is not None:
        known.append(("copp", CoppSocp(), True))
    rows = []
    for name, solver, jerk_limited in known:
        solver.solve(problem)
        began = time.process_time()
        found = solver.solve(problem)
        rows.append(
            {
                "solver": name,
                "jerk": jerk_limited,
                "status": found.status.value,
                "cycle_time_s": found.cycle_time,
                "cpu_s": time.process_time() - began,  # beside other work: ratios alone say something
                "points": len(problem),
            }
        )
    return rows


def main() -> None:
    """Plan, judge, compare, write."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--points", type=int, default=161)
    points = parser.parse_args().points
    five = machine()
    tips, directions = s_piece(points)
    program = tip_path(five, tips, directions=directions, feed=FEED)
    program = dataclasses.replace(program, source="S piece")
    on_tip = at_tip(five)
    rows: list[dict[str, Any]] = []
    for method in ("second-order", "optimal"):
        plan = planner.plan(program, on_tip, method=method)
        found = verify_joints(
            joint_setpoints(plan.require().trajectory, kinematics_of(five)),
            plan.toolpath,
            five,
            not_limited=("jerk",) if method == "second-order" else (),
        )
        rows.append(
            {
                "method": method,
                "cycle_time_s": plan.cycle_time,
                "passed_at_the_tip": bool(plan.verdict.passed),
                "passed_in_the_joints": found.passed,
                "tip_error_mm": found.tip_error_mm,
                "faults": found.faults[:3],
                "ratios": found.ratios,
            }
        )
    solved = solvers_on_the_path(program, on_tip)
    table = [
        "| method | motion [s] | at the tip | in the joints | tip error [mm] | largest joint ratios |",
        "|---|---|---|---|---|---|",
    ]
    for row in rows:
        judged = {
            k: v for k, v in row["ratios"].items() if row["method"] == "optimal" or not k.startswith("jerk")
        }
        most = sorted(judged.items(), key=lambda pair: -pair[1])[:4]
        table.append(
            f"| {row['method']} | {row['cycle_time_s']:.4f} | {'passed' if row['passed_at_the_tip'] else 'failed'} | "
            f"{'passed' if row['passed_in_the_joints'] else 'failed'} | {row['tip_error_mm']:.5f} | "
            + ", ".join(f"{name} {ratio:.4f}" for name, ratio in most)
            + " |"
        )
    table += ["", f"The joint-space problem of the first splines, {solved[0]['points']} points:", ""]
    table += [
        "| solver | jerk limits | status | motion [s] | CPU, of that of the first |",
        "|---|---|---|---|---|",
    ]
    first = solved[0]["cpu_s"]
    table += [
        f"| {r['solver']} | {'yes' if r['jerk'] else 'no'} | {r['status']} | {r['cycle_time_s']:.5f} | {r['cpu_s'] / first:.3g} |"
        for r in solved
    ]
    if copp() is None:
        table.append("\ncopp-py is not installed here, and left out.")
    text = "\n".join(table)
    print(text)
    write_results("five_axis", {"methods": rows, "solvers": solved}, text)


if __name__ == "__main__":
    main()
