"""Sweeps: a job planned with every combination of values of some settings, kept point by point, as a table and a picture.

Processes of this machine (joblib) or workers of a Dask cluster call `planned_point`; the process that asks writes the
files. A point whose worker died is given to another one, up to `DEATHS` times; a local process that dies ends the sweep.
"""

import dataclasses
import itertools
import logging
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import CancelledError
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from planner.base.errors import InputError, NotSolvedError, import_needed
from planner.base.threads import threads
from planner.commands.study.points import FAILED, FIGURE, TABLE, SweepFolder, planned_point
from planner.commands.study.settings import Setting, StudiedJob, Varied, grid_of
from planner.report.plots import STYLE
from planner.report.replace import replacing_file

# Columns of the table behind those of the settings.
TEXTS = ("outcome", "sentence", "held_by")
NUMBERS = ("cycle_time_s", "contour_error_mm", "vertex_error_mm", "corner_ratio", "planning_cpu_s")


@dataclasses.dataclass(frozen=True, kw_only=True)
class Sweep:
    """A sweep that is done."""

    varied: tuple[Varied, ...]  # settings and values
    rows: tuple[dict[str, Any], ...]  # one for each combination, the last setting changing fastest
    reused: int  # how many of them were there before


def sweep(
    job: StudiedJob,
    varied: Sequence[Varied],
    folder: SweepFolder,
    cluster: str | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Sweep:
    """Plan all combinations that the folder does not have yet, and keep each as soon as it is done.

    cluster  : address of a Dask scheduler; None for processes of this machine
    progress : called with the number of points that are there, and of how many

    Raises InputError if a point cannot be written or there is no such scheduler, NotSolvedError if processes
    die.
    """
    points = grid_of(varied)
    rows = {point: row for point in points if (row := folder.known(point)) is not None}
    reused = len(rows)
    missing = [point for point in points if point not in rows]
    if progress is not None:
        progress(reused, len(points))
    if missing:
        found = planned_here(job, missing) if cluster is None else planned_on_cluster(cluster, job, missing)
        for point, row in found:
            folder.keep(point, row)
            rows[point] = row
            if progress is not None:
                progress(len(rows), len(points))
    return Sweep(varied=tuple(varied), rows=tuple(rows[point] for point in points), reused=reused)


Point = tuple[Setting, ...]
DEATHS = 10  # workers that may die over one point before it is given up: it may be the point that kills them
WAIT = 10.0  # for an answer of the scheduler [s]


def planned_here(job: StudiedJob, points: Sequence[Point]) -> Iterator[tuple[Point, dict[str, Any]]]:
    """Rows of points, as they are planned by processes of this machine, one for each core.

    Raises NotSolvedError if one of them dies.
    """
    from joblib import Parallel, delayed
    from joblib.externals.loky.process_executor import TerminatedWorkerError

    count = min(threads(), len(points))
    try:
        yield from Parallel(n_jobs=count, return_as="generator_unordered", batch_size=1)(
            delayed(_planned)(job, point) for point in points
        )
    except TerminatedWorkerError:
        raise NotSolvedError(
            "a process of the sweep was ended from outside, perhaps because the memory is used up; the points so far are kept: "
            "the same command goes on with them, --threads N takes fewer processes"
        ) from None


def planned_on_cluster(
    address: str, job: StudiedJob, points: Sequence[Point]
) -> Iterator[tuple[Point, dict[str, Any]]]:
    """Rows of points, as they are planned by the workers of the Dask cluster whose scheduler has this
    address.

    Raises InputError if there is no scheduler, NotSolvedError if it goes away, or if a point is given up
    because its workers died.
    """
    distributed = import_needed("distributed", "--cluster")
    # how it tries to reach a scheduler that has gone, in pages; what came of it is said below
    for name in ("client", "batched"):
        logging.getLogger(f"distributed.{name}").setLevel(logging.CRITICAL)
    try:
        client = distributed.Client(address, timeout=WAIT, set_as_default=False)
    except (OSError, ValueError) as fault:
        raise InputError(f"--cluster {address}: no scheduler answers there ({fault})") from None
    try:
        with client:
            yield from _planned_by(client, distributed, address, job, points)
    except distributed.KilledWorker as fault:
        raise NotSolvedError(
            f"more than {DEATHS} workers died over one point; the points so far are kept ({fault})"
        ) from None
    except (CancelledError, distributed.comm.CommClosedError):
        raise NotSolvedError(
            f"--cluster {address}: the scheduler has gone, and with it what it was asked for; the points so far are kept: with a new "
            "scheduler the same command goes on with them"
        ) from None


def _planned_by(
    client: Any, distributed: Any, address: str, job: StudiedJob, points: Sequence[Point]
) -> Iterator[tuple[Point, dict[str, Any]]]:
    if not client.scheduler_info()["workers"]:
        raise InputError(
            f"--cluster {address}: its scheduler has no workers; start some with: dask worker {address}"
        )
    client.run_on_scheduler(_allow_deaths, deaths=DEATHS)
    # a task, and not scattered: what dies with a worker the scheduler then makes again
    shared = client.submit(_same, job, pure=False)
    tasks = [client.submit(_planned, shared, point, pure=False) for point in points]
    for done in distributed.as_completed(tasks, loop=client.loop):
        yield done.result()
        done.release()


def _planned(job: StudiedJob, point: Point) -> tuple[Point, dict[str, Any]]:
    return point, planned_point(job, point)


def _same(job: StudiedJob) -> StudiedJob:
    return job


def _allow_deaths(deaths: int, dask_scheduler: Any = None) -> None:
    """Runs in the scheduler."""
    dask_scheduler.allowed_failures = max(deaths, dask_scheduler.allowed_failures)


PANELS_MAX = 9  # of a picture; the table has all
LINES_MAX = 12  # of a panel
LOG_FROM = 4.0  # a setting is shown on a logarithmic axis if its largest value is so many times its least [-]
WIDTH, HEIGHT = 3.4, 2.7  # of a panel [inch]


def write_sweep(done: Sweep, directory: Path) -> list[str]:
    """Write table and picture; returns their names. Raises InputError if they cannot be written."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    columns: dict[str, Any] = {one.name: [row[one.name] for row in done.rows] for one in done.varied}
    columns |= {name: pa.array([row.get(name) for row in done.rows], pa.string()) for name in TEXTS}
    columns |= {name: pa.array([row.get(name) for row in done.rows], pa.float64()) for name in NUMBERS}
    with replacing_file(directory / TABLE) as new, new.open("wb") as file:
        pq.write_table(pa.table(columns), file)
    with replacing_file(directory / FIGURE) as new:
        sweep_figure(done, new)
    return [TABLE, FIGURE]


def sweep_figure(done: Sweep, path: Path) -> None:
    """Write the picture (PNG). Motions that failed the verdict are crosses; where there is no motion the line
    is broken."""
    first, *others = done.varied
    second = others[0] if others else None
    shape = [len(one.values) for one in done.varied]
    time = np.array([row.get("cycle_time_s") for row in done.rows], dtype=np.float64).reshape(shape)
    failed = np.array([row["outcome"] == FAILED for row in done.rows]).reshape(shape)
    panels = list(itertools.product(*(range(len(one.values)) for one in others[1:])))
    shown = panels[:PANELS_MAX]
    columns = min(3, len(shown))
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(WIDTH * columns, HEIGHT * -(-len(shown) // columns)), layout="constrained")
        FigureCanvasAgg(figure)
        grid = figure.subplots(-(-len(shown) // columns), columns, squeeze=False, sharey=True)
        for axes in grid.flat[len(shown) :]:
            axes.remove()
        for axes, at in zip(grid.flat, shown, strict=False):
            lines = range(len(second.values)) if second is not None else [None]
            for k in _spread(lines, LINES_MAX):
                where = (slice(None), *(() if k is None else (k,)), *at)
                colour = matplotlib.colormaps["viridis"](0.9 * (k or 0) / max(len(lines) - 1, 1))
                label = None if k is None or second is None else f"{second.values[k]:.4g}"
                passed, missed = (
                    np.where(failed[where] == which, time[where], np.nan) for which in (False, True)
                )
                axes.plot(first.values, passed, ".-", color=colour, label=label)
                axes.plot(first.values, missed, "x", color=colour)
            axes.set_xlabel(f"{first.name} [{first.unit or '-'}]")
            axes.set_ylabel("cycle time [s]")
            if max(first.values) >= LOG_FROM * min(first.values):
                axes.set_xscale("log")
            named = [f"{one.name} = {one.values[n]:.4g}" for one, n in zip(others[1:], at, strict=True)]
            axes.set_title("\n".join(named))
        if second is not None:
            grid[0, 0].legend(title=f"{second.name} [{second.unit or '-'}]")
        if len(shown) < len(panels):
            figure.suptitle(f"{len(shown)} of {len(panels)} panels; the table has all")
        figure.savefig(path, format="png")


def _spread(items: object, count_max: int) -> list[int | None]:
    """At most so many of some items, the first and the last among them."""
    every = list(items)  # type: ignore[call-overload]
    if len(every) <= count_max:
        return every
    return [every[k] for k in np.unique(np.linspace(0, len(every) - 1, count_max).round().astype(int))]
