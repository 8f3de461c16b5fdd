"""One corner in closed form against the superposed motion, and the misprints of paper 000, eq. 11 to 15."""

from __future__ import annotations

import numpy as np
import pytest
from guides import corner, guide_through, machine_of, overlapping
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from planner.baselines.fir.rules import corner_error, overlap_beside, overlap_within, overlap_within_limits
from planner.baselines.fir.slow_down import make
from planner.corners.fir import overlap_time
from planner.planning.methods.fir import motion_of

V, T1, T2 = 100.0, 0.05, 0.03
Td = T1 + T2
MACHINE = machine_of(velocity=1e4)

thetas = st.floats(1.0, 174.0).map(np.deg2rad)


def corner_motion(theta, overlap, T1=T1, T2=T2, feed=V, length=50.0):
    guide = guide_through(corner(theta, length, 3), MACHINE, feed)
    return guide, motion_of(guide, make(overlapping(guide, overlap, T1, T2), MACHINE).motion)


def around_corner(guide, motion, overlap, feed=V, T1=T1, T2=T2, count=2001):
    """Times and trajectory while both pulses are active."""
    start = guide.length[0] / np.broadcast_to(feed, 2)[0] + T1 + T2 - overlap
    return motion.at(np.linspace(start, start + overlap, count), 1.0)


@given(theta=thetas, T1=st.floats(0.01, 0.1), ratio=st.floats(0.05, 1.0), share=st.floats(0.05, 1.0))
@settings(max_examples=40)
def test_equation_14_is_how_far_the_motion_misses_the_vertex(theta, T1, ratio, share):
    """docs/papers.md A3; the nearest point is the middle, and the deviation from the legs eps cos(theta/2)."""
    T2 = T1 * ratio
    Tk = share * (T1 + T2)
    guide, motion = corner_motion(theta, Tk, T1, T2)
    near = around_corner(guide, motion, Tk, T1=T1, T2=T2)
    eps = corner_error(np.array(Tk), V, np.sin(theta / 2), np.array(T1), np.array(T2))
    apart = np.linalg.norm(near.position - guide.point[1], axis=1)
    assert apart.min() == pytest.approx(eps, rel=1e-6)
    assert apart[1000] == pytest.approx(eps, rel=1e-6)
    across = np.abs(near.position[:, 1])  # from the first leg; from the second by symmetry
    u2 = guide.direction[1]
    other = np.abs((near.position - guide.point[1]) @ np.array([u2[1], -u2[0], 0.0]))
    assert np.minimum(across, other).max() == pytest.approx(eps * np.cos(theta / 2), rel=1e-3, abs=1e-9)


@given(theta=thetas, eps=st.floats(1e-4, 1.0))
@settings(max_examples=40)
def test_equation_15_uses_the_whole_tolerance(theta, eps):
    Tk = float(overlap_time(np.array(eps), V, np.sin(theta / 2), T1, T2))
    guide, motion = corner_motion(theta, Tk)
    near = around_corner(guide, motion, Tk)
    most = V * np.sin(theta / 2) * (3 * T1**2 + T2**2) / (12 * T1)
    assert np.linalg.norm(near.position - guide.point[1], axis=1).min() == pytest.approx(
        min(eps, most), rel=1e-5
    )


def test_misprint_the_branch_is_chosen_on_the_error():
    """Equation 15's conditions are on Tk, which it is to give: with the wrong branch the error is not the tolerance."""
    s, eps, T2 = np.sin(np.pi / 4), 0.7, 0.01  # beyond eps_1 = V s T2^2/(3 T1) = 0.047
    first = (24 * T1 * T2 * eps / (V * s)) ** (1 / 3)
    wrong = corner_error(np.array(first), V, s, np.array(T1), np.array(T2))
    assert wrong != pytest.approx(eps, rel=1e-2)
    right = overlap_time(np.array(eps), V, s, T1, T2)
    assert corner_error(right, V, s, np.array(T1), np.array(T2)) == pytest.approx(eps)


def test_misprint_the_interior_angle():
    """150 degrees of turn, read as the angle between the segments (30): a true error of 0.373 for 0.1 (docs/papers.md A.14)."""
    misread = float(overlap_time(np.array(0.1), V, np.sin(np.deg2rad(15)), T1, T2))
    guide, motion = corner_motion(np.deg2rad(150), misread)
    apart = np.linalg.norm(around_corner(guide, motion, misread).position - guide.point[1], axis=1).min()
    assert apart == pytest.approx(0.373, abs=1e-3)


def test_misprint_no_overlap_is_a_full_stop():
    """The text has "Tk = 0: the overlap is the delay"; it is the standstill that is. Tk = 0 stops, Tk = Td does not wait."""
    for Tk, waits in ((0.0, Td), (0.02, Td - 0.02), (Td, 0.0)):
        guide, motion = corner_motion(np.pi / 2, Tk)
        assert motion.end == pytest.approx(guide.length.sum() / V + waits + Td)
        slowest = motion.at(np.linspace(0.3, 0.9, 20_001), 1.0).feed.min()
        expected = {
            0.0: 0.0,
            0.02: V * 0.02**2 * np.cos(np.pi / 4) / (4 * T1 * T2),
            Td: V * (Td - T2) / T1 * np.cos(np.pi / 4),
        }
        assert slowest == pytest.approx(expected[Tk], rel=1e-4, abs=1e-3)  # the speed dip of docs/papers.md


def equation_13(t, Tv, Tk, Vs, Ve, printed):
    """The seven rows of x velocity through the corner; `printed` with rows 4, 5 and 7 as in the paper."""
    t2 = Tv + Td - Tk
    rise = (t - (Tv + Td)) if printed else (t - t2)
    fall = (Td - t) if printed else (t2 + Td - t)
    rows = [
        (t < Tv, np.full_like(t, Vs)),
        (t < Tv + T2, Vs * (1 - (t - Tv) ** 2 / (2 * T1 * T2))),
        (t < Tv + T1, Vs * (1 - (2 * (t - Tv) - T2) / (2 * T1))),
        (t < t2, Vs * (Td - (t - Tv)) ** 2 / (2 * T1 * T2)),
        (t < Tv + Td, Vs * (Td - (t - Tv)) ** 2 / (2 * T1 * T2) + Ve * rise**2 / (2 * T1 * T2)),
        (t < t2 + T2, Ve * rise**2 / (2 * T1 * T2)),
        (t < t2 + T1, Ve * (2 * (t - t2) - T2) / (2 * T1)),
        (t < t2 + Td, Ve * (1 - fall**2 / (2 * T1 * T2))),
    ]
    return np.select([row[0] for row in rows], [row[1] for row in rows], Ve)


@pytest.mark.parametrize("Tk", [0.01, 0.02, 0.03, 0.045, 0.06])
def test_misprint_equation_13(Tk):
    """Three rows lack Tk, and all of it needs Tk <= T2 (docs/papers.md A4: 666 mm/s; 2.2 and 9.9 mm/s at 45 and 60 ms)."""
    theta, Tv = np.deg2rad(60), 50.0 / V
    _, motion = corner_motion(theta, Tk)
    t = np.linspace(Tv, Tv + 2 * Td - Tk - 1e-9, 5001)
    true = motion.at(t, 1.0).velocity[:, 0]
    corrected = np.abs(equation_13(t, Tv, Tk, V, V * np.cos(theta), printed=False) - true).max()
    assert np.abs(equation_13(t, Tv, Tk, V, V * np.cos(theta), printed=True) - true).max() > 100
    assert corrected < 1e-9 if Tk <= T2 else corrected > 1.0


@given(
    theta=st.floats(5.0, 170.0).map(np.deg2rad),
    V1=st.floats(5.0, 300.0),
    V2=st.floats(5.0, 300.0),
    eps=st.floats(1e-3, 0.3),
)
@settings(max_examples=30)
def test_different_speeds_share_the_geometric_mean(theta, V1, V2, eps):
    """docs/papers.md, different programmed speeds: the vertex is missed by at most the tolerance, in the cubic zone too."""
    Tk = float(overlap_time(np.array(eps), np.sqrt(V1 * V2), np.sin(theta / 2), T1, T2))
    feed = np.array([V1, V2])
    guide, motion = corner_motion(theta, Tk, feed=feed, length=100.0)
    near = around_corner(guide, motion, Tk, feed=feed)
    missed = np.linalg.norm(near.position - guide.point[1], axis=1).min()
    if Tk <= T2:
        assert missed <= eps * (1 + 1e-3)  # the nearest of 2001 samples
        # the exact closed form D sin(theta) of the deviation from the legs
        u2 = guide.direction[1]
        off = np.minimum(
            np.abs(near.position[:, 1]),
            np.abs((near.position - guide.point[1]) @ np.array([u2[1], -u2[0], 0.0])),
        )
        D = Tk**3 / (6 * T1 * T2) * V1 * V2 / (np.cbrt(V1) + np.cbrt(V2)) ** 3
        assume(Tk / (1 + min(np.cbrt(V2 / V1), np.cbrt(V1 / V2))) <= T2)
        assert off.max() == pytest.approx(D * np.sin(theta), rel=2e-3)


def test_the_smaller_speed_would_be_unsafe():
    """100 and 10 mm/s at 90 degrees: 0.0031 promised with min(V1, V2), 0.0075 true (docs/papers.md A5)."""
    Tk = 0.025
    feed = np.array([100.0, 10.0])
    guide, motion = corner_motion(np.pi / 2, Tk, feed=feed)
    missed = np.linalg.norm(
        around_corner(guide, motion, Tk, feed=feed).position - guide.point[1], axis=1
    ).min()
    s = np.sin(np.pi / 4)
    by = {
        V: float(corner_error(np.array(Tk), V, s, np.array(T1), np.array(T2)))
        for V in (10.0, np.sqrt(1000.0))
    }
    assert by[10.0] < 0.5 * missed
    assert missed <= by[np.sqrt(1000.0)]


@given(
    theta=thetas,
    turn=st.floats(0, 6.3),
    T1=st.floats(0.01, 0.1),
    ratio=st.floats(0.05, 1.0),
    share=st.floats(0.0, 1.0),
)
@settings(max_examples=40)
def test_overlaps_within_limits_keep_them(theta, turn, T1, ratio, share):
    """The longest overlap at which two pulses at their limits stay within them, measured on the motion."""
    T2 = T1 * ratio
    a, j = V / T1, V / (T1 * T2)
    c, s = np.cos(turn), np.sin(turn)
    points = corner(theta, 50.0, 3) @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])
    machine = machine_of(velocity=1e4, acceleration=a, jerk=j)
    guide = guide_through(points, machine)
    w = guide.direction * V
    ones = np.ones(1)
    Tk = overlap_within_limits(
        ones * share * (T1 + T2), w[:1], w[1:], ones * T1, ones * T2, np.full(3, a), np.full(3, j)
    )[0]
    assert 0 <= Tk <= share * (T1 + T2)
    made = make(overlapping(guide, Tk, T1, T2), machine)
    assert made.seen.acceleration.max() <= 1 + 1e-6
    assert made.seen.jerk.max() <= 1 + 1e-6


def test_neighbours_stay_apart():
    """Tk_i + Tk_{i+1} <= Tv + Td, shared equally unless one needs less."""
    first, second = np.array([0.08, 0.08, 0.01, 0.03]), np.array([0.08, 0.02, 0.08, 0.03])
    duration, delay = np.full(4, 0.01), np.full(4, 0.08)
    one, two = overlap_beside(first, second, duration, delay), overlap_beside(second, first, duration, delay)
    np.testing.assert_allclose(one, [0.045, 0.07, 0.01, 0.03])
    np.testing.assert_allclose(two, [0.045, 0.02, 0.08, 0.03])
    assert (one + two <= duration + delay + 1e-12).all()


@given(theta=thetas, eps=st.floats(1e-3, 0.5), dt=st.floats(1e-4, 4e-3))
@settings(max_examples=60)
def test_the_chord_error_is_part_of_the_tolerance(theta, eps, dt):
    """Corner error and the bow of the chord over one period at the middle, where both are largest, fit into the tolerance."""
    s = np.sin(theta / 2)
    Tk = float(overlap_within(np.array(eps), V, s, np.array(T1), np.array(T2), dt))
    missed = float(corner_error(np.array(Tk), V, s, np.array(T1), np.array(T2)))
    bow = 2 * V * s * min(Tk / 2 / T2, 1.0) / T1 * dt**2 / 8
    assume(bow < eps / 2)  # beyond, the audit decides
    assert missed + bow <= eps * (1 + 1e-9)
    assert missed >= eps / 2 - 1e-12 or Tk == T1 + T2
