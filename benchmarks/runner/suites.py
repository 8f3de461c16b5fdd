"""Suites: sets of jobs as data. Jobs are made by the generators of `benchmarks`, and only when they are planned.

The machine is that of jobs/problems.py where nothing else is said: 100 mm/s, 2000 mm/s2 and 2e5 mm/s3 on every axis, 0.05 mm, 1 ms.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from benchmarks.campaign import axes as axes_campaign
from benchmarks.controls import planned_ngc
from benchmarks.cost import growth, long_jobs
from benchmarks.jobs import five_axis, problems, published, random_lines
from benchmarks.jobs.nurbs_chords import chord_program
from benchmarks.runner import grids, nasty
from benchmarks.solvers.random_paths import COPP_LIMITS, CURVES, copp_spline
from planner.base.names import METHODS
from planner.geometry.nurbs import Nurbs
from planner.machine import Machine, load_machine
from planner.machine.kinematics import at_tip
from planner.nc.program import Program
from planner.nc.reader import read_program
from planner.report.interactive.points import tip_path

ROOT = Path(__file__).resolve().parent.parent.parent
SHARED = Path(os.environ.get("PLANNER_SHARED", ROOT.parent / "shared"))
CORNER_ANGLES = (
    1, 2, 5, 10, 20, 30, 45, 60, 75, 90, 105, 120, 135, 150, 160, 170, 174, 176, 178, 179,
)  # [deg]  # fmt: skip
CURVE_TOLERANCES = (0.005, 0.02, 0.1)  # [mm]
CURVE_CHORDS = 0.1  # of the tolerance: what the chords of a curve may leave it by [-]
RELIEFS = (1_000, 3_000, 10_000, 30_000, 100_000)  # blocks
RANDOM_JOBS = 100
AXES_JOBS, AXES, COPP_JOBS = 10, 7, 2
COPP_SCALE = 100.0  # [mm] and [deg] for a unit of the splines that the authors of copp test with
S_POINTS = (161, 321)  # tips of the five-axis piece
GRID_JOBS = (
    "pentagon", "lines and arcs", "circle", "relief", "stops", "seed 3", "90 degrees", "trident 20 um",
)  # fmt: skip
# papers 000, 001 and 003: filters of 50 and 30 ms at 100 mm/s and 2000 mm/s2 [mm/s3]
PAPER_JERK = 2000 / 0.03
PAPER_TOLERANCE = 0.1  # [mm]
RADIAN = 57.3  # radius at which a degree is a millimetre [mm]


@dataclass(frozen=True, kw_only=True)
class Job:
    """A program and what it is planned on.

    program   : makes the program for the machine
    machine   : makes the machine
    tolerance : [mm]; None for the program's or the machine's
    """

    name: str
    program: Callable[[Machine], Program]
    machine: Callable[[], Machine] = problems.machine
    tolerance: float | None = None


@dataclass(frozen=True, kw_only=True)
class Suite:
    """Jobs, what they say, and the ways that are run unless others are asked for.

    absent : why there are no jobs here; None where there are
    scales : whether its jobs differ in their number of blocks, so that planning time over it says something
    merits : whether its rows have a bound and the saturation of limits (their processor time has both in it)
    """

    says: str
    jobs: Callable[[], list[Job]]
    ways: tuple[str, ...]
    absent: Callable[[], str | None] = lambda: None
    scales: bool = False
    merits: bool = False


MODELS = ("linuxcnc (model)", "grbl (model)", "klipper (model)")
QUICK_WAYS = ("optimal", "optimal:quick", "second-order", "kinematic", "fir", "bezier", "stop")
COPP_WAYS = ("copp", "copp:quick", "copp-lp:quick")
SMALL = (
    *METHODS,
    "optimal:quick",
    "optimal:best",
    "toppra",
    "sequential-convex",
    *COPP_WAYS,
    "ruckig",
    "linuxcnc",
    "ipopt",
    "fatrop",
    *MODELS,
)
USUAL = (*QUICK_WAYS, "toppra", "copp", "copp:quick", "ruckig", "linuxcnc", *MODELS)
RANDOM_RIVALS = ("stop", "kinematic", "optimal/bezier", "optimal/fir", "optimal/kinematic")
PUBLISHED_WAYS = ("optimal", "optimal:quick", *QUICK_WAYS[2:-1], "fir-plain", "stop")
LARGE = ("optimal", "optimal:quick", "second-order", "toppra", "linuxcnc", "kinematic", "stop", *MODELS)


def made(make: Callable[[], Program]) -> Callable[[Machine], Program]:
    """A program that does not depend on the machine."""
    return lambda machine: make()


def text(make: Callable[[], str]) -> Callable[[Machine], Program]:
    """A program from its text."""
    return lambda machine: read_program(text=make(), machine=machine)


def curve(name: str) -> Nurbs:
    """A curve of curves.json: the butterfly or the trident."""
    given = CURVES[name]
    columns = {key: np.array(given[key], float) for key in ("points", "knots", "weights")}
    return Nurbs(degree=given["degree"], **columns)


def chords(name: str, machine: Machine) -> Program:
    """A curve of curves.json as chords within a tenth of the machine's tolerance."""
    return chord_program(curve(name), CURVE_CHORDS * machine.tolerance, problems.FEED)


def papers() -> list[Job]:
    """The jobs on which the four papers show their figures, as docs/papers.md reads them."""
    paper = partial(problems.machine, jerk=PAPER_JERK, tolerance=PAPER_TOLERANCE)
    kinematic = partial(problems.machine, jerk=PAPER_JERK, tolerance=PAPER_TOLERANCE, dt=5e-4)
    right_angle = [[0, 0], [20, 0], [20, 20]]
    return [
        Job(name="000 pentagon", program=made(problems.pentagon), machine=paper),
        Job(name="000 zig-zag", program=made(problems.zigzag), machine=paper),
        Job(name="001 butterfly", program=partial(chords, "butterfly"), machine=paper),
        Job(name="001 trident", program=partial(chords, "trident"), machine=paper),
        Job(name="002 five points", program=made(problems.five_points), machine=problems.five_points_machine),
        Job(name="003 corner", program=made(lambda: problems.polyline(right_angle)), machine=kinematic),
    ]


def from_literature() -> list[Job]:
    """The cases of jobs/published.py."""
    return [Job(name=one.name, program=made(one.program), machine=one.machine) for one in published.CASES]


def corners() -> list[Job]:
    """Two legs of 20 mm, the first along x."""
    return [
        Job(name=f"{degrees} degrees", program=made(partial(problems.corner, np.deg2rad(degrees))))
        for degrees in CORNER_ANGLES
    ]


def curves() -> list[Job]:
    """The NURBS of the literature as chords."""
    return [
        Job(
            name=f"{name} {1e3 * tolerance:g} um",
            program=partial(chords, name),
            machine=partial(problems.machine, tolerance=tolerance),
        )
        for name in CURVES
        for tolerance in CURVE_TOLERANCES
    ]


def dense() -> list[Job]:
    """Blocks far shorter than the tolerance and the distance of a period."""
    return [
        Job(name="circle of 360", program=made(problems.chord_circle)),
        Job(name="spiral of 1,000", program=made(problems.star_spiral)),
        Job(name="carving, 4,000 blocks", program=text(partial(long_jobs.carving, 4_000))),
        Job(name="contour, 4,000 blocks", program=text(partial(long_jobs.contour, 4_000))),
        Job(
            name="loops of 1 um",
            program=text(partial(planned_ngc.micro_blocks, planned_ngc.loops, 1e-3, 4_000)),
        ),
        Job(
            name="wave of 10 um",
            program=text(partial(planned_ngc.micro_blocks, planned_ngc.wave, 1e-2, 4_000)),
        ),
    ]


def relief() -> list[Job]:
    """Rows of a milled relief, one run without a stop."""
    mill = partial(load_machine, "mill")
    return [
        Job(name=f"{blocks:,} blocks", program=text(partial(growth.relief, blocks)), machine=mill)
        for blocks in RELIEFS
    ]


def axes7() -> list[Job]:
    """The random jobs of campaign/axes.py that have seven axes, and the splines of copp's own tests as 1,000 lines."""
    seeds = [seed for seed in range(200) if len(axes_campaign.job(seed)[1].axes) == AXES][:AXES_JOBS]
    return [
        Job(
            name=f"seed {seed}",
            program=text(lambda seed=seed: axes_campaign.job(seed)[0]),
            machine=lambda seed=seed: axes_campaign.job(seed)[1],
        )
        for seed in seeds
    ] + [
        Job(name=f"copp spline {seed}", program=text(partial(copp_text, seed)), machine=copp_machine)
        for seed in range(COPP_JOBS)
    ]


def copp_text(seed: int) -> str:
    """The spline of random_paths.copp_spline as lines, its tangents summed up by the trapezoidal rule."""
    problem = copp_spline(seed)
    step = 0.5 * COPP_SCALE * (problem.d1[1:] + problem.d1[:-1]) * np.diff(problem.s)[:, None]
    lines = [
        " ".join(f"{letter}{value:.5f}" for letter, value in zip("XYZUVWA", at, strict=True))
        for at in np.cumsum(step, axis=0)
    ]
    return "\n".join(["G21 G90 G94 F60000", *(f"G1 {line}" for line in lines), "M2", ""])


def copp_machine() -> Machine:
    """Copp's mean limits on every axis."""
    limits = {name: COPP_SCALE * value for name, value in COPP_LIMITS.items()}
    return Machine(
        name="copp",
        dt=0.004,
        tolerance=PAPER_TOLERANCE,
        rotary_radius=RADIAN,
        axes=dict.fromkeys("xyzuvwa", limits),
    )


def five_axes() -> list[Job]:
    """The S-shaped test piece of jobs/five_axis.py, judged at the tip with the limits of all joints."""
    return [
        Job(
            name=f"S piece of {points}",
            program=partial(_s_piece, points),
            machine=lambda: at_tip(five_axis.machine()),
        )
        for points in S_POINTS
    ]


def _s_piece(points: int, machine: Machine) -> Program:
    tips, directions = five_axis.s_piece(points)
    return tip_path(five_axis.machine(), tips, directions=directions, feed=five_axis.FEED)


def random() -> list[Job]:
    """The first random jobs of jobs/random_lines.py, each on a machine of its own."""
    return [
        Job(
            name=f"seed {seed}",
            program=made(lambda seed=seed: random_lines.job(seed)[0]),
            machine=lambda seed=seed: random_lines.job(seed)[1],
        )
        for seed in range(RANDOM_JOBS)
    ]


def difficult() -> list[Job]:
    """What has broken planners before (nasty.py)."""
    return [
        Job(
            name=name,
            program=text(lambda name=name: nasty.PROGRAMS[name]),
            machine=nasty.MACHINES.get(name, problems.machine),
        )
        for name in nasty.PROGRAMS
    ]


def programs() -> list[Job]:
    """The real programs of ../shared/nc, smallest first."""
    files = [file for file in (SHARED / "nc").glob("*") if file.suffix not in (".csv", ".h")]
    return [
        Job(
            name=file.name.rpartition("__")[2],
            program=lambda machine, file=file: read_program(file, machine),
            machine=partial(load_machine, "mill"),
        )
        for file in sorted(files, key=lambda file: (file.stat().st_size, file.name))
    ]


def _no_programs() -> str | None:
    return None if (SHARED / "nc").is_dir() else f"no folder {SHARED / 'nc'} (PLANNER_SHARED names another)"


def quick() -> list[Job]:
    """Small jobs of every kind, for every change of the code."""
    machine = problems.machine
    return [
        Job(name="pentagon", program=made(problems.pentagon)),
        Job(name="zigzag", program=made(partial(problems.zigzag, 10)), machine=partial(machine, jerk=5e4)),
        Job(name="five points", program=made(problems.five_points), machine=problems.five_points_machine),
        Job(name="lines and arcs", program=text(lambda: nasty.LINES_AND_ARCS)),
        Job(name="circle", program=made(partial(problems.chord_circle, 90))),
        Job(name="spiral", program=made(partial(problems.star_spiral, 60))),
        Job(name="relief", program=made(nasty.small_relief)),
        Job(name="stops", program=text(lambda: nasty.STOPS)),
        *(one for one in difficult() if one.name in nasty.QUICK),
        *(one for one in random() if one.name in ("seed 3", "seed 7")),
    ]


def on_grids() -> list[Job]:
    """Jobs of other suites that are small on every grid."""
    return [
        *(one for one in quick() if one.name in GRID_JOBS),
        *(one for one in corners() if one.name in GRID_JOBS),
        *(one for one in curves() if one.name in GRID_JOBS),
    ]


SUITES: dict[str, Suite] = {
    "quick": Suite(says="small jobs of every kind; the guard of the test suite", jobs=quick, ways=QUICK_WAYS),
    "papers": Suite(says="the jobs of the four papers", jobs=papers, ways=SMALL),
    "published": Suite(
        says="cases with published times", merits=True, jobs=from_literature, ways=PUBLISHED_WAYS
    ),
    "corners": Suite(says="single corners of 1 to 179 degrees", jobs=corners, ways=(*USUAL, "tube")),
    "curves": Suite(says="butterfly and trident as chords, three tolerances", jobs=curves, ways=USUAL),
    "dense": Suite(says="chords of 1 um to 0.2 mm, carving and micro blocks", jobs=dense, ways=LARGE),
    "relief": Suite(
        says="a relief of 1,000 to 100,000 blocks: how planning grows", scales=True, jobs=relief, ways=LARGE
    ),
    "axes7": Suite(
        says="random jobs in seven axes", jobs=axes7, ways=(*QUICK_WAYS, "toppra", *COPP_WAYS[1:])
    ),
    "five-axis": Suite(
        says="an S-shaped piece on a tilting rotary table",
        jobs=five_axes,
        ways=("optimal", "optimal:quick", "second-order", "toppra", "copp:quick"),
    ),
    "grids": Suite(says="the same motions on coarser and finer grids", jobs=on_grids, ways=tuple(grids.WAYS)),
    "nasty": Suite(says="what has broken planners before", jobs=difficult, ways=USUAL),
    "random": Suite(
        says="random lines and arcs on random machines", jobs=random, ways=(*USUAL, *RANDOM_RIVALS[2:])
    ),
    "programs": Suite(
        says="real programs of ../shared/nc", scales=True, jobs=programs, ways=LARGE, absent=_no_programs
    ),
}
