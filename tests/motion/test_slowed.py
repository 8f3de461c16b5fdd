"""A motion at another pace: its derivatives, its limits, its rests, and its time."""

from __future__ import annotations

import numpy as np
import pytest

from planner.motion.axis_motion import AxisMotion
from planner.motion.slowed import FAR, Place, Slowed, reach, without_stands

V, A, J = (
    120.0,
    2000.0,
    3e4,
)  # of the motion of these tests; a/j is 67 ms, and it is at one of them at all times


def bang_bang() -> AxisMotion:
    """Two strokes of one axis and back on two, each at a limit all the time: jerk, acceleration or velocity, with a rest between."""
    pieces = []
    for jerks in ([1, 0, -1, 0, -1, 0, 1], [-1, 0, 1, 0, 1, 0, -1]):
        lasting = [A / J, 0.01, A / J, 0.05, A / J, 0.01, A / J]
        pieces += [(h, J * sign) for h, sign in zip(lasting, jerks, strict=True)] + [(0.02, 0.0)]
    h, j = np.array(pieces).T
    state = np.zeros((len(h) + 1, 3))
    for k in range(len(h)):
        x, v, a = state[k]
        state[k + 1] = (
            x + h[k] * (v + h[k] * (a / 2 + h[k] * j[k] / 6)),
            v + h[k] * (a + h[k] * j[k] / 2),
            a + h[k] * j[k],
        )
    t = np.append(0.0, np.cumsum(h))
    columns = [np.stack([c, 0.5 * c], axis=1) for c in (*state[:-1].T, j)]
    names = ("position", "velocity", "acceleration", "jerk")
    none = np.zeros(len(h), int)
    return AxisMotion(
        axes=("x", "y"),
        t=t[:-1],
        block=none,
        line=none,
        end=float(t[-1]),
        **dict(zip(names, columns, strict=True)),
    )


MOTION = bang_bang()
FASTEST = float(np.abs(MOTION.at(np.linspace(0, MOTION.end, 4001), 1e-3).velocity).max())
W = reach(FASTEST, A, J)
PLACES = (
    Place(0.05, 0.06, 0.01, W),
    Place(0.12, 0.13, 0.2, W),
    Place(0.33, 0.5, 0.0031, W, MOTION.t[7], MOTION.t[8]),
)


def inside(motion: Slowed) -> np.ndarray:
    """Times inside all its pieces [s]."""
    edges = np.append(motion.t, motion.end)
    h = np.diff(edges)
    return np.sort(
        np.concatenate([edges[:-1][h > 1e-6] + share * h[h > 1e-6] for share in (0.02, 0.3, 0.5, 0.7, 0.98)])
    )


def test_columns_are_the_derivatives_of_the_positions():
    motion, step = Slowed(motion=MOTION, places=PLACES), 2e-6
    t = inside(motion)
    seen, before, after = (motion.at(t + k * step, 1e-3) for k in (0, -1, 1))
    for low, high in (("position", "velocity"), ("velocity", "acceleration"), ("acceleration", "jerk")):
        rate = (getattr(after, low) - getattr(before, low)) / (2.0 * step)
        scale = {"velocity": FASTEST, "acceleration": A, "jerk": J}[high]
        np.testing.assert_allclose(rate, getattr(seen, high), atol=2e-4 * scale)
    np.testing.assert_allclose(seen.feed, np.linalg.norm(seen.velocity, axis=1), rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("by", [1e-4, 0.01, 0.3, 1.0])
def test_a_place_with_reach_keeps_all_limits_wherever_it_is(by):
    """The law of the module's text, on a motion that is at a limit at all times."""
    limits = (FASTEST, A, J)
    for begin in np.linspace(0.0, MOTION.end - 0.01, 23):
        motion = Slowed(
            motion=MOTION, places=(Place(begin, begin + 0.004, by, W), Place(0.2, 0.21, by / 2, W))
        )
        seen = motion.at(np.linspace(0.0, motion.end, 3001), 1e-3)
        for name, limit in zip(("velocity", "acceleration", "jerk"), limits, strict=True):
            assert np.abs(getattr(seen, name)).max() <= limit * (1.0 + 1e-9)


def test_a_shorter_reach_does_not_keep_them():
    motion = Slowed(motion=MOTION, places=(Place(0.2, 0.204, 0.1, 0.2 * W),))
    assert np.abs(motion.at(np.linspace(0.0, motion.end, 3001), 1e-3).jerk).max() > 1.01 * J


def test_between_two_rests_the_whole_way_is_slower_and_nothing_else():
    begin, end, f = MOTION.t[8], MOTION.t[15], 1.02
    motion = Slowed(motion=MOTION, places=(Place(begin, end, f - 1.0, W, begin, end),))
    assert motion.end - MOTION.end == pytest.approx((f - 1.0) * (end - begin), rel=1e-12)
    tau = np.linspace(0.0, motion.end, 501)
    was = np.where(
        tau < begin,
        tau,
        np.where(tau < begin + f * (end - begin), begin + (tau - begin) / f, tau - motion.end + MOTION.end),
    )
    np.testing.assert_allclose(motion.was_at(tau), was, atol=1e-14)
    np.testing.assert_allclose(
        motion.at(tau, 1e-3).position, MOTION.at(np.clip(was, 0, MOTION.end), 1e-3).position, atol=1e-11
    )
    np.testing.assert_allclose(motion.run_at(was), tau, atol=1e-14)


def test_what_a_place_costs():
    by, length = 0.01, 0.02
    motion = Slowed(motion=MOTION, places=(Place(0.15, 0.15 + length, by, 1e-3),))
    assert motion.end - MOTION.end == pytest.approx(by * (length + 4e-3), rel=1e-9)
    far = motion.was_at(np.array([0.15 - FAR * 1e-3]))
    assert far[0] == pytest.approx(0.15 - FAR * 1e-3, abs=1e-15)


def test_it_stands_longer_where_it_rests():
    motion = Slowed(motion=MOTION, places=PLACES)
    rest = motion.run_at(MOTION.t[[7]])[0]
    longer = motion.waiting(np.array([rest]), np.array([0.0123]))
    assert longer.end == pytest.approx(motion.end + 0.0123, abs=1e-14)
    seen = longer.at(np.linspace(rest, rest + 0.0123, 12), 1e-3)
    assert np.ptp(seen.position, axis=0).max() == 0.0
    assert np.abs(seen.velocity[1:-1]).max() == 0.0
    later = np.linspace(rest + 1e-6, motion.end, 50)
    for name in ("position", "velocity", "jerk"):
        np.testing.assert_allclose(
            getattr(longer.at(later + 0.0123, 1e-3), name), getattr(motion.at(later, 1e-3), name), atol=1e-6
        )
    again = longer.waiting(np.array([longer.end]), np.array([0.5]))
    assert again.end == pytest.approx(motion.end + 0.5123, abs=1e-14)


def test_times_without_stands():
    stands = np.array([[1.0, 0.5], [3.0, 0.25]])
    moving, stood = without_stands(stands, np.array([0.9, 1.2, 1.6, 3.4, 3.6, 4.0]))
    np.testing.assert_allclose(moving, [0.9, 1.0, 1.1, 2.9, 3.0, 3.25])
    np.testing.assert_array_equal(stood, [False, True, False, False, True, False])
