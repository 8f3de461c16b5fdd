"""Pieces of constant axis jerk: exact between the samples, arc length by another quadrature, and the samples of a delivery."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.integrate import quad
from whole_plans import dense_motion

from planner.motion.axis_motion import AxisMotion
from planner.motion.timing import sample_motion


def motion_of(duration, jerk, start=(0.0, 0.0)) -> AxisMotion:
    """From rest at `start`: jerk (L, 2) over the pieces of `duration` (L,)."""
    duration, jerk = np.asarray(duration, float), np.asarray(jerk, float)
    state = np.zeros((3, len(duration) + 1, 2))
    state[0, 0] = start
    for m, h in enumerate(duration):
        p, v, a = state[:, m]
        j = jerk[m]
        state[:, m + 1] = (
            p + h * v + h**2 * a / 2 + h**3 * j / 6,
            v + h * a + h**2 * j / 2,
            a + h * j,
        )
    end = np.cumsum(duration)
    return AxisMotion(
        axes=("x", "y"),
        t=np.concatenate([[0.0], end[:-1]]),
        position=state[0, :-1],
        velocity=state[1, :-1],
        acceleration=state[2, :-1],
        jerk=jerk,
        block=np.arange(len(duration)),
        line=10 * np.arange(len(duration)),
        end=float(end[-1]),
    )


jerks = st.tuples(st.floats(-1e5, 1e5), st.floats(-1e5, 1e5))
pieces = st.lists(st.tuples(st.floats(1e-4, 0.05), jerks), min_size=1, max_size=6)


@given(pieces=pieces)
@settings(max_examples=40)
def test_it_goes_where_the_jerk_takes_it(pieces):
    """Derivatives by the columns of a motion sampled finely: position, velocity and acceleration integrate what follows them."""
    motion = motion_of([h for h, _ in pieces], [j for _, j in pieces])
    step = motion.end / 2000
    got = motion.at(np.linspace(0.0, motion.end - step, 2001), 1.0)
    for lower, upper in (("position", "velocity"), ("velocity", "acceleration"), ("acceleration", "jerk")):
        value, slope = getattr(got, lower), getattr(got, upper)
        size = np.abs(slope).max() + 1e-12
        means = np.diff(value, axis=0) / np.diff(got.t)[:, None]
        allowed = np.abs(np.diff(slope, axis=0)).max() + 1e-9 * size
        assert (np.abs(means - (slope[1:] + slope[:-1]) / 2) <= allowed).all()
    np.testing.assert_allclose(got.feed, np.linalg.norm(got.velocity, axis=1))


@given(pieces=pieces)
@settings(max_examples=40)
@example(pieces=[(0.046875, (5.0, 0.0)), (0.03125, (2.2e-309, 0.0))])
@example(pieces=[(0.015625, (0.0, -28054.0)), (0.046, (0.0, 0.0)), (0.0425, (0.0, 46706.0))])
def test_arc_length_is_the_integral_of_the_speed(pieces):
    motion = motion_of([h for h, _ in pieces], [j for _, j in pieces])
    state = [np.stack([motion.velocity[m], motion.acceleration[m], motion.jerk[m] / 2], axis=1).tolist()
             for m in range(len(motion))]  # fmt: skip

    def speed(t, m):  # called some 1e5 times: no arrays
        tau = t - motion.t[m]
        return math.hypot(*(v + tau * (a + tau * j) for v, a, j in state[m]))

    edges = np.append(motion.t, motion.end)
    parts = []
    for m in range(len(motion)):
        kinks = (np.roots(np.where(np.abs(of) < 1e-9, 0.0, of)[::-1]) for of in np.array(state[m]))
        turns = [motion.t[m] + tau.real for of in kinks for tau in of]
        inside = [t for t in turns if edges[m] < t < edges[m + 1]]
        points = {"points": inside} if inside else {}
        parts.append(quad(speed, edges[m], edges[m + 1], args=(m,), limit=200, epsabs=1e-12, **points)[0])
    np.testing.assert_allclose(np.diff(motion.s), parts, rtol=1e-6, atol=1e-12)


@given(back=st.floats(0.025, 0.2), aside=st.floats(0.0, 1e-6))
@settings(max_examples=40)
def test_arc_length_through_a_reversal(back, aside):
    """There and back along a line, or nearly so, where the speed has a kink."""
    motion = motion_of([0.01, back, 0.01], [[1e5, aside], [-1e5, 0], [1e5, -aside]])
    v, a, j = motion.velocity[1, 0], motion.acceleration[1, 0], motion.jerk[1, 0]
    turn = (-a - np.sqrt(a**2 - 2 * j * v)) / j
    x = motion.at(motion.t[1] + np.array([-0.01, 0.0, turn, back]), 1.0).position[:, 0]
    walked = np.abs(np.diff(x)).sum()
    assert motion.s[2] == pytest.approx(walked, rel=1e-10)


def test_samples_and_the_motion_between_them():
    motion = motion_of([0.01, 0.02, 0.0101], [[1e5, 3e4], [-1e5, -3e4], [1e5, 3e4]], start=(5.0, -2.0))
    got = sample_motion(motion, 1e-3)
    assert got.t[0] == 0.0
    assert got.t[-1] == motion.end
    np.testing.assert_allclose(np.diff(got.t)[:-1], 1e-3)
    assert (np.diff(got.s) >= 0).all()
    np.testing.assert_array_equal(got.velocity[-1], 0.0)
    np.testing.assert_array_equal(got.line, 10 * got.block)
    np.testing.assert_array_equal(got.block, np.searchsorted(motion.t, got.t, side="right") - 1)
    (fine,) = dense_motion(motion, 1e-3)
    together = np.union1d(fine.t, got.t)
    again = motion.at(together, 1e-3)
    np.testing.assert_array_equal(again.position[np.isin(together, got.t)], got.position)
    np.testing.assert_array_equal(again.s[np.isin(together, fine.t)], fine.s)
    assert fine.t[-1] == motion.end
    assert len(fine) > len(got)


def test_a_standstill_and_pieces_without_duration():
    motion = motion_of(
        [0.0, 0.5, 0.01, 0.0, 0.02, 0.01, 0.2],
        [[0, 0], [0, 0], [1e5, 0], [9, 9], [-1e5, 0], [1e5, 0], [0, 0]],
    )
    got = sample_motion(motion, 0.01)
    assert not got.feed[got.t < 0.499].any()
    assert np.ptp(got.s[got.t > 0.5401]) <= 1e-12
    assert got.position[-1, 0] == pytest.approx(motion.s[-1], rel=1e-9)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"t": [0.1, 0.2]}, "begin at 0"),
        ({"t": [0.0, -0.1]}, "follow one another"),
        ({"end": 0.01}, "follow one another"),
        ({"end": float("inf")}, "follow one another"),
        ({"jerk": [[0.0, 0.0]]}, "jerk: shape"),
        ({"velocity": [[0.0, 0.0], [float("nan"), 0.0]]}, "velocity"),
    ],
)
def test_what_is_no_motion_is_refused(changes, message):
    motion = motion_of([0.02, 0.02], [[1e5, 0], [-1e5, 0]])
    with pytest.raises(ValueError, match=message):
        dataclasses.replace(motion, **changes)
