"""What a plan says beside its motion: the active limits, what more of them would save, and the corners where tolerance saves most.

The figures come from sensitivity/activity.py and sensitivity/prices.py; here they become words for the terminal and numbers for
`summary.json`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from planner.base.units import MICROMETRE

if TYPE_CHECKING:
    from planner.sensitivity.records import DearCorners, GridHistory, PriceList

LIMITS_SHOWN = 5  # of the limits that save time, the most valuable
SAVED_SHOWN = 5e-4  # what saves less of the cycle time is not worth a place in the table [-]
MILLISECOND = 1e-3  # [s]
NOTHING = "nothing"
HINT = "a hint only"


def held_by_text(grid: GridHistory) -> str:
    """Active limits with their share of the time: "feed 98 %, jerk.y 41 %, ..."."""
    return ", ".join(f"{name} {percent} %" for name, percent in grid.percents())


def held_by_rows(grid: GridHistory, prices: PriceList | None) -> list[tuple[str, int, str]]:
    """What is active, for how many per cent of the time, and what more of it saves: "" where that is not known or nothing."""
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
        rows.append((f"{more} at line", f"saves, in ms, {_by_line(prices.corners)}"))
    return rows


def _by_line(corners: DearCorners) -> str:
    """What more tolerance at the corners saves, by line: "7: 4.4, 4: 2.2"; corners that a loop passes again are added up."""
    passed: dict[int, list[float]] = {}
    for line, saved in zip(corners.line.tolist(), corners.saved.tolist(), strict=True):
        passed.setdefault(line, []).append(saved / MILLISECOND)
    ranked = sorted(passed.items(), key=lambda one: -sum(one[1]))
    return ", ".join(
        f"{line}: {sum(saved):.2g}" + (f" at {len(saved)} corners" if len(saved) > 1 else "")
        for line, saved in ranked
    )


def _seconds(prices: PriceList, name: str) -> str:
    """What more of a limit saves: a number, or a range where a number would say too much."""
    if name not in prices.hints:
        return f"{prices.saved[name]:.3g} s"
    least, most = prices.ranges[name]
    return f"{least:.2g} to {most:.2g} s"


def optimum_summary(grid: GridHistory | None, prices: PriceList | None) -> dict[str, Any]:
    """`held_by` and `prices` of a plan in numbers; None where they are not known."""
    return {
        "held_by": dict(grid.ranked()) if grid is not None else None,
        "prices": _price_summary(prices) if prices is not None else None,
    }


def _price_summary(prices: PriceList) -> dict[str, Any]:
    from planner.sensitivity.prices import MORE_LIMIT, MORE_TOLERANCE

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
