"""Does F hold on every block, whatever the tolerance? Random programs, and code that shares nothing with the verdict.

    python -m benchmarks.judge.feed_promise [--jobs 500] [--first 0] [--methods stop ...]     into results/feed-promise.json and .md

Every program has 3 to 8 blocks of 0.03 to 3 mm, whose F changes by up to a factor of 1,000 at every block, and a `G64 P` of 0.005
to 2 mm: along one axis, along a slope, round corners in two and three axes, and with arcs, in turn, on machine `mill` with
setpoints every 0.25 ms. Of each method is counted: passed by the verdict, and kept by the other code
(benchmarks/judge/passages.py), which finds no stretch that is run sooner than the blocks on it take at their F; passed and not
kept; not passed. The other code has the motion that the verifier was given, at the ends of its pieces and every 16 us: setpoints
alone do not tell where a vertex is passed on a bend.
"""

from __future__ import annotations

import argparse
import time
from collections import Counter
from dataclasses import dataclass
from typing import Any

import numpy as np

from benchmarks.judge.passages import Motion, saved
from benchmarks.record import markdown, write_results
from planner.base.errors import InputError
from planner.machine import Machine, load_machine
from planner.motion.timing import MotionInTime
from planner.motion.trajectory import Trajectory
from planner.nc.reader import parse_program
from planner.planning.job import job as job_module
from planner.planning.job.plan import Plan
from planner.planning.methods.registry import plan
from planner.verifier import Verdict

Array = np.ndarray
STREAM = 61  # of random numbers
METHODS = ("optimal", "second-order", "kinematic", "stop", "bezier", "fir")
KINDS = ("line", "slope", "plane", "space", "arcs")
PERIOD = 0.00025  # of setpoints [s]
PARTS = 16  # of a period, at whose ends the other code looks at a motion
SHORTEST = 1e-8  # [s] between two places that it looks at
# What the other code may find to be run too soon [s]: it looks at 64 places from one time to the next.
KEPT = 0.02 * PERIOD
MARK = np.pi / 8  # [rad] between the points of an arc that are passed in order
BLOCKS = (3, 9)  # from, below
LENGTHS = (-1.5, 0.5)  # powers of ten [mm]
FEEDS = (1.0, 4.0)  # powers of ten [mm/min]
TOLERANCES = (-2.3, 0.3)  # powers of ten [mm]


@dataclass(frozen=True)
class Case:
    """A program.

    points : (V, 3) between its start and end, that are passed in order [mm]
    within : (V,) how far from them [mm]: the tolerance
    feeds  : (V+1,) between them [mm/s]
    """

    text: str
    points: Array
    within: Array
    feeds: Array
    kind: str


def case(seed: int, kind: str | None = None) -> Case:
    """The program of that number, and of that kind."""
    random = np.random.default_rng([STREAM, seed])
    kind = KINDS[seed % len(KINDS)] if kind is None else kind
    tolerance = float(f"{10 ** random.uniform(*TOLERANCES):.4g}")
    slope = random.normal(size=3)
    at, rows, points, feeds, within = np.zeros(3), [], [], [], []
    for _ in range(int(random.integers(*BLOCKS))):
        way = {"line": np.array([1.0, 0.0, 0.0]), "slope": slope}.get(kind, random.normal(size=3))
        way = way * np.array([1.0, 1.0, kind in ("slope", "space")])
        end = np.round(at + way / np.linalg.norm(way) * 10 ** random.uniform(*LENGTHS), 6)
        feed = np.round(10 ** random.uniform(*FEEDS), 2)
        if kind == "arcs" and random.random() < 0.5:
            words, new = _arc(at, end, random.uniform(-1.0, 1.0))
        else:
            words, new = "G1 X{:.6f} Y{:.6f} Z{:.6f}".format(*end), end[None]
        rows.append(f"{words} F{feed:.2f}")
        points.append(new)
        within += [tolerance] * len(new)
        feeds += [feed / 60.0] * len(new)
        at = end
    text = "\n".join(["G21 G90 G94 G17", f"G64 P{tolerance:g}", "G0 X0 Y0 Z0", *rows, "M2", ""])
    return Case(text, np.concatenate(points)[:-1], np.array(within[1:]), np.array(feeds), kind)


def _arc(at: Array, end: Array, beside: float) -> tuple[str, Array]:
    """The words of an arc whose centre is so many halves of the chord beside its middle, to the left or the right of it by its sign;
    points along it (n, 3) to its end."""
    way = end - at
    center = at + way / 2 + beside * np.array([-way[1], way[0], 0.0]) / 2
    begin, stop = (np.arctan2(*(p - center)[1::-1]) for p in (at, end))
    turn = (stop - begin) % (2 * np.pi)
    parts = max(int(np.ceil(turn / MARK - 1e-9)), 1)
    angles = begin + turn * np.arange(1, parts + 1) / parts
    radius = np.linalg.norm(at - center)
    points = center + radius * np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=1)
    points[-1] = end
    i, j = (center - at)[:2]
    words = f"G3 X{end[0]:.6f} Y{end[1]:.6f} I{i:.9f} J{j:.9f}"
    return words, points


class Judged:
    """The motions that the verifier is given while plans are made, as a context."""

    def __enter__(self) -> Judged:
        self._usual, self._seen = job_module.verify, list[tuple[Trajectory, MotionInTime]]()
        job_module.verify = self._verify  # type: ignore[assignment]
        return self

    def __exit__(self, *_: object) -> None:
        job_module.verify = self._usual

    def _verify(self, trajectory: Trajectory, *given: Any, motion: MotionInTime, **more: Any) -> Verdict:
        self._seen.append((trajectory, motion))
        return self._usual(trajectory, *given, motion=motion, **more)

    def motion_of(self, made: Plan) -> MotionInTime:
        """What the setpoints of a plan were taken from."""
        assert made.trajectory is not None
        x = made.trajectory.position
        return next(motion for seen, motion in self._seen[::-1] if np.array_equal(seen.position, x))


def too_soon(motion: MotionInTime, job: Case) -> float:
    """The most time that a motion saves against F on any stretch, by the other code [s]."""
    t = np.unique(np.concatenate([motion.t, [0.0, motion.end], np.arange(0.0, motion.end, PERIOD / PARTS)]))
    t = t[np.append(True, np.diff(t) > SHORTEST)]
    seen = motion.at(t, PERIOD)
    column = ["xyz".index(axis) for axis in seen.axes]
    position, velocity = np.zeros((2, len(t), 3))
    position[:, column], velocity[:, column] = seen.position, seen.velocity
    return saved(Motion(t, position, velocity), job.points, job.within, job.feeds)


def machine() -> Machine:
    """`mill`, with setpoints that tell well enough where a vertex is passed."""
    return load_machine("mill").model_copy(update={"dt": PERIOD})


def row(seed: int, method: str, kind: str | None = None) -> dict[str, Any]:
    """What verdict and other code say of a job."""
    job = case(seed, kind)
    began = time.process_time()
    found: dict[str, Any] = {"seed": seed, "kind": job.kind, "method": method}
    judged = Judged()
    try:
        with judged:
            made = plan(parse_program(job.text, source=f"job {seed}"), machine(), method=method)
    except InputError as fault:
        return found | {"passed": False, "saved": None, "said": str(fault)}
    found["cpu"] = time.process_time() - began
    if made.trajectory is None or made.verdict is None:
        return found | {"passed": False, "saved": None, "said": made.sentence}
    verdict = made.verdict
    return found | {
        "time": made.cycle_time,
        "passed": verdict.passed,
        "saved": too_soon(judged.motion_of(made), job),
        "verdict": verdict.limits["feed"].ratio,
        "said": (verdict.faults or ("",))[0],
    }


def outcome(found: dict[str, Any]) -> str:
    """The column of the table that a job is counted in."""
    if not found["passed"]:
        return "not passed"
    return "passed, kept" if found["saved"] <= KEPT else "passed, not kept"


def main() -> None:
    """Plan, judge, count."""
    parser = argparse.ArgumentParser(description="does F hold on every block?")
    parser.add_argument("--jobs", type=int, default=500)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--methods", nargs="+", default=METHODS, choices=METHODS)
    chosen = parser.parse_args()
    rows = []
    for method in chosen.methods:
        for seed in range(chosen.first, chosen.first + chosen.jobs):
            rows.append(row(seed, method))
            if outcome(rows[-1]) != "passed, kept":
                print(rows[-1], flush=True)
    columns = ("passed, kept", "passed, not kept", "not passed")
    table = []
    for method in chosen.methods:
        mine = [one for one in rows if one["method"] == method]
        count = Counter(outcome(one) for one in mine)
        worst = max((one["saved"] for one in mine if one["passed"]), default=0.0)
        cpu = sum(one.get("cpu", 0.0) for one in mine)
        table.append(
            [method, str(len(mine)), *(str(count[c]) for c in columns), f"{worst * 1e6:.1f}", f"{cpu:.0f}"]
        )
    text = markdown(
        ["method", "jobs", *columns, "most time saved on any stretch, by other code [us]", "CPU s"], table
    )
    write_results("feed-promise", {"rows": rows}, text)
    print(text)


if __name__ == "__main__":
    main()
