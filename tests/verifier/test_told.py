"""What a verdict says of itself in a line."""

from __future__ import annotations

import dataclasses

import pytest

import planner
from planner.verifier.excess import Fault, Kind


@pytest.mark.parametrize(("count", "more"), [(1, ""), (2, ", and 1 more"), (4, ", and 3 more")])
def test_the_first_fault_is_told_and_the_others_are_counted(count: int, more: str) -> None:
    verdict = planner.plan(planner.path([[0, 0], [9, 0]], feed=50), "mill", method="stop").verdict
    assert repr(verdict) == "<Verdict: passed>"
    fault = Fault(kind=Kind.LIMIT, name="jerk.x", found="too much", ratio=2.0, time=0.1, line=3)
    failed = dataclasses.replace(verdict, passed=False, faults=(fault,) * count)
    assert repr(failed) == f"<Verdict: failed, {fault}{more}>"
