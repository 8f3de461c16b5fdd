"""Sweeps: a job planned with every combination of values of some settings, kept point by point, as a table and a picture."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from planner.commands.study.points import PASSED, SweepFolder
from planner.commands.study.ranges import Varied, grid_of
from planner.commands.study.variant import StudiedJob
from planner.commands.study.workers import planned_here, planned_on_cluster

# Columns of the table behind those of the settings.
TEXTS = ("outcome", "sentence", "held_by")
NUMBERS = ("cycle_time_s", "contour_error_mm", "vertex_error_mm", "corner_ratio", "planning_cpu_s")


@dataclasses.dataclass(frozen=True, kw_only=True)
class Sweep:
    """A sweep that is done.

    varied : settings and values
    rows   : one for each combination, the last setting changing fastest
    reused : how many of them were there before
    """

    varied: tuple[Varied, ...]
    rows: tuple[dict[str, Any], ...]
    reused: int


def sweep(
    job: StudiedJob,
    varied: Sequence[Varied],
    folder: SweepFolder,
    cluster: str | None = None,
    progress: Callable[[int, int, int], None] | None = None,
) -> Sweep:
    """Plan all combinations that the folder does not have yet, and keep each as soon as it is done.

    cluster  : address of a Dask scheduler; None for processes of this machine
    progress : called with the number of points that are there, of how many, and how many of them were there before

    Raises InputError if a point cannot be written or there is no such scheduler, NotSolvedError if processes die.
    """
    points = grid_of(varied)
    rows = {point: row for point in points if (row := folder.known(point)) is not None}
    reused = len(rows)
    missing = [point for point in points if point not in rows]
    if progress is not None:
        progress(reused, len(points), reused)
    if missing:
        found = planned_here(job, missing) if cluster is None else planned_on_cluster(cluster, job, missing)
        for point, row in found:
            folder.keep(point, row)
            rows[point] = row
            if progress is not None:
                progress(len(rows), len(points), reused)
    return Sweep(varied=tuple(varied), rows=tuple(rows[point] for point in points), reused=reused)


def times_of(done: Sweep) -> np.ndarray[Any, np.dtype[np.float64]]:
    """Cycle times, an array with one axis for each varied setting [s]; NaN where no motion passed."""
    shape = tuple(len(one.values) for one in done.varied)
    times = [row.get("cycle_time_s") if row["outcome"] == PASSED else None for row in done.rows]
    return np.array(times, dtype=np.float64).reshape(shape)
