"""How many points the grid has, and what they cost in cycle time."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from whole_plans import smooth_path, solve

from benchmarks.jobs import problems
from planner.corners.kinematic import KinematicCorner
from planner.corners.smooth import round_corners
from planner.feedrate.sampling.samples import RESOLUTION, sample_path
from planner.geometry.build import toolpath_from_program

MACHINE = problems.machine()
JOBS = problems.all_jobs()


@pytest.mark.parametrize("job", ["pentagon", "arcs", "zigzag"])
def test_cycle_time_converges_in_the_resolution(job):
    """First order in the step, because u is constant on an interval; the step goes with the root of the resolution.

    Measured: order 0.5 to 0.75 in the resolution; at the default the plan is at most 0.3 % slower than the exact optimum.
    """
    exact = solve(JOBS[job], MACHINE, resolution=1e-5).time
    resolutions = np.array([1.6e-2, 8e-3, 4e-3, 2e-3, 1e-3])
    excess = np.array([solve(JOBS[job], MACHINE, resolution=r).time for r in resolutions]) / exact - 1
    assert (np.diff(excess) < 0).all()
    order = np.polyfit(np.log(resolutions), np.log(excess), 1)[0]
    assert 0.45 < order < 0.85
    assert 0 < excess[resolutions == RESOLUTION][0] < 3e-3


def test_the_number_of_points_grows_with_the_root_of_the_resolution():
    """An error of second order in the step: a resolution four times finer costs about twice the points."""
    path = smooth_path(JOBS["zigzag"], MACHINE)
    points = [len(sample_path(path, MACHINE, r)) for r in (1.6e-2, 4e-3, 1e-3, 2.5e-4)]
    growth = np.array(points[1:]) / points[:-1]
    assert ((growth > 1.4) & (growth < 2.6)).all()


def test_points_grow_in_proportion_to_the_path():
    counts = [
        len(sample_path(smooth_path(problems.zigzag(n), MACHINE), MACHINE)) for n in (50, 100, 200, 400)
    ]
    steps = np.diff(counts) / np.array([50, 100, 200])
    np.testing.assert_allclose(steps, steps[0], rtol=1e-3)


def test_pieces_of_rounding_length_do_not_make_their_neighbours_as_short():
    """A kinematic corner between chords of a circle ends within an ulp of its apex: an interval without length."""
    machine = problems.machine()
    toolpath = toolpath_from_program(problems.chord_circle(), machine, None)
    corner = KinematicCorner.from_machine(machine, toolpath.axes)
    path = round_corners(toolpath, machine, corner, blend_tangents=True)
    samples = sample_path(path, machine, third_order=True)
    assert len(samples) < 40 * len(toolpath)


def test_a_straight_line_needs_one_interval():
    samples = sample_path(smooth_path(problems.polyline([[0, 0], [100, 50]]), MACHINE), MACHINE)
    assert len(samples) == 2
    assert (samples.margin == 0).all()


@given(pieces=st.integers(2, 6), seed=st.integers(0, 1000))
@settings(max_examples=15)
def test_splitting_lines_changes_nothing_but_the_block_boundaries(pieces, seed):
    rng = np.random.default_rng(seed)
    angle = np.cumsum(np.deg2rad(rng.uniform(-150, 150, 5)))
    corners = np.vstack([[0, 0], np.cumsum(3 * np.stack([np.cos(angle), np.sin(angle)], axis=1), axis=0)])
    shares = np.concatenate([[0.0], np.sort(rng.uniform(0.05, 0.95, pieces - 1)), [1.0]])
    split = np.vstack(
        [corners[:1], *[a + shares[1:, None] * (b - a) for a, b in itertools.pairwise(corners)]]
    )
    whole, parts = solve(problems.polyline(corners), MACHINE), solve(problems.polyline(split), MACHINE)
    np.testing.assert_allclose(parts.path.d[parts.path.d > 0], whole.path.d[whole.path.d > 0], rtol=1e-9)
    assert parts.samples.s[-1] == pytest.approx(whole.samples.s[-1], rel=1e-7)
    assert parts.time == pytest.approx(whole.time, rel=2e-3)  # other grid points, each within the resolution
