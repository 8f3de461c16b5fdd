"""Behind the machine's filters, methods that pass corners are not slower than stopping at all of them."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from benchmarks.jobs import problems
from planner.machine import Machine
from planner.machine.parts import Fir
from planner.nc.program import Program
from planner.planning.methods.bezier import BezierMethod
from planner.planning.methods.kinematic import KinematicMethod
from planner.planning.methods.stop import StopMethod


def random_job(seed: int) -> tuple[Program, Machine]:
    """Lines on a machine with one to three filters of 3 to 30 ms and a tolerance of 2 to 100 um."""
    rng = np.random.default_rng(seed)
    axes = problems.random_axes(rng, velocity=(2, 3), acceleration=(3, 4.5), jerk=(5, 7))
    filters = Fir(time_constants=tuple(10 ** rng.uniform(-2.5, -1.5, size=int(rng.integers(1, 4)))))
    machine = problems.machine(tolerance=10 ** rng.uniform(-2.7, -1), axes=axes, fir=filters)
    blocks, dims = int(rng.integers(2, 12)), int(rng.integers(2, 4))
    return problems.random_polyline(rng, blocks=blocks, shortest=0.5, longest=50.0, dimensions=dims), machine


@pytest.mark.parametrize("method", [KinematicMethod(), BezierMethod()])
@given(seed=st.integers(0, 10**6))
@settings(max_examples=10)
def test_corners_are_never_slower_than_stops(method, seed):
    """Found by the campaign of random jobs: legs accelerated so little that filters did no harm at full stops, though a short rest is
    enough there; that took up to six times as long as stopping everywhere."""
    program, machine = random_job(seed)
    made, stops = method.plan(program, machine), StopMethod().plan(program, machine)
    assert made.verdict.passed
    assert made.cycle_time <= stops.cycle_time * (1 + 1e-3)
