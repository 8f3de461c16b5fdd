"""Several methods on one job: each is planned and judged, and whatever comes of it is its row.

The best is the fastest motion that passed with every quantity limited. A motion without a jerk limit (method
second-order) is listed beside it, and is the best only if no other passed.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from planner.base.errors import InputError, NotSolvedError
from planner.base.names import METHODS, method_name
from planner.machine import LINEAR_AXES, Machine
from planner.nc.program import Program
from planner.nc.reading import AS_USUAL, Reading
from planner.report.summary import summary

if TYPE_CHECKING:
    from planner.machine.user_limit import OwnLimit
    from planner.planning.job.plan import Plan
    from planner.planning.job.trace import Progress
    from planner.planning.page import Method
    from planner.report.html.data import Samples
    from planner.verifier import Verdict
# Stages of a plan that cost every method the same per second of motion; the others are its planning time.
AFTER_PLANNING = ("read", "sample", "verify")


@dataclass(frozen=True, kw_only=True, repr=False)
class Row:
    """The result of one method.

    outcome       : "passed", "failed" (a limit or the tolerance is exceeded), "not solved" or "refused"
    sentence      : how the plan was solved, the first fault, or the reason why there is no motion
    cycle_time    : [s]; None without a motion, as the following fields
    worst         : for each quantity the largest ratio to its limit, and the name of that limit ("jerk.y")
    free          : quantities that this method does not limit
    contour_error, vertex_error : [mm]
    after_filters : the larger of both behind the filters of the machine [mm]; None without filters, or where
                    it is not known
    corner_ratio  : the largest ratio of eq. 18-19 at the programmed corners [-]; None without corners
    gain          : median of the speed there over eq. 20 of the paper's corner [-]; None where it is not
                    defined
    ringing       : largest amplitude of a linear axis at which a vibration mode rings after the motion [mm];
                    None without modes
    planning_time : computing time without reading, sampling and verification [s]
    summary       : the content of `summary.json`
    shown         : samples of the motion for a page (html/comparison_page.py); None unless asked for
    """

    method: str
    outcome: str
    sentence: str
    cycle_time: float | None = None
    worst: dict[str, tuple[float, str]] | None = None
    free: tuple[str, ...] = ()
    contour_error: float | None = None
    vertex_error: float | None = None
    corner_ratio: float | None = None
    gain: float | None = None
    after_filters: float | None = None
    ringing: float | None = None
    planning_time: float | None = None
    summary: dict[str, Any] | None = None
    shown: Samples | None = field(default=None, compare=False)

    def __repr__(self) -> str:
        """Method, cycle time and outcome, in a line."""
        time = "" if self.cycle_time is None else f"{self.cycle_time:.4f} s, "
        return f"<Row of {self.method}: {time}{self.outcome}>"

    @property
    def passed(self) -> bool:
        """Whether its motion passed the verdict."""
        return self.outcome == "passed"


def compare(
    program: Program | str | Path,
    machine: Machine | str | Path | None = None,
    methods: str | Sequence[str | Method] | None = None,
    *,
    limits: OwnLimit | Sequence[OwnLimit] = (),
    tolerance: float | None = None,
    reading: Reading = AS_USUAL,
    progress: Progress | None = None,
) -> list[Row]:
    """Plan a program with several methods and put them side by side, judged by the same verifier.

    methods   : names, or methods with settings of your own, one name alone too; None for all that have names
    the others : as in `planner.plan`

    Raises InputError for a program or a machine that cannot be read, and for a name that is no method; what a
    method cannot do is its row.
    """
    from planner.planning.job.trace import Stages
    from planner.planning.methods.registry import machine_of, program_of

    machine = machine_of(machine, limits)
    program = program_of(program, machine, reading, Stages(None))
    chosen = METHODS if methods is None else [methods] if isinstance(methods, str) else methods
    for name in chosen:
        if isinstance(name, str):
            method_name(name)
    return [row_of(method, program, machine, tolerance, progress) for method in chosen]


def row_of(
    method: str | Method,
    program: Program,
    machine: Machine,
    tolerance: float | None = None,
    progress: Progress | None = None,
    shown: int = 0,
) -> Row:
    """The row of a method, whatever comes of it.

    shown : samples of the motion to keep for a page, at most; 0 for none
    """
    from planner.planning.methods.registry import plan

    label = method if isinstance(method, str) else _label(method)
    how = {"method": method, "tolerance": tolerance, "progress": progress}
    row, made = tried(label, partial(plan, program, machine, **how))  # type: ignore[arg-type]
    if shown and made is not None and made.solved:
        from planner.report.html.data import samples_of  # only pages need it

        row = replace(row, shown=samples_of(made, shown))
    return row


def tried(label: str, make: Callable[[], Plan]) -> tuple[Row, Plan | None]:
    """The row of a plan that is made now, with the reason where it is refused, and the plan."""
    try:
        plan = make()
    except (InputError, NotSolvedError) as fault:
        return Row(method=label, outcome="refused", sentence=str(fault)), None
    return row_of_plan(label, plan), plan


def _label(method: Method) -> str:
    """A method's repr, which names its settings, or its class."""
    return type(method).__name__ if type(method).__repr__ is object.__repr__ else repr(method)


def row_of_plan(method: str, plan: Plan) -> Row:
    """The row of a plan, solved or not."""
    planning = sum(seconds for stage, seconds in plan.timings.items() if stage not in AFTER_PLANNING)
    if plan.trajectory is None or plan.verdict is None:
        return Row(method=method, outcome="not solved", sentence=plan.sentence, planning_time=planning)
    verdict = plan.verdict
    worst: dict[str, tuple[float, str]] = {}
    for name, check in verdict.limits.items():
        quantity = name.partition(".")[0]
        if np.isfinite(check.ratio) and check.ratio >= worst.get(quantity, (0.0, ""))[0]:
            worst[quantity] = (float(check.ratio), name)
    return Row(
        method=method,
        outcome="passed" if verdict.passed else "failed",
        sentence=plan.sentence if verdict.passed else str(verdict.faults[0]),
        cycle_time=plan.trajectory.cycle_time,
        worst=worst,
        free=verdict.not_limited,
        contour_error=verdict.contour_error_mm,
        vertex_error=verdict.vertex_error_mm,
        corner_ratio=_known(verdict.corners.worst_ratio),
        gain=_known(verdict.corners.gains()[0]),
        after_filters=_after_filters(verdict),
        ringing=_ringing(verdict),
        planning_time=planning,
        summary=summary(plan),
    )


def _after_filters(verdict: Verdict) -> float | None:
    after = verdict.after_filters
    if after is None or after.contour_error_mm is None or after.vertex_error_mm is None:
        return None
    return max(after.contour_error_mm, after.vertex_error_mm)


def _ringing(verdict: Verdict) -> float | None:
    pairs = (pair for mode in verdict.ringing for pair in zip(mode.axes, mode.after.tolist(), strict=True))
    return max((amplitude for axis, amplitude in pairs if axis in LINEAR_AXES), default=None)


def best_of(rows: list[Row]) -> Row | None:
    """The fastest method that passed, among those that limit every quantity if there is one; None if none
    passed."""
    passed = [row for row in rows if row.passed]
    candidates = [row for row in passed if not row.free] or passed
    return min(candidates, key=lambda row: row.cycle_time or np.inf, default=None)


def _known(value: float) -> float | None:
    return value if np.isfinite(value) else None
