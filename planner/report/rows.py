"""What is said of a plan and of a verdict: one list of labels and texts, which the terminal prints, `summary.json` holds under `told`,
and the report and the card of a notebook show. Nothing else puts these figures into words.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from planner.base.names import SINGLE_CORNERS
from planner.base.units import MICROMETRE
from planner.report.beside import beside_rows
from planner.report.optimum import held_by_text, price_rows
from planner.report.times import hours_text

if TYPE_CHECKING:
    from planner.base.arrays import FloatArray
    from planner.planning.job.plan import Plan
    from planner.verifier import Ringing, Verdict

FAULTS_SHOWN = 8  # so that a table fits a terminal of 24 rows
VERDICT, PASSED, FAILED = "verdict", "passed", "FAILED"
Rows = list[tuple[str, str]]


def plan_rows(plan: Plan) -> Rows:
    """The plan in a dozen lines: times, largest ratios, errors, corners, active limits, savings, computing time, how it was solved."""
    rows: Rows = []
    if plan.trajectory is not None:
        time = plan.trajectory.cycle_time
        rows.append(("cycle time", f"{time:.4f} s{hours_text(time)}"))
        if plan.method != "stop" and np.isfinite(plan.stop_time):
            times = f"{plan.stop_time:.4f} s, {plan.stop_time / time:.2f} times as long"
            rows.append(("stopping at every block", times))
        rows += beside_rows(plan.beside, time, float(plan.program.dwell.sum()))
    if plan.verdict is not None:
        rows += verdict_rows(plan.verdict)
    if plan.grid is not None:
        rows.append(("held by", held_by_text(plan.grid)))
    if plan.prices is not None and plan.trajectory is not None:
        rows += price_rows(plan.prices, plan.trajectory.cycle_time)
    rows.append(("blocks, grid points", f"{len(plan.program):,}, {plan.grid_points:,}"))
    stages = ", ".join(f"{name} {seconds:.2f}" for name, seconds in plan.timings.items())
    computing = f"{sum(plan.timings.values()):.2f}: {stages}" if stages else "-"
    return [*rows, ("computing time [s]", computing), ("solution", plan.sentence)]


def smoothing(plan: Plan) -> str:
    """How the path was smoothed, where the method's name does not say it."""
    if plan.corner in (None, plan.method):
        return ""
    return f" on {plan.corner} corners" if plan.geometry == SINGLE_CORNERS else f", geometry {plan.geometry}"


def verdict_rows(verdict: Verdict) -> Rows:
    """Largest ratios to the limits, errors, corners, ringing, and whether it passed; where not, why."""
    rows: Rows = []
    for quantity, checks in _by_quantity(verdict).items():
        said = ", ".join(
            f"{name.partition('.')[2] or ''} {ratio_text(check.ratio)}".strip() for name, check in checks
        )
        free = "" if all(check.limited for _, check in checks) else "  (not limited by this method)"
        rows.append((f"{quantity.replace('_', ' ')} / limit", said + free))
    rows.append(("contour error", _micrometres(verdict.contour_error_mm, verdict)))
    if verdict.linear_error_mm is not None:
        both = f"{verdict.linear_error_mm / MICROMETRE:.3f} µm in linear axes, {verdict.angle_error_deg:.4g}° in rotary ones"
        rows.append(("of it", both))
    rows.append(("corners missed by", _micrometres(verdict.vertex_error_mm, verdict)))
    if (after := verdict.after_filters) is not None:
        rows.append(("contour error after the filters", _micrometres(after.contour_error_mm, verdict)))
        rows.append(("corners missed after the filters by", _micrometres(after.vertex_error_mm, verdict)))
    rows.append(("end error", f"{verdict.end_error_mm / MICROMETRE:.3g} µm"))
    rows.append(("corners", verdict.corners.sentence()))
    for mode in verdict.ringing:
        rows.append((f"rings at {mode.frequency:g} Hz", _ringing_text(mode)))
    rows.append((VERDICT, PASSED if verdict.passed else FAILED))
    return rows + [("", fault) for fault in first_of(verdict.sentences, FAULTS_SHOWN)]


def first_of(items: Sequence[str], count: int) -> list[str]:
    """The first of some texts, and how many more there are."""
    more = len(items) - count
    return [*items[:count], *([f"and {more} more"] if more > 0 else [])]


def _ringing_text(mode: Ringing) -> str:
    """Amplitudes after the motion and peaks during it, axis by axis."""

    def said(values: FloatArray) -> str:
        return ", ".join(
            f"{axis} {value / MICROMETRE:.4g} µm" for axis, value in zip(mode.axes, values, strict=True)
        )

    return f"after the motion {said(mode.after)}; at most {said(mode.during)} during it"


def _micrometres(distance: float | None, verdict: Verdict) -> str:
    """A distance [mm], or why it is not known."""
    if distance is None:
        return f"not known: lost after line {verdict.lost_after}" if verdict.lost_after else "not known"
    return f"{distance / MICROMETRE:.3f} µm"


def _by_quantity(verdict: Verdict) -> dict[str, list]:
    """Limits grouped by what stands before the dot: velocity.x, velocity.y -> velocity."""
    groups: dict[str, list] = {}
    for name, check in verdict.limits.items():
        groups.setdefault(name.partition(".")[0], []).append((name, check))
    return groups


def ratio_text(value: float) -> str:
    """A ratio to a limit as text; near 1 with six digits, to which the verdict rounds."""
    if not np.isfinite(value):
        return "-"
    return f"{value:.6f}" if 0.999 < value < 1.01 else f"{value:.4g}"
