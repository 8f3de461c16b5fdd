"""A job of the campaign as a row: planned, judged by the verifier and by the second judge, and every tenth held against a law."""

from __future__ import annotations

import time
import traceback
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.campaign.course import Blocks, course
from benchmarks.campaign.jobs import Job, job
from benchmarks.campaign.judge import Motion, faults
from benchmarks.campaign.laws import broken, changed, holds
from benchmarks.campaign.tally import CRASH, DOCUMENTED, FAILED, PASSED, REFUSED, UNSOLVED
from planner.base.errors import InputError
from planner.feedrate.solution import Status
from planner.machine import LINEAR_AXES, ROTARY_AXES, Machine
from planner.nc.program import Kind, Program
from planner.planning.job.plan import Plan
from planner.planning.methods.registry import plan
from planner.verifier import Kind as KindOfFault

LAW_EVERY = 10  # jobs
ROUNDING = 1e-9  # of a time [-]
NO_JERK_LIMIT = ("second-order",)
Row = dict[str, Any]


def outcome(seed: int) -> Row:
    """The row of the job of a seed. Nothing that drawing and planning raise is raised here."""
    began = time.process_time()
    try:
        row = row_of(job(seed))
    except Exception as fault:
        row = {"seed": seed} | _crash(fault)
    return row | {"cpu": round(time.process_time() - began, 3)}


def row_of(made: Job) -> Row:
    """The row of a job. Nothing that planning raises is raised here."""
    try:
        return about(made) | _planned(made)
    except Exception as fault:
        return about(made) | _crash(fault)


def _crash(fault: Exception) -> Row:
    at = traceback.extract_tb(fault.__traceback__)[-1]
    return {
        "outcome": CRASH,
        "said": f"{type(fault).__name__}: {fault} ({Path(at.filename).name}:{at.lineno})",
    }


def about(made: Job) -> Row:
    """What a row says of a job before it is planned."""
    machine = made.machine
    return {
        "seed": made.seed,
        "source": made.source,
        "way": made.way,
        "blocks": 0 if made.program is None else len(made.program),
        "axes": "".join(machine.axes),
        "dt": float(f"{machine.dt:.4g}"),
        "tolerance": float(f"{made.tolerance or machine.tolerance:.4g}"),
        "filters": 0 if machine.fir is None else len(machine.fir.time_constants),
        "modes": len(machine.modes),
    }


def _planned(made: Job) -> Row:
    if made.program is None:
        return {"outcome": REFUSED, "said": made.refusal}
    try:
        found = plan(
            made.program, made.machine, method=made.method, tolerance=made.tolerance, **made.settings
        )
    except InputError as fault:
        return {"outcome": REFUSED, "said": str(fault)}
    if found.trajectory is None or found.verdict is None:
        return {"outcome": UNSOLVED, "status": found.status.name, "said": found.sentence}
    second = second_verdict(found, made.tolerance)
    row: Row = {
        "outcome": PASSED if found.verdict.passed else FAILED,
        "status": found.status.name,
        "time": found.cycle_time,
        "samples": len(found.trajectory),
        "said": found.verdict.sentences[0] if found.verdict.sentences else "",
        "second": second,
        **bounded(found),
    }
    if not found.verdict.passed and (why := documented(made, found.verdict.kinds)):
        row |= {"outcome": DOCUMENTED, "why": why}
    return row | (_law(made, found) if made.seed % LAW_EVERY == 0 and found.verdict.passed else {})


def bounded(found: Plan) -> Row:
    """The proved bound beside a motion that passes: `above` it [-], and `below` where the motion is faster than it."""
    least = found.least_time
    if least is None or found.verdict is None or not found.verdict.passed:
        return {}
    above = found.cycle_time / least - 1.0
    return {"above": above} | ({"below": above} if above < -ROUNDING else {})


def documented(made: Job, kinds: frozenset[KindOfFault]) -> str:
    """Why docs/methods.md says that a method's verdict fails with these kinds of faults; empty where it does not."""
    if made.method.endswith("-plain"):
        return "methods as their papers describe them"
    assert made.program is not None
    under_g61 = (
        made.method in ("fir", "fir-spline")
        or "shaped" in made.settings
        or (made.method == "kinematic" and len(made.program.splines))
    )
    return "chords within the tolerance under G61" if under_g61 and kinds <= {KindOfFault.EXACT} else ""


def _law(made: Job, found: Plan) -> Row:
    assert made.program is not None
    rng = np.random.default_rng([43, made.seed])
    other = changed(made.program, made.machine, made.tolerance, rng)
    if other is None or not holds(other.law, made.method):
        return {}
    try:
        after = plan(
            other.program, other.machine, method=made.method, tolerance=other.tolerance, **made.settings
        )
    except InputError as fault:
        return {"law": other.law, "law_said": f"refused: {fault}"}
    if after.trajectory is None or after.verdict is None or not after.verdict.passed:
        said = after.sentence if after.verdict is None else after.verdict.sentences[0]
        return {"law": other.law, "law_said": f"{after.status.name}: {said}"}
    stops = 1 + int(np.isin(made.program.kind, (Kind.STOP, Kind.DWELL, Kind.RAPID)).sum())
    slack = made.machine.dt * (
        stops if found.status in (Status.OPTIMAL, Status.ACCEPTABLE) else len(made.program)
    )
    return {
        "law": other.law,
        "law_time": after.cycle_time,
        "law_broken": broken(other, found.cycle_time, after.cycle_time, slack),
        "law_second": second_verdict(after, other.tolerance),
    }


def second_verdict(found: Plan, tolerance: float | None = None) -> list[str]:
    """What the second judge finds wrong with a plan's samples."""
    assert found.trajectory is not None
    axes = found.trajectory.axes
    asked = course(blocks_of(found.program, found.machine, axes, tolerance))
    return faults(motion_of(found), asked)


def motion_of(found: Plan) -> Motion:
    """The samples and limits of a plan, as arrays."""
    trajectory, machine = found.trajectory, found.machine
    assert trajectory is not None
    axes = trajectory.axes
    limits = np.array([machine.limits(name, axes) for name in ("velocity", "acceleration", "jerk")])
    if found.method in NO_JERK_LIMIT:
        limits[2] = np.inf
    return Motion(
        t=np.array(trajectory.t),
        q=np.array(trajectory.position),
        dt=machine.dt,
        limits=limits,
        linear=np.isin(axes, LINEAR_AXES),
        normal_acceleration=machine.normal_acceleration or np.inf,
        filters=machine.fir.time_constants if machine.fir is not None else (),
    )


def blocks_of(program: Program, machine: Machine, axes: tuple[str, ...], tolerance: float | None) -> Blocks:
    """A program as arrays, for the axes of its motion."""
    of = [program.axes.index(letter) for letter in axes]
    rotary = np.isin(axes, ROTARY_AXES)
    scale = np.where(rotary, machine.radius, 1.0)
    allowed = np.where(np.isnan(program.tolerance), machine.tolerance, program.tolerance)
    return Blocks(
        kind=program.kind,
        start=program.start[of] * scale,
        end=program.end[:, of] * scale,
        feed=program.feed,
        dwell=program.dwell,
        control=program.path_control,
        tolerance=allowed if tolerance is None else np.full(len(program), tolerance),
        arc_block=program.arc_block,
        arc_center=program.arc_center,
        arc_normal=program.arc_normal,
        arc_sweep=program.arc_sweep,
        spline_block=program.splines.block,
        spline_points=program.splines.points[:, :, of] * scale,
        spline_weights=program.splines.weights,
        linear=np.isin(axes, LINEAR_AXES),
        rotary=rotary,
        radius=machine.radius,
        feed_max=machine.feed_max or np.inf,
        blend_rapids=machine.blend_rapids,
    )
