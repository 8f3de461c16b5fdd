"""The grid along the path: derivatives, arc length, error control, and the constraints between the points."""

from __future__ import annotations

import dataclasses
from functools import cache

import numpy as np
import pytest
from quick import slow_but
from scipy.special import ellipe, ellipk
from whole_plans import CORNERS, Solved, dense_motion, smooth_path, solve

from benchmarks.jobs import problems
from planner.base.arrays import FloatArray
from planner.base.errors import InputError
from planner.corners.bezier import BezierCorner
from planner.corners.elements import element_length, element_point, to_arc_length
from planner.feedrate.sampling.path_samples import PathSamples
from planner.feedrate.sampling.samples import insert_points, sample_path
from planner.nc.reader import parse_program

MACHINE = problems.machine()
JOBS = problems.all_jobs()
NODES, WEIGHTS = np.polynomial.legendre.leggauss(24)

# Jobs made to hurt, beyond the shared ones.
NASTY = {
    "leg of 1 um between corners": problems.polyline([[0, 0], [10, 0], [10, 1e-3], [20, 1e-3]]),
    "U-turn of 1 um": problems.polyline([[0, 0], [10, 0], [10, 1e-3], [0, 1e-3]]),
    "1 um steps": problems.polyline(np.c_[np.arange(60) * 1e-3, (np.arange(60) % 2) * 1e-3]),
    "174.9 degrees": problems.polyline([[0, 0], [10, 0], [10 - 10 * np.cos(np.deg2rad(5.1)), 10 * np.sin(np.deg2rad(5.1))]]),
    "zero-length moves": problems.polyline([[0, 0], [0, 0], [10, 0], [10, 0], [10, 10], [10, 10]]),
    "S-curve of tiny arcs": parse_program(
        "G21 G17 G90 F6000\n" + "".join(f"G{2 + i % 2} X{0.02 * (i + 1):.4f} Y0 I0.01 J0\n" for i in range(20)) + "G1 X1\n"
    ),
    "arcs with a closing gap": parse_program("G21 G17 G90 F6000\nG1 X1\nG3 X1.41 Y0.402 I0 J0.4\nG1 X1.41 Y5\n"),
    "nearly tangent arcs": parse_program(
        "G21 G17 G90 F6000\nG1 X10\nG3 X20.001 Y10.002 I0.002 J10\nG1 X20.01 Y30\nG2 X25 Y35 R5.0\nG1 X30\n"
    ),
}  # fmt: skip
EVERY = JOBS | NASTY


@cache
def sampled(job: str, kind: str = "bezier") -> PathSamples:
    return sample_path(smooth_path(EVERY[job], MACHINE, kind), MACHINE)


@cache
def solved_path(job: str, kind: str = "bezier") -> Solved:
    return solve(EVERY[job], MACHINE, kind)


def evaluate(samples: PathSamples, i: int, share: float) -> tuple[FloatArray, float]:
    """Arc-length derivatives (4, A) and speed |dr/dw| inside interval i."""
    out, work = np.empty((4, 3)), np.empty((2, 4, 3))
    w = samples.w0[i] + share * (samples.w1[i] - samples.w0[i])
    middle = 0.5 * (samples.w0[i] + samples.w1[i])
    element_point(
        samples.table.legs,
        samples.table.corners,
        samples.table.spans,
        samples.element[i],
        w,
        middle,
        work,
        out,
    )
    return out, to_arc_length(out)


def quadrature(samples: PathSamples, i: int) -> float:
    """Length of interval i by a rule of order 48."""
    speeds = [evaluate(samples, i, 0.5 + 0.5 * x)[1] for x in NODES]
    return float(0.5 * (samples.w1[i] - samples.w0[i]) * (WEIGHTS @ speeds))


# --- what the samples say -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", CORNERS)
@pytest.mark.parametrize("job", list(JOBS))
def test_tangents_are_unit_and_curvature_is_normal(job, kind):
    samples = sampled(job, kind)
    np.testing.assert_allclose(np.linalg.norm(samples.d1, axis=1), 1.0, rtol=1e-13)
    for d2 in (samples.d2_left, samples.d2_right):
        size = np.maximum(np.linalg.norm(d2, axis=1), 1.0)
        assert (np.abs((samples.d1 * d2).sum(axis=1)) <= 1e-9 * size).all()
    for d2, d3 in (
        (samples.d2_left, samples.d3_left),
        (samples.d2_right, samples.d3_right),
    ):  # T.r''' = -kappa^2
        along = (samples.d1 * d3).sum(axis=1) + (d2 * d2).sum(axis=1)
        assert (np.abs(along) <= 1e-7 * (1 + (d2 * d2).sum(axis=1))).all()


@pytest.mark.parametrize("job", ["pentagon", "arcs", "five points"])
@pytest.mark.parametrize("kind", CORNERS)
def test_derivatives_against_differences(job, kind):
    """r'' and r''' inside the intervals are what central differences of r' and r'' say."""
    samples = sampled(job, kind)
    for i in samples.intervals[::3]:
        here, speed = evaluate(samples, i, 0.5)
        step = 1e-4
        after, before = evaluate(samples, i, 0.5 + step)[0], evaluate(samples, i, 0.5 - step)[0]
        ds = 2 * step * speed * (samples.w1[i] - samples.w0[i])
        for order in (1, 2):
            difference = (after[order] - before[order]) / ds
            size = max(1.0, np.abs(here[order + 1]).max())
            rounding = 1e-14 * (1 + np.abs(here[order]).max()) / ds
            np.testing.assert_allclose(difference, here[order + 1], atol=1e-5 * size + rounding)


@pytest.mark.parametrize("job", list(JOBS))
@pytest.mark.parametrize("kind", slow_but("bezier", CORNERS))
def test_arc_length_against_quadrature(job, kind):
    samples = sampled(job, kind)
    inner = samples.intervals[:: max(1, len(samples) // 300)]
    ds = samples.s[inner + 1] - samples.s[inner]
    exact = np.array([quadrature(samples, i) for i in inner])
    np.testing.assert_allclose(ds, exact, rtol=2e-8, atol=1e-12)


@pytest.mark.parametrize("theta_deg", [30.0, 60.0, 90.0, 120.0, 150.0, 170.0])
def test_length_of_the_polynomial_corner_in_elliptic_integrals(theta_deg):
    """L = d [2 sec^2 + K - (2 sec^2 - 1) E], modulus k = sin(theta/2) (docs/papers.md C)."""
    theta = np.deg2rad(theta_deg)
    program = problems.polyline([[-50, 0], [0, 0], [50 * np.cos(theta), 50 * np.sin(theta)]])
    path = smooth_path(program, MACHINE, BezierCorner(sigma2=1.0))
    samples = sample_path(path, MACHINE)
    sec2, m = 1 / np.cos(theta / 2) ** 2, np.sin(theta / 2) ** 2
    expected = path.d[1] * (2 * sec2 + ellipk(m) - (2 * sec2 - 1) * ellipe(m))
    corner = samples.intervals[samples.element[samples.intervals] < 0]
    found = (samples.s[corner + 1] - samples.s[corner]).sum()
    assert found == pytest.approx(expected, rel=1e-8)
    assert samples.s[-1] == pytest.approx(100 - 2 * path.d[1] + expected, rel=1e-9)


@pytest.mark.parametrize("theta", [1e-5, 1e-3, 0.03])
def test_length_of_gentle_corners(theta):
    """Where the accelerations need no fine grid the length still does: the motion must not run faster than it says."""
    program = problems.polyline([[-5, 0], [0, 0], [5 * np.cos(theta), 5 * np.sin(theta)]])
    samples = sample_path(smooth_path(program, MACHINE), MACHINE)
    for i in samples.intervals:
        assert samples.s[i + 1] - samples.s[i] == pytest.approx(quadrature(samples, i), rel=1e-8)


def test_curvature_jumps_where_a_line_meets_an_arc():
    """Tangent joints stay as they are: r'' is 0 before and 1/R after, and nothing in between."""
    program = parse_program("G21 G17 G90 F6000\nG1 X10\nG3 X20 Y10 I0 J10\nG1 Y20\n")
    samples = sample_path(smooth_path(program, MACHINE), MACHINE)
    jump = np.linalg.norm(samples.d2_right - samples.d2_left, axis=1)
    at = np.flatnonzero(jump > 1e-9)
    np.testing.assert_allclose(samples.position[at], [[10, 0, 0], [20, 10, 0]], atol=1e-12)
    np.testing.assert_allclose(samples.d2_left[at], [[0, 0, 0], [-0.1, 0, 0]], atol=1e-12)
    np.testing.assert_allclose(samples.d2_right[at], [[0, 0.1, 0], [0, 0, 0]], atol=1e-12)
    assert samples.s[-1] == pytest.approx(20 + 5 * np.pi, rel=1e-12)


@pytest.mark.parametrize("job", list(EVERY))
@pytest.mark.parametrize("kind", slow_but("bezier", CORNERS))
def test_the_path_is_continuous_and_in_order(job, kind):
    samples = sampled(job, kind)
    inner = samples.intervals
    assert (samples.s[inner + 1] > samples.s[inner]).all()
    assert (np.diff(samples.segment) >= 0).all()
    for i in inner[:: max(1, len(inner) // 200)]:
        np.testing.assert_allclose(evaluate(samples, i, 0.0)[0][0], samples.position[i], atol=1e-9)
        np.testing.assert_allclose(evaluate(samples, i, 1.0)[0][0], samples.position[i + 1], atol=1e-9)
        np.testing.assert_allclose(evaluate(samples, i, 1.0)[0][1], samples.d1[i + 1], atol=1e-6)
    np.testing.assert_array_equal(samples.position[0], EVERY[job].start)
    np.testing.assert_allclose(samples.position[-1], EVERY[job].end[-1], atol=1e-12)


# --- between the grid points ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("job", list(EVERY))
@pytest.mark.parametrize("kind", slow_but("bezier", CORNERS))
def test_limits_hold_between_grid_points(job, kind):
    """The solved profile evaluated densely: axis velocity and acceleration, and feed."""
    for chunk in dense_motion(solved_path(job, kind).motion, MACHINE.dt):
        assert np.abs(chunk.velocity).max() <= 100.0 * (1 + 1e-6)
        assert np.abs(chunk.acceleration).max() <= 2000.0 * (1 + 1e-6)
        assert chunk.feed.max() <= 100.0 * (1 + 1e-9)


def normal_acceleration(solved, machine) -> float:
    """Largest kappa feed^2 anywhere between the samples."""
    worst = 0.0
    for chunk in dense_motion(solved.motion, machine.dt):
        moving = chunk.feed > 1e-3
        tangent = chunk.velocity[moving] / chunk.feed[moving, None]
        normal = (
            chunk.acceleration[moving] - tangent * (chunk.acceleration[moving] * tangent).sum(axis=1)[:, None]
        )
        worst = max(worst, float(np.linalg.norm(normal, axis=1).max()))
    return worst


@pytest.mark.parametrize("job", list(EVERY))
def test_normal_acceleration_between_grid_points(job):
    machine = problems.machine(normal_acceleration=1500.0)
    assert normal_acceleration(solve(EVERY[job], machine), machine) <= 1500.0 * (1 + 1e-6)


@pytest.mark.parametrize("job", list(EVERY))
def test_axis_accelerations_hold_anywhere_in_an_interval(job):
    """The same at its very ends and at random places, from r', r'', x and u alone."""
    rng = np.random.default_rng(1)
    solved = solved_path(job)
    samples, x, u = solved.samples, solved.solution.feed_sq, solved.solution.acc_s
    legs, corners, spans, scratch = (
        samples.table.legs,
        samples.table.corners,
        samples.table.spans,
        np.empty((4, 3)),
    )
    for i in samples.intervals[:: max(1, len(samples) // 1000)]:
        middle = 0.5 * (samples.w0[i] + samples.w1[i])
        for share in (1e-6, *rng.uniform(0, 1, 3), 1 - 1e-6):
            w = samples.w0[i] + share * (samples.w1[i] - samples.w0[i])
            ds = element_length(legs, corners, spans, samples.element[i], samples.w0[i], w, middle, scratch)
            here, _ = evaluate(samples, i, share)
            assert np.abs(here[1] * u[i] + here[2] * (x[i] + 2 * u[i] * ds)).max() <= 2000.0 * (1 + 1e-6)


# --- inserting points -----------------------------------------------------------------------------------------------------


def test_inserted_points_lie_on_the_line():
    samples = sampled("pentagon")
    straight = samples.intervals[samples.element[samples.intervals] >= 0]
    chosen = np.repeat(straight[:2], 2)
    s = samples.s[chosen] + np.tile([0.25, 0.75], 2) * (samples.s[chosen + 1] - samples.s[chosen])
    more = insert_points(samples, chosen, s)
    assert len(more) == len(samples) + 4
    new = np.flatnonzero(np.isin(more.s, s))
    np.testing.assert_array_equal(more.s[new], s)
    for i in new:
        assert not more.d2_left[i].any()
        assert not more.d2_right[i].any()
        np.testing.assert_allclose(evaluate(more, i, 0.0)[0][0], more.position[i], atol=1e-12)
        np.testing.assert_allclose(evaluate(more, i - 1, 1.0)[0][0], more.position[i], atol=1e-12)
    np.testing.assert_array_equal(np.delete(more.d1, new, axis=0), samples.d1)
    np.testing.assert_array_equal(more.s[more.piece[1:] - 1], samples.s[samples.piece[1:] - 1])


def test_points_cannot_be_inserted_on_curves():
    samples = sampled("arcs")
    corner = samples.intervals[samples.element[samples.intervals] < 0][:1]
    with pytest.raises(ValueError, match="straight"):
        insert_points(samples, corner, samples.s[corner] + 1e-9)
    arc = samples.intervals[samples.table.legs["round"][np.maximum(samples.element[samples.intervals], 0)]][
        -1:
    ]
    with pytest.raises(ValueError, match="straight"):
        insert_points(samples, arc, samples.s[arc] + 1e-9)


def test_a_machine_without_an_axis_is_refused():
    path = smooth_path(JOBS["pentagon"], MACHINE)
    flat = MACHINE.model_copy(update={"axes": {k: MACHINE.axes[k] for k in "xy"}})
    with pytest.raises(InputError, match="no axis 'z'"):
        sample_path(path, flat)


# --- jobs that once broke a stage -----------------------------------------------------------------------------------------


def test_a_reversal_is_a_full_stop_of_a_fixed_path():
    solved = solve(problems.polyline([[0, 0], [10, 0], [0, 0]]), MACHINE)
    assert solved.time == pytest.approx(2 * (10 / 100 + 100 / 2000), rel=1e-9)


def test_a_short_arc_between_stops_takes_finite_time():
    program = parse_program("G21 G17 G90 F6000\nG61.1\nG3 X0.5 Y0.0125078 I0 J10\nG1 X5\n")
    assert np.isfinite(solve(program, MACHINE).time)


def test_a_slow_long_move_takes_its_length_over_its_feed():
    program = problems.polyline([[0, 0], [300, 0], [300, 300]], feed=1.0)
    assert solve(program, MACHINE).time == pytest.approx(600.0, rel=1e-3)


def test_a_hardly_turning_joint_beside_a_sharp_corner():
    angle = np.cumsum([0, 2e-8, np.deg2rad(174), np.deg2rad(174)])
    steps = np.array([10, 1e-3, 10, 10])[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    solved = solve(problems.polyline(np.vstack([[0, 0], np.cumsum(steps, axis=0)])), MACHINE)
    # Faster than from rest to rest on every leg, slower than the feed.
    assert 30.0 / 100.0 < solved.time < 3 * (10 / 100 + 100 / 2000)
    assert (solved.solution.feed_sq <= problems.FEED**2 * (1 + 1e-9)).all()


def test_joined_lines_stay_within_the_tolerance():
    heading = 0.9e-8 * np.arange(20_000)
    steps = 0.1 * np.stack([np.cos(heading), np.sin(heading)], axis=1)
    program = problems.polyline(np.vstack([[0, 0], np.cumsum(steps, axis=0)]))
    samples = sample_path(smooth_path(program, MACHINE, tolerance=0.01), MACHINE)
    middle = program.end[10_000 - 1]
    along = np.interp(middle[0], samples.position[:, 0], samples.position[:, 1])
    assert abs(along - middle[1]) <= 0.01


def test_records_are_frozen():
    samples = sampled("pentagon")
    with pytest.raises(ValueError, match="read-only"):
        samples.s[0] = 1.0
    with pytest.raises(dataclasses.FrozenInstanceError):
        samples.s = np.zeros(3)  # type: ignore[misc]
