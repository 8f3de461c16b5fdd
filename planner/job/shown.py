"""What a plan shows of itself and writes: tables, pictures, files and pages, for Python and notebooks.

They are made by later stages (report/, interactive/), which know plans; a plan imports them when it is asked for one, by name.
"""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

if TYPE_CHECKING:
    import pandas

    from planner.interactive.figures import PlanFigures
    from planner.interactive.page import ReportPage


class Shown:
    """The part of `Plan` that shows and writes it. Each raises NotSolvedError for a plan without a trajectory."""

    def to_pandas(self) -> pandas.DataFrame:
        """The setpoints as a table of pandas, with the columns of a trajectory file; `attrs["units"]` has their units.

        Raises InputError if pandas is not installed.
        """
        table: pandas.DataFrame = _later("frame").plan_frame(self)
        return table

    @property
    def plot(self) -> PlanFigures:
        """Figures of plotly: `plan.plot.path(color="feed")`, `plan.plot.feed()`, `plan.plot.profiles()`."""
        figures: PlanFigures = _later("figures").PlanFigures(self)
        return figures

    def save(
        self,
        directory: str | Path,
        *,
        trajectory: Literal["parquet", "csv", "npz"] = "parquet",
        plots: bool = False,
        report: bool = False,
        force: bool = False,
    ) -> list[Path]:
        """Write the files that `planner plan -o` writes into a directory, all of them or none.

        trajectory : format of the trajectory
        plots      : with pictures
        report     : with the page that opens in a browser
        force      : replace files of these names even if no run wrote them

        Returns the files.

        Raises InputError if the directory cannot be written, or if a file is in the way that no run wrote.
        """
        files: list[Path] = _later("files").save(
            self, directory, trajectory=trajectory, plots=plots, report=report, force=force
        )
        return files

    def report(self) -> ReportPage:
        """The page that opens in a browser: shown in a notebook, and written by `plan.report().save("report.html")`."""
        page: ReportPage = _later("page").ReportPage(self)
        return page

    def _repr_html_(self) -> str:
        card: str = _later("card").plan_card(self)
        return card


def _later(module: str) -> Any:
    return import_module(f"planner.interactive.{module}")
