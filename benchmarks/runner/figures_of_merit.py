"""Numbers from rows: performance profiles, the trade of motion against planning time, and how planning grows.

A motion counts where it passed its verdict with every quantity limited (`Row.comparable`). The best of a job is the shortest of these.

    profile(tau)    share of the jobs on which a way is within a factor tau of the best (Dolan and More, Math. Program. 91, 2002); a job
                    without such a motion counts as not reached, a job that no way solves is left out
    trade           geometric means, over the jobs that a way and the reference both solve: cycle time over the best, and processor time
                    over that of the reference
    beaten          by how much the reference is slower than a way, where both have a motion that counts
    slope           exponent p of processor time = c blocks^p, by least squares of the logarithms
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from benchmarks.cost.growth import fitted_slope
from benchmarks.runner.rows import MODEL, SKIPPED, Row

REFERENCE = "optimal"
ALLOWED = 1e-4  # share of the cycle time by which the reference may be slower: what grids leave [-]
FEWEST = 3  # sizes from which a slope is told


@dataclass(frozen=True, kw_only=True)
class Trade:
    """Motion against planning time of one way.

    cycle : over the best of each job [-]
    cpu   : over the reference's [-]
    jobs  : that were counted
    free  : quantities that this way does not limit; its cycle time is then over the best of those that limit all
    front : whether it limits all, solves all jobs of the reference, and no other such way is better in both
    """

    way: str
    cycle: float
    cpu: float
    jobs: int
    free: tuple[str, ...] = ()
    front: bool = False


def by_job(rows: Iterable[Row]) -> dict[str, dict[str, Row]]:
    """Rows by job and way, without those that were skipped."""
    found: dict[str, dict[str, Row]] = {}
    for row in rows:
        if row.status != SKIPPED:
            found.setdefault(row.job, {})[row.way] = row
    return found


def best_times(jobs: dict[str, dict[str, Row]]) -> dict[str, float]:
    """The shortest cycle time of each job that has one that counts [s]."""
    best = {}
    for job, of_job in jobs.items():
        times = [row.cycle_s for row in of_job.values() if row.comparable and row.cycle_s]
        if times:
            best[job] = min(times)
    return best


def ratios(jobs: dict[str, dict[str, Row]]) -> dict[str, np.ndarray]:
    """(jobs,) ascending: cycle time over the best of each way that has a motion that counts, inf where it has none on a job that it
    was run on."""
    best = best_times(jobs)
    found: dict[str, list[float]] = {}
    for job, time in best.items():
        for way, row in jobs[job].items():
            if row.kind != MODEL:
                found.setdefault(way, []).append(
                    row.cycle_s / time if row.comparable and row.cycle_s else math.inf
                )
    return {way: np.sort(of_way) for way, of_way in found.items() if np.isfinite(of_way).any()}


def profile(of_way: np.ndarray, tau: float) -> float:
    """Share of the jobs (n,) within a factor tau of the best [-]."""
    return float(np.searchsorted(of_way, tau, side="right") / len(of_way))


def trades(jobs: dict[str, dict[str, Row]], reference: str = REFERENCE) -> list[Trade]:
    """Motion against planning time of every way but the models; empty where the reference solves no job."""
    best = best_times(jobs)
    pairs: dict[str, list[tuple[float, float]]] = {}
    free: dict[str, tuple[str, ...]] = {}
    for job, time in best.items():
        base = jobs[job].get(reference)
        if base is None or not base.comparable or not base.cpu_s:
            continue
        for way, row in jobs[job].items():
            if row.kind != MODEL and row.verdict == "passed" and row.cycle_s and row.cpu_s:
                pairs.setdefault(way, []).append((row.cycle_s / time, row.cpu_s / base.cpu_s))
                free[way] = row.free
    means = {way: np.exp(np.log(np.array(of_way)).mean(axis=0)) for way, of_way in pairs.items()}
    most = len(pairs.get(reference, ()))
    full = [way for way in means if not free[way] and len(pairs[way]) == most]
    return [
        Trade(
            way=way,
            cycle=float(mean[0]),
            cpu=float(mean[1]),
            jobs=len(pairs[way]),
            free=free[way],
            front=way in full
            and not any((means[other] <= mean).all() and (means[other] < mean).any() for other in full),
        )
        for way, mean in means.items()
    ]


def beaten(jobs: dict[str, dict[str, Row]], reference: str = REFERENCE) -> dict[str, dict[str, float]]:
    """For each way with motions that count, the reference's cycle time over its own, less 1, by job; inf where the reference has no
    motion that counts."""
    found: dict[str, dict[str, float]] = {}
    for job, of_job in jobs.items():
        base = of_job.get(reference)
        for way, row in of_job.items():
            if base is None or way == reference or not row.comparable or not row.cycle_s:
                continue
            counts = base.comparable and base.cycle_s
            found.setdefault(way, {})[job] = base.cycle_s / row.cycle_s - 1.0 if counts else math.inf
    return found


def growth(jobs: dict[str, dict[str, Row]]) -> dict[str, tuple[list[int], list[float], float]]:
    """Blocks, processor seconds and fitted slope of each way that was measured at `FEWEST` sizes or more, smallest first."""
    points: dict[str, dict[int, float]] = {}
    for of_job in jobs.values():
        for way, row in of_job.items():
            if row.blocks and row.cpu_s and row.cycle_s:
                points.setdefault(way, {})[row.blocks] = row.cpu_s
    found = {}
    for way, of_way in points.items():
        sizes = sorted(of_way)
        if len(sizes) >= FEWEST:
            seconds = [of_way[size] for size in sizes]
            found[way] = (sizes, seconds, fitted_slope(sizes, seconds))
    return found
