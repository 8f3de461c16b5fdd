"""Behind the machine's filters every method's motion stays within the tolerance of the path and of every vertex.

The judge here is a convolution of the delivered samples, and the nearest of many points of the path: no code of the package. Chords
between samples dt apart are what is convolved; they miss the motion by up to |a| dt^2 / 12 on average.
"""

from __future__ import annotations

import numpy as np
import pytest
from quick import slow_but
from scipy.spatial import cKDTree

from benchmarks.jobs import problems
from planner.delivery import mending
from planner.machine import Fir
from planner.nc.reader import parse_program
from planner.planning.job import job as job_module
from planner.planning.methods.fir import FirMethod
from planner.planning.methods.fir_spline import FirSplineMethod
from planner.planning.methods.optimal import OptimalMethod
from planner.planning.methods.registry import plan
from planner.planning.methods.tube import TubeMethod
from planner.planning.optimal import path_motion

FINE = 2e-4  # [s] of the convolution
STEP = 2e-3  # [mm] between points of the path
# A corner into an arc, a tangent joint out of it, an exact stop, a stop between sharp corners, a reversal.
JOB = parse_program(
    "G21 F6000\nG1 X6\nX10 Y5\nG3 X6 Y9 I-4 J0\nG61.1\nG1 X3\nG64\nY6\nX5 Y4\nX1\n",
    source="corners, arc, stops",
)
CORNER = problems.polyline([[0, 0], [5, 0], [5, 5]], source="corner")
LENGTHS = [(0.01, 0.004), (0.02, 0.013), (0.05, 0.03)]
# At a tolerance of 0.05 mm these alone ask something of a motion on the jobs here: of the shorter ones nothing is kept or mended.
ASKING = (0.05, 0.03)
BEZIER = {"optimal": "bezier", "second-order": "bezier"}  # on splines below
METHODS = ["stop", "kinematic", "bezier", "fir", "fir-spline", "second-order", "optimal"]
# Filters that the motions of these two show to ask nothing: of a closed form and of a search.
BEHIND = [
    *((method, ASKING) for method in METHODS),
    *((m, some) for m in ("kinematic", "optimal") for some in LENGTHS[:2]),
]


def machine(lengths, **more):
    return problems.machine(fir=Fir(time_constants=lengths), **more)


def convolved(made, lengths):
    """Positions behind the filters at the period `FINE` (n, A)."""
    t = made.trajectory
    grid = np.arange(0.0, t.t[-1] + sum(lengths) + 10 * FINE, FINE)
    kernel = np.ones(1)
    for length in lengths:
        count = round(length / FINE)
        kernel = np.convolve(kernel, np.full(count, 1.0 / count))
    columns = []
    for axis in t.position.T:
        x = np.concatenate([np.zeros(len(kernel) - 1), np.interp(grid, t.t, axis) - axis[0]])
        columns.append(np.convolve(x, kernel, mode="valid") + axis[0])
    return np.stack(columns, axis=1)


def path_points(toolpath):
    """Points of the programmed path, `STEP` apart."""
    found = []
    for i, length in enumerate(toolpath.length):
        x = np.linspace(0.0, length, int(length / STEP) + 2)[:, None]
        if (row := toolpath.arc[i]) < 0:
            found.append(toolpath.start[i] + x / length * (toolpath.end[i] - toolpath.start[i]))
            continue
        arcs, angle = toolpath.arcs, toolpath.arcs.rate[toolpath.arc[i]] * x
        circle = arcs.radius[row] * (np.cos(angle) * arcs.e1[row] + np.sin(angle) * arcs.e2[row])
        found.append(arcs.center[row] + circle + arcs.drift[row] * x)
    return np.concatenate(found)


def assert_kept(made, lengths):
    assert made.require().verdict.passed, made.verdict.faults
    limits, position = made.machine, convolved(made, lengths)
    bow = np.linalg.norm(limits.limits("acceleration", made.toolpath.axes)) * limits.dt**2 / 12
    budget = limits.tolerance + bow + STEP**2 / (8 * limits.tolerance)
    off = cKDTree(path_points(made.toolpath)).query(position)[0].max()
    missed = cKDTree(position).query(made.toolpath.end)[0].max()
    assert off <= budget
    assert missed <= budget
    after = made.verdict.after_filters
    # the verifier's is in order: more where parts of the path are close
    assert after.contour_error_mm >= off - bow - 1e-3
    assert after.vertex_error_mm == pytest.approx(missed, abs=2e-3)
    np.testing.assert_allclose(position[-1], made.toolpath.end[-1], atol=1e-6)


@pytest.mark.shows("filters", "sampled: every method within the tolerance behind them")
@pytest.mark.slow
@pytest.mark.parametrize(("method", "lengths"), BEHIND, ids=str)
def test_behind_the_filters_nothing_leaves_the_tolerance(method, lengths):
    assert_kept(plan(JOB, machine(lengths), method=method, corner=BEZIER.get(method)), lengths)


@pytest.mark.slow
@pytest.mark.parametrize("lengths", [ASKING, (0.01, 0.02, 0.005), (0.03,)], ids=str)
def test_any_number_of_filters_on_splines(lengths):
    assert_kept(OptimalMethod(corner="spline").plan(CORNER, machine(lengths)), lengths)


@pytest.mark.slow
def test_tube_too():
    assert_kept(TubeMethod().plan(CORNER, machine(ASKING)), ASKING)


@pytest.mark.slow
@pytest.mark.parametrize("method", [FirMethod, FirSplineMethod])
def test_filters_that_make_the_profile_are_not_those_behind_it(method):
    made = method(profile_filters=(0.03, 0.01)).plan(CORNER, machine(ASKING))
    assert made.sentence.endswith("filters of 40 to 40 ms in all")
    assert_kept(made, ASKING)


@pytest.mark.parametrize("tolerance", [0.005, 0.2])
def test_tight_and_loose_tolerances(tolerance):
    for method in ("stop", "kinematic"):
        assert_kept(plan(JOB, machine((0.02, 0.013), tolerance=tolerance), method=method), (0.02, 0.013))


def test_a_stop_rests_no_longer_than_the_filters_need():
    """Less rest misses the vertex by more than the tolerance, more costs time: what is used of the tolerance is all but 1 %. At most
    the delay is waited; nothing is added behind the end."""
    plain = plan(CORNER, problems.machine(), method="stop").trajectory.cycle_time
    made = plan(CORNER, machine((0.05, 0.03)), method="stop")
    waited = made.trajectory.cycle_time - plain
    assert 0.0 < waited < 0.08
    assert 0.99 * 0.05 < made.verdict.after_filters.vertex_error_mm <= 0.05
    assert not made.trajectory.velocity[-1].any()
    assert plan(CORNER, machine((0.01, 0.004)), method="stop").trajectory.cycle_time == plain


@pytest.mark.slow
def test_a_shorter_filter_costs_less():
    for method in ("stop", "bezier"):
        times = [plan(CORNER, machine(lengths), method=method).trajectory.cycle_time for lengths in LENGTHS]
        assert times == sorted(times)


@pytest.mark.parametrize("method", slow_but(("stop", "optimal"), METHODS))
def test_without_the_constraint_the_verdict_fails(method, monkeypatch):
    monkeypatch.setattr(job_module, "kept", lambda motion, toolpath, machine: motion)
    monkeypatch.setattr(
        path_motion, "within_filters", lambda planned, motion, *rest: (planned, motion, False)
    )
    monkeypatch.setattr(mending, "mended", lambda *of_motion: None)
    made = plan(CORNER, machine(ASKING), method=method, corner=BEZIER.get(method))
    assert not made.verdict.passed
    assert all("after the filters" in fault for fault in made.verdict.sentences)


# --- the closed forms along arcs ----------------------------------------------------------------------------------------------

CIRCLE = parse_program("G21 F60000\nG2 X0 Y0 I5 J0\n", source="circle")


def steady_feed(made):
    t = made.trajectory
    return np.median(t.feed[(t.t > 0.4 * t.t[-1]) & (t.t < 0.6 * t.t[-1])])


def test_an_arc_is_run_as_fast_as_the_filter_error_allows():
    """kappa v^2 (dt^2/8 + sum T^2/24) is the whole tolerance in the steady part, of which the filters' part is measured behind them."""
    limits = machine((0.03, 0.05), velocity=1000.0)
    made = plan(CIRCLE, limits, method="second-order", corner="bezier")
    rate = limits.dt**2 / 8 + (0.03**2 + 0.05**2) / 24
    assert steady_feed(made) == pytest.approx(np.sqrt(0.05 / rate * 5.0), rel=2e-3)
    assert made.verdict.after_filters.contour_error_mm == pytest.approx(0.05, rel=2e-2)


def test_an_arc_turns_by_no_more_than_the_phase_lag():
    fir = Fir(time_constants=(0.02, 0.01), phase_lag_max=3.0)
    made = plan(CIRCLE, problems.machine(fir=fir), method="second-order", corner="bezier")
    assert steady_feed(made) == pytest.approx(2 * 5.0 * np.deg2rad(3.0) / 0.03, rel=2e-3)
