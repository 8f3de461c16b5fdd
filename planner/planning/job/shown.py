"""The views and files of a plan: tables, pictures, files and pages, for Python and notebooks.

They are made by later stages (report/, report/interactive/), which know plans, and a plan knows none of them:
`planner` says in `VIEWS` what makes each, and it is imported when a plan is asked for it.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any, Literal, Protocol

if TYPE_CHECKING:
    from pathlib import Path

    import pandas
    from plotly.graph_objects import Figure

# "module:name" of what makes each view of a plan; filled in planner/__init__.py.
VIEWS: dict[str, str] = {}


class Figures(Protocol):
    """The figures of a plan; report/interactive/page.py says what they take and raise."""

    def __call__(self) -> Figure:
        """The path, coloured by feed."""

    def path(self, color: str = "feed") -> Figure:
        """The motion over the programmed path."""

    def feed(self, against: Literal["t", "s"] = "t") -> Figure:
        """The feed, over time or over the length of the path."""

    def profiles(self, against: Literal["t", "s"] = "t") -> Figure:
        """Velocity, acceleration and jerk of the axes in per cent of their limits, below the feed."""


class Page(Protocol):
    """The page of a plan (report/interactive/page.py)."""

    def save(self, file: str | Path = "report.html", *, force: bool = False) -> Path:
        """Write it to a file. Raises InputError if it cannot be written."""

    def open(self) -> Path:
        """Show it in the system's browser; returns the file."""


class Shown:
    """The part of `Plan` that shows and writes it. Each raises NotSolvedError without a trajectory."""

    def to_pandas(self) -> pandas.DataFrame:
        """The setpoints as a table of pandas, as in a trajectory file; `attrs["units"]` has their units.

        Raises InputError if pandas is not installed.
        """
        table: pandas.DataFrame = _view("to_pandas")(self)
        return table

    @property
    def plot(self) -> Figures:
        """Figures of plotly: `plan.plot.path(color="feed")`, `plan.plot.feed()`, `plan.plot.profiles()`."""
        figures: Figures = _view("plot")(self)
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
        files: list[Path] = _view("save")(
            self, directory, trajectory=trajectory, plots=plots, report=report, force=force
        )
        return files

    def report(self) -> Page:
        """The page for the browser: shown in a notebook, written by `plan.report().save("report.html")`."""
        page: Page = _view("report")(self)
        return page

    def _repr_html_(self) -> str:
        card: str = _view("card")(self)
        return card


def _view(name: str) -> Any:
    module, _, maker = VIEWS[name].partition(":")
    return getattr(import_module(module), maker)
