"""LinuxCNC's own trajectory planner as a peer: the module of its package, stepped without a machine (linuxcnc_planner.c).

What LinuxCNC's interpreter and task do before their planner is done here: limits of each move from those of the axes, G64 P and Q0,
rest at dwells. What they do after it is left out: the joints' cubic interpolation, which smooths the positions over four periods. Jerk
is not limited, for LinuxCNC knows no limit of it.

It misses corners by a little more than P, and joints with arcs by up to a fifth more. So that it is not beaten by that, P is the
largest of `SHARES` of the tolerance with which the verdict passes; where none does, the motion with all of it is what the row shows.
"""

from __future__ import annotations

import functools
import math
import shutil
import subprocess
import tempfile
from pathlib import Path

import numpy as np

import planner
from benchmarks.runner.judged import Judged, NotApplicable, NotHere
from planner.base.arrays import Array, FloatArray
from planner.base.errors import NotSolvedError
from planner.machine import Machine
from planner.nc.program import MOVES, Kind, PathControl, Program

SOURCE = Path(__file__).with_name("linuxcnc_planner.c")
MODULE = Path("/usr/lib/linuxcnc/modules/tpmod.so")
HEADERS = Path("/usr/include/linuxcnc")
AXES = ("x", "y", "z")
ENDS = {PathControl.EXACT_STOP: 0, PathControl.EXACT_PATH: 1, PathControl.BLEND: 2}
RAPID, FEED = 1, 2  # motion types of motion_types.h
NORMAL = (
    math.sqrt(3.0) / 2.0
)  # share of the acceleration that its interpreter leaves arcs across (emccanon.cc) [-]
SHARES = (1.0, 0.98, 0.9, 0.7, 0.5)  # of the tolerance: P of G64
AT_REST = 1e-9  # a step of a period below this is none [mm]


def linuxcnc(program: Program, machine: Machine, tolerance: float | None) -> Judged:
    """The motion of LinuxCNC's planner. Raises NotHere without its package, NotApplicable for what it or this adapter cannot do, and
    NotSolvedError where the planner refuses a move."""
    _check(program, machine)
    first = None
    for share in SHARES:
        found = _judged(program, machine, tolerance, share)
        if found.verdict.passed:
            return found
        first = first or found
    assert first is not None
    return first


def _judged(program: Program, machine: Machine, tolerance: float | None, share: float) -> Judged:
    """The motion with a share of the tolerance as P, judged with all of it."""
    given = records_of(program, machine, tolerance, share).encode()
    ran = subprocess.run([str(_host()), str(MODULE)], input=given, capture_output=True, check=False)
    if ran.returncode != 0:
        raise NotSolvedError(" ".join(ran.stderr.decode(errors="replace").split()))
    q = _without_ends(np.frombuffer(ran.stdout).reshape(-1, 3), program)
    t = machine.dt * np.arange(len(q))
    columns = [AXES.index(letter) for letter in program.axes]
    letters = "".join(program.axes)
    verdict = planner.verify(
        t, q[:, columns], program, machine, axes=letters, tolerance=tolerance, not_limited=("jerk",)
    )
    return Judged(verdict=verdict, cycle_s=float(t[-1]), free=("jerk",))


def _check(program: Program, machine: Machine) -> None:
    """Raises NotApplicable for a job that is not LinuxCNC's planner's, and NotHere without it."""
    if set(program.axes) - set(AXES):
        raise NotApplicable("x, y and z only")
    if (program.kind == Kind.SPLINE).any():
        raise NotApplicable("lines and arcs only: its interpreter makes arcs of splines")
    if len(program.synchronised):
        raise NotApplicable("moves in step with the spindle need a spindle")
    if len(program.extruded):
        raise NotApplicable("LinuxCNC knows no extruder that follows the path")
    if machine.fir is not None or machine.modes:
        raise NotApplicable("LinuxCNC has no filters behind its planner")
    if not (MODULE.is_file() and HEADERS.is_dir() and shutil.which("gcc")):
        raise NotHere("LinuxCNC is not here (apt-get install linuxcnc-uspace linuxcnc-uspace-dev gcc)")


@functools.cache
def _host() -> Path:
    """The compiled host of the module, once per process. Raises NotHere where it cannot be compiled."""
    folder = tempfile.TemporaryDirectory(prefix="linuxcnc-")
    host = Path(folder.name) / "linuxcnc_planner"
    flags = ("-O2", "-w", "-DRTAPI", "-DUSPACE", f"-I{HEADERS}")
    made = subprocess.run(
        ["gcc", *flags, str(SOURCE), "-o", str(host), "-rdynamic", "-ldl", "-lm"],
        capture_output=True,
        text=True,
        check=False,
    )
    if made.returncode != 0:
        raise NotHere(f"the host of LinuxCNC's planner does not compile: {made.stderr.strip()[:200]}")
    _KEPT.append(folder)
    return host


_KEPT: list[tempfile.TemporaryDirectory[str]] = []  # folders that live as long as the process


def records_of(program: Program, machine: Machine, tolerance: float | None, share: float = 1.0) -> str:
    """The program as records for linuxcnc_planner.c. P is a share of the tolerance of the job [mm], None for the program's or the
    machine's."""
    limits = _limits(machine)
    columns = [AXES.index(letter) for letter in program.axes]
    ends = np.zeros((len(program) + 1, 3))
    ends[:, columns] = np.vstack([program.start, program.end])
    within = np.full(len(program), tolerance) if tolerance is not None else program.tolerance
    within = share * np.where(np.isnan(within), machine.tolerance, within)
    feed = np.minimum(program.feed, math.inf if machine.feed_max is None else machine.feed_max)
    rests = _rests_after(program, machine)
    arcs = {int(block): k for k, block in enumerate(program.arc_block)}
    lines = ["machine " + _words(machine.dt, *limits.ravel()), "start " + _words(*ends[0])]
    for b, kind in enumerate(program.kind):
        if kind not in MOVES:
            lines.append(f"rest {round(program.dwell[b] / machine.dt)}")
            continue
        condition = 0 if rests[b] else ENDS[PathControl(program.path_control[b])]
        lines.append(f"ends {condition} " + _words(within[b]))
        if b in arcs:
            lines.append(_arc(program, arcs[b], ends[b], ends[b + 1], float(feed[b]), limits))
        elif (ends[b] != ends[b + 1]).any():
            top, most = _straight(ends[b + 1] - ends[b], limits)
            rapid = kind == Kind.RAPID
            asked = _words(min(float(feed[b]), top), top, most)
            lines.append(f"line {_words(*ends[b + 1])} {RAPID if rapid else FEED} {asked}")
    return "\n".join(lines) + "\n"


def _limits(machine: Machine) -> FloatArray:
    """(2, 3) velocity [mm/s] and acceleration [mm/s2] of x, y and z; of a machine without z, which stands still, 1."""
    there = AXES if "z" in machine.axes else AXES[:2]
    limits = np.ones((2, 3))
    limits[0, : len(there)] = machine.limits("velocity", there)
    limits[1, : len(there)] = machine.limits("acceleration", there)
    return limits


def _rests_after(program: Program, machine: Machine) -> Array:
    """(B,) True where the motion comes to rest: between rapids and feed moves, unless the machine rounds there."""
    rests = np.zeros(len(program), dtype=bool)
    if not machine.blend_rapids:
        moves = np.flatnonzero(np.isin(program.kind, MOVES))
        rapid = program.kind[moves] == Kind.RAPID
        rests[moves[:-1][rapid[1:] != rapid[:-1]]] = True
    return rests


def _straight(step: FloatArray, limits: FloatArray) -> tuple[float, float]:
    """Largest speed [mm/s] and acceleration [mm/s2] along a straight move (3,) within limits (2, 3) of the axes."""
    top, most = np.linalg.norm(step) / (np.abs(step) / limits).max(axis=1)
    return float(top), float(most)


def _arc(
    program: Program, k: int, start: FloatArray, end: FloatArray, feed: float, limits: FloatArray
) -> str:
    """Record of arc k; its speed and acceleration as LinuxCNC's interpreter allows them."""
    center = np.zeros(3)
    center[[AXES.index(letter) for letter in program.axes]] = program.arc_center[k]
    axial, sweep = AXES.index(program.axes[program.arc_normal[k]]), float(program.arc_sweep[k])
    plane = [axis for axis in range(3) if axis != axial]
    normal = np.eye(3)[axial]
    turns = max(math.ceil(abs(sweep) / (2.0 * math.pi) - 1e-9), 1)
    radius = float(np.linalg.norm((start - center)[plane]))
    growth = float(np.linalg.norm((end - center)[plane])) - radius
    axis_top, axis_most = limits[:, plane].min(axis=1)
    around = math.hypot(growth / sweep, min(radius, radius + growth))
    planar = math.hypot(min(radius, radius + growth) * abs(sweep), growth)
    whole = math.hypot(planar, float(end[axial] - start[axial]))
    by_move = (np.abs(end - start) / limits).max(axis=1)
    top = whole / max(float(by_move[0]), planar / min(axis_top, math.sqrt(NORMAL * axis_most * around)))
    most = whole / max(float(by_move[1]), planar / axis_most)
    numbered = turns - 1 if sweep > 0.0 else -turns
    return f"arc {_words(*end, *center, *normal)} {numbered} {_words(min(feed, top), top, most)}"


def _words(*numbers: float) -> str:
    return " ".join(f"{number:.17g}" for number in numbers)


def _without_ends(q: FloatArray, program: Program) -> FloatArray:
    """Positions (T, 3) [mm] without the periods at rest before the first move and after the last, where the program does not wait."""
    steps = np.flatnonzero((np.abs(np.diff(q, axis=0)) > AT_REST).any(axis=1))
    if not len(steps):
        return q[:1]
    waits = program.dwell > 0.0
    first = 0 if waits[0] else int(steps[0])
    last = len(q) - 1 if waits[-1] else int(steps[-1]) + 1
    return q[first : last + 1]
