"""The shared jobs give the results that were once read and committed (made by make_golden.py)."""

from __future__ import annotations

import importlib.util
import json
from pathlib import Path

import pytest

HERE = Path(__file__).resolve().parent
GOLDEN = json.loads((HERE / "jobs.json").read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def fresh():
    spec = importlib.util.spec_from_file_location("make_golden", HERE / "make_golden.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.results()


def test_the_same_jobs(fresh):
    assert fresh.keys() == GOLDEN.keys()


@pytest.mark.parametrize("job", list(GOLDEN))
def test_results_are_those_committed(job, fresh):
    """Times to 1e-3, the accuracy of the grid; the geometry to 1e-4."""
    was, now = GOLDEN[job], fresh[job]
    assert (now["corners"], now["pieces"]) == (was["corners"], was["pieces"])
    assert now["cycle_time_s"] == pytest.approx(was["cycle_time_s"], rel=1e-3)
    assert now["length_mm"] == pytest.approx(was["length_mm"], rel=1e-4)
    assert now["mean_reach_mm"] == pytest.approx(was["mean_reach_mm"], rel=1e-3)
