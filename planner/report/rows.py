"""The rows on a plan and on a verdict: one list of labels and texts, which the terminal prints, `summary.json` holds under
`told`, and report and card show. Nothing else puts these figures into words."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from planner.base.errors import InputError
from planner.base.names import SINGLE_CORNERS
from planner.base.units import MICROMETRE, SECONDS_PER_MINUTE
from planner.controls.timing.times import TIMED, ControlTimes, control_times
from planner.nc.extents import block_boxes, work_box

if TYPE_CHECKING:
    from planner.base.arrays import FloatArray
    from planner.planning.job.beside import Beside
    from planner.planning.job.plan import Plan
    from planner.sensitivity.records import DearCorners, GridHistory, PriceList
    from planner.verifier import Ringing, Verdict


FAULTS_SHOWN = 8  # so that a table fits a terminal of 24 rows
# Of motions by the search more than that [%] is the bound's, not the motion's (benchmarks/results/least-time.md).
WEAK_ABOVE, WEAK = (
    5.0,
    "; it is weak where jerk holds the motion on short blocks and arcs, or the tolerance is large",
)
VERDICT, PASSED, FAILED = "verdict", "passed", "FAILED"
Rows = list[tuple[str, str]]


def plan_rows(plan: Plan) -> Rows:
    """The plan in a dozen lines: times, largest ratios, errors, corners, active limits, savings, computing
    time, how it was solved."""
    rows: Rows = []
    if plan.trajectory is not None:
        time = plan.trajectory.cycle_time
        rows.append(("cycle time", f"{time:.4f} s{hours_text(time)}"))
        rows += saved_rows(plan)
        if plan.least_time:  # 0 where the tolerance allows to stay where one is
            above = time / plan.least_time - 1.0
            said = (
                f"{plan.least_time:.4f} s or more, certified; this motion is {percent_text(above)} above that"
            )
            said += WEAK if 100.0 * above > WEAK_ABOVE else ""
            rows.append(("fastest possible", said))
        rows += beside_rows(plan.beside, time, float(plan.program.dwell.sum()))
    if plan.verdict is not None:
        rows += verdict_rows(plan.verdict)
    if plan.grid is not None:
        rows.append(("held by", ", ".join(f"{name} {percent} %" for name, percent in plan.grid.percents())))
    if plan.prices is not None and plan.trajectory is not None:
        rows += price_rows(plan.prices, plan.trajectory.cycle_time)
    if len(plan.program):
        low, high = block_boxes(plan.program)
        rows += extent_rows(low.min(axis=0), high.max(axis=0), work_box(plan.program, low, high))
    rows.append(("blocks, grid points", f"{len(plan.program):,}, {plan.grid_points:,}"))
    stages = ", ".join(f"{name} {seconds:.2f}" for name, seconds in plan.timings.items())
    computing = f"{sum(plan.timings.values()):.2f}: {stages}" if stages else "-"
    return [*rows, ("computing time [s]", computing), ("solution", plan.sentence)]


# Of controls, as they write themselves.
NAMES = {"linuxcnc": "LinuxCNC", "klipper": "Klipper", "marlin": "Marlin"}


SAVED = "saved"


def saved_rows(plan: Plan) -> Rows:
    """What is saved against the planner of the control that the machine names, else against a stop at every block."""
    if plan.method == "stop" and plan.machine.control is None:
        return []
    assert plan.trajectory is not None
    time, found = plan.trajectory.cycle_time, control_of(plan)
    other, takes, why = "a stop at every block", plan.stop_time, ""
    if found is not None:
        other = f"{NAMES.get(found.control, found.control)}'s own planner (our model of it)"
        takes = found.seconds
        why = ", which limits no jerk" if plan.verdict and "jerk" not in plan.verdict.not_limited else ""
    elif without := _not_in_stop_time(plan):
        return [(SAVED, f"not known: {other} is planned without the limits of {', '.join(without)}")]
    if not np.isfinite(takes):
        return [(SAVED, "not known")]
    saved, gain = takes - time, NOTHING
    if saved > SAVED_SHOWN * takes:
        gain, why = f"{saved:.4g} s, {percent_text(saved / takes)}", ""
    return [(SAVED, f"{gain}, against {other}{why}: {takes:.4f} s of motion")]


def _not_in_stop_time(plan: Plan) -> list[str]:
    """The limits of the motion that `Plan.stop_time` leaves out."""
    of_joints = plan.joints is not None
    powered = np.isfinite(plan.machine.powers(plan.toolpath.axes)).any()
    own = [limit.name for limit in plan.machine.own] if not of_joints else ["the joints"]
    return own + ["drive power"] * bool(powered)


def control_of(plan: Plan) -> ControlTimes | None:
    """What the control that the machine names takes for the program as it is; None where it names none, or
    where there is no model of that, or none for this program."""
    control = plan.machine.control
    if control is None or control.name not in TIMED:
        return None
    try:
        return control_times(plan.program, plan.machine, control.name, plan.toolpath.same_tolerance)
    except InputError:
        return None


def percent_text(share: float) -> str:
    """A share in per cent, with two digits or more."""
    percent = 100.0 * share
    return f"{percent:.0f} %" if percent >= 10.0 else f"{percent:.2g} %"


def extent_rows(low: FloatArray, high: FloatArray, work: tuple[FloatArray, FloatArray] | None) -> Rows:
    """The ends of the programmed path in x, y and z.

    low, high : (A,) in machine coordinates [mm]
    work      : both (3,) as the program has them; None for the same
    """
    boxes = {"extent [mm]": (low, high), "in its own zero": work}
    return [
        (name, ", ".join(f"{c} {a:.3f} to {b:.3f}" for c, a, b in zip("xyz", *box, strict=False)))
        for name, box in boxes.items()
        if box is not None
    ]


def smoothing(plan: Plan) -> str:
    """How the path was smoothed, where the method's name does not say it."""
    if plan.corner in (None, plan.method):
        return ""
    return f" on {plan.corner} corners" if plan.geometry == SINGLE_CORNERS else f", geometry {plan.geometry}"


def verdict_rows(verdict: Verdict) -> Rows:
    """Largest ratios to the limits, errors, corners, ringing, and whether it passed; where not, why."""
    rows: Rows = []
    ratios: dict[str, list[str]] = {}  # by what stands before the dot: velocity.x, velocity.y -> velocity
    for name, check in verdict.limits.items():
        quantity, _, axis = name.partition(".")
        ratios.setdefault(quantity, []).append(f"{axis} {ratio_text(check.ratio)}".strip())
    for quantity, said in ratios.items():
        free = "  (not limited by this method)" if quantity in verdict.not_limited else ""
        rows.append((f"{quantity.replace('_', ' ')} / limit", ", ".join(said) + free))
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
    rows.append(("known between setpoints", verdict.claims.sentence()))
    rows.append((VERDICT, PASSED if verdict.passed else FAILED))
    return rows + [("", fault) for fault in first_of(verdict.sentences, FAULTS_SHOWN)]


def first_of(items: Sequence[str], count: int) -> list[str]:
    """The first of some texts, and how many more there are."""
    more = len(items) - count
    return [*items[:count], *([f"and {more} more"] if more > 0 else [])]


def _ringing_text(mode: Ringing) -> str:
    """Amplitudes after the motion and peaks during it, axis by axis."""

    def said(values: FloatArray) -> str:
        pairs = zip(mode.axes, values, strict=True)
        return ", ".join(f"{axis} {value / MICROMETRE:.4g} µm" for axis, value in pairs)

    return f"after the motion {said(mode.after)}; at most {said(mode.during)} during it"


def _micrometres(distance: float | None, verdict: Verdict) -> str:
    """A distance [mm], or why it is not known."""
    if distance is None:
        return f"not known: lost after line {verdict.lost_after}" if verdict.lost_after else "not known"
    return f"{distance / MICROMETRE:.3f} µm"


def ratio_text(value: float) -> str:
    """A ratio to a limit as text; near 1 with six digits, to which the verdict rounds."""
    if not np.isfinite(value):
        return "-"
    return f"{value:.6f}" if 0.999 < value < 1.01 else f"{value:.4g}"


def number_text(value: float | None, form: str, unit: float = 1.0) -> str:
    """A number in a unit, "-" where there is none."""
    return "-" if value is None else format(value / unit, form)


LIMITS_SHOWN = 5  # of the limits that save time, the most valuable
SAVED_SHOWN = 5e-4  # what saves less of the cycle time is not worth a place in the table [-]
MILLISECOND = 1e-3  # [s]
NOTHING = "nothing"
HINT = "a hint only"


def held_by_rows(grid: GridHistory, prices: PriceList | None) -> list[tuple[str, int, str]]:
    """The active limits, for how many per cent of the time, and what more of it saves: "" where that is not
    known or nothing."""
    return [(name, percent, _saves(prices, name)) for name, percent in grid.percents()]


def _saves(prices: PriceList | None, name: str) -> str:
    from planner.sensitivity.prices import MORE_LIMIT, MORE_TOLERANCE

    if prices is None or prices.saved.get(name, 0.0) <= 0.0:
        return ""
    more = f"{MORE_TOLERANCE / MICROMETRE:g} µm" if name == "tolerance" else f"{100.0 * MORE_LIMIT:g} %"
    return f"{more} more: {_seconds(prices, name)}"


def price_rows(prices: PriceList, cycle_time: float) -> list[tuple[str, str]]:
    """Rows of the table of a plan: what more of each limit saves, what more tolerance saves, and where.

    cycle_time : of the plan [s]
    """
    from planner.sensitivity.prices import MORE_LIMIT, MORE_TOLERANCE

    least = SAVED_SHOWN * cycle_time
    ranked = [name for name, saved in prices.ranked() if name != "tolerance" and saved >= least]
    ranked = ranked[:LIMITS_SHOWN]
    told = ", ".join(f"{name} {_seconds(prices, name)}" for name in ranked) or NOTHING
    if set(ranked) & set(prices.hints):
        told += "; ranges are hints only"
    rows = [(f"{100.0 * MORE_LIMIT:g} % more saves", told)]
    more = f"{MORE_TOLERANCE / MICROMETRE:g} µm more"
    if prices.tolerance is None:
        return [*rows, (f"{more} tolerance", "not known on this path")]
    saved = prices.saved["tolerance"]
    if saved >= least and "tolerance" in prices.hints:
        told = f"saves {_seconds(prices, 'tolerance')}, {HINT}"
    elif saved >= least:
        told = f"saves {saved:.3g} s"
    elif saved <= -least:
        told = f"costs {-saved:.3g} s: corners that share a short leg take room from each other"
    else:
        told = f"saves {NOTHING} to speak of"
    rows.append((f"{more} tolerance", told))
    if prices.corners is not None and len(prices.corners):
        rows.append(("most sensitive corners", f"ms saved by {more} tolerance: {_by_line(prices.corners)}"))
    return rows


def _by_line(corners: DearCorners) -> str:
    """The time that more tolerance at the corners saves, by line: "line 7: 4.4, line 4: 2.2"; corners that a loop
    passes again are added up."""
    passed: dict[int, list[float]] = {}
    for line, saved in zip(corners.line.tolist(), corners.saved.tolist(), strict=True):
        passed.setdefault(line, []).append(saved / MILLISECOND)
    ranked = sorted(passed.items(), key=lambda one: -sum(one[1]))
    return ", ".join(
        f"line {line}: {sum(saved):.2g}" + (f" at {len(saved)} corners" if len(saved) > 1 else "")
        for line, saved in ranked
    )


def _seconds(prices: PriceList, name: str) -> str:
    """The time that more of a limit saves: a number, or a range where a number would say too much."""
    if name not in prices.hints:
        return f"{prices.saved[name]:.3g} s"
    least, most = prices.ranges[name]
    if name != "tolerance":
        least = max(least, 0.0)  # more of a limit never costs time
    return f"{least:.2g} to {most:.2g} s"


def beside_rows(beside: Sequence[Beside], cycle_time: float, dwell: float) -> list[tuple[str, str]]:
    """Rows of the table of a plan: dwells, what takes time beside the motion, the total, and what is not in
    it.

    cycle_time : of the motion [s]
    dwell      : of it, as the program sets it [s]
    """
    rows = [("of it dwells", f"{dwell:g} s")] if dwell else []
    known = [it for it in beside if it.each is not None]
    if known:
        seconds = sum(it.seconds for it in known)
        told = ", ".join(f"{_counted(it)} of {it.each:g} s" for it in known)
        rows.append(("beside the motion", f"{seconds:g} s: {told}"))
        total = cycle_time + seconds
        rows.append(("total", f"{total:.4f} s{hours_text(total)}"))
    because: dict[str, list[str]] = {}
    for it in beside:
        if it.each is None:
            because.setdefault(it.because, []).append(_counted(it))
    if because:
        told = "; ".join(f"{', '.join(counted)} ({why})" for why, counted in because.items())
        rows.append(("not in the total" if known else "not in the cycle time", told))
    return rows


def _counted(it: Beside) -> str:
    return f"{it.count:,} {it.what}" + ("s" if it.count > 1 and not it.what.startswith("M") else "")


def hours_text(seconds: float) -> str:
    """A time [s] in hours and minutes, in brackets behind a space; nothing below a minute."""
    if seconds < SECONDS_PER_MINUTE:
        return ""
    minutes, rest = divmod(seconds, SECONDS_PER_MINUTE)
    hours, minutes = divmod(int(minutes), 60)
    return f" ({hours} h {minutes} min {rest:.0f} s)" if hours else f" ({minutes} min {rest:.0f} s)"
