"""Is a file judged as it was planned? Plans on machines with filters, their verdicts, and those on their setpoints alone.

    python -m benchmarks.judge.one_meaning [--jobs 200] [--first 0]     into results/one-meaning.json and .md

Random programs of 2 to 7 lines and arcs on random machines: periods of 0.25 to 8 ms, one to three filters of 1 to 60 ms, every
interpolation between setpoints, every method in turn. Three answers are compared for each: the verdict of the plan, that on its
setpoints (as `planner verify` gives it of the file), and that of other code (benchmarks/judge/setpoints.py), which filters the
signal between the setpoints and asks whether it keeps a distance from the path in order. The worst error over the tolerance behind
the filters, r, is the same number in both verdicts, and the other code finds that the tolerance is kept where r is at most 1, and
that r (1 - CLOSE) is not. The same is asked of the setpoints without the filters.
"""

from __future__ import annotations

import argparse
import time
from collections import Counter
from dataclasses import dataclass
from typing import Any

import numpy as np

from benchmarks.judge.setpoints import averaged, within
from benchmarks.record import markdown, write_results
from planner.machine import Axis, Fir, Machine
from planner.nc.program import Program
from planner.nc.reader import parse_program
from planner.planning.job.plan import Plan
from planner.planning.methods.registry import plan
from planner.verifier import Verdict, verify

Array = np.ndarray
STREAM = 53  # of random numbers
PERIODS = (0.00025, 0.0005, 0.001, 0.002, 0.004, 0.008)  # [s]
KINDS = ("linear", "cubic", "hold")
WAYS: tuple[tuple[str, dict[str, Any]], ...] = (
    ("optimal", {"effort": "quick"}),
    ("second-order", {}),
    ("kinematic", {}),
    ("stop", {}),
    ("bezier", {}),
    ("fir", {}),
    ("fir-spline", {}),
    ("optimal", {"effort": "quick", "shaped": True}),
)
ARC = 1e-3  # of the tolerance, by which chords stand for arcs in the other code [-]
# By how much the other code's answer may differ [-]: it takes straight lines between places of the filtered motion, as the judge does
# at other places.
CLOSE = 0.02
LOST = 2.0  # [-] a motion that is lost has no distance from the path
SAMPLES = 2_000  # of a program at its feed, at most


@dataclass(frozen=True)
class Case:
    """A job: the program, the same as a polyline (n+1, A) [mm], its machine, and how it is planned."""

    program: Program
    path: Array
    machine: Machine
    method: str
    settings: dict[str, Any]


def case(seed: int) -> Case:
    """The job of that number."""
    random = np.random.default_rng([STREAM, seed])
    method, settings = WAYS[seed % len(WAYS)]
    tolerance = float(f"{10 ** random.uniform(-2.3, -0.7):.3g}")
    dt = float(random.choice(PERIODS))
    feed = float(f"{10 ** random.uniform(2.5, 4.3):.4g}")
    words, path = _moves(random, ARC * tolerance, most=SAMPLES * dt * feed / 60.0)
    acceleration, delay = 10 ** random.uniform(2.5, 4.3), 10 ** random.uniform(-2.3, -1.0)
    axes = {
        letter: Axis(velocity=random.uniform(50, 500), acceleration=a, jerk=a / delay)
        for letter, a in zip("xy", acceleration * random.uniform(0.6, 1.5, 2), strict=True)
    }
    filters = tuple(float(f"{T:.3g}") for T in 10 ** random.uniform(-3.0, -1.2, int(random.integers(1, 4))))
    machine = Machine(
        name="filtered",
        dt=dt,
        interpolation=str(random.choice(KINDS)),  # type: ignore[arg-type]
        tolerance=tolerance,
        axes=axes,
        fir=Fir(time_constants=filters),
        modes=({"frequency": random.uniform(15.0, 60.0), "damping": 0.02},) if settings.get("shaped") else (),  # type: ignore[arg-type]
    )
    program = parse_program(f"G21 G90 F{feed:g}\n" + "\n".join(words) + "\n", source=f"job {seed}")
    return Case(program, path, machine, method, settings)


def _moves(random: np.random.Generator, sag: float, most: float) -> tuple[list[str], Array]:
    """Blocks, and the path as a polyline (n+1, 2) whose chords are within `sag` [mm] of arcs; `most` [mm] is about the longest."""
    at, words, path = np.zeros(2), [], [np.zeros((1, 2))]
    count = int(random.integers(2, 8))
    size = min(10 ** random.uniform(-0.7, 1.3), most / count)
    for _ in range(count):
        way = random.normal(size=2)
        way *= size * 10 ** random.uniform(-0.5, 0.3) / np.linalg.norm(way)
        end = np.round(at + way, 4)
        if random.random() < 0.7:
            words.append(f"G1 X{end[0]:.4f} Y{end[1]:.4f}")
            path.append(end[None])
        else:  # about the middle of a chord, and up to a radius beside it
            way = end - at
            center = at + way / 2 + random.uniform(-1.0, 1.0) * np.array([-way[1], way[0]])
            radius, clockwise = float(np.linalg.norm(at - center)), random.random() < 0.5
            begin, stop = (np.arctan2(*(p - center)[::-1]) for p in (at, end))
            turn = (stop - begin) % (2 * np.pi) - 2 * np.pi * clockwise
            i, j = center - at
            words.append(f"G{2 if clockwise else 3} X{end[0]:.4f} Y{end[1]:.4f} I{i:.9f} J{j:.9f}")
            parts = int(np.ceil(abs(turn) / (2 * np.arccos(max(1 - sag / radius, 0.0)))))
            angles = begin + turn * np.arange(1, parts + 1) / parts
            path.append(center + radius * np.stack([np.cos(angles), np.sin(angles)], axis=1))
        at = end
    return words, np.concatenate(path)


def worst(verdict: Verdict) -> float:
    """The largest error over the tolerance behind the filters [-]."""
    after = verdict.after_filters
    assert after is not None
    return max(after.contour.ratio, after.vertex.ratio)


def row(seed: int) -> dict[str, Any]:
    """What the three say of a job."""
    job = case(seed)
    began = time.process_time()
    made: Plan = plan(job.program, job.machine, method=job.method, **job.settings)
    spent = time.process_time() - began
    machine = job.machine
    found: dict[str, Any] = {
        "seed": seed,
        "method": job.method + (" --shaped" if job.settings.get("shaped") else ""),
        "interpolation": machine.interpolation,
        "dt": machine.dt,
        "filters": list(machine.fir.time_constants) if machine.fir else [],
        "tolerance": machine.tolerance,
        "cpu": spent,
    }
    if made.trajectory is None or made.verdict is None:
        return found | {"planned": False, "said": made.sentence}
    free = ("jerk",) if not made.verdict.limits["jerk.x"].limited else ()
    alone = verify(made.trajectory, made.toolpath, machine, not_limited=free)
    ratio, unfiltered = worst(alone), max(alone.contour.ratio, alone.vertex.ratio)
    assert machine.fir is not None
    lengths = machine.fir.time_constants
    return found | {
        "planned": True,
        "time": made.cycle_time,
        "plan passed": made.verdict.passed,
        "verify passed": alone.passed,
        "plan": worst(made.verdict),
        "verify": ratio,
        "other": compared(averaged(made.trajectory, machine.interpolation, lengths), job, ratio),
        "unfiltered": unfiltered,
        "other, unfiltered": compared(averaged(made.trajectory, machine.interpolation, ()), job, unfiltered),
        "said": (made.verdict.sentences or alone.sentences or [""])[0],
    }


def compared(motion: Array, job: Case, ratio: float) -> str:
    """What other code says of a motion whose worst error is a ratio of the tolerance: it keeps the tolerance if that is at most 1, and
    no smaller distance than the ratio says.

    The verdict's number is the distance from the nearest piece that can be reached in order, which is less than that in order where
    pieces are close to each other.
    """
    tolerance = job.machine.tolerance
    if ratio <= 1.0 and not within(motion, job.path, tolerance * (1 + CLOSE)):
        return "more"
    return "less" if within(motion, job.path, tolerance * (ratio * (1 - CLOSE) - 2 * ARC)) else "agrees"


def agrees(found: dict[str, Any]) -> bool:
    """Whether a job is judged as it was planned, by all three."""
    same = found["plan passed"] == found["verify passed"] and found["plan"] == found["verify"]
    return same and all(
        found[ratio] > LOST or found[other] == "agrees"
        for ratio, other in (("verify", "other"), ("unfiltered", "other, unfiltered"))
    )


def main() -> None:
    """Plan, judge, compare."""
    parser = argparse.ArgumentParser(description="is a file judged as it was planned?")
    parser.add_argument("--jobs", type=int, default=200)
    parser.add_argument("--first", type=int, default=0)
    chosen = parser.parse_args()
    rows = []
    for seed in range(chosen.first, chosen.first + chosen.jobs):
        rows.append(row(seed))
        if not rows[-1]["planned"] or not agrees(rows[-1]) or not rows[-1]["plan passed"]:
            print(rows[-1], flush=True)
    planned = [one for one in rows if one["planned"]]
    apart = [one for one in planned if not agrees(one)]
    text = f"{len(rows)} jobs, {len(planned)} planned; the three differ on {len(apart)}.\n\n"
    for by, heading in (("method", "method"), ("interpolation", "interpolation"), ("dt", "dt [s]")):
        count: dict[Any, Counter[str]] = {
            one[by]: Counter() for one in sorted(planned, key=lambda one: str(one[by]))
        }
        for one in planned:
            count[one[by]].update(
                jobs=1,
                passed=one["plan passed"],
                same=one["plan passed"] == one["verify passed"],
                all=agrees(one),
            )
        names = ("jobs", "passed", "same", "all")
        table = [[f"{key}", *(str(c[name]) for name in names)] for key, c in count.items()]
        text += markdown([heading, "jobs", "passed", "plan and verify alike", "other code too"], table) + "\n"
    write_results("one-meaning", {"rows": rows}, text)


if __name__ == "__main__":
    main()
