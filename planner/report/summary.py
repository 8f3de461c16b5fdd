"""A plan, a verdict, a program in numbers, ready for JSON."""

from __future__ import annotations

import dataclasses
import math
import platform
from collections.abc import Mapping
from importlib import metadata
from typing import TYPE_CHECKING, Any

import numpy as np

from planner.nc.info import PLACES_SHOWN
from planner.nc.program import ToolPoint
from planner.report.brief import tool_times
from planner.report.rows import plan_rows

if TYPE_CHECKING:
    from planner.nc.info import ProgramInfo
    from planner.planning.job.plan import Plan
    from planner.sensitivity.records import PriceList

NO_CORNERS = {"count": 0, "worst_speed_ratio": None}  # of a plan without a motion
PACKAGES = ("numpy", "scipy", "numba", "toppra", "pyarrow")


def summary(plan: Plan) -> dict[str, Any]:
    """The plan in numbers, ready for JSON: what `planner plan --json` prints."""
    verdict = plan.verdict
    return json_ready(
        {
            "program": plan.program.source,
            "assumptions": plan.program.assumptions,
            "machine": plan.machine.name,
            "method": plan.method,
            "geometry": plan.geometry,
            "corner": plan.corner,
            "solver": plan.solver,
            "status": plan.status.name,
            "sentence": plan.sentence,
            "cycle_time_s": plan.trajectory.cycle_time if plan.trajectory is not None else None,
            "beside_motion": beside_summary(plan),
            "tools_s": tool_times(plan),
            "stop_time_s": plan.stop_time,
            "least_time_s": plan.least_time,
            "tolerance_mm": plan.toolpath.same_tolerance,
            "verdict": verdict.summary() if verdict is not None else None,
            "corners": plan.corners.summary() if plan.corners is not None else NO_CORNERS,
            "held_by": dict(plan.grid.ranked()) if plan.grid is not None else None,
            "prices": price_summary(plan.prices) if plan.prices is not None else None,
            "reading": plan.program.reading.changed(),
            "blocks": len(plan.program),
            "tool_point": tool_point_summary(plan.program.tool_point),
            "grid_points": plan.grid_points,
            "notes": plan.notes,
            "timings_s": plan.timings,
            "versions": versions(),
            "told": plan_rows(plan),
        }
    )


def info_summary(info: ProgramInfo) -> dict[str, Any]:
    """The figures of a program, ready for JSON. Keys and units are those of the fields of `ProgramInfo`.

    Of `unsupported` the first `PLACES_SHOWN` are listed; `unsupported_places` counts them all.
    """
    fields = {field.name: getattr(info, field.name) for field in dataclasses.fields(info)}
    fields["tool_point"] = tool_point_summary(info.tool_point)
    fields["expansion"] = None if info.expansion is None else dataclasses.asdict(info.expansion)
    fields["unsupported"] = [dataclasses.asdict(fault) for fault in info.unsupported[:PLACES_SHOWN]]
    fields["unsupported_places"] = len(info.unsupported)
    return json_ready(fields)


def tool_point_summary(point: ToolPoint | None) -> dict[str, Any] | None:
    """Where the tool centre point is on, and the tool's length; None where x, y and z are those of the
    joints."""
    return None if point is None else dataclasses.asdict(point)


def price_summary(prices: PriceList) -> dict[str, Any]:
    """The prices of a plan in numbers."""
    from planner.sensitivity.prices import MORE_LIMIT, MORE_TOLERANCE  # scipy

    dear = prices.corners
    return {
        "limits": prices.limits,
        "feed": prices.feed,
        "tolerance": prices.tolerance,
        "more_limit": MORE_LIMIT,
        "more_tolerance_mm": MORE_TOLERANCE,
        "saved_s": prices.saved,
        "saved_range_s": {name: list(between) for name, between in prices.ranges.items()},
        "hints": list(prices.hints),
        "corners": None
        if dear is None
        else [
            {
                "line": dear.line[k],
                "position_mm": dear.position[k],
                "theta_deg": np.rad2deg(dear.theta[k]),
                "price_s_per_mm": dear.price[k],
                "saved_s": dear.saved[k],
            }
            for k in range(len(dear))
        ],
    }


def beside_summary(plan: Plan) -> dict[str, Any]:
    """The auxiliary time: how often, how long each, the sum, and the total with the motion [s]; None where
    a time is not known. `dwell_s` is part of the cycle time."""
    beside = plan.beside
    seconds = sum(it.seconds for it in beside)
    return {
        "dwell_s": float(plan.program.dwell.sum()),
        "counted": [
            {"what": it.what, "count": it.count, "each_s": it.each}
            | ({"because": it.because} if it.each is None else {})
            for it in beside
        ],
        "known_s": seconds,
        "total_s": None if plan.trajectory is None else plan.trajectory.cycle_time + seconds,
        "complete": all(it.each is not None for it in beside),
    }


def versions() -> dict[str, str]:
    """Versions of this package, of Python, and of the packages that compute."""
    found = {"planner": metadata.version("feedrate-planner"), "python": platform.python_version()}
    return found | {name: metadata.version(name) for name in PACKAGES}


def json_ready(value: Any) -> Any:
    """Numbers, strings, lists and dictionaries only; NaN and infinity, which JSON lacks, become None."""
    if isinstance(value, Mapping):
        return {str(key): json_ready(item) for key, item in value.items()}
    if isinstance(value, (list, tuple, np.ndarray)):
        return [json_ready(item) for item in value]
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
