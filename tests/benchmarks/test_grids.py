"""Accuracy against the grid: fitted orders of made-up rows, and motions of which the excess is of second order."""

from __future__ import annotations

import pytest

from benchmarks.runner.grid_report import convergence, tables
from benchmarks.runner.grids import FACTORS, name_of
from benchmarks.runner.measure import outcome
from benchmarks.runner.rows import ERROR, SOLVED, Row
from benchmarks.runner.suites import SUITES
from benchmarks.runner.ways import way_of

LIMIT = 2.0  # of the times of all grids [s]


def made_up(order: float, excess: float, points: list[int]) -> dict[str, Row]:
    return {
        name_of(False, finer): Row(
            suite="grids", job="a", way=name_of(False, finer), kind="method", status=SOLVED, verdict="failed",
            cycle_s=LIMIT + 30.0 / n**order, points=n, excess=1.0 + 5.0 / n**excess,
        )
        for finer, n in zip(FACTORS, points, strict=True)
    }  # fmt: skip


def test_orders_of_powers_are_found_and_the_limit_of_all_grids_with_them() -> None:
    found = convergence(made_up(1.5, 2.0, [100, 200, 400, 800, 1600]), kept=False)
    assert found is not None
    assert found.order == pytest.approx(1.5)
    assert found.falls == pytest.approx(2.0)
    assert found.times[-1] - found.left == pytest.approx(LIMIT, rel=1e-9)


def test_a_grid_with_hardly_more_points_says_nothing() -> None:
    found = convergence(made_up(2.0, 2.0, [190, 200, 400, 800, 1600]), kept=False)
    assert found is not None
    assert (found.order, found.falls) == (pytest.approx(2.0), pytest.approx(2.0))


def test_a_job_without_all_grids_is_left_out() -> None:
    rows = made_up(2.0, 2.0, [100, 200, 400, 800, 1600])
    del rows["grid:2"]
    assert convergence(rows, kept=False) is None
    assert tables({"a": rows}) == []


@pytest.mark.slow
def test_what_a_motion_exceeds_between_grid_points_is_of_second_order_and_is_made_good() -> None:
    job = next(job for job in SUITES["grids"].jobs() if job.name == "pentagon")
    rows = {}
    for kept in (False, True):
        for finer in FACTORS:
            way = way_of(name_of(kept, finer))
            blank = Row(suite="grids", job=job.name, way=way.name, kind=way.kind, status=ERROR)
            rows[way.name] = outcome(way, job, blank)
    at_points, between = convergence(rows, kept=False), convergence(rows, kept=True)
    assert at_points is not None
    assert between is not None
    assert 1.8 < at_points.falls < 2.2
    assert at_points.excess[0] > 1e-3
    assert between.excess == (0.0,) * len(FACTORS)
    assert at_points.order > 1.0
    assert between.order > 1.0
    assert 0.0 < between.times[-1] / at_points.times[-1] - 1.0 < 1e-4
