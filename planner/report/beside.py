"""What takes time beside the motion (planning/job/beside.py), in words for the terminal and in numbers for `summary.json`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from planner.report.times import hours_text

if TYPE_CHECKING:
    from planner.planning.job.beside import Beside
    from planner.planning.job.plan import Plan


def beside_rows(beside: Sequence[Beside], cycle_time: float, dwell: float) -> list[tuple[str, str]]:
    """Rows of the table of a plan: dwells, what takes time beside the motion, the total, and what is not in it.

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


def beside_summary(plan: Plan) -> dict[str, Any]:
    """What takes time beside the motion: how often, how long each, the sum, and the total with the motion [s]; None where
    a time is not known. `dwell_s` is part of the cycle time."""
    beside = plan.beside
    seconds = sum(it.seconds for it in beside)
    return {
        "dwell_s": float(plan.program.dwell.sum()),
        "counted": [
            {"what": it.what, "count": it.count, "each_s": it.each, "because": it.because}
            if it.each is None
            else {"what": it.what, "count": it.count, "each_s": it.each}
            for it in beside
        ],
        "known_s": seconds,
        "total_s": None if plan.trajectory is None else plan.trajectory.cycle_time + seconds,
        "complete": all(it.each is not None for it in beside),
    }
