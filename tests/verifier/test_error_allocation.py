"""Eq. 18-20 at programmed corners: the record is what closed forms and brute force say, good motions keep the laws, bad ones do not."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from motions import JERK_FREE, Asked, Moves, chain, changed, machine, polyline, rounded, sample, stay

from planner.machine import machine_from_dict
from planner.report.trajectory_reader import divided_difference
from planner.verifier import Given, error_allocation, verify

AXES = {
    letter: {"velocity": 500.0, "acceleration": a, "jerk": 1e9}
    for letter, a in zip("xyz", (2000.0, 900.0, 1500.0), strict=True)
}
UNEQUAL = machine_from_dict({"name": "unequal", "dt": 0.001, "tolerance": 0.05, "axes": AXES})
LIMITS = np.array([axis["acceleration"] for axis in AXES.values()])
BOX = np.array(np.meshgrid(*[(-a, a) for a in LIMITS])).reshape(3, -1).T  # all that the axes can do at once


def bent(theta, heading=0.0, leg=20.0):
    """Two legs that turn by theta, the first in the direction of heading [rad]."""
    turn = np.array([heading, heading + theta])
    steps = leg * np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)
    return np.round(np.vstack([np.zeros(3), np.cumsum(steps, axis=0)]), 9)


def program(points, on=UNEQUAL, feed=200.0):
    moves = Moves(tuple(points[0]))
    for point in points[1:]:
        moves.line(*point, feed=feed)
    return moves.toolpath(on)


def judged(motion, points, on=UNEQUAL, between=True, **more):
    return verify(
        sample(motion, on.dt), program(points, on), on,
        motion=Asked(motion, on.dt) if between else None, not_limited=JERK_FREE, **more,
    )  # fmt: skip


def laws_broken(verdict):
    return [fault for fault in verdict.sentences if fault.startswith("eq.")]


def arc_of(theta, cut):
    """Radius and inward normal of the circle that `rounded` puts into a corner of `bent`."""
    return cut / (1 / np.cos(theta / 2) - 1)


# --- the record ---------------------------------------------------------------------------------------------------------------

angles = st.floats(8.0, 165.0).map(np.deg2rad)
headings = st.floats(-np.pi, np.pi)


@pytest.mark.shows("eq-18-20", "exact: closed forms and brute force")
@given(theta=angles, heading=headings, share=st.floats(0.05, 2.0), cut=st.floats(0.002, 0.045))
@settings(max_examples=40)
def test_a_circle_in_a_corner_is_measured_as_what_it_is(theta, heading, share, cut):
    """Radius R, speed v, across the bisector: kappa = 1/R, v^2/R against the most that the axes can do that way."""
    radius = arc_of(theta, cut)
    inward = np.array([-np.sin(heading + theta / 2), np.cos(heading + theta / 2), 0.0])
    most = (BOX @ inward).max()
    feed = min(np.sqrt(share * most * radius), 150.0)
    points = bent(theta, heading, leg=radius * np.tan(theta / 2) + 20 * feed * UNEQUAL.dt)
    verdict = judged(rounded(points, cut, feed), points)
    found = verdict.corners
    assert (len(found), found.count, found.not_looked_at) == (1, 1, 0)
    assert found.feed_planned[0] == pytest.approx(feed, rel=1e-6)
    assert found.speed_ratio[0] >= feed / np.sqrt(most * radius) * (1 - 1e-5)
    assert found.feed_closed_form[0] == pytest.approx(np.sqrt(most * radius), rel=1e-5)
    assert found.miss[0] == pytest.approx(cut, abs=1e-7)
    chord = feed**2 / radius * UNEQUAL.dt**2 / 8
    assert found.chord_error[0] == pytest.approx(chord, rel=1e-6)
    assert found.budget_ratio[0] >= (cut + chord) / 0.05 * (1 - 1e-5)
    # the laws are kept exactly by those that the axes can do, and that stay within the tolerance
    within = found.budget_ratio[0] <= 1 + 1e-6
    assert (found.held == 1) == (found.speed_ratio[0] <= 1 + 1e-6 and within)
    assert bool(laws_broken(verdict)) == (found.held == 0)


@pytest.mark.shows("eq-18-20", "exact: closed forms and brute force")
@given(
    theta=angles, heading=headings, dt=st.floats(3e-4, 1e-2), eps=st.floats(0.003, 0.1),
    filters=st.sampled_from([(), (0.02,), (0.02, 0.013)]), normal=st.sampled_from([None, 300.0]),
)  # fmt: skip
@settings(max_examples=40)
def test_equation_20_is_the_best_that_sharing_the_budget_can_do(theta, heading, dt, eps, filters, normal):
    """Brute force over what the rounding gets: kappa = (2/3) tan^2(theta/2) / eps_ap; the rest pays for chords and filters."""
    more = {"fir": {"time_constants": filters}} if filters else {}
    on = machine_from_dict(
        {"name": "m", "dt": dt, "tolerance": eps, "axes": AXES, "normal_acceleration": normal, **more}
    )
    points = bent(theta, heading, leg=1.0)
    n = points[0] + points[2] - 2 * points[1]
    most = min((BOX @ n).max() / np.linalg.norm(n), normal or np.inf)
    share = np.linspace(0.0, eps, 20_001)[1:]
    kappa = (2 / 3) * np.tan(theta / 2) ** 2 / share
    across = np.minimum(most, (eps - share) / (dt**2 / 8 + sum(T**2 for T in filters) / 24))
    best = np.sqrt(across / kappa).max()
    toolpath = program(points, on)
    found = verify(sample(polyline(points), on.dt), toolpath, on).corners
    assert found.feed_paper[0] == pytest.approx(best, rel=1e-4)


def test_the_place_is_the_nearest_in_the_program_s_order():
    """The last leg runs exactly through the vertex that the corner missed by 40 um; in space that would be nearer."""
    points = np.array([(0, 0, 0), (10, 0, 0), (10, 5, 0), (15, 5, 0), (15, 0, 0), (0, 0, 0)], float)
    found = judged(rounded(points, 0.04, 5.0), points).corners
    np.testing.assert_allclose(found.miss, 0.04, atol=1e-7)
    assert (np.diff(found.time) > 0).all()
    assert found.time[0] == pytest.approx(10 / 5.0, rel=0.01)


@pytest.mark.parametrize("dt", [0.0005, 0.004, 0.02])
def test_the_motion_is_looked_at_where_it_is_nearest_however_far_apart_the_samples_lie(dt):
    """A parabola-like pass between two samples: the distance of its nearest point is found to 1e-9 mm."""
    on = machine(dt=dt, acceleration=1e5, tolerance=0.5)
    points = bent(np.deg2rad(80.0), 0.3)
    motion = rounded(points, 0.3, 50.0)
    t = np.linspace(0.45, 0.55, 200_001) * motion[0]
    brute = np.linalg.norm(motion[1](t)[0] - points[1], axis=1).min()
    found = judged(motion, points, on).corners
    assert found.miss[0] == pytest.approx(brute, abs=1e-9)


def test_a_stop_at_a_corner_keeps_the_laws_and_is_counted_as_one():
    points = bent(np.deg2rad(70.0))
    found = judged(polyline(points, acceleration=900.0), points).corners
    assert (found.count, found.held, int(found.stands.sum()), int(found.compared.sum())) == (1, 1, 1, 0)
    assert max(found.worst_speed_ratio, found.worst_budget_ratio) < 0.002
    assert found.stands.sum() == 1


def test_stops_of_the_program_and_joints_that_do_not_turn_are_no_corners():
    toolpath = Moves().line(5).line(10).line(10, 5).dwell(0.01).line(20, 5).toolpath(UNEQUAL)
    motion = chain(
        polyline([(0, 0, 0), (10, 0, 0)]), polyline([(10, 0, 0), (10, 5, 0)]),
        stay((10, 5, 0), 0.01), polyline([(10, 5, 0), (20, 5, 0)]),
    )  # fmt: skip
    found = verify(sample(motion, 0.001), toolpath, UNEQUAL).corners
    assert found.line.tolist() == [20]
    assert (
        "no corner without a full stop"
        in judged(polyline([(0, 0, 0), (9, 0, 0)]), [(0, 0, 0), (9, 0, 0)]).corners.sentence()
    )


# --- what cannot be looked at -------------------------------------------------------------------------------------------------


def test_samples_too_far_apart_are_said_aloud_and_the_motion_is_looked_at_instead():
    """At 2692 mm/s2 and 20 ms the axes can bow by 0.13 mm between samples, more than eps."""
    coarse = machine_from_dict({"name": "c", "dt": 0.02, "tolerance": 0.05, "axes": AXES})
    points = bent(np.deg2rad(60.0))
    motion = rounded(points, 0.04, 5.0)
    alone = judged(motion, points, coarse, between=False).corners
    assert (alone.count, alone.not_looked_at, alone.held) == (0, 1, 0)
    assert np.isnan(alone.worst_speed_ratio)
    assert alone.sentence() == "eq. 18 holds at 0 of 1 corners; 1 could not be checked"
    assert alone.summary()["not_looked_at"] == 1
    asked = judged(motion, points, coarse).corners
    assert (asked.count, asked.not_looked_at) == (1, 0)


def test_corners_that_the_motion_never_reaches_are_not_looked_at():
    points = np.vstack([bent(np.deg2rad(60.0)), [(20.0, 40.0, 0.0), (0.0, 45.0, 0.0)]])
    verdict = judged(rounded(points[:3], 0.04, 5.0), points)
    assert not verdict.passed
    found = verdict.corners
    assert found.looked.tolist() == [True, True, False]  # it ends at the second
    assert found.held == 2
    assert "1 could not be checked" in found.sentence()


# --- the laws, broken ---------------------------------------------------------------------------------------------------------


def test_a_corner_taken_too_fast_is_a_fault_with_its_line():
    points, theta = bent(np.deg2rad(60.0)), np.deg2rad(60.0)
    radius = arc_of(theta, 0.04)
    inward = np.array([-np.sin(theta / 2), np.cos(theta / 2), 0.0])
    limit = np.sqrt((BOX @ inward).max() * radius)
    verdict = judged(rounded(points, 0.04, 1.1 * limit), points)
    said = [fault for fault in laws_broken(verdict) if fault.startswith("eq. 19")]
    assert len(said) == 1
    assert "1.1" in said[0]
    assert "line 10, x20 y0 z0" in said[0]
    reported = verify(
        sample(rounded(points, 0.04, 1.1 * limit), 0.001),
        program(points),
        UNEQUAL,
        not_limited=("acceleration", "jerk"),
    )
    assert not laws_broken(reported)
    assert reported.corners.worst_speed_ratio > 1.09


def test_a_budget_that_chords_overdraw_is_a_fault_wherever_the_samples_fall():
    """The motion misses by 45 of 50 um; at 4 ms its chords bow by 8 um more, and only some phases of the samples show it."""
    on = machine(dt=0.004, acceleration=1e5)
    points, theta = bent(np.deg2rad(60.0)), np.deg2rad(60.0)
    radius = arc_of(theta, 0.045)
    feed = np.sqrt(4000.0 * radius)  # kappa v^2 dt^2/8 = 8 um
    shown = 0
    for wait in np.arange(8) * 0.0005:
        verdict = judged(chain(stay(points[0], wait), rounded(points, 0.045, feed)), points, on)
        assert verdict.corners.budget_ratio[0] == pytest.approx(0.053 / 0.05, rel=2e-3)
        assert [fault for fault in laws_broken(verdict) if fault.startswith("eq. 18")]
        shown += any(fault.startswith("vertex") for fault in verdict.sentences)
    assert 0 < shown < 8


def test_many_broken_corners_are_five_sentences_and_a_count():
    points = np.array([(5.0 * k, 5.0 * (k % 2), 0.0) for k in range(12)])
    verdict = judged(rounded(points, 0.04, 100.0), points)
    said = [fault for fault in laws_broken(verdict) if fault.startswith("eq. 19")]
    assert len(said) == 6
    assert said[-1] == "eq. 19: 10 corners in all"


def test_half_of_the_closed_form_would_fail_motions_that_use_it(monkeypatch):
    """A corner at 0.9 of its law: with half of the acceleration in the law the verdict fails, with half of the speed in eq. 20 the
    gain doubles."""
    points, theta = bent(np.deg2rad(60.0)), np.deg2rad(60.0)
    inward = np.array([-np.sin(theta / 2), np.cos(theta / 2), 0.0])
    feed = 0.9 * np.sqrt((BOX @ inward).max() * arc_of(theta, 0.04))
    before = judged(rounded(points, 0.04, feed), points)
    assert not laws_broken(before)
    support = error_allocation.allowed_across
    monkeypatch.setattr(error_allocation, "allowed_across", lambda *given: 0.5 * support(*given))
    after = judged(rounded(points, 0.04, feed), points)
    assert laws_broken(after)
    assert after.corners.worst_speed_ratio == pytest.approx(np.sqrt(2) * before.corners.worst_speed_ratio)


@pytest.mark.parametrize("digits", [None, 6, 4])
def test_accelerations_from_positions_break_the_law_only_if_the_motion_does(digits):
    """Divided differences are means of the acceleration; the digits that positions are written with are taken off, not the law."""
    points, theta = bent(np.deg2rad(60.0)), np.deg2rad(60.0)
    inward = np.array([-np.sin(theta / 2), np.cos(theta / 2), 0.0])
    limit = np.sqrt((BOX @ inward).max() * arc_of(theta, 0.04))
    rounding = np.full(3, 0.5 * 10.0**-digits) if digits else ()
    for share in (0.9999999, 1.6):
        given = sample(rounded(points, 0.04, share * limit), 0.001)
        position = given.position if digits is None else np.round(given.position, digits)
        velocity, acceleration, jerk = (divided_difference(given.t, position, order) for order in (1, 2, 3))
        bare = changed(given, position=position, velocity=velocity, acceleration=acceleration, jerk=jerk)
        verdict = verify(
            bare,
            program(points),
            UNEQUAL,
            given=Given(columns=(), position_rounding=rounding),
            not_limited=JERK_FREE,
        )
        assert verdict.corners.count == 1
        # of 1780 mm/s2 4 r / h^2 is 3.5 for six digits, 350 for four; it is in there once and taken off once
        assert verdict.corners.speed_ratio[0] > share * {None: 0.99, 6: 0.98, 4: 0.6}[digits]
        broken = any(fault.startswith("eq. 19") for fault in verdict.sentences)
        assert broken == (share > 1)
