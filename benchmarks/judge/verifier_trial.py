"""The verifier on trial: does it find every fault, and does it pass every correct motion?

    python -m benchmarks.judge.verifier_trial [--plans 20] [--faults 50] [--first 0]     into results/verifier-trial.json and .md

Faults: so many mutations (benchmarks/judge/mutations.py) of each of so many plans, of random polylines in three axes on random
machines, by methods in turn. Each mutation is a fault by a proof of its own. Only the positions are delivered, except where columns
are in question.

Correct motions: each plan itself, the plans of `kinematic` and `stop`, one in closed form (every line from rest to rest in seven
phases of constant jerk), and those of other programs: ruckig and TOPP-RA (benchmarks/judge/foreign.py). They are written to files
as other programs write them (positions only, in CSV with 6 and 9 digits, as 32-bit floats, as 64-bit floats), read from there and
judged. None may be refused except for too few digits, which the verdict says.
"""

from __future__ import annotations

import argparse
import tempfile
from collections import Counter
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.judge.foreign import PROGRAMS, along
from benchmarks.judge.mutations import KINDS, Case, program_of
from benchmarks.record import markdown, write_results
from planner.base.arrays import FloatArray
from planner.geometry.build import toolpath_from_program
from planner.machine import Axis, Machine
from planner.motion.trajectory import Trajectory
from planner.planning.methods.kinematic import KinematicMethod
from planner.planning.methods.optimal import OptimalMethod
from planner.planning.methods.second_order import SecondOrderMethod
from planner.planning.methods.stop import StopMethod
from planner.planning.page import Method
from planner.report.trajectory_reader import read_trajectory
from planner.verifier import Given, Kind, Verdict, verify

DRAWS = 40  # of a mutation until one is proved to be a fault
POSITIONS = Given(columns=())
TOO_FEW_DIGITS = "too few digits"
CLOSED_FORM = "closed form"


def methods() -> tuple[tuple[Method, bool], ...]:
    """By which plans are made in turn, and if they limit jerk."""
    return (
        (OptimalMethod(), True),
        (KinematicMethod(), True),
        (SecondOrderMethod(), False),
        (OptimalMethod(corner="bezier"), True),
        (StopMethod(), True),
    )


def case(seed: int) -> Case:
    """The plan of that number: 3 to 8 lines of 0.5 to 30 mm."""
    random = np.random.default_rng([29, seed])
    steps = random.normal(size=(int(random.integers(4, 10)), 3))
    steps *= 10 ** random.uniform(-0.3, 1.5) / np.linalg.norm(steps, axis=1, keepdims=True)
    points = np.vstack([np.zeros(3), np.round(np.cumsum(steps, axis=0), 3)])
    feed, acceleration = 10 ** random.uniform(1.0, 2.2), 10 ** random.uniform(2.5, 3.8)
    delay = 10 ** random.uniform(-2.3, -1.3)  # acceleration / jerk [s]
    axes = {
        letter: Axis(velocity=random.uniform(40, 200), acceleration=a, jerk=a / delay)
        for letter, a in zip("xyz", acceleration * random.uniform(0.5, 1.5, 3), strict=True)
    }
    machine = Machine(
        name="trial",
        dt=float(random.choice([0.001, 0.002, 0.004])),
        tolerance=float(random.choice([0.01, 0.05, 0.2])),
        axes=axes,
    )
    method, jerk = methods()[seed % len(methods())]
    plan = method.plan(program_of(points, float(f"{feed:.4g}")), machine)
    if plan.verdict is None or not plan.verdict.passed:
        raise RuntimeError(f"case {seed}: {plan.sentence}")
    return Case(points=points, feed=float(f"{feed:.4g}"), machine=machine, plan=plan, jerk=jerk)


def judged(
    motion: Trajectory, points: FloatArray, feed: float, machine: Machine, given: Given, jerk: bool
) -> Verdict:
    """The verdict on a delivered motion, by its samples alone."""
    toolpath = toolpath_from_program(program_of(points, feed), machine)
    return verify(motion, toolpath, machine, given=given, not_limited=() if jerk else ("jerk",))


def faults_of(seed: int, count: int) -> list[dict[str, Any]]:
    """So many faults of a plan, all kinds in turn: which kind, and whether it was found, with the first sentence."""
    subject = case(seed)
    rows: list[dict[str, Any]] = []
    random = np.random.default_rng([31, seed])
    kinds = list(KINDS)
    while len(rows) < count and kinds:
        for kind in tuple(kinds):
            fault = next((made for _ in range(DRAWS) if (made := kind(subject, random)) is not None), None)
            if fault is None:
                kinds.remove(kind)  # this plan cannot have it: a line has no normal acceleration
                continue
            given = Given() if fault.columns else POSITIONS
            verdict = judged(fault.trajectory, fault.points, fault.feed, fault.machine, given, subject.jerk)
            said = "" if verdict.passed else verdict.sentences[0]
            rows.append(
                {
                    "plan": seed,
                    "kind": kind.__name__.replace("_", " "),
                    "found": not verdict.passed,
                    "said": said,
                }
            )
    return rows[:count]


# ---- correct motions from elsewhere ----------------------------------------------------------------------------------------------


def seven_phases(length: float, v: float, a: float, j: float) -> tuple[FloatArray, FloatArray]:
    """(7,) durations and jerks of a way from rest to rest: jerk up, constant acceleration, jerk down, constant speed, and back."""
    low, high = 0.0, v
    for _ in range(100):  # the peak speed by bisection: the way from rest to rest grows with it
        peak = 0.5 * (low + high)
        up = max(peak / a + a / j, 2.0 * np.sqrt(peak / j)) if peak * j > a * a else 2.0 * np.sqrt(peak / j)
        low, high = (peak, high) if peak * up < length else (low, peak)
    peak = low
    ramp = a / j if peak * j > a * a else np.sqrt(peak / j)
    hold = max(peak / (j * ramp) - ramp, 0.0)
    cruise = length / peak - 2.0 * ramp - hold
    return np.array([ramp, hold, ramp, max(cruise, 0.0), ramp, hold, ramp]), j * np.array(
        [1.0, 0, -1, 0, -1, 0, 1]
    )


def from_rest_to_rest(points: FloatArray, feed: float, machine: Machine) -> tuple[FloatArray, FloatArray]:
    """(T,) times and (T, 3) positions at dt of lines that are each run from rest to rest."""
    v, a, j = (machine.limits(name, ("x", "y", "z")) for name in ("velocity", "acceleration", "jerk"))
    begins, parts = 0.0, []
    for start, end in pairwise(points):
        length = float(np.linalg.norm(end - start))
        u = (end - start) / length
        with np.errstate(divide="ignore"):
            of_axes = [float((limit / np.abs(u)).min()) for limit in (v, a, j)]
        top = min(of_axes[0], feed)
        durations, jerks = seven_phases(length, 0.999999 * top, 0.999999 * of_axes[1], 0.999999 * of_axes[2])
        parts.append((begins, start, u, length, durations, jerks))
        begins += float(durations.sum())
    t = np.append(np.arange(0.0, begins, machine.dt), begins)
    if t[-1] - t[-2] < 1e-6:
        t = np.delete(t, -2)
    x = np.empty((len(t), 3))
    starts = np.array([part[0] for part in parts])
    for k, (begin, start, u, length, durations, jerks) in enumerate(parts):
        mine = np.searchsorted(starts, t, side="right") - 1 == k
        x[mine] = start + np.minimum(_way(t[mine] - begin, durations, jerks), length)[:, None] * u
    x[-1] = points[-1]
    return t, x


def _way(t: FloatArray, durations: FloatArray, jerks: FloatArray) -> FloatArray:
    s = v = a = 0.0
    way, begin = np.zeros(len(t)), 0.0
    for duration, jerk in zip(durations, jerks, strict=True):
        tau = np.clip(t - begin, 0.0, duration)
        inside = t >= begin
        way[inside] = (s + tau * (v + tau * (a / 2 + tau * jerk / 6)))[inside]
        s, v, a = (
            s + duration * (v + duration * (a / 2 + duration * jerk / 6)),
            v + duration * (a + duration * jerk / 2),
            a + duration * jerk,
        )
        begin += duration
    return way


def files(folder: Path, t: FloatArray, x: FloatArray) -> dict[str, Path]:
    """A motion as other programs write it."""
    made = {}
    for digits in (6, 9):
        path = folder / f"d{digits}.csv"
        rows = np.column_stack([t, x])
        np.savetxt(
            path, rows, fmt=["%.9f"] + [f"%.{digits}f"] * 3, delimiter=",", header="t,x,y,z", comments=""
        )
        made[f"CSV, {digits} digits"] = path
    np.savez(folder / "f32.npz", t=t, xyz=x.astype(np.float32))
    np.savez(folder / "f64.npz", t=t, xyz=x)
    return made | {"32-bit floats": folder / "f32.npz", "64-bit floats": folder / "f64.npz"}


def correct_of(seed: int) -> list[dict[str, Any]]:
    """Correct motions of a case, from files: how each was judged."""
    subject = case(seed)
    rows: list[dict[str, Any]] = []
    program = program_of(subject.points, subject.feed)
    motions = {CLOSED_FORM: (*from_rest_to_rest(subject.points, subject.feed, subject.machine), True)}
    for name, method in (("kinematic", KinematicMethod()), ("stop", StopMethod())):
        made = method.plan(program, subject.machine).require().trajectory
        assert made is not None
        motions[name] = (made.t, made.position, True)
    motions[subject.plan.method] = (subject.trajectory.t, subject.trajectory.position, subject.jerk)
    for name, (line, jerk) in PROGRAMS.items():
        motions[name] = (*along(subject.points, subject.feed, subject.machine, line), jerk)
    with tempfile.TemporaryDirectory() as folder:
        for name, (t, x, jerk) in motions.items():
            for written, path in files(Path(folder), t, x).items():
                read = read_trajectory(path)
                verdict = judged(
                    read.trajectory, subject.points, subject.feed, subject.machine, read.given, jerk
                )
                wrong = [fault.sentence for fault in verdict.faults if fault.kind is not Kind.DIGITS]
                answer = "passed" if verdict.passed else "refused" if wrong else TOO_FEW_DIGITS
                rows.append(
                    {
                        "plan": seed,
                        "motion": name,
                        "written": written,
                        "answer": answer,
                        "said": (wrong or [""])[0],
                    }
                )
    return rows


def main() -> None:
    """Hold the trial."""
    parser = argparse.ArgumentParser(
        description="does the verifier find every fault and pass every correct motion?"
    )
    parser.add_argument("--plans", type=int, default=20)
    parser.add_argument("--faults", type=int, default=50)
    parser.add_argument("--first", type=int, default=0)
    chosen = parser.parse_args()
    seeds = range(chosen.first, chosen.first + chosen.plans)
    faults = [row for seed in seeds for row in faults_of(seed, chosen.faults)]
    correct = [row for seed in seeds for row in correct_of(seed)]
    for row in [each for each in faults if not each["found"]] + [
        each for each in correct if each["answer"] == "refused"
    ]:
        print(row, flush=True)
    made, found = (
        Counter(row["kind"] for row in faults),
        Counter(row["kind"] for row in faults if row["found"]),
    )
    text = f"{len(faults)} faults in {len(seeds)} plans, {sum(found.values())} found.\n\n"
    text += markdown(
        ["fault", "made", "found"], [[kind, str(n), str(found[kind])] for kind, n in made.items()]
    )
    elsewhere = sum(row["motion"] in (*PROGRAMS, CLOSED_FORM) for row in correct)
    text += f"\n{len(correct)} correct motions, {elsewhere} of them not by this planner:\n\n"
    answers = ("passed", TOO_FEW_DIGITS, "refused")
    for by, heading in (("written", "written as"), ("motion", "made by")):
        table = []
        for one in dict.fromkeys(row[by] for row in correct):
            count = Counter(row["answer"] for row in correct if row[by] == one)
            table.append([one, *(str(count[answer]) for answer in answers)])
        text += markdown([heading, *answers], table) + "\n"
    text = text.rstrip("\n") + "\n"
    write_results("verifier-trial", {"faults": faults, "correct": correct}, text)


if __name__ == "__main__":
    main()
