"""Method `kinematic`: always verified, never slower than stopping, arcs, stops, dwells, and the paper's two extra rules."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from benchmarks.jobs import problems
from planner.base.errors import InputError
from planner.geometry.build import toolpath_from_program
from planner.geometry.chords import arc_point, arc_sagitta, chorded
from planner.geometry.toolpath import Joint
from planner.nc.program import PathControl
from planner.nc.reader import parse_program
from planner.planning.methods.kinematic import CHORD_FRACTION, KinematicMethod
from planner.planning.methods.registry import plan
from planner.planning.methods.stop import StopMethod
from planner.verifier.pieces import RATIO_ROUNDING

JOBS = problems.all_jobs()
MACHINE = problems.machine()
ARCS_WHOLE = 4e-4  # arcs run whole keep 3e-4 away from their limits


def kinematic(program, machine=MACHINE, **settings_):
    made = KinematicMethod(**settings_).plan(program, machine)
    assert made.require().verdict.passed, made.verdict.faults
    return made


@pytest.fixture(scope="module", params=sorted(JOBS))
def planned(request):
    return kinematic(JOBS[request.param])


def test_it_is_verified_within_eps_and_faster_than_stopping(planned):
    verdict = planned.verdict
    assert max(check.ratio for check in verdict.limits.values()) <= 1 + RATIO_ROUNDING
    assert verdict.contour_error_mm <= 0.05
    assert verdict.vertex_error_mm <= 0.05
    assert planned.trajectory.cycle_time < planned.stop_time


def test_some_limit_is_reached(planned):
    """What limits the motion is the machine, the tolerance or the feed, not the method's own caution."""
    used = [check.ratio for check in planned.verdict.limits.values()]
    assert max(used) > 0.999 or planned.verdict.vertex_error_mm > 0.99 * 0.05


def test_it_ends_exactly_at_rest_on_the_programmed_end(planned):
    last = planned.trajectory
    np.testing.assert_allclose(last.position[-1], planned.toolpath.end[-1], atol=1e-9)
    assert not last.velocity[-1].any()
    assert not last.acceleration[-1].any()


def test_blocks_are_named_in_order_and_none_is_left_out(planned):
    """Corners change the block in their middle, long legs where the block ends."""
    trajectory, path = planned.trajectory, planned.toolpath
    assert (np.diff(trajectory.block) >= 0).all()
    at = np.searchsorted(path.block, trajectory.block)
    # within a corner or chord of its block
    towards = path.start[at] + np.clip(
        np.einsum("ta,ta->t", trajectory.position - path.start[at], path.end[at] - path.start[at])
        / path.length[at] ** 2, 0, 1,
    )[:, None] * (path.end[at] - path.start[at])  # fmt: skip
    straight = path.arc[at] < 0
    off = np.linalg.norm(trajectory.position - towards, axis=1)[straight]
    assert off.max(initial=0.0) <= 0.05 * (1 + 1e-6)


def test_times_of_the_shared_jobs():
    """From `planner plan`; a change is a change of the method."""
    times = {name: kinematic(JOBS[name]).trajectory.cycle_time for name in ("pentagon", "zigzag", "circle")}
    assert times == pytest.approx({"pentagon": 1.0238, "zigzag": 2.8645, "circle": 1.7143}, abs=2e-4)


@pytest.mark.shows("kinematic", "sampled: random paths verified, never slower than stopping")
@pytest.mark.slow
@given(seed=st.integers(0, 10**6))
@settings(max_examples=20)
def test_random_paths_are_verified_and_never_slower_than_stopping(seed):
    """Two or three axes with limits of their own, legs of 10 um to 100 mm, turns of all sizes."""
    rng = np.random.default_rng(seed)
    axes = problems.random_axes(rng, velocity=(1, 3), acceleration=(2, 4), jerk=(3.5, 6.5))
    machine = problems.machine(
        tolerance=10 ** rng.uniform(-2.8, -0.5),  # a dt^2/8 and more
        axes=axes,
        **({"normal_acceleration": 10 ** rng.uniform(2, 4)} if rng.random() < 0.3 else {}),
    )
    dims = int(rng.integers(2, 4))
    program = problems.random_polyline(
        rng, blocks=int(rng.integers(2, 30)), shortest=0.01, longest=100.0, dimensions=dims
    )
    program = dataclasses.replace(program, feed=10 ** rng.uniform(0.5, 2.5, len(program)))
    made = kinematic(program, machine)
    assert made.trajectory.cycle_time <= made.stop_time * (1 + 1e-6)


ARC_JOBS = {
    "tangent": "G1 X10\nG3 X20 Y10 J10\nG1 Y20\nG2 X30 Y30 I10\nG1 X40\n",
    "sharp": "G1 X10\nG2 X14 Y0 I2 J3\nG1 X20 Y5\nG3 X20 Y5 I3 J0\n",
    "helix": "G1 X5\nG2 X5 Y0 Z6 I4 J3 P2\nG1 X0 Z0\n",
    "tiny": "G1 X1\nG2 X1.01 Y-0.01 J-0.01\nG1 Y-1\nG3 X1.02 I0.005\nG1 Y0\n",
    "full circle": "G2 X0 Y0 I50 J0\n",
    "only arcs": "G2 X10 Y0 I5 J0\nG3 X20 Y0 I5 J0\nG2 X30 Y0 I5 J0\n",
}


@pytest.mark.parametrize("name", sorted(ARC_JOBS))
@pytest.mark.parametrize("feed", [600, 6000, 30000])
def test_arcs_are_verified_and_not_slower_than_stopping(name, feed):
    made = kinematic(parse_program(f"G21 G17 F{feed}\n{ARC_JOBS[name]}"), problems.machine(velocity=500.0))
    assert made.trajectory.cycle_time <= made.stop_time * (1 + ARCS_WHOLE)


def test_small_arcs_are_run_through_and_long_ones_whole():
    """A fillet between lines is not stopped at; a circle at high feed is faster exact, with stops at its ends."""
    fillet = kinematic(parse_program("G21 G17 F3000\nG1 X10\nG3 X11 Y1 J1\nG1 Y10\n"))
    assert fillet.trajectory.cycle_time < 0.9 * fillet.stop_time
    assert fillet.verdict.contour_error_mm > 1e-3
    circle = kinematic(parse_program("G21 G17 F30000\nG2 X0 Y0 I50 J0\n"), problems.machine(velocity=500.0))
    assert circle.verdict.contour_error_mm < 2e-3  # the interpolator's chords, no others
    assert circle.trajectory.cycle_time == pytest.approx(circle.stop_time, rel=ARCS_WHOLE)


def test_chords_stay_within_their_share():
    path = toolpath_from_program(JOBS["arcs"], MACHINE)
    count, sagitta = arc_sagitta(path, CHORD_FRACTION)
    lines = chorded(path, CHORD_FRACTION, np.zeros(len(path), bool))
    assert (lines.arc < 0).all()
    assert len(lines) == count.sum() > 40
    for i in np.flatnonzero(path.arc >= 0):
        x = np.linspace(0, path.length[i], 400 * count[i] + 1)
        segment = np.full(len(x), i)
        on_arc = path.arcs.center[path.arc[segment]] + arc_point(path, segment, x)
        k = np.flatnonzero(lines.block == path.block[i])
        part = np.minimum(np.arange(len(x)) // 400, count[i] - 1)
        start, u = lines.start[k][part], lines.tangent_start[k][part]
        away = on_arc - start
        off = np.linalg.norm(away - (away * u).sum(axis=1, keepdims=True) * u, axis=1)
        assert off.max() == pytest.approx(sagitta[i], rel=1e-3)
        assert off.max() <= CHORD_FRACTION * 0.05 * (1 + 1e-9)
        # what the chords use is not left to the corners between them
        np.testing.assert_allclose(lines.tolerance[k[1:]] + sagitta[i], 0.05, rtol=1e-12)


def test_exact_path_keeps_arcs_and_stops_at_corners():
    made = kinematic(parse_program("G21 G17 F3000\nG61\nG1 X10\nG3 X11 Y1 J1\nG1 Y10\nX0\n"))
    assert made.verdict.contour_error_mm == pytest.approx(
        50**2 / 1.0 * MACHINE.dt**2 / 8, rel=0.6
    )  # F^2 dt^2 / 8R
    assert made.verdict.contour_error_mm < 2e-4
    assert made.verdict.vertex_error_mm < 2e-4
    assert made.trajectory.cycle_time == pytest.approx(made.stop_time, rel=ARCS_WHOLE)


def test_stops_dwells_and_rapids():
    text = "G21 F6000\nG4 P0.25\nG1 X10\nG61.1\nX20\nG64\nX30 Y5\nG4 P0.5\nG1 X40\nG0 X50 Y0\nX0\nG1 X-5 Y3\nG4 P0.125\n"
    made = kinematic(parse_program(text))
    path, t = made.toolpath, made.trajectory
    assert (path.joint == Joint.STOP).sum() >= 6
    still = ~t.velocity.any(axis=1)
    assert still.sum() * MACHINE.dt == pytest.approx(0.875, abs=0.02)
    assert made.trajectory.cycle_time < made.stop_time
    assert path.dwell.sum() == pytest.approx(0.875)


def test_a_dwell_before_an_arc_that_is_run_whole():
    made = kinematic(
        parse_program("G21 G17 F30000\nG4 P0.2\nG2 X0 Y0 I50 J0\nG4 P0.1\n"), problems.machine(velocity=500.0)
    )
    assert made.verdict.contour_error_mm < 2e-3
    assert not made.trajectory.velocity[made.trajectory.t < 0.199].any()
    assert made.trajectory.cycle_time == pytest.approx(made.stop_time, rel=ARCS_WHOLE)


def test_feed_changes_on_a_straight_line():
    """Each block at its own feed; no stop where only the feed changes."""
    made = kinematic(parse_program("G21\nG1 X10 F6000\nX20 F1200\nX30 F6000\n"))
    t = made.trajectory
    block = t.block == made.program.end[:, 0].searchsorted(15.0)
    assert t.feed[block].max() == pytest.approx(20.0, rel=1e-9)
    inside = (t.position[:, 0] > 1) & (t.position[:, 0] < 29)
    assert t.feed[inside].min() == pytest.approx(20.0, rel=1e-6)
    assert made.verdict.limits["feed"].ratio <= 1 + RATIO_ROUNDING


def test_cutting_a_straight_line_into_blocks_changes_nothing():
    whole = kinematic(problems.polyline([[0, 0], [20, 0], [20, 20]]))
    rng = np.random.default_rng(4)
    cut = np.sort(rng.uniform(0, 20, 30))
    points = [[0, 0], *([x, 0] for x in cut), [20, 0], *([20, y] for y in cut), [20, 20]]
    parts = kinematic(problems.polyline(points))
    assert parts.trajectory.cycle_time == pytest.approx(whole.trajectory.cycle_time, rel=1e-9)
    assert len(np.unique(parts.trajectory.block)) > 50  # some of the 62 are shorter than a period


@pytest.mark.parametrize("job", ["pentagon", "zigzag", "spiral"])
def test_the_reverse_path_takes_as_long(job):
    program = JOBS[job]
    points = np.vstack([program.start, program.end])[::-1]
    back = kinematic(problems.polyline(points - points[0]))
    assert back.trajectory.cycle_time == pytest.approx(kinematic(program).trajectory.cycle_time, rel=1e-6)


@given(length=st.floats(-2, 2), time=st.floats(-1, 1))
@settings(max_examples=8)
def test_scaled_lengths_and_times_scale_the_plan(length, time):
    length, time = 10.0**length, 10.0**time
    v, a, j = 100.0 * length / time, 2000.0 * length / time**2, 2e5 * length / time**3
    machine = problems.machine(velocity=v, acceleration=a, jerk=j, tolerance=0.05 * length, dt=1e-3 * time)
    program = JOBS["pentagon"]
    scaled = dataclasses.replace(program, end=program.end * length, feed=program.feed * length / time)
    made = KinematicMethod().plan(scaled, machine).require()
    assert made.trajectory.cycle_time == pytest.approx(
        time * kinematic(program).trajectory.cycle_time, rel=1e-6
    )


def test_start_stop_speed_is_a_step_at_the_vertex():
    """docs/papers.md: floor = v_ss / max |du_k|, at the vertex exactly; incompatible with the limits by construction, and reported
    as such."""
    program, machine = (
        problems.polyline([[0, 0], [10, 0], [20, 0.5], [20, 10], [10, 10]]),
        problems.machine(tolerance=1e-3),
    )
    plain, stepping = kinematic(program, machine), KinematicMethod(start_stop=5.0).plan(program, machine)
    assert stepping.trajectory.cycle_time < plain.trajectory.cycle_time
    assert "step of velocity" in stepping.sentence
    assert not stepping.verdict.passed
    assert all(
        fault.startswith(("acceleration", "jerk", "columns", "motion"))
        for fault in stepping.verdict.sentences
    )
    assert stepping.verdict.vertex_error_mm <= 1e-3
    speed = stepping.trajectory.velocity
    steps = np.abs(np.diff(speed, axis=0)) - 2000 * MACHINE.dt
    assert 0.5 < steps.max() <= 5.0 + 1e-9


def test_without_use_a_start_stop_speed_changes_nothing():
    made = kinematic(JOBS["pentagon"], start_stop=1e-6)
    assert made.trajectory.cycle_time == kinematic(JOBS["pentagon"]).trajectory.cycle_time


@pytest.mark.parametrize(
    "settings_", [{"start_stop": -1.0}, {"start_stop": np.inf}, {"start_stop": np.nan}],
)  # fmt: skip
def test_settings_that_make_no_sense_are_refused(settings_):
    with pytest.raises(InputError, match=next(iter(settings_))):
        KinematicMethod(**settings_)


def test_it_has_a_name_and_counts_its_corners():
    made = plan(JOBS["pentagon"], MACHINE, method="kinematic")
    assert made.method == "kinematic"
    assert made.corner == "kinematic"
    assert made.sentence.startswith("4 corners are run through")


def test_samples_on_both_sides_of_a_stop_do_not_cut_its_vertex():
    """With a dt^2/8 = 8 um and a tolerance of 1 um it waits for a sample at its stops, or it would depend on where they fall."""
    machine = problems.machine(dt=0.004, acceleration=4000.0, tolerance=1e-3)
    rng = np.random.default_rng(0)
    made = kinematic(problems.random_polyline(rng, blocks=60, shortest=0.5, longest=5.0), machine)
    assert made.verdict.vertex_error_mm <= 1e-3
    assert made.trajectory.cycle_time < made.stop_time + 59 * machine.dt


def test_no_tolerance_for_blending_means_the_plan_of_stop():
    program = problems.polyline([[0, 0], [10, 0], [10, 10]], path_control=PathControl.EXACT_STOP)
    made, stop = kinematic(program), StopMethod().plan(program, MACHINE)
    assert made.trajectory.cycle_time == pytest.approx(stop.trajectory.cycle_time, rel=1e-9)
    np.testing.assert_allclose(made.trajectory.position, stop.trajectory.position, atol=1e-7)


@pytest.mark.parametrize("radius", [0.2, 116.0, 5e3])
@pytest.mark.parametrize(("acceleration", "jerk"), [(10.0, 3e7), (2000.0, 2e5), (2000.0, 3e9)])
def test_samples_lie_on_the_arc_however_fast_the_acceleration_steps(radius, acceleration, jerk):
    """Found by the campaign: phases of 1e-7 s between pieces of 0.1 s took the motion 2e-5 mm off the arc."""
    machine = problems.machine(acceleration=acceleration, jerk=jerk)
    end = radius * np.array([np.sin(0.5), 1.0 - np.cos(0.5)])
    text = f"G21 G61 F6000\nG3 X{end[0]:.9f} Y{end[1]:.9f} I0 J{radius:.9f}\n"
    made = kinematic(parse_program(text), machine)
    off = np.linalg.norm(made.trajectory.position[:, :2] - [0.0, radius], axis=1) - radius
    assert np.abs(off).max() <= 1e-6


LABEL = (  # a frame with round corners, a circle and a star, in HPGL
    "IN;SP1;VS30;PU200,0;PD3000,0;AA3000,200,90;PD3200,2200;AA3000,2200,90;PD200,2400;AA200,2200,90;PD0,200;AA200,200,90;"
    "PU2600,1200;CI300;PU1600,1800;PD1747,1402,2171,1385,1838,1123,1953,715,1600,950,1247,715,1362,1123,1029,1385,1453,1402,1600,1800;"
    "PU0,0;SP0;"
)


def test_the_contour_error_of_paper_003_with_its_settings():
    """It prints 2000 mm/s2, 300 mm/s, 10 ms, 0.05 mm and an error within 0.025 mm, which is a dt^2/8, the bow of a chord; the jerk of
    paper 000. (docs/papers.md, E)"""
    machine = problems.machine(
        velocity=300.0, acceleration=2000.0, jerk=2000.0 / 0.03, dt=0.01, tolerance=0.05
    )
    drawn = kinematic(parse_program(LABEL, source="label.plt"), machine)
    stopping = StopMethod().plan(parse_program(LABEL, source="label.plt"), machine)
    assert drawn.cycle_time < 0.95 * stopping.require().cycle_time
    assert 0.02 < drawn.verdict.contour_error_mm < 0.025
