"""Public names as a user's program has them: checked by mypy (pyproject.toml), never run."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, assert_type

import numpy as np

import planner

if TYPE_CHECKING:  # who imports the file plans nothing, and writes no `out` and no report.html
    machine = planner.load_machine("mill")
    program = planner.read_program(text="G1 X10 F600")
    assert_type(program, planner.Program)
    assert_type(planner.path(np.zeros((3, 2)), feed=50.0), planner.Program)
    p = planner.plan(program, machine, method="kinematic", tolerance=0.02)
    assert_type(p, planner.Plan)
    assert_type(p.cycle_time, float)
    assert_type(p.save("out", report=True), list[Path])
    assert_type(p.report().save("report.html"), Path)
    verdict = planner.verify(np.zeros(2), np.zeros((2, 3)), program, machine)
    assert_type(verdict, planner.Verdict)
    assert_type(verdict.passed, bool)
    assert_type(p.require(), planner.Plan)
    names: list[str] = list(planner.methods)
    method: planner.Method = planner.methods["stop"]
    times = [row.cycle_time for row in planner.compare(program, machine, ["stop", method])]
    assert_type(times, list[float | None])
    assert_type(planner.__version__, str)
    figure = p.plot.path(color="limit")
    table = p.to_pandas()
