"""What the joint search finds: the times of its jobs, pairs of jobs that should take alike, and laws on random jobs.

    python -m benchmarks.solvers.joint [--laws 300] [--threads 1]            into results/joint.json and .md

Jobs are pentagon, zig-zag, circle and star spiral of jobs/problems.py on the built-in `mill` and on the machine of jobs/problems.py, a
relief, the bracket, curves, and programs of ../shared or windows of them where these are there. Every motion is judged by the
planner's verifier and by the campaign's second judge, which shares no code with the package. Of a pair it is told how much longer the
second takes: a program with curves beside its chords, a limit or filters that never bind beside none, a turn a little sharper, more
tolerance. Laws are those of the campaign on the programs of jobs/random_lines.py, one for each job in turn.
"""

from __future__ import annotations

import argparse
import itertools
import time
from collections import Counter
from typing import Any

import numpy as np

import planner
from benchmarks.campaign import laws
from benchmarks.campaign.rows import second_verdict
from benchmarks.jobs import problems, random_lines
from benchmarks.jobs.searched import SHARED, jobs, window
from benchmarks.record import markdown, write_results
from benchmarks.runner.suites import curve
from benchmarks.solvers.joint_campaign import counted
from planner.base.errors import InputError
from planner.base.threads import use_threads
from planner.machine import Axis, Fir, Machine
from planner.nc.program import Program

# Control points of curves G5, each from the end of the one before, tangents alike where they meet: I J, P Q, X Y [mm].
CURVES = (
    (4, 0, -2, -4, 12, 6),
    (2, 4, -4, 0, 18, 14),
    (4, 0, -1, 5, 30, 8),
    (1, -5, 3, 3, 26, -2),
    (-3, -3, 5, 0, 14, -6),
    (-5, 0, 0, -4, 4, 2),
)
CHORDS = 80  # of each curve
SIDE, SIDES = 2.0, 50  # of the zig-zag [mm]
PAIRED_TURNS = (174.9, 175.1)  # [deg]
TOLERANCES = (0.0005, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1)  # [mm]
MORE = {"velocity": 1.1, "acceleration": 1.1, "jerk": 1.1, "tolerance": 1.1, "feed": 1.1}  # of the laws
LAWS = ("mirror", "reverse", "split", *(f"looser {name}" for name in MORE))


class Never(planner.PathLimit):
    """A limit that never binds."""

    name = "never"

    def velocity(self, at: Any) -> float:
        """[mm/s]"""
        return 1e4


def curved(*, chords: bool) -> Program:
    """Six blocks G5, or the chords of them."""
    return _text(_blocks((0.0, 0.0), CURVES, chords=chords))


def zigzag(*, chords: bool) -> Program:
    """A zig-zag of 50 lines with one block G5 in the middle, or with the chords of it."""
    way, at, lines = np.deg2rad(30.0), np.zeros(2), []
    for k in range(SIDES):
        at = at + SIDE * np.array([np.cos(way), np.sin(way) * (1 - 2 * (k % 2))])
        lines.append(f"G1 X{at[0]:.6f} Y{at[1]:.6f}")
        if k == SIDES // 2 - 1:
            bend = (1.0, 0.5, -1.0, 0.5, float(at[0]) + 3.0, float(at[1]))
            lines += _blocks((float(at[0]), float(at[1])), (bend,), chords=chords)
            at = at + np.array([3.0, 0.0])
    return _text(lines)


def retrace(turn: float) -> Program:
    """Ten lines of 2 mm there and back, each turned by so many degrees."""
    heading = np.cumsum(np.resize([1.0, -1.0], 10)) * np.deg2rad(turn)
    steps = SIDE * np.column_stack([np.cos(heading), np.sin(heading)])
    return problems.polyline(np.vstack([[0.0, 0.0], np.cumsum(steps, axis=0)]), source=f"turns of {turn:g}")


def _blocks(start: tuple[float, float], curves: Any, *, chords: bool) -> list[str]:
    lines, at = [], np.array(start)
    for i, j, p, q, x, y in curves:
        end = np.array([x, y])
        t = np.linspace(0.0, 1.0, CHORDS + 1)[1:, None]
        points = at, at + np.array([i, j]), end + np.array([p, q]), end
        way = sum(w * np.array(c) for w, c in zip(_bernstein(t), points, strict=True))
        lines += (
            [f"G1 X{px:.6f} Y{py:.6f}" for px, py in way]
            if chords
            else [f"G5 I{i} J{j} P{p} Q{q} X{x:.6f} Y{y:.6f}"]
        )
        at = end
    return lines


def _bernstein(t: Any) -> tuple[Any, ...]:
    return (1 - t) ** 3, 3 * t * (1 - t) ** 2, 3 * t**2 * (1 - t), t**3


def _text(lines: list[str]) -> Program:
    return planner.read_program(
        text="\n".join(["G21 G90 G64", "F6000", *lines, "M2"]), machine=planner.load_machine("mill")
    )


def measured(program: Program, machine: Machine, **settings: Any) -> dict[str, Any]:
    """Cycle time [s], what both judges say, windows and CPU seconds of a job."""
    found = counted()
    found.clear()
    began = time.process_time()
    plan = planner.plan(program, machine, **settings).require()
    cpu = time.process_time() - began
    assert plan.verdict is not None
    return {
        "blocks": len(program.kind),
        "time_s": plan.cycle_time,
        "passed": plan.verdict.passed,
        "second": second_verdict(plan),
        "windows": sum(one.windows for one in found),
        "solved": sum(one.solved for one in found),
        "iterations": sum(one.iterations for one in found),
        "cpu_s": cpu,
    }


def pairs() -> dict[str, tuple[dict[str, Any], dict[str, Any]]]:
    """Jobs that should take alike."""
    mill, peers = planner.load_machine("mill"), problems.machine()
    filtered = mill.model_copy(update={"fir": Fir(time_constants=(1e-4, 1e-4))})
    shapes = {"pentagon": problems.pentagon(), "zig-zag": problems.zigzag()}
    if SHARED.exists():
        shapes["stellabee1, 121 blocks"] = window("stellabee1, 121 blocks", mill)
    made: dict[str, tuple[dict[str, Any], dict[str, Any]]] = {}
    for machine in (mill, peers):
        for name, make in (("six G5", curved), ("one G5 in a zig-zag", zigzag)):
            made[f"{name}: chords, curves; {machine.name}"] = (
                measured(make(chords=True), machine),
                measured(make(chords=False), machine),
            )
        first, second = (measured(retrace(turn), machine) for turn in PAIRED_TURNS)
        made[f"turns of {PAIRED_TURNS[0]}, {PAIRED_TURNS[1]} degrees; {machine.name}"] = first, second
    for name, program in shapes.items():
        plain = measured(program, mill)
        made[f"{name}: without, with a limit that never binds"] = (
            plain,
            measured(program, mill, limits=[Never()]),
        )
        made[f"{name}: without, with filters of 0.1 and 0.1 ms"] = plain, measured(program, filtered)
    return made


def by_tolerance() -> list[dict[str, Any]]:
    """The trident as one curve, by the tolerance."""
    axes = {
        letter: Axis(velocity=500.0, acceleration=acceleration, jerk=5000.0)
        for letter, acceleration in (("x", 2500.0), ("y", 3000.0), ("z", 2500.0))
    }
    machine = Machine(name="trident", dt=0.001, tolerance=0.01, axes=axes)
    program = curve("trident").exact_program(50.0)
    return [
        {"tolerance": tolerance} | measured(program, machine.model_copy(update={"tolerance": tolerance}))
        for tolerance in TOLERANCES
    ]


def law(seed: int) -> dict[str, Any] | None:
    """A random job and the same changed; None where the law does not apply to it."""
    program, machine = random_lines.job(seed)
    name, rng = LAWS[seed % len(LAWS)], np.random.default_rng([47, seed])
    other = _changed(name, program, machine, rng)
    if other is None:
        return None
    try:
        first = measured(program, machine)
        after = measured(other.program, other.machine, tolerance=other.tolerance)
    except InputError:
        return None
    off = after["time_s"] / first["time_s"] - 1.0
    over = abs(off) if name in ("mirror", "reverse") else max(off, 0.0)
    return {"job": seed, "law": name, "off": over, "first": first, "after": after}


def _changed(name: str, program: Program, machine: Machine, rng: laws.Rng) -> laws.Changed | None:
    if name == "mirror":
        return laws.Changed(law=name, program=laws.mirrored(program), machine=machine, tolerance=None)
    if name == "reverse":
        if len(np.unique(program.path_control)) > 1 or not laws.ends_alike(program):
            return None
        return laws.Changed(law=name, program=laws.reversed_program(program), machine=machine, tolerance=None)
    if name == "split":
        other = laws.split(program, rng)
        return (
            None if other is None else laws.Changed(law=name, program=other, machine=machine, tolerance=None)
        )
    what = name.removeprefix("looser ")
    return laws.looser(program, machine, None, what, MORE[what])


def main() -> None:
    """Plan all jobs, and write the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--laws", type=int, default=300, help="random jobs that are held against a law")
    parser.add_argument("--threads", type=int, default=1)
    asked = parser.parse_args()
    use_threads(asked.threads)
    measured(problems.pentagon(), planner.load_machine("mill"))  # kernels are loaded
    single: dict[str, Any] = {}
    for name, (make, machine) in jobs().items():
        single[name] = measured(make(), machine)
        print(name, single[name], flush=True)
    paired = pairs()
    print(paired, flush=True)
    tolerances = by_tolerance()
    held = []
    for seed in range(asked.laws):
        found = law(seed)
        if found is not None:
            held.append(found)
            print(seed, found["law"], f"{found['off']:.2e}", flush=True)
    data = {"jobs": single, "pairs": paired, "tolerances": tolerances, "laws": held}
    write_results(
        "joint", data, "\n".join([_singles(single), _pairs(paired), _tolerances(tolerances), _laws(held)])
    )


def _fault(row: dict[str, Any]) -> str:
    if row["passed"] and not row["second"]:
        return ""
    return " (second judge)" if row["passed"] else " (failed)"


def _singles(rows: dict[str, Any]) -> str:
    columns = ["job", "blocks", "cycle time [s]", "windows", "not converged", "iterations", "CPU [s]"]
    cells = [
        [
            name,
            f"{row['blocks']:,}",
            f"{row['time_s']:.6g}{_fault(row)}",
            f"{row['windows']}",
            f"{row['windows'] - row['solved']}",
            f"{row['iterations']:,}",
            f"{row['cpu_s']:.2f}",
        ]
        for name, row in rows.items()
    ]
    text = (
        "Cycle times of the default method; all pass the verdict and the second judge unless it is said.\n\n"
    )
    return text + markdown(columns, cells)


def _pairs(rows: dict[str, Any]) -> str:
    columns = ["pair", "first [s]", "second [s]", "longer by", "CPU, second over first"]
    cells = [
        [
            name,
            f"{one['time_s']:.6g}{_fault(one)}",
            f"{two['time_s']:.6g}{_fault(two)}",
            f"{two['time_s'] / one['time_s'] - 1.0:+.1e}",
            f"{two['cpu_s'] / one['cpu_s']:.2g}",
        ]
        for name, (one, two) in rows.items()
    ]
    return markdown(columns, cells)


def _tolerances(rows: list[dict[str, Any]]) -> str:
    columns = ["tolerance [um]", *(f"{1e3 * row['tolerance']:g}" for row in rows)]
    return "The trident as one NURBS:\n\n" + markdown(
        columns, [["cycle time [s]", *(f"{row['time_s']:.5f}{_fault(row)}" for row in rows)]]
    )


def _laws(rows: list[dict[str, Any]]) -> str:
    count = Counter(row["law"] for row in rows)
    cells = []
    for name in LAWS:
        off = np.array([row["off"] for row in rows if row["law"] == name])
        if count[name]:
            over = ", ".join(
                f"{row['job']}: {row['off']:.1e}"
                for row in rows
                if row["law"] == name and row["off"] > laws.ALLOWED
            )
            cells.append([name, f"{count[name]}", f"{np.median(off):.1e}", f"{off.max():.1e}", over])
    both = list(itertools.chain.from_iterable((row["first"], row["after"]) for row in rows))
    windows, solved = (sum(row[key] for row in both) for key in ("windows", "solved"))
    bad = sum(not row["passed"] or bool(row["second"]) for row in both)
    return (
        f"Laws on {len(rows)} random jobs; larger by 10 % where it says looser. Of {len(both)} plans {bad} do not pass both judges; of "
        f"{windows:,} windows {windows - solved} did not converge.\n\n"
        + markdown(["law", "jobs", "off, median", "worst", f"jobs off by more than {laws.ALLOWED:g}"], cells)
    )


if __name__ == "__main__":
    main()
