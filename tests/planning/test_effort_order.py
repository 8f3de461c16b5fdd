"""Effort `normal` is never slower than `quick`, also where its own search finds nothing that passes."""

from __future__ import annotations

import pytest

from benchmarks.jobs import problems
from planner.feedrate.solution import Status
from planner.joint.parts import FoundRun
from planner.nc.reader import parse_program
from planner.planning import joint_search
from planner.planning.attempts import ATTEMPTS
from planner.planning.job.trace import Trace
from planner.planning.methods.registry import plan

ZIGZAG = "G21 G90 G64 P0.05 F4000\nG1 X7\nX9 Y6\nX2 Y8\nG3 X-3 Y3 J-5\nG1 X0 Y-4\nM2\n"


@pytest.mark.shows("effort", "sampled: on chosen jobs")
def test_what_quick_finds_is_taken_where_shorter_steps_find_nothing(monkeypatch):
    """As where the period is so long that the chords of a motion in shorter steps leave the tolerance, and those of one in longer
    steps, with which `quick` ends, do not. Its plan on splines alone is slower."""
    machine = problems.machine(normal_acceleration=900.0)
    program = parse_program(ZIGZAG)
    quick = plan(program, machine, effort="quick").require()
    on_splines = plan(program, machine, effort="quick", geometry="spline").require()
    searched = joint_search.searched_runs

    def not_in_shorter_steps(runs, start, search, *more, **named):
        nothing = [FoundRun(run, Status.ACCEPTABLE, "not found") for run in runs]
        return nothing if search.finer else searched(runs, start, search, *more, **named)

    monkeypatch.setattr(joint_search, "searched_runs", not_in_shorter_steps)
    trace = Trace()
    normal = plan(program, machine, log=trace).require()
    assert normal.verdict.passed
    assert quick.cycle_time < on_splines.cycle_time
    assert normal.cycle_time <= quick.cycle_time
    names = {"search", *(attempt.name for attempt in ATTEMPTS)}
    assert [step.name for step in trace.steps if step.name in names] == ["joint search", "search", "search"]
