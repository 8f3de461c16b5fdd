"""`verify`: from a delivered motion to a verdict."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np

from planner.errors import InputError
from planner.geometry.toolpath import Toolpath
from planner.machine import LINEAR_AXES, Machine
from planner.trajectory import Trajectory
from planner.verify import findings
from planner.verify.dense import PERIOD_ROUNDING, Comparison
from planner.verify.findings import QUANTITIES, Look
from planner.verify.pieces import pieces_of
from planner.verify.ringing import ringing_of
from planner.verify.stream import Limits, watch
from planner.verify.verdict import Verdict

NOT_LIMITED_NAMES = (*QUANTITIES, "feed", "normal_acceleration")


def verify(
    trajectory: Trajectory,
    toolpath: Toolpath,
    machine: Machine,
    *,
    dense: Iterable[Trajectory] | None = None,
    not_limited: tuple[str, ...] = (),
    progress: Callable[[float], None] | None = None,
) -> Verdict:
    """Judge a delivered motion against the programmed path and the machine.

    trajectory  : the delivered samples at dt; only its times, positions and their derivatives are looked at
    toolpath    : the programmed path (lines, arcs, helices) with feeds, budgets and stops
    dense       : the same motion evaluated between the samples too: chunks in order, adjoining or overlapping; None to
                  judge the samples alone
    not_limited : quantities that are reported but not part of passing, of `NOT_LIMITED_NAMES`
    progress    : called now and then with the share that is done, 0 to 1

    Raises InputError if the axes differ or the trajectory has no samples, ValueError for an unknown name in `not_limited` and
    for a toolpath that contradicts itself.
    """
    _check_input(trajectory, toolpath, not_limited)
    pieces = pieces_of(toolpath)
    limits = _limits(machine, toolpath, not_limited)
    share = 0.5 if dense is not None else 1.0

    def delivered_done(samples: int) -> None:
        if progress:
            progress(share * samples / len(trajectory))

    looks = [Look(watch([trajectory], pieces, limits, middles=True, progress=delivered_done), "")]
    faults = _sampling_faults(trajectory)
    if dense is not None:
        comparison = Comparison(trajectory, lambda done: progress(0.5 + 0.5 * done) if progress else None)
        seen = watch(comparison.pass_on(dense), pieces, limits, middles=False, progress=lambda samples: None)
        if seen.samples:
            looks.append(Look(seen, "between the samples"))
        faults += comparison.faults(limits, looks)

    checks = findings.limit_checks(looks, toolpath, machine, pieces, not_limited)
    contour, vertex = (
        findings.contour_check(looks, toolpath, pieces),
        findings.vertex_check(looks, toolpath, pieces),
    )
    end_error, end_faults = findings.end_error(looks, toolpath)
    lost, order, order_faults = findings.order(looks, toolpath, pieces)
    faults += [check.sentence(toolpath.axes) for check in checks.values() if check.broken]
    faults += findings.column_faults(looks, limits, toolpath, pieces)
    faults += end_faults
    faults += [contour.sentence(toolpath.axes)] if contour.broken else []
    faults += findings.vertex_faults(looks, toolpath, pieces)
    faults += order_faults
    faults += findings.stop_faults(looks, toolpath, pieces)
    return Verdict(
        passed=not faults,
        limits=checks,
        contour=contour,
        vertex=vertex,
        contour_error_mm=findings.contour_error(looks),
        vertex_error_mm=findings.vertex_error(looks, pieces),
        end_error_mm=end_error,
        chord_error_mm=findings.chord_error(looks),
        order=order,
        lost=tuple(int(toolpath.block[k]) for k in lost),
        lost_lines=tuple(dict.fromkeys(int(toolpath.line[k]) for k in lost)),
        faults=tuple(faults),
        ringing=ringing_of(trajectory, machine),
    )


def _check_input(trajectory: Trajectory, toolpath: Toolpath, not_limited: tuple[str, ...]) -> None:
    if trajectory.axes != toolpath.axes:
        raise InputError(
            f"the trajectory has the axes {' '.join(trajectory.axes)}, the program {' '.join(toolpath.axes)}; "
            "they must be the same in the same order"
        )
    if not len(trajectory):
        raise InputError("the trajectory has no samples")
    for name in not_limited:
        if name not in NOT_LIMITED_NAMES:
            raise ValueError(
                f"not_limited: '{name}' is not known; allowed are {', '.join(NOT_LIMITED_NAMES)}"
            )


def _limits(machine: Machine, toolpath: Toolpath, not_limited: tuple[str, ...]) -> Limits:
    per_axis = np.array(
        [
            machine.limits("velocity", toolpath.axes),
            machine.limits("acceleration", toolpath.axes),
            machine.limits("jerk", toolpath.axes),
        ]
    )
    return Limits(
        per_axis=per_axis,
        linear=np.array([letter in LINEAR_AXES for letter in toolpath.axes]),
        normal_acceleration=machine.normal_acceleration or np.inf,
        acceleration_at_stop=np.where("acceleration" in not_limited, np.inf, per_axis[1]),
        jerk_limited="jerk" not in not_limited,
    )


def _sampling_faults(trajectory: Trajectory) -> list[str]:
    periods = np.diff(trajectory.t)
    wrong = np.abs(periods - trajectory.dt) > PERIOD_ROUNDING
    if len(wrong):
        wrong[-1] = periods[-1] > trajectory.dt + PERIOD_ROUNDING  # the last one may be shorter
    if not wrong.any():
        return []
    k = int(wrong.argmax())
    return [
        f"period: {periods[k]:.9g} s between the samples at t = {trajectory.t[k]:.6g} s and the next, dt is "
        f"{trajectory.dt:.9g} s ({int(wrong.sum())} such periods)"
    ]
