"""The verifier on trial: does it find every fault, and does it pass every correct motion?

    python -m benchmarks.judge.verifier_trial [--plans 20] [--faults 50] [--each 80] [--jittering 42] [--first 0] [--processes 1]
                                                                       into results/verifier-trial.json and .md

Faults: so many mutations (benchmarks/judge/mutations.py) of each of so many plans, of random polylines in three axes on random
machines, by methods in turn; and `--each` motions of every kind that are wrong for their program (benchmarks/judge/wrong_motions.py,
wrong_samples.py). Each is a fault by a proof of its own. Only the positions are delivered, except where columns are in question.

Correct motions: each plan itself, the plans of `kinematic` and `stop`, one in closed form (every line from rest to rest in seven
phases of constant jerk), and those of other programs: ruckig and TOPP-RA (benchmarks/judge/foreign.py). They are written to files
as other programs write them (positions only, in CSV with 6 and 9 digits, as 32-bit floats, as 64-bit floats), read from there and
judged. Those of other programs are delivered with clocks that jitter, too (`CLOCKS`), of the first so many plans. None may be refused
except for too few digits, which the verdict says.
"""

from __future__ import annotations

import argparse
import tempfile
from collections import Counter
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from itertools import repeat
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.judge.foreign import PROGRAMS, Line, along, at_times, every_period, seven_phase_line
from benchmarks.judge.mutations import KINDS, Case, program_of
from benchmarks.judge.wrong_motions import KINDS as MOTIONS
from benchmarks.judge.wrong_motions import program
from benchmarks.judge.wrong_samples import KINDS as SAMPLES
from benchmarks.record import markdown, write_results
from planner.base.arrays import FloatArray
from planner.base.errors import InputError
from planner.geometry.build import toolpath_from_program
from planner.machine import Axis, Machine
from planner.motion.trajectory import Trajectory
from planner.nc.reader import parse_program
from planner.planning.methods.kinematic import KinematicMethod
from planner.planning.methods.optimal import OptimalMethod
from planner.planning.methods.second_order import SecondOrderMethod
from planner.planning.methods.stop import StopMethod
from planner.planning.page import Method
from planner.report.trajectory_reader import read_trajectory, trajectory_of_columns
from planner.verifier import Given, Kind, Verdict, verify

WRONG = (*MOTIONS, *SAMPLES)
DRAWS = 40  # of a mutation until one is proved to be a fault
POSITIONS = Given(columns=())
TOO_FEW_DIGITS = "too few digits"
CLOSED_FORM = "closed form"
CLOCKS = ("1 us around the period", "up to 2 us early", "0.3 to 1 periods")
JITTER = 1e-6  # [s]


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


def wrong_of(which: int, count: int, first: int = 0) -> list[dict[str, Any]]:
    """So many motions of that kind in `WRONG` that are wrong for their program: whether each is found, and whether it passes by
    its own program as it was made."""
    kind = WRONG[which]
    rows: list[dict[str, Any]] = []
    random = np.random.default_rng([37, which, first])
    for _ in range(DRAWS * count):
        if len(rows) == count:
            break
        row: dict[str, Any] = {
            "plan": first + len(rows),
            "kind": kind.__name__.replace("_", " "),
            "own": None,
        }
        try:
            made = kind(random)
            if made is None:
                continue
            said = _said(made.text, made.motion, made.machine)
            if made.own or made.made is not None:
                own = made.motion if made.made is None else made.made
                row["own"] = _said(made.own or made.text, own, made.machine)
        except (InputError, ValueError) as error:
            said = str(error)
        rows.append(row | {"found": bool(said), "said": said})
    return rows


def _said(text: str, motion: Trajectory, machine: Machine) -> str:
    """The first sentence against a motion; "" where it passes."""
    toolpath = toolpath_from_program(parse_program(program(text), machine, source="trial"), machine)
    verdict = verify(motion, toolpath, machine, given=POSITIONS)
    return "" if verdict.passed else verdict.sentences[0]


# ---- correct motions from elsewhere ----------------------------------------------------------------------------------------------


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
    even = every_period(subject.machine.dt)
    motions = {
        CLOSED_FORM: (*at_times(subject.points, subject.feed, subject.machine, seven_phase_line, even), True)
    }
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


def _own(faults: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Rows of the motions that were right for another program, as that judged them."""
    return [
        {
            "plan": row["plan"],
            "motion": "every kind, before it was changed",
            "written": "as it was made",
            "answer": "refused" if row["own"] else "passed",
            "said": row["own"],
        }
        for row in faults
        if row.get("own") is not None
    ]


def _clock(random: np.random.Generator, dt: float, how: str) -> Callable[[float], FloatArray]:
    """Times from 0 to a duration [s] that are not all dt apart."""

    def times(end: float) -> FloatArray:
        count = int(end / (0.3 * dt)) + 2
        step = np.full(count, dt) + random.uniform(-JITTER, JITTER, count)
        if how == CLOCKS[1]:
            step = dt - random.uniform(0.0, 2.0 * JITTER, count)
        elif how == CLOCKS[2]:
            step = dt * random.uniform(0.3, 1.0, count)
        t = np.append(0.0, np.cumsum(step))
        return np.append(t[t < end - JITTER], end)

    return times


def jittering_of(seed: int) -> list[dict[str, Any]]:
    """Correct motions of a case by other programs, with clocks that jitter: how each was judged."""
    subject, random = case(seed), np.random.default_rng([41, seed])
    rows = []
    programs: dict[str, tuple[Line, bool]] = {CLOSED_FORM: (seven_phase_line, True)} | PROGRAMS
    for name, (line, jerk) in programs.items():
        for how in CLOCKS:
            clock = _clock(random, subject.machine.dt, how)
            t, x = at_times(subject.points, subject.feed, subject.machine, line, clock)
            read = trajectory_of_columns({"t": t} | dict(zip("xyz", x.T, strict=True)), "trial")
            verdict = judged(read.trajectory, subject.points, subject.feed, subject.machine, read.given, jerk)
            said = "" if verdict.passed else verdict.sentences[0]
            answer = "passed" if verdict.passed else "refused"
            rows.append(
                {"plan": seed, "motion": name, "written": f"clock: {how}", "answer": answer, "said": said}
            )
    return rows


def main() -> None:
    """Hold the trial."""
    parser = argparse.ArgumentParser(
        description="does the verifier find every fault and pass every correct motion?"
    )
    parser.add_argument("--plans", type=int, default=20)
    parser.add_argument("--faults", type=int, default=50)
    parser.add_argument("--each", type=int, default=80)
    parser.add_argument("--jittering", type=int, default=42)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--processes", type=int, default=1)
    chosen = parser.parse_args()
    seeds = range(chosen.first, chosen.first + chosen.plans)
    jittering = range(chosen.first, chosen.first + chosen.jittering)
    with ProcessPoolExecutor(chosen.processes) as pool:
        of_plans = pool.map(faults_of, seeds, repeat(chosen.faults))
        of_kinds = pool.map(wrong_of, range(len(WRONG)), repeat(chosen.each), repeat(chosen.first))
        right = pool.map(correct_of, seeds)
        shaken = pool.map(jittering_of, jittering)
        faults = [row for rows in (*of_plans, *of_kinds) for row in rows]
        correct = [row for rows in (*right, *shaken) for row in rows]
    correct += _own(faults)
    for row in [each for each in faults if not each["found"]] + [
        each for each in correct if each["answer"] == "refused"
    ]:
        print(row, flush=True)
    made, found = (
        Counter(row["kind"] for row in faults),
        Counter(row["kind"] for row in faults if row["found"]),
    )
    text = f"{len(faults)} faults, {sum(found.values())} found.\n\n"
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
