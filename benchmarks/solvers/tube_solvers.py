"""Do the solvers of method `tube` end at the same cycle time? Small jobs: own, ipopt and fatrop on the same problem and start.

    python -m benchmarks.solvers.tube_solvers [--jobs 50] [--fatrop]     into results/tube-solvers.json and .md

The random programs of jobs/random_lines.py, lines and arcs, on the built-in `mill` and on the machine of jobs/problems.py, where no
normal acceleration is limited (the solvers hold it between its places in different ways), with one run between full stops and at
most `STEPS` steps; single corners, pentagons and arcs before them. The start is the motion on the first splines. ipopt begins
there, and once more where the own solver ended: what it still finds there is what the own solver left. The own solver is asked for
more than by default (`PRECISE`). Jobs that the results hold already are not made again.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

import planner
from benchmarks.jobs import problems, random_lines
from benchmarks.record import RESULTS, markdown, write_results
from planner.base.arrays import FloatArray
from planner.geometry.build import toolpath_from_program
from planner.joint.guess import Guess, guesses_from
from planner.joint.nlp import TubeNLP
from planner.joint.outcome import TubeSolution
from planner.joint.own import TubeOwn
from planner.joint.run import TubeRun
from planner.joint.runs import tube_runs_of
from planner.joint.solvers import TubeSolver
from planner.machine import Machine
from planner.motion.vertex_times import passing_times
from planner.nc.program import Program
from planner.planning.methods.optimal import OptimalMethod

NAME = "tube-solvers"
STEPS = 120  # of a job at most: ipopt takes 10 to 40 ms per step in all
PRECISE = TubeOwn(gap=1e-6, least=0.01)
# The own solver begins again where it has ended, pulled to the durations there as ipopt is, until it gains less than this share [-], at
# most so often.
GAINED, AGAIN = 2e-6, 12
SAME = 1e-5  # share of the cycle time within which two solvers agree [-]


class Precise:
    """The own solver, asked for more than by default."""

    legs_max = np.inf

    def solve(self, run: TubeRun, guess: Guess) -> TubeSolution:
        """Its optimum."""
        found = PRECISE.solve(run, guess)
        for _ in range(AGAIN if found.steps is not None else 0):
            assert found.steps is not None
            guess = again(run, guess, found)
            other = PRECISE.solve(run, guess)
            if other.steps is None:
                break
            gained = 1.0 - other.steps.h.sum() / found.steps.h.sum()
            found = replace(other, iterations=found.iterations + other.iterations)
            if gained < GAINED:
                break
        return found


def begun(program: Program, machine: Machine) -> tuple[TubeRun, Guess] | None:
    """The one run of a job and its motion on the first splines cut into steps; None for several runs, or where vertices coincide."""
    toolpath = toolpath_from_program(program, machine)
    runs = list(tube_runs_of(toolpath, machine))
    plan = OptimalMethod(effort="quick", corner="spline").plan(program, machine)
    if len(runs) != 1 or plan.trajectory is None or np.isfinite(runs[0].across_max).any():
        return None
    times = np.maximum.accumulate(passing_times(plan.trajectory, toolpath))
    times[-1] = plan.trajectory.t[-1]
    if (np.diff(times[runs[0].first]) <= 0).any():
        return None
    return runs[0], guesses_from([runs[0]], plan.trajectory, [times[runs[0].first]])[0]


def jobs() -> Iterator[tuple[str, Program, Machine]]:
    """Named jobs, and then random ones without end."""
    mill, peers = planner.load_machine("mill"), problems.machine()
    for name, machine in (("mill", mill), ("peers", peers)):
        for degrees in (30, 90, 150):
            turn = np.deg2rad(degrees)
            points = [[0, 0], [4, 0], [4 + 4 * np.cos(turn), 4 * np.sin(turn)]]
            yield f"corner of {degrees} degrees, {name}", problems.polyline(points), machine
        yield f"pentagon of 6 mm, {name}", problems.pentagon(6.0), machine
        yield f"zig-zag of 8, {name}", problems.zigzag(8), machine
    seed = 0
    while True:
        for name, machine in (("mill", mill), ("peers", peers)):
            yield f"random {seed}, {name}", random_lines.job(seed)[0], machine
        seed += 1


def again(run: TubeRun, guess: Guess, found: TubeSolution) -> Guess:
    """Where a search ended, as a guess."""
    steps, place = found.steps, found.place
    assert steps is not None
    assert place is not None
    state = np.zeros((len(guess) + 1, 3, len(run.axis)))
    state[:-1] = np.stack([steps.position, steps.velocity, steps.acceleration], axis=1)
    state[-1, 0] = run.vertex[-1]
    even = np.linspace(0.0, 1.0, 4)
    return Guess(
        leg=guess.leg, h=steps.h, state=state, place=place[:-1, None] + np.diff(place)[:, None] * even
    )


def compared(run: TubeRun, guess: Guess, fatrop: bool) -> dict[str, Any]:
    """Cycle times [s], iterations and CPU seconds of the solvers."""
    row: dict[str, Any] = {
        "legs": len(run),
        "arcs": int((run.curvature > 0).sum()),
        "steps": len(guess),
        "start_s": float(guess.h.sum()),
    }
    row |= _of("default", TubeOwn().solve(run, guess), 0.0)
    found = {}
    solvers: dict[str, TubeSolver] = {
        "own": Precise(),
        "ipopt": TubeNLP(),
        "fatrop": TubeNLP(solver="fatrop"),
    }
    for name, solver in solvers.items():
        if name == "fatrop" and not fatrop:
            continue
        began = time.process_time()
        solution = solver.solve(run, guess)
        found[name] = solution
        row |= _of(name, solution, time.process_time() - began)
    if found["own"].steps is not None:
        began = time.process_time()
        # pulled to the durations there: from a far start the pull costs up to 2e-4
        ended = again(run, guess, found["own"])
        solution = TubeNLP().solve_from(run, ended, ended)
        row |= _of("ipopt from own", solution, time.process_time() - began)
    return row


def _of(name: str, solution: TubeSolution, cpu: float) -> dict[str, Any]:
    lasts = None if solution.steps is None else float(solution.steps.h.sum())
    return {
        f"{name}_s": lasts,
        f"{name}_iterations": solution.iterations,
        f"{name}_cpu": cpu,
        f"{name}_status": str(solution.status),
    }


def table(rows: dict[str, dict[str, Any]]) -> str:
    """What came of it."""
    cells = []
    for name, row in rows.items():
        own = row["own_s"]
        cells.append([name, str(row["legs"]), str(row["arcs"]), str(row["steps"]), _time(own)])
        for other in ("default", "ipopt", "ipopt from own", "fatrop"):
            lasts = row.get(f"{other}_s")
            cells[-1].append(
                f"{lasts / own - 1.0:+.1e}" if lasts and own else "" if f"{other}_s" not in row else "failed"
            )
        cells[-1] += [f"{row['own_cpu']:.2f}", f"{row['ipopt_cpu']:.1f}"]
    columns = [
        "job",
        "legs",
        "arcs",
        "steps",
        "own [s]",
        "default - 1",
        "ipopt - 1",
        "ipopt from own - 1",
        "fatrop - 1",
    ]
    text = "The own solver's cycle time, and by what share that of the others is longer.\n\n"
    for other in ("default", "ipopt", "ipopt from own", "fatrop"):
        ended = [row for row in rows.values() if row.get(f"{other}_s") and row["own_s"]]
        asked = sum(f"{other}_s" in row for row in rows.values())
        if not asked:
            continue
        share: FloatArray = np.array([row[f"{other}_s"] / row["own_s"] - 1.0 for row in ended])
        text += (
            f"- {other}: {len(ended)} of {asked} ended; {(np.abs(share) <= SAME).sum()} within {SAME:g} of the own solver's time, "
            f"{(share > SAME).sum()} slower, {(share < -SAME).sum()} faster, by {max(-share.min(), 0.0) if len(share) else 0.0:.1e} at "
            "most.\n"
        )
    return text + "\n" + markdown([*columns, "own CPU [s]", "ipopt CPU [s]"], cells)


def _time(lasts: float | None) -> str:
    return f"{lasts:.6f}" if lasts else "failed"


def main() -> None:
    """Run what is missing."""
    parser = argparse.ArgumentParser(description="the solvers of method tube on the same problems")
    parser.add_argument("--jobs", type=int, default=50)
    parser.add_argument("--fatrop", action="store_true", help="fatrop too")
    asked = parser.parse_args()
    file = RESULTS / f"{NAME}.json"
    rows: dict[str, Any] = json.loads(file.read_text(encoding="utf-8"))["jobs"] if file.exists() else {}
    for name, program, machine in jobs():
        if len(rows) >= asked.jobs:
            break
        if name in rows:
            continue
        made = begun(program, machine)
        if made is None or len(made[1]) > STEPS:
            continue
        rows[name] = compared(*made, asked.fatrop)
        print(name, rows[name], flush=True)
        write_results(NAME, {"jobs": rows}, table(rows))


if __name__ == "__main__":
    main()
