"""`verify`: from a delivered motion to a verdict."""

from collections.abc import Callable

import numpy as np

from planner.base.errors import InputError
from planner.geometry.toolpath import Toolpath
from planner.machine import ROTARY_AXES, Machine
from planner.motion.trajectory import Trajectory
from planner.verifier import contour, error_allocation, findings, samples, travel
from planner.verifier.claims import claims_of
from planner.verifier.exact import exact_faults
from planner.verifier.excess import Kind
from planner.verifier.extruder import extruder_seen
from planner.verifier.filtered import after_filters
from planner.verifier.given import DERIVATIVES, WHOLE, Given
from planner.verifier.limits import NORMAL_NAME, limits_of
from planner.verifier.pieces import program_pieces, widened
from planner.verifier.reading import CHORDS, AnyMotion, Reader, cells_per_period
from planner.verifier.ringing import ringing_of
from planner.verifier.spindle_sync import thread_checks, thread_faults
from planner.verifier.verdict import Verdict

NOT_LIMITED_NAMES = (*DERIVATIVES, "feed", NORMAL_NAME, travel.NAME)
READING = 0.9  # share of a verdict's time that the first reading takes, about [-]


def verify(
    trajectory: Trajectory,
    toolpath: Toolpath,
    machine: Machine,
    *,
    motion: AnyMotion | None = None,
    seed: int = 0,
    given: Given = WHOLE,
    not_limited: tuple[str, ...] = (),
    progress: Callable[[float], None] | None = None,
) -> Verdict:
    """Judge a delivered motion against the programmed path and the machine.

    trajectory  : the delivered samples at dt; only its times, positions and their derivatives are used
    toolpath    : the programmed path (lines, arcs, helices) with feeds, tolerances and stops
    motion      : what the samples were taken from, to be judged between them too, at times chosen here
                  (reading.py); None to judge the samples alone
    seed        : of those times; another one if the motion was changed because of a verdict
    given       : which columns of the trajectory were delivered, and with how many digits
    not_limited : quantities of `NOT_LIMITED_NAMES` that are reported and not judged
    progress    : called now and then with the fraction done (0 to 1)

    Raises InputError if the axes differ, if the trajectory has no samples, or if its times can only be
    milliseconds. Raises ValueError for an unknown name in `not_limited`, and for a toolpath that contradicts
    itself.
    """
    _check_input(trajectory, toolpath, not_limited)
    if motion is None:
        samples.check_unit_of_time(trajectory, toolpath, machine)
    pieces = program_pieces(toolpath)
    limits = limits_of(machine, trajectory, given, not_limited)
    if limits.rounding.any():
        pieces = widened(pieces, more=float(np.linalg.norm(limits.rounding)))
    acceleration = float(np.linalg.norm(machine.limits("acceleration", toolpath.axes)))
    cells = cells_per_period(machine.dt, float(toolpath.tolerance.min()), acceleration)
    between = (cells, True) if machine.interpolation == "cubic" else CHORDS
    reader = Reader(trajectory, motion, limits, given, dt=machine.dt, cells=cells, seed=seed, between=between)
    readings = reader.read(pieces, lambda done: None if progress is None else progress(READING * done))
    apart = contour.apart(readings, pieces, reader.read)
    contour_error, vertex_error = apart.contour_error(), apart.vertex_error()
    checks = findings.limit_checks(readings, toolpath, pieces, not_limited)
    contour_check = apart.contour_check(toolpath)
    end_error, end_faults = findings.end_error(readings, toolpath, limits.rounding)
    complete, order_faults = findings.unvisited(readings, toolpath, pieces)
    vertex_faults = apart.vertex_faults(toolpath)
    if not (contour_check.broken or vertex_faults or order_faults):
        order_faults = findings.out_of_order(readings, toolpath, pieces)
    coarse, notes = samples.digits(trajectory, limits, given, not_limited)
    if motion is None:
        seen = max(contour_error or 0.0, vertex_error or 0.0)
        sparse = samples.density(trajectory, machine, limits, float(toolpath.tolerance.min()), seen)
        coarse, notes = sparse[0] + coarse, sparse[1] + notes
    of_samples = coarse + reader.delivered.period_faults()
    of_samples += reader.comparison.faults(limits, readings) if reader.comparison is not None else []
    of_samples += findings.column_faults(readings, limits, toolpath, pieces)
    of_samples += samples.rest_faults(reader.delivered, readings, limits, toolpath.velocities)
    passed = findings.joint_times(readings[0], pieces)
    threads = thread_checks(trajectory, passed, toolpath, machine)
    more_checks, of_extruder, more_notes = extruder_seen(trajectory, passed, toolpath, given, not_limited)
    checks, notes = checks | more_checks, notes + more_notes
    after = after_filters(trajectory, toolpath, machine, pieces)
    of_travel = (
        [] if travel.NAME in not_limited else travel.travel_faults(trajectory, toolpath, machine, passed)
    )
    linear_error, angle_error = _both_errors(apart, toolpath)
    corners = error_allocation.check_corners(
        trajectory,
        readings,
        pieces,
        toolpath,
        machine,
        motion=motion if len(readings) > 1 else None,
        limits=limits,
        judged="acceleration" not in not_limited,
    )
    faults = (
        *of_samples,
        *(check.fault(Kind.LIMIT, toolpath.axes) for check in checks.values() if check.broken),
        *end_faults,
        *([contour_check.fault(Kind.CONTOUR, toolpath.axes)] if contour_check.broken else []),
        *vertex_faults,
        *order_faults,
        *of_travel,
        *findings.stop_faults(readings, toolpath, pieces, limits),
        *exact_faults(trajectory, readings, toolpath, limits),
        *thread_faults(threads),
        *of_extruder,
        *(after.faults if after is not None else ()),
        *error_allocation.faults(corners, toolpath.axes),
    )
    excesses = findings.excesses(readings, checks, not_limited)
    excesses += apart.excesses() + error_allocation.excesses(corners)
    excesses += () if after is None else after.excesses
    if progress is not None:
        progress(1.0)
    return Verdict(
        passed=not faults,
        excesses=tuple(sorted(excesses, key=lambda each: each.begin)),
        limits=checks,
        claims=claims_of(readings, limits, checks, machine.interpolation),
        contour=contour_check,
        corners=corners,
        vertex=apart.vertex_check(toolpath),
        contour_error_mm=contour_error,
        linear_error_mm=linear_error,
        angle_error_deg=angle_error,
        vertex_error_mm=vertex_error,
        end_error_mm=end_error,
        lost_after=contour.lost_after(readings, toolpath, pieces, complete=complete),
        threads=threads,
        faults=faults,
        ringing=ringing_of(trajectory, machine),
        notes=tuple(notes),
        after_filters=after,
    )


def _both_errors(apart: contour.Apart, toolpath: Toolpath) -> tuple[float | None, float | None]:
    """The contour error in linear axes [mm] and in rotary ones [deg]; None without these, or if unknown."""
    if not apart.fits or not set(toolpath.axes) & set(ROTARY_AXES):
        return None, None
    linear, rotary = np.max([reading.apart for reading in apart.readings], axis=0)
    return float(linear), float(np.rad2deg(rotary / toolpath.radius))


def _check_input(trajectory: Trajectory, toolpath: Toolpath, not_limited: tuple[str, ...]) -> None:
    if trajectory.axes != toolpath.axes:
        raise InputError(
            f"the trajectory has the axes {' '.join(trajectory.axes)}, the program {' '.join(toolpath.axes)}; "
            "they must be the same in the same order"
        )
    if not len(trajectory):
        raise InputError("the trajectory has no samples")
    for name in set(not_limited) - {*NOT_LIMITED_NAMES}:
        raise ValueError(f"not_limited: '{name}' is not known; allowed are {', '.join(NOT_LIMITED_NAMES)}")
