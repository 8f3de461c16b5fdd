"""The cases of jobs/published.py beside what was published: the way that is like for like, what differs, and what is left out."""

from __future__ import annotations

from benchmarks.jobs.published import CASES, LEFT_OUT, Case
from benchmarks.record import markdown
from benchmarks.runner.rows import Row

NAME = "published"
NOTE = (
    "Times in seconds, as printed. Bound: no motion within tolerance, feed and limits is below it. Active: the share of the time in "
    "which at least one limit, or the tolerance, is active (the figure of merit of Liang et al., Robot. Comput.-Integr. Manuf. 2022: "
    "89 to 94 % there). Error: of the tolerance, the larger one of contour and vertices."
)
COLUMNS = [
    "case",
    "published",
    "way",
    "time",
    "bound",
    "above it",
    "active",
    "error",
    "verdict",
    "what differs",
    "source",
]


def tables(name: str, jobs: dict[str, dict[str, Row]]) -> list[str]:
    """The parts of the report; none for other suites."""
    if name != NAME:
        return []
    rows = [_line(case, jobs.get(case.name, {}).get(case.way)) for case in CASES]
    left = "\n".join(f"* {what}: {why}." for what, why in LEFT_OUT.items())
    return ["## Like for like", NOTE, markdown(COLUMNS, rows), "## Left out", left]


def _line(case: Case, row: Row | None) -> list[str]:
    published = case.published or "no time"
    if row is None or row.cycle_s is None:
        return [case.name, published, case.way, *[""] * 6, case.differs, case.source]
    bound = [f"{row.bound_s:.4g}", f"{row.cycle_s / row.bound_s - 1.0:.1%}"] if row.bound_s else ["", ""]
    active = "" if row.active is None else f"{row.active:.1%}"
    error = "" if row.error is None else f"{row.error:.3f}"
    numbers = [f"{row.cycle_s:.4f}", *bound, active, error, row.verdict]
    return [case.name, published, case.way, *numbers, case.differs, case.source]
