"""More effort never costs time on the machine; the names are those of the registry."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.jobs import problems
from planner import plan
from planner.base.errors import InputError
from planner.base.names import EFFORTS as NAMES
from planner.machine import load_machine
from planner.planning.optimal.effort import EFFORTS

MACHINE = load_machine("mill")


def test_every_name_has_an_effort_and_more_points_a_coarser_grid():
    assert tuple(EFFORTS) == NAMES
    for effort in EFFORTS.values():
        grids = [effort.grids(points).final for points in (1, 10**4, 10**5, 10**6, 10**8)]
        assert grids == sorted(grids)


@pytest.mark.shows("effort", "sampled: on chosen jobs")
@pytest.mark.slow
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
    for made in (quick, normal, best):
        assert "path and feed optimised together" in made.sentence
        assert 0.9 < made.grid.share.max() + made.grid.share[-2] <= 1.0 + 1e-12
        assert made.prices is not None
    np.testing.assert_allclose(best.trajectory.position[-1], best.toolpath.end[-1], atol=1e-9)


def test_where_jerk_is_what_limits_the_search_finds_what_splines_have_not():
    """On mill, a/j = 40 ms: ipopt's free optimum takes 2.8357 s for 50 legs, the feed along splines 5 % more."""
    splines, default = plan(problems.zigzag(6), MACHINE, geometry="spline"), plan(problems.zigzag(6), MACHINE)
    assert splines.verdict.passed
    assert default.verdict.passed
    assert "path and feed optimised together" in default.sentence
    assert "path and feed optimised together" not in splines.sentence
    assert default.trajectory.cycle_time < splines.trajectory.cycle_time * (1 - 1e-2)


def test_an_unknown_effort_and_one_for_another_method():
    with pytest.raises(InputError, match="no effort 'hard'; there are quick, normal, best"):
        plan(problems.zigzag(), MACHINE, effort="hard")
    with pytest.raises(InputError, match="method stop does not use it"):
        plan(problems.zigzag(), MACHINE, effort="best", method="stop")
