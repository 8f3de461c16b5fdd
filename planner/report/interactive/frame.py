"""The setpoints of a plan as a table of pandas."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

from planner.base.errors import InputError
from planner.planning.job.at_tip import joints_of
from planner.report.trajectory_file import trajectory_columns, units
from planner.report.word_feed import WordFeed

if TYPE_CHECKING:
    import pandas

    from planner.planning.job.plan import Plan


def plan_frame(plan: Plan) -> pandas.DataFrame:
    """`Plan.to_pandas`: a row for each setpoint."""
    try:
        pd = import_module("pandas")
    except ImportError as fault:
        raise InputError(
            "a table needs the package pandas: pip install 'feedrate-planner[notebook]'"
        ) from fault
    trajectory = plan.require().trajectory
    assert trajectory is not None
    joints = joints_of(plan)
    word = WordFeed(plan.toolpath)
    table: pandas.DataFrame = pd.DataFrame(trajectory_columns(trajectory, joints, word.of))
    table.attrs["units"] = units(
        trajectory.axes,
        extruder=plan.toolpath.extrusion is not None,
        tip=joints is not None,
        feed=word.units,
    )
    return table
