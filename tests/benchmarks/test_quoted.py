"""Figures that pages quote are those of the rows."""

from __future__ import annotations

from benchmarks.record import RESULTS
from benchmarks.runner.ages import ROOT
from benchmarks.runner.rows import PASSED, read

SUITES = ("quick", "curves", "dense")


def test_the_cycle_times_of_methods_are_those_of_the_suites() -> None:
    text = (
        (ROOT / "docs" / "methods.md")
        .read_text(encoding="utf-8")
        .partition("## Measured")[2]
        .partition("\n## ")[0]
    )
    table = [line.split(" | ") for line in text.splitlines() if line.startswith("| ")]
    jobs, *lines = [[cell.strip("| `") for cell in line] for line in table]
    rows = {(job, way): row for suite in SUITES for (_, job, way), row in _rows(suite)}
    assert [line[0] for line in lines] == ["stop", "kinematic", "optimal", "second-order"]
    for way, *times in lines:
        for job, time in zip(jobs[1:], times, strict=True):
            row = rows[job, way]
            assert row.verdict == PASSED
            assert f"{row.cycle_s:.5g}" == time, f"{job} by {way}"


def _rows(suite: str):
    return read(RESULTS / f"{suite}.jsonl").rows.items()
