"""Pictures of a plan, made for paper: fine lines at 200 dpi, units on every axis, colours that colour-blind readers tell apart.

The tool path coloured by feed (report/toolpath_figure.py), and the profiles over time against their limits (report/profiles_figure.py).
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import matplotlib

from planner.report.profiles_figure import profiles_figure
from planner.report.toolpath_figure import toolpath_figure

if TYPE_CHECKING:
    from planner.planning.job.plan import Plan

STYLE: Any = {
    "font.size": 8.5,
    "axes.titlesize": 9,
    "axes.labelsize": 8.5,
    "axes.linewidth": 0.6,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "xtick.direction": "out",
    "xtick.labelsize": 8,
    "ytick.labelsize": 8,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "legend.fontsize": 8,
    "legend.frameon": False,
    "lines.linewidth": 0.9,
    "savefig.dpi": 200,
}


def write_figures(plan: Plan, directory: Path) -> None:
    """Write `toolpath.png` and `profiles.png` of a solved plan into a directory."""
    with matplotlib.rc_context(STYLE):
        toolpath_figure(plan).savefig(directory / "toolpath.png", bbox_inches="tight")
        profiles_figure(plan).savefig(directory / "profiles.png", bbox_inches="tight")
