"""Jobs of one run of a job."""

from __future__ import annotations

import numpy as np

from benchmarks import problems
from planner.geometry.build import toolpath_from_program
from planner.geometry.toolpath import Joint
from planner.job.by_run import job_of_run
from planner.job.job import Job
from planner.job.stages import Stages


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
