"""The sizes at which the code changes its way: long jobs go in parts, other routes, or less effort.

What only long jobs go through only long jobs would try. So all these sizes are settings, with two values
each: the usual one and a small one, with which nearly every job goes the large way. The environment variable
PLANNER_SIZES says which are small: `small` for all, or kinds of them, `parts,routes,effort,shown`. It is for
the tests (tests/base/test_sizes.py plans both ways; `PLANNER_SIZES=small python -m pytest -m "not slow"`;
`python -m benchmarks campaign --sizes small`); whoever plans gains nothing by it. It is read once, when this
module is imported, and holds for the processes that are started from there.

    parts  : the same computation, cut otherwise or on other threads: the same result to rounding
    routes : other windows and ranges of the same optimisation: another way to the same optimum
    effort : what is not tried, or less finely, for large jobs: slower by what is written beside the size
    shown  : what a page or a table has no room for

A size beyond which something is refused is no setting: there is no large way behind it.
"""

import os
from dataclasses import dataclass, field, fields, replace
from typing import Any

from planner.base.errors import InputError

VARIABLE = "PLANNER_SIZES"
KINDS = (PARTS, ROUTES, EFFORT, SHOWN) = ("parts", "routes", "effort", "shown")
SMALL = "small"  # all kinds


def _size(kind: str, usual: Any, small: Any) -> Any:
    return field(default=usual, metadata={"kind": kind, "small": small})


@dataclass(frozen=True, kw_only=True)
class Sizes:
    """One value for each size; in the units of its name, as a number of what it counts."""

    # Motions and files. A sample takes 132 bytes with three axes.
    samples_kept: int = _size(PARTS, 2**20, 50)  # more are evaluated when they are asked for: 138 MB
    samples_at_once: int = _size(PARTS, 65_536, 77)  # of those: 9 MB
    times_at_once: int = _size(PARTS, 100_000, 350)  # of a finely sampled motion: 20 MB
    row_group: int = _size(PARTS, 2**18, 101)  # samples in memory while a file is written: 35 MB
    text_rows: int = _size(PARTS, 100_000, 60)  # setpoints written as text together: 10 MB
    # of a program in a language that are executed together, at most
    program_rows: int = _size(PARTS, 100_000, 50)
    idle_rows: int = _size(PARTS, 2_000, 20)  # the same at first, and as long as nothing moves
    turns_at_once: int = _size(PARTS, 500, 5)  # of loops and jumps between two looks at their number
    # steps that are placed on their legs, or whose active limits are looked at: 10 MB
    steps_at_once: int = _size(PARTS, 20_000, 30)

    # Threads: they take 1 ms to begin; a point takes some us, a span 20 us to relax.
    grid_shared: int = _size(PARTS, 5_000, 10)  # points of a grid that are worth a thread
    intervals_shared: int = _size(PARTS, 5_000, 10)  # of its intervals, to be sampled
    points_shared: int = _size(PARTS, 3_000, 0)  # fewer are solved by one thread
    relaxed_shared: int = _size(PARTS, 2_000, 0)  # spans; fewer are relaxed by one thread
    read_shared: int = _size(PARTS, 65_536, 0)  # samples; fewer are judged by one thread
    windows_shared: int = _size(PARTS, 1_000, 0)  # steps of searches that are worth a thread

    # The judge and what it is asked for before.
    judged_at_once: int = _size(PARTS, 16_384, 64)  # samples: 2 MB
    places_at_once: int = _size(PARTS, 100_000, 350)  # times of its own: 30 MB
    corners_at_once: int = _size(PARTS, 100_000, 3)  # 50 MB
    filtered_at_once: int = _size(PARTS, 50_000, 37)  # times behind filters: 5 MB
    convolved_at_once: int = _size(PARTS, 50_000, 40)  # setpoints, for the planner: 5 MB
    stops_at_once: int = _size(PARTS, 500, 2)  # 5 MB an array

    # Splines.
    relaxed_window: int = _size(ROUTES, 240, 120)  # control points relaxed at a time ...
    relaxed_overlap: int = _size(ROUTES, 30, 30)  # ... and of them again with the next window

    # The feedrate along a path, and the search for path and feedrate together.
    solved_window: int = _size(ROUTES, 2_000, 120)  # intervals solved at a time
    # steps of a run that is one window: divided, 3 of 150 random jobs ended 2e-3 to 1.1e-2 slower
    searched_whole: int = _size(ROUTES, 1_500, 200)
    # steps of a window of others, which is three quarters as long at least: joins that are searched once more must not
    # touch one another. Longer ones take more iterations, and four of them side by side have no room in a processor's cache
    searched_window: int = _size(ROUTES, 500, 200)
    # steps of searches together from which their windows are solved side by side
    searched_in_lanes: int = _size(ROUTES, 5_000, 200)
    searched_overlap: int = _size(ROUTES, 120, 30)  # steps on each side of a join that is searched once more
    # steps between a join and where it would be: it is where the motion uses least of its limits
    searched_join: int = _size(ROUTES, 40, 10)
    # steps of the smallest part that a window which fails is divided into
    searched_least: int = _size(ROUTES, 60, 15)

    # What large jobs go without.
    # points: coarser final grids of each leave up to 4e-3 of the time (planning/optimal/effort.py)
    small_grids: tuple[float, float, float] = _size(EFFORT, (1_500, 4_000, 40_000), (15, 40, 400))
    # more have a coarser grid, which leaves 0.3 to 0.5 % (feedrate/sampling/samples.py)
    corners_finely: int = _size(EFFORT, 50_000, 2)
    searched_again: int = _size(EFFORT, 10_000, 5)  # steps: up to 1e-3 (planning/attempts.py)
    searched_finely: int = _size(EFFORT, 30_000, 20)  # steps: 7e-5 on reliefs (planning/optimal/effort.py)
    searched_most: int = _size(EFFORT, 5_000_000, 200)  # steps: `python -m benchmarks.cost.growth`
    # blocks of a job beside whose motion on a path method kinematic is planned
    rivals_planned: int = _size(EFFORT, 40_000, 100)
    corners_compared: int = _size(EFFORT, 1_000_000, 2_000)  # points: some 10 s and 1 GB
    # points of a motion on a path that is slowed down by 2e-5 before its verdict (planning/optimal/tighten.py)
    slowed_before: int = _size(EFFORT, 50_000, 10)

    # Pages, pictures and tables.
    page_samples: int = _size(SHOWN, 150_000, 500)  # the page of 250,000 blocks then has less than 20 MB
    page_programmed: int = _size(SHOWN, 60_000, 200)  # points of the programmed path
    page_corners: int = _size(SHOWN, 20_000, 3)  # those closest to eq. 18-19
    page_calls: int = _size(SHOWN, 10_000, 2)  # chains of calls; places in others have their line alone
    compared_samples: int = _size(SHOWN, 20_000, 100)  # ten methods have a page of some ten megabytes
    figure_samples: int = _size(SHOWN, 40_000, 300)  # the path of 11,157 samples makes a figure of 1.1 MB
    # of a tool path; the pixel grows until there are no more
    picture_points: int = _size(SHOWN, 150_000, 300)
    picture_dense: int = _size(SHOWN, 60_000, 100)  # points from which on thick lines would hide each other
    table_corners: int = _size(SHOWN, 1_000, 3)  # a second of layout; `plan.corners` has them all


USUAL = Sizes()


def chosen(said: str) -> Sizes:
    """The sizes of `said`: "" the usual, `small`, or kinds with commas. Raises InputError for others."""
    kinds = {word.strip() for word in said.split(",") if word.strip()}
    unknown = sorted(kinds - {SMALL, *KINDS})
    if unknown:
        known = ", ".join((SMALL, *KINDS))
        raise InputError(f"{VARIABLE}={said}: no kind of sizes is called {unknown[0]}; there are {known}")
    if SMALL in kinds:
        kinds = {*KINDS}
    small = {size.name: size.metadata["small"] for size in fields(Sizes) if size.metadata["kind"] in kinds}
    return replace(USUAL, **small)


SIZES = chosen(os.environ.get(VARIABLE, ""))
