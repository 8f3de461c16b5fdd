"""The default method takes the times that were once read and committed (made by make_optimal.py)."""

from __future__ import annotations

import importlib.util
import json
from pathlib import Path

import pytest
from quick import slow_but

from planner.methods.optimal import OptimalMethod

HERE = Path(__file__).resolve().parent
GOLDEN = json.loads((HERE / "optimal.json").read_text(encoding="utf-8"))
_spec = importlib.util.spec_from_file_location("make_optimal", HERE / "make_optimal.py")
assert _spec is not None
assert _spec.loader is not None
make_optimal = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(make_optimal)
JOBS = make_optimal.jobs()


def test_the_same_jobs():
    assert GOLDEN.keys() == JOBS.keys()


@pytest.mark.parametrize("name", slow_but(("pentagon", "five points"), JOBS))
def test_times_are_those_committed(name):
    """To 1e-3, faster or slower: what makes it faster is worth a look and new numbers."""
    program, machine = JOBS[name]
    made = OptimalMethod().plan(program, machine).require()
    assert made.verdict.passed, made.verdict.faults
    assert made.trajectory.cycle_time == pytest.approx(GOLDEN[name]["cycle_time_s"], rel=1e-3)
