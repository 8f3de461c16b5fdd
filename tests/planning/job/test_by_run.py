"""Jobs of one run of a job."""

from __future__ import annotations

import itertools

import numpy as np

from benchmarks.jobs import problems
from planner.geometry.build import toolpath_from_program
from planner.geometry.chords import points_on
from planner.geometry.toolpath import Joint
from planner.nc.reader import parse_program
from planner.planning.job.by_run import full_stops, job_of_run
from planner.planning.job.job import Job
from planner.planning.job.trace import Stages
from planner.planning.methods.optimal import OptimalMethod


def test_a_run_begins_and_ends_at_rest_also_where_the_path_it_is_judged_by_runs_on():
    """A joint can be a full stop of the job alone: a corner at which only a stop keeps the tolerance."""
    program = problems.polyline([[0, 0], [20, 0], [20, 20], [0, 20], [0, 5]])
    machine = problems.machine()
    judged = toolpath_from_program(program, machine)
    stopping = judged.with_joints(np.array([1, 3]), Joint.STOP)
    job = Job(program=program, machine=machine, toolpath=stopping, stages=Stages(), judged=(machine, judged))
    run = job_of_run(job, 1, 3)
    assert run.judged is not None
    for toolpath in (run.toolpath, run.judged[1]):
        assert len(toolpath) == 2
        assert toolpath.joint[[0, -1]].tolist() == [Joint.STOP, Joint.STOP]
        np.testing.assert_array_equal(toolpath.start[0], judged.start[1])
    assert judged.joint[1] != Joint.STOP


ARCS_AND_CURVES = """G21 G90 G64 P0.05 F2000
G2 X10 Y0 I5 J0
G1 X20
G4 P0.1
G1 X30 Y5
G5 X40 Y5 I3 J4 P-3 Q4
G1 X50
G4 P0.1
G3 X60 Y5 I5 J0
G1 X70 Y10
"""


def test_each_run_alone_is_the_path_and_takes_the_time_of_its_own_program():
    """Arcs and curves stay with their segments where those before them are left out."""
    machine = problems.machine()
    program = parse_program(ARCS_AND_CURVES, machine)
    whole = toolpath_from_program(program, machine)
    stops = full_stops(whole)
    assert len(stops) == 4
    job = Job(program=program, machine=machine, toolpath=whole, stages=Stages())
    for first, last in itertools.pairwise(stops.tolist()):
        run = job_of_run(job, first, last).toolpath
        assert (len(run.arcs), len(run.curves)) == ((run.arc >= 0).sum(), (run.curve >= 0).sum())
        for k in np.flatnonzero((run.arc >= 0) | (run.curve >= 0)):
            x = np.linspace(0.0, run.length[k], 7)
            here, there = np.full(7, k), np.full(7, first + k)
            np.testing.assert_array_equal(points_on(run, here, x), points_on(whole, there, x))
        plan = OptimalMethod().plan_job(job_of_run(job, first, last))
        assert plan.verdict is not None
        assert plan.verdict.passed
