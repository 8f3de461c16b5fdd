"""Settings of `plan` that are none: said before any work, whatever their type."""

from __future__ import annotations

import pytest

from benchmarks.jobs import problems
from planner.base.errors import InputError
from planner.planning.methods.registry import plan


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ({"effort": 3}, "no effort '3'; there are quick, normal, best"),
        ({"geometry": 2}, "no geometry '2'; there are auto, spline, corners"),
        ({"solver": 3}, "solver = 3: method optimal does not use it; it has own"),
        ({"corner": 4}, "corner = 4: give the name of a shape, or a shape of your own"),
        ({"corner": "bezir"}, r"no corner shape 'bezir'; .* \(did you mean 'bezier'\?\)"),
        ({"shaped": "yes"}, "shaped = 'yes': it is True or False"),
        ({"method": 3}, "method = 3: give a name, optimal, "),
        ({"tolerance": "x"}, "tolerance 'x'; give a number, in mm"),
    ],
)
def test_a_setting_of_the_wrong_type_is_refused_by_name(settings, said):
    with pytest.raises(InputError, match=said):
        plan(problems.all_jobs()["pentagon"], problems.machine(), **settings)
