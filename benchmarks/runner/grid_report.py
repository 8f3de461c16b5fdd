"""How time and excess converge with the grid, from the rows of grids.py.

With N grid points and times T,

    order of the time      T(N) = T(inf) + c/N^p, so that successive differences on grids of twice the points go with N^-p too; p is
                           the slope of their logarithms, and the last difference over 2^p - 1 is what the finest grid is from T(inf)
    order of the excess    slope of the logarithms of the largest ratio to a limit, less 1

A grid that has hardly more points than the one before says nothing (a spline's spans may ask for more than its resolution does), and is
left out of the fits.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes

from benchmarks.record import markdown
from benchmarks.runner.grids import FACTORS, name_of
from benchmarks.runner.rows import Row

FEWEST = 3  # values that a slope is fitted to
MORE = 1.5  # times the points of the grid before, at least, for a grid to be another one
NOTE = (
    "Of the same path, on grids whose steps halve from column to column. Excess: by how much the motion is above a limit between grid "
    "points, before anything is done about it. Orders are fitted: successive differences of the time, and the excess, fall with that "
    "power of the number of points. Left: what the finest grid's time is from the limit of all grids."
)


@dataclass(frozen=True, kw_only=True)
class Convergence:
    """What grids make of a job.

    points : of each grid
    times  : cycle times [s]
    excess : largest ratio to a limit, less 1 [-]
    order  : of the time [-], nan where it cannot be told
    left   : what the finest grid's time is from the limit of all grids [s]
    falls  : order of the excess [-]
    """

    points: tuple[int, ...]
    times: tuple[float, ...]
    excess: tuple[float, ...]
    order: float
    left: float
    falls: float


def convergence(of_job: dict[str, Row], kept: bool) -> Convergence | None:
    """How the rows of a job on all grids converge; None where a grid is missing or has no motion."""
    rows = [of_job.get(name_of(kept, finer)) for finer in FACTORS]
    found = [row for row in rows if row is not None and row.cycle_s is not None]
    if len(found) < len(FACTORS):
        return None
    times = tuple(float(row.cycle_s or math.nan) for row in found)
    excess = tuple(max((row.excess or 0.0) - 1.0, 0.0) for row in found)
    points = np.array([row.points or 0 for row in found])
    other = np.append(points[1:] >= MORE * points[:-1], True)
    order = -fitted(points[:-1][other[:-1]], np.abs(np.diff(times))[other[:-1]])
    left = abs(times[-1] - times[-2]) / (2.0**order - 1.0) if order > 0.0 else math.nan
    return Convergence(
        points=tuple(points.tolist()),
        times=times,
        excess=excess,
        order=order,
        left=left,
        falls=-fitted(points[other], np.array(excess)[other]),
    )


def fitted(points: np.ndarray, values: np.ndarray) -> float:
    """Slope of the logarithms of the values that are above zero [-]; nan where they are too few."""
    there = values > 0.0
    if there.sum() < FEWEST:
        return math.nan
    return float(np.polyfit(np.log(points[there]), np.log(values[there]), 1)[0])


def converging(jobs: dict[str, dict[str, Row]], kept: bool) -> dict[str, Convergence]:
    """Of all jobs that have the rows."""
    found = {job: convergence(of_job, kept) for job, of_job in jobs.items()}
    return {job: one for job, one in found.items() if one is not None}


def tables(jobs: dict[str, dict[str, Row]]) -> list[str]:
    """The parts of a report; none without such rows."""
    at_points, between = converging(jobs, False), converging(jobs, True)
    if not at_points:
        return []
    steps = [f"{finer:g}" for finer in FACTORS]
    excess = [
        [
            job,
            f"{one.points[0]:,} to {one.points[-1]:,}",
            *(f"{value:.1e}" for value in one.excess),
            f"{one.falls:.2f}",
        ]
        for job, one in at_points.items()
    ]
    parts = ["## Accuracy against the grid", NOTE]
    parts += ["Excess between grid points:", markdown(["job", "points", *steps, "order"], excess)]
    for found, said in (
        (at_points, "Time over that of the finest grid, less 1, limits kept at grid points:"),
        (between, "The same with limits kept between grid points too, which is what plans deliver:"),
    ):
        rows = [
            [
                job,
                *(f"{time / one.times[-1] - 1.0:.1e}" for time in one.times[:-1]),
                f"{one.order:.2f}",
                f"{one.left / one.times[-1]:.0e}",
            ]
            for job, one in found.items()
        ]
        parts += [said, markdown(["job", *steps[:-1], "order", "left [of the time]"], rows)]
    return parts


def draw_on(axes: Axes, jobs: dict[str, dict[str, Row]]) -> None:
    """Excess, and distance of the time from the limit of all grids, over grid points."""
    at_points, between = converging(jobs, False), converging(jobs, True)
    for number, (job, one) in enumerate(at_points.items()):
        color = f"C{number}"
        axes.loglog(one.points, one.excess, "s--", ms=3, color=color)
        if (exact := between.get(job)) is not None and math.isfinite(exact.left):
            end = exact.times[-1] - exact.left
            axes.loglog(exact.points, np.array(exact.times) / end - 1.0, "o-", ms=3, color=color, label=job)
    axes.set(xlabel="grid points", ylabel="share", title="solid: time; dashed: excess between grid points")
    axes.legend(fontsize=7)
