"""Correct motions pass, and what is measured on them is what the closed forms say."""

import numpy as np
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st
from judging import judge
from motions import (
    JERK_FREE,
    Moves,
    along,
    chain,
    helix,
    machine,
    polyline,
    rest_to_rest,
    rounded,
    sample,
    stay,
    straight,
)

from planner.verifier import Kind, verify

M = machine()


@pytest.mark.shows("verify", "exact: right motions have the ratios of closed forms")
def test_line_at_the_limits_has_ratio_one():
    toolpath = Moves().line(30, feed=200).toolpath(M)
    motion = polyline([(0, 0, 0), (30, 0, 0)], feed=100)
    verdict = judge(motion, toolpath, not_limited=JERK_FREE)
    assert verdict.passed, verdict.faults
    assert verdict.limits["velocity.x"].ratio == pytest.approx(1.0, abs=1e-12)
    assert verdict.limits["acceleration.x"].ratio == pytest.approx(1.0, abs=1e-6)
    assert verdict.limits["feed"].ratio == pytest.approx(0.5, abs=1e-12)
    assert verdict.limits["velocity.y"].value == 0.0
    assert not verdict.limits["jerk.x"].limited
    # the acceleration jumps by 2000 mm/s2 on a sample; the third difference spreads that over two periods
    samples_alone = verify(sample(motion, M.dt), toolpath, M, not_limited=JERK_FREE)
    assert samples_alone.limits["jerk.x"].value == pytest.approx(2000 / (2 * M.dt), rel=1e-5)


def test_jerk_limited_line_has_jerk_ratio_one():
    toolpath = Moves().line(30, feed=80).toolpath(M)
    verdict = judge(polyline([(0, 0, 0), (30, 0, 0)], feed=80, jerk=2e5), toolpath)
    assert verdict.passed, verdict.faults
    for name in ("acceleration.x", "jerk.x", "feed"):
        assert verdict.limits[name].ratio == pytest.approx(1.0, abs=1e-6)


@pytest.mark.shows("normal-acceleration", "exact: on a circle, by the judge")
def test_a_circle_has_the_normal_acceleration_and_chord_error_of_the_closed_forms():
    limited = machine(normal_acceleration=500.0)
    toolpath = Moves((10.0, 0, 0)).arc((0, 0), 2 * np.pi).toolpath(limited)
    length, curve = helix((10.0, 0, 0), (0, 0), 2 * np.pi)
    motion = along(length, curve, rest_to_rest(length, 50.0, 1000.0, 1e5))
    verdict = judge(motion, toolpath, limited)
    assert verdict.passed, verdict.faults
    assert verdict.limits["normal_acceleration"].value == pytest.approx(50.0**2 / 10, rel=1e-6)
    sagitta = 10 * (1 - np.cos(50 * 0.001 / 20))
    assert verdict.contour_error_mm == pytest.approx(sagitta, rel=1e-6)


@pytest.mark.parametrize("rise", [0.0, 5.0, -40.0])
@pytest.mark.parametrize("sweep", [2 * np.pi, -1.3 * np.pi, 7.5 * np.pi])
def test_helices_are_on_their_own_path(sweep, rise):
    toolpath = Moves((3.0, 4.0, 0)).arc((0, 0), sweep, rise=rise).toolpath(M)
    length, curve = helix((3.0, 4.0, 0), (0, 0), sweep, rise)
    motion = along(length, curve, rest_to_rest(length, 20.0, 500.0, 5e4))
    verdict = judge(motion, toolpath)
    # the program's end point is rounded to 1e-4 mm, so that end and contour are off by that much
    assert verdict.contour_error_mm < 1.2e-4
    assert [fault for fault in verdict.sentences if not fault.startswith(("end", "start", "stop"))] == []


@pytest.mark.shows("verify", "exact: right motions have the ratios of closed forms")
@pytest.mark.parametrize("angle", [10.0, 90.0, 150.0])
def test_a_corner_cut_by_the_whole_budget_passes_and_is_measured(angle):
    turn = np.deg2rad(angle)
    points = [(0.0, 0, 0), (10.0, 0, 0), (10 + 10 * np.cos(turn), 10 * np.sin(turn), 0)]
    fast = machine(acceleration=1e5, jerk=1e9)
    toolpath = Moves().line(*points[1]).line(*points[2]).toolpath(fast)
    verdict = judge(rounded(points, 0.0495, 5.0), toolpath, fast, not_limited=JERK_FREE)
    # it neither starts nor ends at rest
    assert [f for f in verdict.sentences if not f.startswith(("stop", "start", "end"))] == []
    assert verdict.vertex_error_mm == pytest.approx(0.0495, rel=5e-3)
    assert Kind.ORDER not in verdict.kinds


def test_dwells_and_stops_pass():
    m = machine()
    toolpath = Moves().line(5).dwell(0.05).line(5, 5).dwell(0.0103).toolpath(m)
    legs = [polyline([(0, 0, 0), (5, 0, 0)], jerk=2e5), polyline([(5, 0, 0), (5, 5, 0)], jerk=2e5)]
    motion = chain(legs[0], stay((5, 0, 0), 0.05), legs[1], stay((5, 5, 0), 0.0103))
    verdict = judge(motion, toolpath)
    assert verdict.passed, verdict.faults


def test_a_dwell_at_the_start_passes():
    toolpath = Moves().dwell(0.02).line(5).toolpath(M)
    motion = chain(stay((0, 0, 0), 0.02), polyline([(0, 0, 0), (5, 0, 0)], jerk=2e5))
    verdict = judge(motion, toolpath)
    assert verdict.passed, verdict.faults


def test_a_reversal_passes():
    toolpath = Moves().line(5).line(1).line(9).toolpath(M)
    points = [(0, 0, 0), (5, 0, 0), (1, 0, 0), (9, 0, 0)]
    verdict = judge(polyline(points, jerk=2e5), toolpath)
    assert verdict.passed, verdict.faults


def turned_at(far: float, jerk: float = 2e5):
    """Along x from rest at 0 to `far` and back to rest, turning at its largest acceleration, jerk r: far is
    47/24 jerk r^3 of the time r of a phase."""
    r = np.cbrt(24.0 / 47.0 * far / jerk)
    phases = [(r, 1), (r, -1), (r, -1), (r / 2, 0), (r / 2, 0), (r, 1), (r, 1), (r, -1)]
    begin, states = np.append(0.0, np.cumsum([lasting for lasting, _ in phases])), [np.zeros(3)]
    for lasting, sign in phases:
        x, v, a = states[-1]
        j = sign * jerk
        states.append(
            np.array(
                [
                    x + lasting * (v + lasting * (a / 2 + lasting * j / 6)),
                    v + lasting * (a + lasting * j / 2),
                    a + lasting * j,
                ]
            )
        )
    np.testing.assert_allclose(states[4], [far, 0.0, -jerk * r], atol=1e-9)

    def motion(t):
        k = np.clip(np.searchsorted(begin, t, side="right") - 1, 0, len(phases) - 1)
        x, v, a = np.array(states)[k].T
        j, tau = jerk * np.array([sign for _, sign in phases])[k], t - begin[k]
        along = [x + tau * (v + tau * (a / 2 + tau * j / 6)), v + tau * (a + tau * j / 2), a + tau * j, j]
        return tuple(np.stack([each, 0 * t, 0 * t], axis=1) for each in along)

    return float(begin[-1]), motion


@pytest.mark.parametrize(
    ("turns_at", "fault"), [(5.0, ""), (4.96, ""), (5.04, ""), (4.94, "vertex"), (5.06, "contour")]
)
def test_a_reversal_is_a_vertex_to_be_passed_within_its_tolerance(turns_at, fault):
    """No rest: the motion turns at its largest acceleration; 0.05 mm is the tolerance."""
    quick = machine(velocity=200.0, acceleration=1e4)
    verdict = judge(turned_at(turns_at), Moves().line(5, feed=300).line(0, feed=300).toolpath(quick), quick)
    assert verdict.passed == (not fault), verdict.faults
    assert all(each.startswith(fault) for each in verdict.sentences) or "eq. 18" in verdict.sentences[-1]
    assert fault in " ".join(verdict.sentences)
    assert verdict.vertex_error_mm == pytest.approx(max(5.0 - turns_at, 0.0), abs=2e-3)


@pytest.mark.parametrize("x", [(0, 5, 0, 5), (0, 5)])
def test_a_reversal_that_is_left_out_is_found(x):
    """A retrace run once instead of twice, or not at all, ends where the program does."""
    toolpath = Moves().line(5).line(0).line(5).line(0).line(5).toolpath(M)
    verdict = judge(polyline([(at, 0, 0) for at in x], jerk=2e5), toolpath)
    assert not verdict.passed
    assert Kind.ORDER in verdict.kinds


def test_segments_far_shorter_than_the_budget_pass():
    """4000 segments of 2.5e-5 mm between two long ones: all of them are within the budget at once."""
    moves = Moves().line(5)
    for k in range(1, 4001):
        moves.line(5 + 2.5e-5 * k)
    toolpath = moves.line(10).toolpath(M)
    verdict = judge(polyline([(0, 0, 0), (10, 0, 0)], jerk=2e5), toolpath)
    assert verdict.passed, verdict.faults
    assert verdict.contour_error_mm < 1e-12


@pytest.mark.slow
def test_a_spiral_with_turns_closer_than_the_budget_passes():
    angle = np.linspace(0, 12 * np.pi, 720)
    radius = 5 + 0.02 * angle / (2 * np.pi)
    points = np.stack([radius * np.cos(angle), radius * np.sin(angle), 0 * angle], 1)
    moves = Moves(tuple(points[0]))
    for p in points[1:]:
        moves.line(*p)
    verdict = judge(polyline(points), moves.toolpath(M), not_limited=JERK_FREE)
    assert verdict.passed, verdict.faults


coordinate = st.floats(-15, 15).map(lambda x: round(x, 3))
point = st.tuples(coordinate, coordinate, coordinate)


@pytest.mark.slow
@settings(max_examples=30, deadline=None)
@given(points=st.lists(point, min_size=2, max_size=12), jerk=st.sampled_from([np.inf, 2e5, 5e3]))
@example(points=[(0.0, 46.281, -49.516), (0.0, 0.75, 46.277)], jerk=2e5)  # ends 0.06 us after a look
def test_every_polyline_run_rest_to_rest_passes(points, jerk):
    points = [p for k, p in enumerate(points) if k == 0 or p != points[k - 1]]
    assume(len(points) > 1)
    moves = Moves(points[0])
    for p in points[1:]:
        moves.line(*p)
    toolpath = moves.toolpath(M)
    verdict = judge(polyline(points, jerk=jerk), toolpath, not_limited=JERK_FREE if np.isinf(jerk) else ())
    assert verdict.passed, verdict.faults
    # chords cut the corners at which the motion rests between two samples
    assert verdict.contour_error_mm < 2000 * M.dt**2 / 8


@pytest.mark.slow
@settings(max_examples=20, deadline=None)
@given(scale=st.floats(0.01, 100), legs=st.integers(1, 6), seed=st.integers(0, 99))
def test_scaling_lengths_and_limits_leaves_the_ratios(scale, legs, seed):
    points = np.round(np.random.default_rng(seed).uniform(-20, 20, (legs + 1, 3)), 3)

    def ratios(k):
        moves = Moves(tuple(points[0] * k))
        for p in points[1:] * k:
            moves.line(*p, feed=50 * k)
        scaled = machine(tolerance=0.05 * k, velocity=100 * k, acceleration=2000 * k, jerk=2e5 * k)
        motion = polyline(points * k, feed=50 * k, acceleration=2000 * k, jerk=2e5 * k)
        verdict = judge(motion, moves.toolpath(scaled), scaled)
        assert verdict.passed, verdict.faults
        return [check.ratio for check in verdict.limits.values()]

    # third differences of positions carry the rounding of the positions: 1e-15 * 50 mm / (0.25 ms)^3 of 2e5 mm/s3
    np.testing.assert_allclose(ratios(scale), ratios(1.0), rtol=1e-4)


def test_the_reading_in_blocks_changes_nothing(monkeypatch):
    from planner.verifier import stream

    toolpath = Moves().line(30).line(30, 20).toolpath(M)
    motion = polyline([(0, 0, 0), (30, 0, 0), (30, 20, 0)], jerk=2e5)
    whole = judge(motion, toolpath)
    monkeypatch.setattr(stream, "BLOCK_SAMPLES", 7)
    pieces = judge(motion, toolpath)
    for name, check in whole.limits.items():
        assert check.ratio == pytest.approx(pieces.limits[name].ratio, rel=1e-9)
    assert whole.contour_error_mm == pieces.contour_error_mm
    assert whole.vertex_error_mm == pieces.vertex_error_mm


def test_progress_ends_at_one():
    toolpath = Moves().line(30).toolpath(M)
    told = []
    judge(polyline([(0, 0, 0), (30, 0, 0)], jerk=2e5), toolpath, progress=told.append)
    assert told[-1] == 1.0
    assert told == sorted(told)


def test_short_last_period_of_any_length_passes():
    length, curve = straight((0, 0, 0), (20, 0, 0))
    for feed in np.linspace(40, 41, 12):
        toolpath = Moves().line(20, feed=feed).toolpath(M)
        motion = along(length, curve, rest_to_rest(length, feed, 2000.0, 2e5))
        verdict = judge(motion, toolpath)
        assert verdict.passed, verdict.faults
