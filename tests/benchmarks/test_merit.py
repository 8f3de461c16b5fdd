"""Performance profiles, the trade of motion against planning time, slopes, and the report made of them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from results_rows import keyed, row

from benchmarks.runner.figures_of_merit import beaten, best_times, by_job, growth, profile, ratios, trades
from benchmarks.runner.report import report_of, write_reports
from benchmarks.runner.rows import MODEL, NOT_APPLICABLE, SKIPPED, Results, about_line, append, line_of
from planner.base.errors import InputError

ROWS = (
    row("a", "optimal", cycle_s=1.0, cpu_s=1.0),
    row("b", "optimal", cycle_s=2.2, cpu_s=4.0),
    row("c", "optimal", cycle_s=3.0, cpu_s=1.0),
    row("a", "stop", cycle_s=1.5, cpu_s=0.1),
    row("b", "stop", cycle_s=2.0, cpu_s=0.1),
    row("c", "stop", status=NOT_APPLICABLE, verdict="", cycle_s=None, message="no arcs here"),
    row("a", "loose", cycle_s=0.8, cpu_s=2.0, free=("jerk",)),
    row("b", "wrong", cycle_s=0.1, verdict="failed", message="jerk.x is exceeded"),
    row("c", "grbl (model)", kind=MODEL, verdict="", cycle_s=0.2),
    row("a", "absent", status=SKIPPED, verdict="", cycle_s=None),
)


def test_the_best_is_of_motions_that_keep_every_limit() -> None:
    assert best_times(by_job(ROWS)) == {"a": 1.0, "b": 2.0, "c": 3.0}


def test_profiles_count_what_a_way_did_not_reach() -> None:
    shares = ratios(by_job(ROWS))
    assert shares.keys() == {"optimal", "stop"}
    np.testing.assert_allclose(shares["optimal"], [1.0, 1.0, 1.1])
    np.testing.assert_allclose(shares["stop"], [1.0, 1.5, np.inf])
    assert [profile(shares["stop"], tau) for tau in (0.99, 1.0, 1.5, 1e9)] == [0.0, 1 / 3, 2 / 3, 2 / 3]


def test_trades_are_geometric_means_over_common_jobs() -> None:
    found = {one.way: one for one in trades(by_job(ROWS))}
    assert found.keys() == {"optimal", "stop", "loose"}
    assert found["stop"].jobs == 2
    assert found["stop"].cycle == pytest.approx(np.sqrt(1.5 * 1.0))
    assert found["stop"].cpu == pytest.approx(np.sqrt(0.1 * 0.1 / 4.0))
    assert found["optimal"].cpu == pytest.approx(1.0)
    assert {way for way, one in found.items() if one.front} == {"optimal"}  # stop does not solve c


def test_a_way_that_is_beaten_in_both_is_not_on_the_front() -> None:
    made = [
        row(job, way, cycle_s=cycle, cpu_s=cpu)
        for job in "ab"
        for way, cycle, cpu in (("optimal", 1.0, 1.0), ("quick", 1.1, 0.5), ("beaten", 1.2, 0.6))
    ]
    assert {one.way: one.front for one in trades(by_job(made))} == {
        "optimal": True,
        "quick": True,
        "beaten": False,
    }


def test_where_the_reference_is_slower_than_others() -> None:
    found = beaten(by_job((*ROWS, row("d", "stop", cycle_s=1.0), row("d", "optimal", verdict="failed"))))
    assert found.keys() == {"stop"}  # the others do not limit the jerk, fail, or are models
    assert found["stop"] == {"a": pytest.approx(-1 / 3), "b": pytest.approx(0.1), "d": np.inf}


def test_slopes_are_those_of_power_laws() -> None:
    rows = [row(f"{n}", "optimal", blocks=n, cpu_s=3e-4 * n**1.2) for n in (3000, 1000, 10_000)]
    sizes, _, slope = growth(by_job(rows))["optimal"]
    assert sizes == [1000, 3000, 10_000]
    assert slope == pytest.approx(1.2)
    assert growth(by_job(rows[:2])) == {}


def test_a_report_is_made_of_the_rows() -> None:
    text = report_of(
        "quick", Results(rows=keyed(*ROWS), abouts=({"command": "c", "commit": "d", "date": "e"},))
    )
    lines = text.splitlines()
    assert lines[0].startswith("Made by `c` at d on e")
    (of_b,) = (line for line in lines if line.startswith("| b |") and "2.2" in line)
    assert of_b.split(" | ")[1:5] == ["2.2", "**2**", "", "0.1*"]
    assert "| stop | 2 | 1 | 11.7% | b (1.0e-01) |" in lines
    assert "* wrong, b: verdict failed: jerk.x is exceeded" in lines
    assert "* stop, c: not applicable: no arcs here" in lines


@pytest.mark.slow
def test_reports_and_pictures_are_beside_the_rows(tmp_path: Path) -> None:
    append(tmp_path / "quick.jsonl", [about_line({"commit": "d"}), *map(line_of, ROWS)])
    made = write_reports(tmp_path)
    assert [file.name for file in made] == [
        "suite-quick.md",
        "suite-quick-profile.png",
        "suite-quick-trade.png",
    ]
    assert all(file.stat().st_size > 500 for file in made)
    with pytest.raises(InputError, match="no rows of suite 'relief'; there are quick"):
        write_reports(tmp_path, ("relief",))
