"""`--threads`: the same motion on any number of cores, and no plan on none."""

from __future__ import annotations

import json

import pyarrow.parquet as pq
import pytest
from typer.testing import CliRunner

from planner.base import threads
from planner.cli import app

PROGRAM = "G21 G90 G64 P0.05 F3000\nG1 X10\nX12 Y5\nG61\nX4 Y9\nG64 P0.05\nX-3 Y7\nG61\nX0 Y0\nM2\n"


@pytest.fixture
def all_cores():
    yield
    threads.use_threads(None)


@pytest.mark.shows("parallel", "exact: the same bytes")
@pytest.mark.slow
def test_the_motion_is_the_same_on_any_number_of_threads(tmp_path, all_cores):
    job = tmp_path / "job.ngc"
    job.write_text(PROGRAM, encoding="ascii")
    bodies = []
    for count in (1, 3):
        out = tmp_path / str(count)
        done = CliRunner().invoke(app, ["plan", str(job), "-q", "-o", str(out), "--threads", str(count)])
        assert done.exit_code == 0, done.output
        assert threads.threads() == count
        bodies.append(pq.read_table(out / "trajectory.parquet"))
        assert json.loads((out / "summary.json").read_text(encoding="utf-8"))["verdict"]["passed"]
    assert bodies[0].num_rows > 100
    assert bodies[0].equals(bodies[1])


def test_no_threads_are_refused(tmp_path):
    job = tmp_path / "job.ngc"
    job.write_text(PROGRAM, encoding="ascii")
    refused = CliRunner().invoke(app, ["plan", str(job), "--threads", "0"])
    assert refused.exit_code == 2
    assert "--threads" in refused.output
    assert "must be 1 or more" in refused.output
