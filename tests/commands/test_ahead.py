"""Kernels compiled ahead: those that plans need, and what an installation does with them."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path

import pytest

from planner.commands import ahead
from planner.commands.ahead import PROGRAMS, compile_corners

ROOT = Path(__file__).resolve().parents[2]
EXAMPLE = ROOT / "planner" / "examples" / "bracket.ngc"
SETUPTOOLS = 77  # pyproject.toml asks for it to build


PLAN = """
import sys
import planner
from planner.cli import app
from typer.testing import CliRunner
print(planner.__file__)
for job in sys.argv[1:]:
    print(CliRunner().invoke(app, ["plan", job, "--quiet"], catch_exceptions=False).stdout)
print("bound", planner.plan(sys.argv[1], "mill").least_time)
"""


def planned(jobs: list[Path], package: Path, **variables: str) -> list[float]:
    """Cycle times of jobs, by the command in one process, with the package in a folder; and the bound of the first."""
    env = {**os.environ, "PYTHONPATH": str(package), **variables}
    command = [sys.executable, "-P", "-c", PLAN, *map(str, jobs)]
    done = subprocess.run(command, env=env, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert Path(done.stdout.split("\n")[0]).is_relative_to(package)
    found = re.findall(r"^(?:time|bound) +(\S+)", done.stdout, re.MULTILINE)
    assert len(found) == len(jobs) + 1
    return [float(time) for time in found]


@pytest.mark.slow
def test_a_package_that_was_built_plans_without_compiling(tmp_path: Path) -> None:
    """`setup.py` builds, as pip lets it do; then other programs than those that it planned, and the example, are
    planned with what it built."""
    if int(version("setuptools").split(".")[0]) < SETUPTOOLS:
        pytest.skip(f"setuptools {SETUPTOOLS} or newer is needed to build")
    build = tmp_path / "build"
    command = [sys.executable, "setup.py", "--quiet", "build_py", "--build-lib", str(build)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    built = {file.name for file in (build / "planner" / "kernels").iterdir()}
    assert len(built) > 30
    assert all(name.endswith(".kernel") for name in built)
    job = tmp_path / "job.ngc"
    job.write_text(
        "G21 G90 G64 P0.02 F3000\nG1 X20\nG2 X24 Y4 I4\nG1 X40 Y3 Z1\nX15 Y20\nM2\n", encoding="utf-8"
    )
    zigzag = "\n".join(f"G1 X{k} Y{k % 3}" for k in range(500))
    (long := tmp_path / "long.ngc").write_text(f"G21 G90 G64 P0.02 F3000\n{zigzag}\nM2\n", encoding="utf-8")
    cache = tmp_path / "cache"
    times = planned([job, long, EXAMPLE], build, NUMBA_CACHE_DIR=str(cache))
    assert times[2] == pytest.approx(11.037, abs=1e-3)  # README's example
    assert 0.0 < times[-1] <= times[0]
    assert not cache.exists()  # nothing was compiled


def test_the_programs_have_every_kind_of_move() -> None:
    """A move of another kind would be compiled by the first plan that has one."""
    words = set(re.findall(r"\bG\d+", " ".join(PROGRAMS)))
    assert {"G1", "G2", "G3", "G61", "G64"} <= words


@pytest.mark.slow
def test_the_plan_beside_is_made(monkeypatch: pytest.MonkeyPatch) -> None:
    """One that ends early would leave its kernels to the other process; the last program, which the build above plans in both
    processes, is a short one here."""
    monkeypatch.setattr(ahead, "PROGRAMS", PROGRAMS[:2])
    assert compile_corners()
