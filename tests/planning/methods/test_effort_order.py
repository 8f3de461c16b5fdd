"""Effort `normal` is never slower than `quick`, also where its own search finds nothing that passes."""

from __future__ import annotations

from benchmarks.jobs import problems
from planner.nc.reader import parse_program
from planner.planning.methods import at_once, from_plan
from planner.planning.methods.at_once import AtOnce
from planner.planning.methods.from_plan import Freed
from planner.planning.methods.registry import plan
from planner.planning.optimal.effort import EFFORTS

ZIGZAG = "G21 G90 G64 P0.05 F4000\nG1 X7\nX9 Y6\nX2 Y8\nG3 X-3 Y3 J-5\nG1 X0 Y-4\nM2\n"


def test_what_quick_finds_is_taken_where_shorter_steps_find_nothing(monkeypatch):
    """As where the period is so long that the chords of a motion in shorter steps leave the tolerance, and those of one in longer
    steps, with which `quick` ends, do not. Its plan on splines alone is slower."""
    machine = problems.machine(normal_acceleration=900.0)
    program = parse_program(ZIGZAG)
    quick = plan(program, machine, effort="quick").require()
    on_splines = plan(program, machine, effort="quick", rounds=2).require()
    searched = at_once.searched_at_once

    def not_in_shorter_steps(job, settings, *others):
        return searched(job, settings, *others) if settings.effort is EFFORTS["quick"] else AtOnce(None, 100)

    monkeypatch.setattr(at_once, "searched_at_once", not_in_shorter_steps)
    monkeypatch.setattr(from_plan, "freed", lambda job, plan, dial: Freed(plan, 1.0))
    normal = plan(program, machine).require()
    assert normal.verdict.passed
    assert quick.cycle_time < on_splines.cycle_time
    assert normal.cycle_time <= quick.cycle_time
