"""More effort never costs time on the machine; the names are those of the registry."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks import problems
from planner import plan
from planner.base.errors import InputError
from planner.base.names import BEST, NORMAL
from planner.base.names import EFFORTS as NAMES
from planner.machine import load_machine
from planner.optimal.effort import EFFORTS

MACHINE = load_machine("mill")


def test_every_name_has_an_effort_and_more_points_a_coarser_grid():
    assert tuple(EFFORTS) == NAMES
    for effort in EFFORTS.values():
        grids = [effort.grids(points).final for points in (1, 10**4, 10**5, 10**6, 10**8)]
        assert grids == sorted(grids)


@pytest.mark.parametrize(
    "program", [problems.zigzag(20), problems.star_spiral(40)], ids=lambda own: own.source
)
def test_more_effort_is_never_slower(program):
    quick, normal, best = (plan(program, MACHINE, effort=name) for name in NAMES)
    assert quick.verdict.passed
    assert normal.verdict.passed
    assert best.verdict.passed
    assert normal.trajectory.cycle_time <= quick.trajectory.cycle_time * (1 + 1e-4)
    assert best.trajectory.cycle_time <= normal.trajectory.cycle_time * (1 + 1e-4)
    assert quick.grid_points < normal.grid_points
    assert "geometry and feed together" in best.sentence
    assert best.grid.share.sum() == pytest.approx(1.0)
    assert best.prices is not normal.prices
    np.testing.assert_allclose(best.trajectory.position[-1], best.toolpath.end[-1], atol=1e-9)


def test_where_jerk_is_what_limits_the_best_effort_finds_what_rounds_do_not():
    """On mill, a/j = 40 ms: rounds end 2 % later than ipopt's free optimum, 2.8357 s for 50 legs."""
    normal, best = (plan(problems.zigzag(6), MACHINE, effort=name) for name in (NORMAL, BEST))
    assert best.verdict.passed
    assert best.trajectory.cycle_time < normal.trajectory.cycle_time * (1 - 1e-2)


def test_an_unknown_effort_and_one_for_another_method():
    with pytest.raises(InputError, match="no effort 'hard'; there are quick, normal, best"):
        plan(problems.zigzag(), MACHINE, effort="hard")
    with pytest.raises(InputError, match="method stop does not use it"):
        plan(problems.zigzag(), MACHINE, effort="best", method="stop")
