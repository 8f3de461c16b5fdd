"""The look-ahead: reach against the motion it stands for, legs against ruckig, feasible on thousands of legs, best of all choices."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from oracles import entry_length, needs_ruckig

from planner.base.arrays import FloatArray
from planner.baselines.lookahead.look_ahead import capped, look_ahead, moves, needed, swept
from planner.baselines.lookahead.ramps import LEG, WAY, JointKind, gain_max, records
from planner.corners import kinematic

seeds = st.integers(0, 2**32 - 1)


def ruckig_time(distance, V1, A1, V2, A2, v, a, j) -> float:
    """Shortest time [s] over a distance from (V1, A1) to (V2, -A2), in units in which the leg and the jerk are 1.

    The leg is a millionth longer and the limits a billionth higher: legs that a sweep left just long enough would otherwise be too
    short by rounding, and ruckig would go back and forth.
    """
    import ruckig

    distance, v, a = distance * (1 + 1e-6), v * (1 + 1e-9), a * (1 + 1e-9)
    unit = (distance / j) ** (1 / 3)
    move, found = ruckig.InputParameter(1), ruckig.Trajectory(1)
    move.current_velocity, move.target_velocity = [V1 * unit / distance], [V2 * unit / distance]
    move.current_acceleration, move.target_acceleration = (
        [A1 * unit**2 / distance],
        [-A2 * unit**2 / distance],
    )
    move.target_position = [1.0]
    move.max_velocity, move.max_acceleration, move.max_jerk = (
        [v * unit / distance],
        [a * unit**2 / distance],
        [1.0],
    )
    assert ruckig.Ruckig(1).calculate(move, found) == ruckig.Result.Working
    return found.duration * unit


def random_case(seed: int, joints: int):
    """Legs of one to a thousand and corners of both families at all inner joints, none longer than half a leg."""
    rng = np.random.default_rng(seed)
    n = joints - 1
    legs = records(
        LEG,
        length=10 ** rng.uniform(-2, 1.3, n),
        v=10 ** rng.uniform(1, 2.5, n),
        a=10 ** rng.uniform(2.5, 4, n),
        j=10 ** rng.uniform(4, 6, n),
    )
    inner = slice(1, n)
    feed = np.zeros(joints)
    feed[inner] = np.minimum(legs.v[:-1], legs.v[1:])
    kind = np.zeros(joints, int)
    alpha, eta = 10 ** rng.uniform(2.5, 5, joints), 10 ** rng.uniform(4, 7, joints)
    a, J = np.ones(joints), 10 ** rng.uniform(4, 7, joints)
    a[inner] = np.minimum(legs.a[:-1], legs.a[1:]) * rng.uniform(0.2, 1.0, n - 1)
    room = np.zeros(joints)
    room[inner] = 0.5 * np.minimum(legs.length[:-1], legs.length[1:])
    wish = feed * rng.uniform(0.05, 1.0, joints)
    candidates = []
    for which, p, q in ((JointKind.ZERO, alpha, eta), (JointKind.ENTRY, a, J)):
        kind = np.zeros(joints, int)
        kind[inner] = which
        candidates.append(capped(records(WAY, kind=kind, V=wish, p=p, q=q), legs, room))
    return legs, candidates


def corner_of(passage: np.recarray, i: int) -> tuple[float, float, float]:
    """A, l and T of a corner by corners/kinematic.py."""
    kind, V, p, q = (getattr(passage, name)[i] for name in ("kind", "V", "p", "q"))
    if kind == JointKind.ZERO and V > 0:
        return 0.0, float(kinematic.approach(V, p, q)), float(np.sum(kinematic.phase_times(V, p, q)))
    if kind == JointKind.ENTRY and V > 0:
        A = float(kinematic.entry_acceleration(V, p, q))
        return A, float(entry_length(V, p, q)), 2 * V / A
    return 0.0, 0.0, 0.0


def shortest_need(legs: np.recarray, passage: np.recarray, i: int) -> float:
    """The shortest length that leg i can have between its corners, by adding up the phases of both ramps."""

    def ramp(V, A, W, a, j):
        peak = min(a, np.sqrt(j * (W - V) + A**2 / 2))
        t1, t3 = (peak - A) / j, peak / j
        t2 = (W - V - (peak**2 - A**2) / (2 * j) - peak**2 / (2 * j)) / peak if peak > 0 else 0.0
        x, v = V * t1 + A * t1**2 / 2 + j * t1**3 / 6, V + A * t1 + j * t1**2 / 2
        x, v = x + v * t2 + peak * t2**2 / 2, v + peak * t2
        return x + v * t3 + peak * t3**2 / 2 - j * t3**3 / 6

    (A1, l1, _), (A2, l2, _) = corner_of(passage, i), corner_of(passage, i + 1)
    V1, V2, a, j = passage.V[i], passage.V[i + 1], legs.a[i], legs.j[i]
    W = max(V1 + A1**2 / (2 * j), V2 + A2**2 / (2 * j))
    return l1 + l2 + ramp(V1, A1, W, a, j) + ramp(V2, A2, W, a, j)


@given(V=st.floats(-3, 3), gain=st.floats(-8, 3), a=st.floats(2, 4), j=st.floats(3, 6))
def test_reach_is_the_inverse_of_the_ramp(V, gain, a, j):
    """docs/papers.md F8: over the length of the fastest ramp by `gain` exactly this gain is reached, from a micro-speed to m/s."""
    V, gain, a, j = 10.0**V, 10.0**gain, 10.0**a, 10.0**j
    time = 2 * np.sqrt(gain / j) if gain <= a**2 / j else gain / a + a / j
    assert gain_max(V, (V + gain / 2) * time, a, j) == pytest.approx(gain, rel=1e-12)


@given(share=st.floats(0.0, 0.499), gain=st.floats(-3, 3), a=st.floats(2, 4), j=st.floats(3, 6))
def test_reach_from_where_a_ramp_would_have_begun_backwards(share, gain, a, j):
    """V' = V - A^2/(2j) may be negative: three real roots, of which the largest is meant."""
    gain, a, j = 10.0**gain, 10.0**a, 10.0**j
    V = -share * gain
    time = 2 * np.sqrt(gain / j) if gain <= a**2 / j else gain / a + a / j
    assert gain_max(V, (V + gain / 2) * time, a, j) == pytest.approx(gain, rel=1e-9)


@pytest.mark.shows("kinematic", "compared: ruckig, the time of every leg")
@needs_ruckig
@given(seeds)
@settings(max_examples=30)
def test_a_leg_takes_the_time_that_ruckig_finds(seed):
    """Both families, both ends; ruckig knows nothing of corners, only of the leg's ends."""
    legs, candidates = random_case(seed, 8)
    passage, time = look_ahead(legs, candidates)
    for i in range(len(legs)):
        (A1, l1, _), (A2, l2, T2) = corner_of(passage, i), corner_of(passage, i + 1)
        free = legs.length[i] - l1 - l2
        if free < 1e-6 * legs.length[i]:
            continue
        expected = ruckig_time(free, passage.V[i], A1, passage.V[i + 1], A2, legs.v[i], legs.a[i], legs.j[i])
        assert time[i + 1] - time[i] - T2 == pytest.approx(expected, rel=1e-4)


@pytest.mark.slow
@pytest.mark.parametrize("family", [0, 1])
def test_no_leg_is_too_short_on_thousands(family):
    legs, candidates = random_case(5, 6000)
    way = candidates[family]
    slower = swept(legs, way)
    assert (slower.V <= way.V).all()
    lowered = (slower.V < way.V * (1 - 1e-9)).mean()
    assert 0.1 < lowered < 0.9
    missing = np.array([shortest_need(legs, slower, i) for i in range(len(legs))]) - legs.length
    assert (missing <= 1e-9 * legs.length).all()
    # without the sweeps very many legs are
    before = np.array([shortest_need(legs, way, i) for i in range(len(legs))]) - legs.length
    assert (before > 1e-3 * legs.length).sum() > 500


@given(seed=seeds)
@settings(max_examples=15)
def test_speeds_are_within_reach_in_both_directions(seed):
    """docs/papers.md F8: V_target <= V + reach, towards either end, where both ends run through."""
    legs, candidates = random_case(seed, 200)
    way = candidates[0]
    slower = swept(legs, way)
    V = slower.V
    length = [corner_of(slower, i)[1] for i in range(len(V))]
    for i in range(len(legs)):
        low, high = sorted(V[i : i + 2])
        free = legs.length[i] - length[i] - length[i + 1]
        assert high <= (low + gain_max(low, max(free, 0.0), legs.a[i], legs.j[i])) * (1 + 1e-9) + 1e-12


def total_time(legs: np.recarray, passage: np.recarray) -> float:
    """Time of a passage by ruckig, infinite where a leg is too short."""
    total = 0.0
    for i in range(len(legs)):
        (A1, l1, _), (A2, l2, T2) = corner_of(passage, i), corner_of(passage, i + 1)
        if shortest_need(legs, passage, i) > legs.length[i] * (1 + 1e-10):
            return np.inf
        free = legs.length[i] - l1 - l2
        ends = (passage.V[i], A1, passage.V[i + 1], A2)
        total += T2 + (ruckig_time(free, *ends, legs.v[i], legs.a[i], legs.j[i]) if free > 1e-9 else 0.0)
    return total


@pytest.mark.slow
@needs_ruckig
@given(seeds)
@settings(max_examples=12)
def test_no_other_choice_of_corners_and_stops_is_faster(seed):
    """Brute force over all 3^4 choices with the swept speeds."""
    legs, candidates = random_case(seed, 6)
    slower = [swept(legs, way) for way in candidates]
    stop = records(WAY, kind=np.zeros(6, int), V=np.zeros(6), p=np.ones(6), q=np.ones(6))
    ways, at = [stop, *slower], np.arange(6)
    times = []
    for choice in itertools.product(range(3), repeat=4):
        row = np.array([0, *choice, 0])
        pick = {name: np.stack([getattr(w, name) for w in ways])[row, at] for name in ("kind", "V", "p", "q")}
        times.append(total_time(legs, records(WAY, **pick)))
    _, time = look_ahead(legs, candidates)
    assert time[-1] <= min(times) * (1 + 1e-4)
    assert time[-1] >= min(times) * (1 - 1e-4)


def two_legs(
    theta: float, V: float, eps: float, *, kinds=("zero", "entry")
) -> tuple[np.recarray, list[np.recarray]]:
    """docs/papers.md' example: two legs of 20 mm, A = 2000, J = 66,667 along the path, a corner of angle theta between them."""
    A, J, s = 2000.0, 66_667.0, np.sin(theta / 2)
    legs = records(LEG, length=np.full(2, 20.0), v=np.full(2, V), a=np.full(2, A), j=np.full(2, J))
    u1, u2 = np.array([[1.0, 0.0]]), np.array([[np.cos(theta), np.sin(theta)]])
    limits = np.full(2, A), np.full(2, J)
    alpha, eta = kinematic.ratio_min(limits[0], u2 - u1), kinematic.ratio_min(limits[1], u2 - u1)
    a, jerk = kinematic.entry_limits(u1, u2, *limits)
    a = np.minimum(a, A)
    m = np.array([eps / (2 * s)])
    ways = {
        "zero": (JointKind.ZERO, kinematic.speed_from_middle(m, alpha, eta), alpha, eta),
        "entry": (JointKind.ENTRY, kinematic.entry_speed_from_middle(m, a, jerk), a, jerk),
    }

    def candidate(kind: JointKind, speed: FloatArray, p: FloatArray, q: FloatArray) -> np.recarray:
        row = np.zeros((3, 3))
        row[:, 1] = np.minimum(speed[0], V), p[0], q[0]
        way = records(WAY, kind=np.array([0, kind, 0]), V=row[0], p=row[1], q=row[2])
        return capped(way, legs, np.array([0.0, 20.0, 0.0]))

    return legs, [candidate(*ways[name]) for name in kinds]


@needs_ruckig
def test_the_fastest_corner_is_not_the_fastest_motion():
    """docs/papers.md: 90 degrees, eps 0.1, V 100: stop 0.56000 s, kinematic corner (22.9 mm/s) 0.56144 s; so the stop is chosen."""
    legs, (zero,) = two_legs(np.pi / 2, 100.0, 0.1, kinds=("zero",))
    assert zero.V[1] == pytest.approx(22.9, abs=0.05)
    assert total_time(legs, zero) == pytest.approx(0.56144, abs=2e-5)
    chosen, time = look_ahead(legs, [zero])
    assert chosen.kind[1] == JointKind.STOP
    assert time[-1] == pytest.approx(0.56, abs=2e-5)


@needs_ruckig
@pytest.mark.parametrize(
    ("theta", "zero_ms", "entry_ms"), [(90, 81.4, 48.7), (30, 40.3, 43.8), (150, 96.4, 49.4)]
)
def test_time_lost_at_a_corner_is_that_of_the_papers_page(theta, zero_ms, entry_ms):
    """Against running through at 100 mm/s; starting and stopping costs 80 ms. The look-ahead takes the best of both and the stop."""
    base = 0.4 + 0.08
    for kind, lost in (("zero", zero_ms), ("entry", entry_ms)):
        legs, ways = two_legs(np.deg2rad(theta), 100.0, 0.1, kinds=(kind,))
        assert 1e3 * (total_time(legs, ways[0]) - base) == pytest.approx(lost, abs=0.06)
    legs, ways = two_legs(np.deg2rad(theta), 100.0, 0.1)
    _, time = look_ahead(legs, ways)
    assert 1e3 * (time[-1] - base) == pytest.approx(min(zero_ms, entry_ms, 80.0), abs=0.06)


def test_needed_counts_the_ramps():
    legs, candidates = random_case(9, 40)
    for way in candidates:
        length = needed(way, legs)
        for i in range(1, 39):
            A, reach_back, _ = corner_of(way, i)
            ramps = [A / j * way.V[i] + A**3 / (3 * j**2) for j in legs.j[i - 1 : i + 1]]
            assert length[i] == pytest.approx(reach_back + max(ramps), rel=1e-12)


@given(seeds)
@settings(max_examples=20)
def test_where_only_limits_change_the_motion_is_as_fast_as_the_limits_allow(seed):
    """Legs without corners: no stop, all legs run; with corners at constant speed some of which are stops, as by brute force."""
    legs, _ = random_case(seed, 7)
    inner = np.minimum(legs.v[:-1], legs.v[1:])
    straight = records(
        WAY, kind=np.array([0, 1, 1, 1, 1, 1, 0]), V=np.array([0, *inner, 0]), p=np.zeros(7), q=np.zeros(7)
    )
    chosen, time = look_ahead(legs, [straight])
    np.testing.assert_allclose(chosen.V, swept(legs, straight).V, rtol=1e-12)
    duration, _ = moves(chosen, legs)
    np.testing.assert_allclose(np.diff(time), duration.sum(axis=1), rtol=1e-12)
    rng = np.random.default_rng(seed)
    corner = np.array([False, False, True, False, True, False, False])
    least = np.append(np.minimum(legs.length[:-1], legs.length[1:]), 0.0)
    taken = 0.3 * np.where(corner, np.insert(least, 0, 0.0)[:7], 0.0)
    turning = records(
        WAY,
        kind=np.where(corner, JointKind.CONSTANT, straight.kind),
        V=np.where(corner, straight.V * rng.uniform(0.02, 1.0), straight.V),
        p=taken,
        q=taken,
        r=2 * taken,
    )
    _, time = look_ahead(legs, [turning])
    times = []
    for through in itertools.product((False, True), repeat=2):
        stopped = np.zeros(7, bool)
        stopped[corner] = through
        kind = np.where(stopped, JointKind.STOP, turning.kind)
        other = {name: np.where(stopped, 0.0, getattr(turning, name)) for name in ("p", "q", "r")}
        V = np.where(corner & ~stopped, swept(legs, turning).V, np.where(stopped, 0.0, turning.V))
        way = swept(legs, records(WAY, kind=kind, V=V, **other))
        lasting = moves(way, legs)[0].sum()
        times.append(lasting)
    assert time[-1] == pytest.approx(min(times), rel=1e-9)
