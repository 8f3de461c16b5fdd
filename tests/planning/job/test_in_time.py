"""A motion that takes longer than the plan that there is already is not delivered, behind filters or not."""

from __future__ import annotations

import pytest

from planner.geometry.build import toolpath_from_program
from planner.machine import Axis, Fir, Machine
from planner.nc.reader import parse_program
from planner.planning.job.job import Job
from planner.planning.job.trace import Stages
from planner.planning.methods.fir import FirMethod
from planner.planning.methods.fir_spline import FirSplineMethod
from planner.planning.methods.kinematic import KinematicMethod
from planner.planning.methods.stop import StopMethod
from planner.planning.page import Method

TEXT = "G21 G90 G64 P0.05 F3000\nG1 X10\nX12 Y5\nX4 Y9\nM2\n"
AXIS = Axis(velocity=120.0, acceleration=2000.0, jerk=60000.0)


def _job(fir: Fir | None) -> Job:
    machine = Machine(name="test", dt=0.001, tolerance=0.05, axes=dict.fromkeys("xyz", AXIS), fir=fir)
    program = parse_program(TEXT, machine)
    toolpath = toolpath_from_program(program, machine, None)
    return Job(program=program, machine=machine, toolpath=toolpath, stages=Stages())


@pytest.mark.parametrize("fir", [None, Fir(time_constants=(0.03,))], ids=["no filters", "filters"])
@pytest.mark.parametrize(
    "method",
    [KinematicMethod(), StopMethod(), FirMethod(), FirSplineMethod()],
    ids=lambda m: type(m).__name__,
)
def test_what_takes_longer_is_not_delivered(method: Method, fir: Fir | None) -> None:
    job = _job(fir)
    made = method.plan_job(job)
    assert made.making is not None
    end = made.making.motion.end
    late = job.faster_than(0.999 * end)
    assert method.plan_job(late).trajectory is None
    early = job.faster_than(1.001 * end)
    assert method.plan_job(early).cycle_time == made.cycle_time
