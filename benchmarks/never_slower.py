"""Is `optimal` ever slower than what it should beat: stopping at every block, `kinematic`, or any single corner shape?

    python -m benchmarks.never_slower [--jobs 300] [--first 0]     into results/never-slower.json and .md
    python -m benchmarks.never_slower --again 141                  these jobs of the results once more

Seeded random jobs of 2 to 12 blocks, lines and arcs, in two or three axes, on machines whose limits differ by axis, with jerks from
tight to loose, four tolerances and four interpolation periods. Only motions that pass their verdict are compared with.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Iterator

import numpy as np

from benchmarks.record import RESULTS, markdown, write_results
from planner.job.method import Method
from planner.job.plan import Plan
from planner.machine import Axis, Machine
from planner.methods.kinematic import KinematicMethod
from planner.methods.optimal import OptimalMethod
from planner.methods.stop import StopMethod
from planner.nc.program import Program
from planner.nc.reader import parse_program

JOBS = 300
ALLOWED = 1e-4  # share of the cycle time by which `optimal` may be slower [-]
TOLERANCES = 0.005, 0.02, 0.05, 0.2  # [mm]
PERIODS = 0.001, 0.002, 0.004, 0.016  # [s]
PLANES = {"G17": ("X", "Y", "Z"), "G18": ("Z", "X", "Y"), "G19": ("Y", "Z", "X")}


def rivals() -> dict[str, Method]:
    """What `optimal` is compared with."""
    corners = {f"corner {name}": OptimalMethod(corner=name) for name in ("bezier", "fir", "kinematic")}
    return {"stop": StopMethod(), "kinematic": KinematicMethod(), **corners}


def job(seed: int) -> tuple[Program, Machine]:
    """The random job of that number."""
    rng = np.random.default_rng([13, seed])
    return _program(rng), _machine(rng)


def _program(rng: np.random.Generator) -> Program:
    three = rng.uniform() < 0.5
    scale = 10.0 ** rng.uniform(-0.5, 1.5)  # of the blocks [mm]
    lines, at = [f"G21 G90 G94 G17 F{60 * 10 ** rng.uniform(0.7, 2.3):.0f}"], np.zeros(3)
    for _ in range(int(rng.integers(2, 13))):
        step = rng.normal(size=3) * scale * 10.0 ** rng.uniform(-0.7, 0.3)
        step[2] *= three
        new = np.round(at + step, 3)
        if rng.uniform() < 0.3:
            plane = str(rng.choice(list(PLANES))) if three else "G17"
            first, second, third = PLANES[plane]
            index = ["XYZ".index(axis) for axis in (first, second)]
            chord = float(np.linalg.norm((new - at)[index]))
            if chord > 0.05:
                new["XYZ".index(third)] = at["XYZ".index(third)]
                words = " ".join(f"{'XYZ'[k]}{new[k]:.3f}" for k in index)
                radius = chord * rng.uniform(0.55, 3.0)
                lines.append(f"{plane} G{rng.integers(2, 4)} {words} R{radius:.4f}")
                at = new
                continue
        lines.append(f"G1 X{new[0]:.3f} Y{new[1]:.3f} Z{new[2]:.3f}")
        at = new
    return parse_program("\n".join([*lines, "M2"]) + "\n", source="random job")


def _machine(rng: np.random.Generator) -> Machine:
    acceleration, delay = 10.0 ** rng.uniform(2.3, 4.0), 10.0 ** rng.uniform(-2.5, -1.3)
    axes = {}
    for letter in "xyz":
        a = acceleration * rng.uniform(0.5, 1.5)
        axes[letter] = Axis(
            velocity=rng.uniform(60.0, 300.0), acceleration=a, jerk=a / (delay * rng.uniform(0.7, 1.4))
        )
    return Machine(
        name="random", dt=float(rng.choice(PERIODS)), tolerance=float(rng.choice(TOLERANCES)), axes=axes
    )


def compared(seed: int) -> dict:
    """Cycle times of one job [s], by method; of motions that do not pass None."""
    program, machine = job(seed)
    row: dict = {"seed": seed, "blocks": len(program.kind), "dt": machine.dt, "tolerance": machine.tolerance}
    best = OptimalMethod().plan(program, machine)
    row |= {"optimal": _time(best), "sentence": best.sentence}
    return row | {name: _time(method.plan(program, machine)) for name, method in rivals().items()}


def _time(plan: Plan) -> float | None:
    if plan.trajectory is None or plan.verdict is None or not plan.verdict.passed:
        return None
    return plan.trajectory.cycle_time


def slower(row: dict) -> Iterator[tuple[str, float]]:
    """Who is faster than `optimal` by how much [share of its cycle time], where that is more than `ALLOWED`."""
    for name in rivals():
        if row[name] is not None and (row["optimal"] is None or row["optimal"] > row[name] * (1.0 + ALLOWED)):
            yield name, np.inf if row["optimal"] is None else row["optimal"] / row[name] - 1.0


def main() -> None:
    """Run the comparison."""
    parser = argparse.ArgumentParser(description="optimal against what it should beat")
    parser.add_argument("--jobs", type=int, default=JOBS)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--again", type=int, nargs="+", help="make these jobs of the results again")
    chosen = parser.parse_args()
    made: dict[int, dict] = {}
    if chosen.again:
        kept = json.loads((RESULTS / "never-slower.json").read_text(encoding="utf-8"))["jobs"]
        made = {row["seed"]: row for row in kept}
    began = time.process_time()
    for seed in chosen.again or range(chosen.first, chosen.first + chosen.jobs):
        made[seed] = compared(seed)
        for name, by in slower(made[seed]):
            print(f"job {seed}: {name} is faster by {by:.2e}; {made[seed]['sentence']}", flush=True)
    rows = [made[seed] for seed in sorted(made)]
    table = []
    for name in rivals():
        gain = np.array([row[name] / row["optimal"] - 1.0 for row in rows if row[name] and row["optimal"]])
        lost = [by for row in rows for rival, by in slower(row) if rival == name]
        table.append(
            [
                name,
                str(len(gain)),
                str(len(lost)),
                f"{-min(gain.min(), 0.0):.1e}",
                f"{np.median(gain):.1%}",
                f"{gain.max():.1%}",
            ]
        )
    columns = [
        "compared with",
        "jobs that pass",
        f"faster by more than {ALLOWED:g}",
        "at most faster",
        "slower, median",
        "at most",
    ]
    unsolved = sum(row["optimal"] is None for row in rows)
    text = f"{len(rows)} random jobs; `optimal` does not pass on {unsolved}.\n\n" + markdown(columns, table)
    if chosen.again:
        text += f"\nMade with this commit: {', '.join(f'job {seed}' for seed in chosen.again)}; the others before.\n"
    print(text, f"{time.process_time() - began:.0f} CPU s")
    write_results("never-slower", {"jobs": rows}, text)


if __name__ == "__main__":
    main()
