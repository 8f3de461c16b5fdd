"""A plan written from Python: the files of `planner plan -o`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from planner.report.export import check_places, write_plan
from planner.report.trajectory_reader import Format

if TYPE_CHECKING:
    from planner.planning.job.plan import Plan


def save(
    plan: Plan, directory: str | Path, *, trajectory: Format, plots: bool, report: bool, force: bool
) -> list[Path]:
    """`Plan.save`."""
    plan.require()
    place = Path(directory)
    source = Path(plan.program.source)
    check_places(
        place,
        [source] if source.is_file() else [],
        file_format=trajectory,
        plots=plots,
        report=report,
        force=force,
    )
    names = write_plan(plan, place, file_format=trajectory, plots=plots, report=report, force=force)
    return [place / name for name in names]
