"""Where parts between extremes may begin and end (planner/sensitivity/bends.py)."""

from __future__ import annotations

import numpy as np
import pytest

from planner.sensitivity.bends import turns_of
from planner.sensitivity.waypoints import Way


@pytest.mark.parametrize("back", [2.1, 2.7])
def test_an_extreme_stands_out_from_what_is_further_than_twice_the_tolerance(back: float) -> None:
    """Two places that the motion may miss by the tolerance each cannot be taken for each other then, and a part may begin there."""
    x = np.array([0.0, 5.0, 5.0 - back, 9.0])
    way = Way(
        point=np.column_stack([x, 0.0 * x]), tolerance=np.ones(4), stop=np.array([True, False, False, True]),
        vertex=np.ones(4, dtype=bool), tangent=np.column_stack([np.sign(np.diff(x)), np.zeros(3)]), length=np.abs(np.diff(x)),
        feed=np.full(3, 100.0), line=np.ones(3, dtype=bool), limit=np.repeat([[500.0], [2e3], [1e5]], 2, axis=1),
    )  # fmt: skip
    found = turns_of(way)
    begins, ends = found.begins.astype(bool), ~found.begins.astype(bool)
    assert found.waypoint[begins].tolist() == [0, 1, 2]
    assert found.stands_out[begins].tolist() == [1, 1, 0], "the end of the run stands out from nothing"
    assert found.waypoint[ends].tolist() == [2, 3, 3]
