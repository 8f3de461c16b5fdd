"""Ten thousand small random problems for the jerk-limited kernel: is every one solved, and does every answer hold?

    python -m benchmarks.solvers.jerk_campaign [--count 10000] [--first 0] [--compared 2000]

The problems are meant to be nasty: 1 to 6 axes, 5 to 300 points, splines of degree 2 to 5 (jumps of the curvature and of r'''), any
parametrisation, points that nearly coincide, limits over four decades. Every answer is checked by code that shares nothing with the
solver: limits at both ends of every interval and exact kinematics. The times of as many as asked for are compared with ipopt's on the
same problems.
Results: benchmarks/results/jerk-campaign.json and .md.
"""

from __future__ import annotations

import argparse
import collections

import numpy as np
from rich.progress import track
from scipy.interpolate import make_interp_spline

from benchmarks.record import write_results
from benchmarks.solvers.ratios import constraint_ratios
from planner.feedrate.constraints.problem import FeedrateProblem
from planner.feedrate.jerk.solver import JerkLimited
from planner.feedrate.reference.nlp import JerkLimitedNLP
from planner.feedrate.solution import FeedrateSolution, Status

LIMIT_ROUNDING = 1e-6  # a limit holds if it is exceeded by no more than this [-]
GAP_MAX = 3e-3  # above ipopt's time [-]
GAPS = (0, 1, 10, 50, 90, 99, 100)  # percentiles of the gaps that are told
KINEMATICS_ROUNDING = 1e-6  # of the fastest feed, of the interval [-]
SIDE = 1e-12  # where derivatives are taken left and right of a knot [share of the parameter]


def small_problem(seed: int) -> FeedrateProblem:
    """The seeded problem of the campaign."""
    rng = np.random.default_rng([33, seed])
    axes, count = int(rng.integers(1, 7)), int(rng.integers(5, 300))
    degree = int(rng.choice([2, 3, 4, 5]))
    ways = int(rng.integers(degree + 2, degree + 2 + max(2, count // 15)))
    points = np.cumsum(rng.normal(size=(ways, axes)), axis=0) * 10 ** rng.uniform(-2, 2)
    curve = make_interp_spline(np.linspace(0.0, 1.0, ways), points, k=degree)
    q = np.linspace(0.0, 1.0, count)
    if rng.random() < 0.4:
        q = np.unique(np.concatenate([[0.0, 1.0], rng.uniform(0.0, 1.0, count)]))
    if rng.random() < 0.2:  # points that nearly coincide
        k = rng.integers(0, len(q) - 1, 3)
        q = np.unique(np.concatenate([q, q[k] + 1e-6 * (q[k + 1] - q[k])]))
    length = np.linalg.norm(np.diff(curve(np.linspace(0.0, 1.0, 1000)), axis=0), axis=1).sum()
    d1, d2_left, d2_right, d3_left, d3_right = (
        curve(np.clip(q + side * SIDE, 0.0, 1.0), order) / length**order
        for order, side in ((1, 0), (2, -1), (2, 1), (3, -1), (3, 1))
    )
    velocity, acceleration = 10 ** rng.uniform(0, 3, axes), 10 ** rng.uniform(2, 4, axes)
    jerk = acceleration * 10 ** rng.uniform(0, 4, axes)
    feed = np.repeat(rng.uniform(20, 200, len(q)), 1 + rng.integers(0, 100, len(q)))[: len(q)]
    by_velocity = 1.0 / (np.abs(d1) / velocity).max(axis=1).clip(1e-9) ** 2
    by_jump = 1.0 / (np.abs(d2_right - d2_left) / acceleration).max(axis=1).clip(1e-12)
    return FeedrateProblem(
        piece=np.array([0, len(q)]),
        s=q * length,
        axes=tuple("xyzabc"[:axes]),
        d1=d1,
        d2_left=d2_left,
        d2_right=d2_right,
        d3_left=d3_left,
        d3_right=d3_right,
        velocity=velocity,
        acceleration=acceleration,
        jerk=jerk,
        feed_sq_max=np.minimum(np.minimum(by_velocity, by_jump), feed**2),
        feed_sq_bound=np.zeros(len(q), dtype=int),
        bound_names=("feed",),
        margin=np.zeros(len(q)),
    )


def faults(problem: FeedrateProblem, solution: FeedrateSolution) -> list[str]:
    """What is wrong with an answer; nothing, it is hoped."""
    if not solution.solved:
        return ["not solved"]
    found = [] if solution.status is Status.OPTIMAL else ["acceptable only"]
    ratio, _ = constraint_ratios(problem, solution)
    if ratio.max() > 1.0 + LIMIT_ROUNDING:
        found.append(f"a limit is exceeded {ratio.max():.9f} times")
    x, a, j, h = solution.feed_sq, solution.acc_s[:-1], solution.jerk_s[:-1], solution.duration[:-1]
    v, ds = np.sqrt(x), np.diff(problem.s)
    if np.abs(v[:-1] * h + a * h**2 / 2 + j * h**3 / 6 - ds).max() > KINEMATICS_ROUNDING * ds.max():
        found.append("the way of an interval is not its length")
    if np.abs(v[:-1] + a * h + j * h**2 / 2 - v[1:]).max() > KINEMATICS_ROUNDING * v.max():
        found.append("the feed jumps")
    return found


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--count", type=int, default=10_000)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--compared", type=int, default=2000, help="so many are given to ipopt as well")
    given = parser.parse_args()
    iterations, trouble, gaps, unsolved = [], [], [], 0
    every = max(given.count // max(given.compared, 1), 1)
    for seed in track(range(given.first, given.first + given.count), description="problems"):
        problem = small_problem(seed)
        solution = JerkLimited().solve(problem)
        iterations.append(solution.iterations)
        found = faults(problem, solution)
        if (seed - given.first) % every == 0 and (seed - given.first) // every < given.compared:
            reference = JerkLimitedNLP().solve(problem)
            unsolved += not reference.solved
            if reference.solved and solution.solved:
                gaps.append(solution.cycle_time / reference.cycle_time - 1.0)
                if gaps[-1] > GAP_MAX:
                    found.append(f"slower than ipopt by {gaps[-1]:.2%}")
        for fault in found:
            trouble.append({"seed": seed, "points": len(problem), "axes": len(problem.axes), "fault": fault})
    kinds = collections.Counter(entry["fault"].split(" exceeded")[0] for entry in trouble)
    percentiles = {str(p): float(np.percentile(iterations, p)) for p in (50, 90, 99, 100)}
    data = {
        "first": given.first,
        "count": given.count,
        "iterations": percentiles,
        "compared": len(gaps),
        "unsolved by ipopt": unsolved,
        "gaps": {str(p): float(np.percentile(gaps, p)) for p in GAPS},
        "faults": trouble,
    }
    lines = [
        f"{given.count:,} problems from seed {given.first}: {given.count - len({t['seed'] for t in trouble}):,} without any fault.",
        "",
        "Iterations (of the worst window and start): "
        + ", ".join(f"{p} % at most {n:.0f}" for p, n in percentiles.items())
        + ".",
        f"Against ipopt on {len(gaps):,} of them ({unsolved} more it does not solve): the time is off by",
        "",
        "| share of the problems | at most |",
        "|---|---|",
        *(f"| {p} % | {gap:+.4%} |" for p, gap in ((p, np.percentile(gaps, p)) for p in GAPS)),
        "",
        *(f"- {count} times: {kind}" for kind, count in kinds.items()),
        *(f"- seed {t['seed']} ({t['points']} points, {t['axes']} axes): {t['fault']}" for t in trouble[:50]),
    ]
    write_results("jerk-campaign", data, "\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
