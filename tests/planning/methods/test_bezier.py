"""Method `bezier` (paper 002): corner speeds of eq. (19)-(20), the error budget with and without allocation, and verified motions."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st

from benchmarks.jobs import problems
from planner.base.arrays import FloatArray
from planner.corners.bezier import BezierCorner
from planner.corners.smooth import round_corners
from planner.machine import Machine
from planner.nc.program import PathControl
from planner.nc.reader import parse_program
from planner.planning.methods.bezier import FREE_FRACTION, BezierMethod
from planner.planning.methods.registry import plan
from planner.planning.methods.stop import StopMethod
from planner.verifier.pieces import RATIO_ROUNDING

JOBS = problems.all_jobs()
MACHINE = problems.machine()
# The 5-point path of paper 002 ten times as large (docs/papers.md E doubts its scale: it takes 7.5 periods), its A_max, Ts and eps.
TEN_TIMES = problems.polyline(
    10.0 * np.array([(0, 0, 0), (0.5, 0, 0), (1.0, 0.4, 0.4), (0.6, 0.9, 0.8), (0.1, 0.9, 0.8)]),
    feed=5000 / 60,
)
EPS, TS, A_MAX = 0.05, 0.004, 1e4


def paper_machine(acceleration: float = 1e4, **more) -> Machine:
    settings_ = {
        "velocity": 1e3,
        "acceleration": acceleration,
        "jerk": 1e7,
        "dt": TS,
        "normal_acceleration": A_MAX,
    }
    return problems.machine(**(settings_ | more))


def bezier(program, machine=MACHINE, **settings_):
    made = BezierMethod(**settings_).plan(program, machine)
    assert made.require().verdict.passed, made.verdict.faults
    return made


def one_corner(theta: float, length: float = 20.0):
    return problems.polyline([[-length, 0], [0, 0], [length * np.cos(theta), length * np.sin(theta)]])


# --- equations 15 to 20 in the motion -----------------------------------------------------------------------------------------


def closed_form(theta: FloatArray, eps_ap: float, X: float, sigma2: float) -> FloatArray:
    """v = sqrt(X/kappa), kappa = sigma2 (2/3) tan^2(theta/2)/eps_ap: eq. (16), corrected, in (17), in (19)."""
    return np.sqrt(X * 1.5 * eps_ap / sigma2) / np.tan(theta / 2)


def run_through(made, corner: BezierCorner | None = None):
    """The corners that are not stopped at: their lines, angles and speeds by the verdict; tangent lengths and shares of the tolerance
    by the rounding of the path."""
    path = round_corners(
        made.toolpath, made.machine, corner or BezierCorner(), blend_tangents=True, free=FREE_FRACTION
    )
    run = ~made.corners.stands
    line = made.corners.line[run]  # the joint behind a line has its number: one leg a line
    return line, made.corners.theta[run], made.corners.feed_planned[run], path.d[line], path.tol_ap[line]


@pytest.mark.shows("bezier", "exact: corner speeds of eq. 19 and 20")
@pytest.mark.parametrize("sigma2", [1.0, 0.9])
def test_corners_have_the_speed_of_equations_19_and_20(sigma2):
    """eps_ch = A Ts^2/8 = 0.02, eps_ap = 0.03. With eq. (16) as printed, d = 4 eps cos, the first corner would be 1.6 times as slow."""
    made = bezier(TEN_TIMES, paper_machine(), corner=BezierCorner(sigma2=sigma2))
    line, theta, feed, _, tol_ap = run_through(made, BezierCorner(sigma2=sigma2))
    assert len(line) >= 1
    np.testing.assert_allclose(tol_ap, 0.03, rtol=3e-4)
    np.testing.assert_allclose(feed, closed_form(theta, 0.03, A_MAX, sigma2), rtol=1e-3)


def test_the_speed_is_constant_from_one_end_of_a_corner_to_the_other():
    made = bezier(TEN_TIMES, paper_machine(dt=1e-4))
    t, (line, _, speed, length, _) = made.trajectory, run_through(made)
    for vertex, d, feed in zip(made.toolpath.end[line - 1], length, speed, strict=True):
        inside = np.linalg.norm(t.position - vertex, axis=1) < 0.9 * d
        assert inside.sum() > 50
        np.testing.assert_allclose(t.feed[inside], feed, rtol=1e-6)


def test_without_allocation_the_errors_add_up_to_more_than_the_tolerance():
    """Figures 6 and 7: with eq. (20) all errors together stay within eps. Without, the rounding takes all of it and the chords of
    A Ts^2/8 = 0.02 come on top: up to 0.07 (docs/papers.md E)."""
    machine = paper_machine()
    sharing, alone = bezier(TEN_TIMES, machine), BezierMethod(allocate=False).plan(TEN_TIMES, machine)
    assert sharing.verdict.vertex_error_mm <= EPS
    run = ~alone.corners.stands
    speed = closed_form(alone.corners.theta[run], EPS, A_MAX, 0.9)
    np.testing.assert_allclose(alone.corners.feed_planned[run], speed, rtol=1e-3)
    assert not alone.verdict.passed
    assert EPS * 1.2 < alone.verdict.vertex_error_mm <= EPS + A_MAX * TS**2 / 8
    assert alone.trajectory.cycle_time < sharing.trajectory.cycle_time  # that is what it buys


@given(theta=st.floats(10.0, 120.0).map(np.deg2rad), eps=st.floats(0.005, 0.1), dt=st.floats(0.5e-3, 4e-3))
@settings(max_examples=25)
def test_rounding_and_chord_error_add_up_to_the_tolerance_at_the_vertex(theta, eps, dt):
    """Eq. (18) at the joint: the curve misses the vertex by eps_ap, the middle of a chord there by kappa v^2 dt^2/8 more."""
    machine = paper_machine(tolerance=eps, dt=dt, jerk=1e9)
    made = bezier(one_corner(theta), machine)
    line, turn, feed, _, tol_ap = run_through(made)
    assume(len(line) == 1)
    kappa = A_MAX / closed_form(turn, tol_ap, A_MAX, BezierCorner().sigma2) ** 2
    chord = (kappa * feed**2 * dt**2 / 8)[0]
    assert tol_ap[0] + chord <= eps * (1 + 1e-6)
    if feed[0] ** 2 * kappa[0] > A_MAX * (1 - 1e-3):  # the normal acceleration is what holds it
        assert tol_ap[0] + chord == pytest.approx(eps, rel=2e-3)
    assert tol_ap[0] * (1 - 1e-6) <= made.verdict.vertex_error_mm <= eps * (1 + 1e-9)


def test_other_weights_are_faster_by_the_root_of_sigma2():
    """docs/papers.md C.G3: in the G3 family kappa_max is sigma2 times the printed pair's."""
    printed, better = (bezier(TEN_TIMES, paper_machine(), corner=BezierCorner(sigma2=s)) for s in (1.0, 0.9))
    both = ~(printed.corners.stands | better.corners.stands)
    assert both.any()
    gain = [made.corners.feed_planned[both] for made in (better, printed)]
    np.testing.assert_allclose(gain[0] / gain[1], np.sqrt(1 / 0.9), rtol=2e-3)
    assert better.trajectory.cycle_time < printed.trajectory.cycle_time


@given(seed=st.integers(0, 10**6), dims=st.integers(2, 3))
@example(seed=3112, dims=3)
@settings(max_examples=10)
def test_cutting_straight_lines_changes_nothing(seed, dims):
    """Where a CAM system cuts a line into blocks is no place of the motion: the look-ahead must not see it."""
    rng = np.random.default_rng(seed)
    program = problems.random_polyline(rng, blocks=int(rng.integers(2, 8)), dimensions=dims, shortest=0.3)
    points = np.vstack([program.start, program.end])
    cuts = [np.append(np.sort(rng.uniform(0.05, 0.95, rng.integers(0, 5))), 1.0) for _ in program.end]
    pieces = [a + q[:, None] * (b - a) for a, b, q in zip(points[:-1], points[1:], cuts, strict=True)]
    machine = problems.machine(tolerance=10 ** rng.uniform(-2, -0.7), jerk=10 ** rng.uniform(4, 5.5))
    whole, cut = (bezier(problems.polyline(p), machine) for p in (points, np.vstack([points[:1], *pieces])))
    # 2e-6 nearly always; 3.4e-5 on the example: a cut inside the corner moves its grid, and with it what the bound of the jerk between
    # samples adds (baselines/lookahead/constant_speed_corners.py): 7.7e-6 with twice the samples, 7.6e-7 with four times
    assert cut.trajectory.cycle_time == pytest.approx(whole.trajectory.cycle_time, rel=1e-4)


# --- motions ------------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", sorted(set(JOBS) - {"five points"}))
def test_jobs_are_verified_and_not_slower_than_stopping(name):
    made = bezier(JOBS[name])
    assert max(check.ratio for check in made.verdict.limits.values()) <= 1 + RATIO_ROUNDING
    assert made.trajectory.cycle_time <= made.stop_time * (1 + 1e-6)
    np.testing.assert_allclose(made.trajectory.position[-1], made.toolpath.end[-1], atol=1e-9)
    assert not made.trajectory.velocity[-1].any()


def test_times_of_the_shared_jobs():
    """From `planner plan`; a change is a change of the method. Sharp corners at constant speed do not pay at this jerk."""
    times = {name: bezier(JOBS[name]).trajectory.cycle_time for name in ("pentagon", "circle", "arcs")}
    assert times == pytest.approx({"pentagon": 1.0651, "circle": 2.544, "arcs": 3.3721}, abs=2e-3)


def test_a_corner_is_run_through_only_where_that_is_faster():
    """At 90 degrees a stop is faster, at 10 degrees the corner is; docs/papers.md 003: the largest corner speed is not time-optimal."""
    sharp, shallow = bezier(one_corner(np.pi / 2)), bezier(one_corner(np.deg2rad(5)))
    assert sharp.corners.stands.all()
    assert sharp.trajectory.cycle_time == pytest.approx(sharp.stop_time, rel=1e-6)
    assert not shallow.corners.stands.any()
    assert shallow.trajectory.cycle_time < 0.95 * shallow.stop_time


@pytest.mark.shows("bezier", "sampled: random paths verified, never slower than stopping")
@given(seed=st.integers(0, 10**6), dims=st.integers(2, 3))
@settings(max_examples=12)
def test_random_paths_are_verified_and_never_slower_than_stopping(seed, dims):
    """Limits of their own per axis, legs of 10 um to 100 mm, turns of all sizes."""
    rng = np.random.default_rng(seed)
    axes = problems.random_axes(rng, velocity=(1, 3), acceleration=(2.5, 4), jerk=(4, 6.5))
    program = problems.random_polyline(rng, blocks=int(rng.integers(2, 25)), dimensions=dims, longest=100.0)
    made = bezier(program, problems.machine(tolerance=10 ** rng.uniform(-2, -0.5), axes=axes))
    assert made.trajectory.cycle_time <= made.stop_time * (1 + 1e-6)


def test_stops_dwells_rapids_and_exact_path():
    text = "G21 F6000\nG4 P0.25\nG1 X10\nG61.1\nX20\nG64\nX30 Y0.5\nG4 P0.5\nG1 X40\nG0 X50 Y0\nX0\nG61\nG1 X-5 Y3\nX-9\n"
    made = bezier(parse_program(text))
    t = made.trajectory
    assert (~t.velocity.any(axis=1)).sum() * MACHINE.dt == pytest.approx(0.75, abs=0.02)
    assert made.trajectory.cycle_time <= made.stop_time * (1 + 1e-6)


def test_no_tolerance_for_blending_means_the_plan_of_stop():
    program = problems.polyline([[0, 0], [10, 0], [10, 10]], path_control=PathControl.EXACT_STOP)
    made, stop = bezier(program), StopMethod().plan(program, MACHINE)
    assert made.trajectory.cycle_time == pytest.approx(stop.trajectory.cycle_time, rel=1e-6)


def test_it_has_a_name_and_counts_its_corners():
    made = plan(TEN_TIMES, paper_machine(), method="bezier")
    assert (made.method, made.corner, made.solver) == ("bezier", "bezier", "look-ahead")
    assert made.sentence.startswith(f"{(~made.corners.stands).sum()} corners are run through")


def test_a_blend_that_is_straight_at_its_apex_has_no_closed_form():
    """Found by the campaign of random jobs: between equal arcs that turn to different sides the closed form was infinite."""
    machine = problems.machine(velocity=4000.0, acceleration=1e5, jerk=3e7, dt=0.002, tolerance=0.7)
    text = "G21 G91 F46480\nG0 X1 Y2 Z3\nG3 X10 I5\nG2 X5 Y5 I5\nG1 Y5\nX5\nM2\n"
    made = plan(parse_program(text, machine), machine, method="bezier")
    assert made.verdict.passed
    assert made.sentence.startswith("1 corners are run through")
