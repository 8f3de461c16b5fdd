"""The report of a plan (report/html) as an object: a notebook shows it, `save` writes it, `open` shows it in the browser."""

from __future__ import annotations

import html
import tempfile
import webbrowser
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

from planner.report.html.page import REPORT, check_report_place, report_page
from planner.report.planned import source_text
from planner.report.replace import replacing_file

if TYPE_CHECKING:
    from planner.planning.job.plan import Plan

HEIGHT = 900  # of the page in a notebook [px]


class ReportPage:
    """The page of a plan. Raises NotSolvedError for a plan without a trajectory."""

    def __init__(self, plan: Plan):
        self._plan = plan.require()

    @cached_property
    def text(self) -> str:
        """The page, HTML with all that it needs."""
        return report_page(self._plan, source_text(self._plan))

    def save(self, file: str | Path = REPORT, *, force: bool = False) -> Path:
        """Write the page to a file.

        force : replace a file that is no report

        Raises InputError if it cannot be written, or if a file is in the way that is no report.
        """
        place = Path(file)
        check_report_place(place, force=force)
        with replacing_file(place) as new:
            new.write_text(self.text, encoding="utf-8")
        return place

    def open(self) -> Path:
        """Show the page in the system's browser, from a new temporary file; returns the file."""
        place = Path(tempfile.mkdtemp(prefix="planner-")) / REPORT
        self.save(place)
        webbrowser.open(place.as_uri())
        return place

    def __repr__(self) -> str:
        return f"<report of {self._plan!r}; .save(FILE) writes it, .open() shows it in the browser>"

    def _repr_html_(self) -> str:
        return f'<iframe srcdoc="{html.escape(self.text)}" style="width:100%;height:{HEIGHT}px;border:0"></iframe>'
