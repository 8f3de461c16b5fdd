"""The kernels' search against numpy's, equal values and empty ranges included."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from planner.base.search import last_not_after


@given(st.lists(st.integers(0, 9), min_size=1, max_size=12), st.floats(-1.0, 10.0), st.data())
def test_the_last_value_that_is_not_above(values: list[int], limit: float, data: st.DataObject) -> None:
    ascending = np.sort(np.array(values, dtype=float))
    first = data.draw(st.integers(0, len(values) - 1))
    last = data.draw(st.integers(first - 1, len(values) - 1))
    expected = first + np.searchsorted(ascending[first : last + 1], limit, side="right") - 1
    assert last_not_after(ascending, limit, first, last) == max(expected, first)
