"""Where a motion changes from block to block is known to rounding where it runs on cubics, and half a micrometre too soon is found."""

from dataclasses import dataclass

import numpy as np
import pytest
from motions import Moves, machine, sample
from test_between import cubics

from planner.motion.trajectory import Trajectory
from planner.verifier import verify
from planner.verifier.nearest import nearest, reach_of

A = 2000.0
TOO_SOON = 5e-4  # [mm]
WIDE = 8.0  # tolerance [mm]
M = machine(dt=0.0005, tolerance=WIDE, acceleration=A)


@dataclass(frozen=True)
class Straight:
    """A motion along x and y, from rest to rest, through the places `ends` [mm] of a line at `feeds` [mm/s], at constant
    accelerations, in the faster feed of two; `wave` [mm] is added along z, no cubic in time."""

    feeds: tuple[float, ...]
    ends: tuple[float, ...]
    way: tuple[float, float] = (1.0, 0.0)
    start: tuple[float, float] = (0.0, 0.0)
    wave: float = 0.0

    @property
    def phases(self):
        """Durations and accelerations."""
        bounds, out, x = [0.0, *self.feeds, 0.0], [], 0.0
        for k, (feed, end) in enumerate(zip(self.feeds, self.ends, strict=True)):
            low, high = min(bounds[k], feed), min(bounds[k + 2], feed)
            up, down = (feed**2 - low**2) / A, (feed**2 - high**2) / A
            assert up + down <= end - x
            out += [((feed - low) / (A / 2), A / 2), ((end - x - up - down) / feed, 0.0)]
            out += [((feed - high) / (A / 2), -A / 2)]
            x = end
        return [phase for phase in out if phase[0] > 0.0]

    @property
    def t(self):
        return np.append(0.0, np.cumsum([lasting for lasting, _ in self.phases]))[:-1]

    @property
    def end(self):
        return float(sum(lasting for lasting, _ in self.phases))

    def along(self, t):
        """(3, n) way, speed and acceleration along the line."""
        x, v, states = 0.0, 0.0, []
        for h, a in self.phases:
            states.append((x, v, a))
            x, v = x + h * (v + h * a / 2), v + h * a
        x, v, a = np.array(states)[np.searchsorted(self.t, t, side="right") - 1].T
        h = t - self.t[np.searchsorted(self.t, t, side="right") - 1]
        over = t >= self.end
        return x + h * (v + h * a / 2), np.where(over, 0.0, v + h * a), np.where(over, 0.0, a)

    def __call__(self, t):
        out, way = np.zeros((4, len(t), 3)), np.array(self.way) / np.hypot(*self.way)
        for order, value in enumerate(self.along(t)):
            out[order, :, :2] = value[:, None] * way
        out[0, :, :2] += self.start
        u = np.pi * t / self.end  # a wave with neither speed nor acceleration at the ends
        rate = np.pi / self.end
        s, c = np.sin(u), np.cos(u)
        out[0, :, 2] = self.wave * s**4
        out[1, :, 2] = self.wave * 4 * s**3 * c * rate
        out[2, :, 2] = self.wave * (12 * s**2 * c**2 - 4 * s**4) * rate**2
        out[3, :, 2] = self.wave * (24 * s * c**3 - 40 * s**3 * c) * rate**3
        return tuple(out)

    def at(self, times, dt):
        x, v, a, j = self(times)
        none, zero = np.full(len(times), -1), np.zeros(len(times))
        return Trajectory(
            axes=("x", "y", "z"), dt=dt, t=times, position=x, velocity=v, acceleration=a, jerk=j,
            s=zero, feed=zero, block=none, line=none,
        )  # fmt: skip


def judged(motion, toolpath, **more):
    return verify(
        sample((motion.end, motion), M.dt), toolpath, M, motion=motion, not_limited=("jerk",), **more
    )


CORNER = Moves((0.0, 10.0, 0.0)).line(0, 0, feed=2).line(10, 0, feed=40).toolpath(M)
FALLING = Moves((0.0, 10.0, 0.0)).line(0, 0, feed=40).line(10, 0, feed=2).toolpath(M)
HALF, WHOLE = 5.0 * np.sqrt(2.0), 10.0 * np.sqrt(2.0)


def across(feeds, half, wave=0.0):
    """Straight across a right angle, 7 mm beside its vertex."""
    return Straight(feeds, (half, WHOLE), (1.0, -1.0), (0.0, 10.0), wave)


@pytest.mark.parametrize(("toolpath", "feeds", "way"), [(CORNER, (2, 40), -1), (FALLING, (40, 2), 1)])
@pytest.mark.parametrize("seed", range(2))
def test_half_a_micrometre_too_soon_is_found_far_beside_a_vertex(toolpath, feeds, way, seed):
    # at 2 mm/s and 2,000 mm/s2 the chords of samples leave 3.7 um open there
    right = judged(across(feeds, HALF), toolpath, seed=seed)
    assert right.passed, right.faults
    assert right.limits["feed"].ratio == pytest.approx(1.0, abs=1e-6)
    wrong = judged(across(feeds, HALF + way * TOO_SOON), toolpath, seed=seed)
    assert {fault.name for fault in wrong.faults} == {"feed"}
    assert wrong.limits["feed"].ratio > 1.03
    other = judged(across(feeds, HALF - way * TOO_SOON), toolpath, seed=seed)
    assert other.passed, other.faults


@pytest.mark.parametrize("seed", range(2))
def test_on_a_motion_that_is_no_cubic_it_is_found_too(seed):
    # the wave is at its height, level, in the middle of the time: it is shifted by the slower half, so half of it is felt
    motion = across((2, 40), HALF, wave=0.01)
    t = np.linspace(0.0, motion.end, 2_000_001)
    p, v, _, _ = motion(t)
    at = np.argmin((p**2).sum(axis=1))
    off = motion.along(t[at : at + 1])[0][0] - HALF  # of the nearest place from the change of speed
    v_most = np.linalg.norm(v, axis=1)[: at - 1].max()
    slower = 2.0 * 2.0 / v_most
    right = judged(across((slower, 40), HALF + max(off, 0.0) + 2e-5, wave=0.01), CORNER, seed=seed)
    assert right.passed, right.faults
    wrong = judged(across((slower, 40), HALF + min(off, 0.0) - TOO_SOON, wave=0.01), CORNER, seed=seed)
    assert {fault.name for fault in wrong.faults} == {"feed"}


@pytest.mark.parametrize("seed", range(2))
def test_vertices_passed_together_are_passed_at_the_nearest_place_to_all(seed):
    # there, back by 0.1 mm and on, inside the tolerance: of x = 10 and 9.9, with the same weight, the middle counts
    toolpath = Moves().line(10, feed=2).line(9.9, feed=2).line(20, feed=40).toolpath(M)
    right = judged(Straight((2, 40), (9.95, 20.0)), toolpath, seed=seed)
    assert right.passed, right.faults
    wrong = judged(Straight((2, 40), (9.95 - TOO_SOON, 20.0)), toolpath, seed=seed)
    assert {fault.name for fault in wrong.faults} == {"feed"}


@pytest.mark.parametrize(("feeds", "way"), [((2, 40), -1), ((40, 2), 1)])
def test_vertices_passed_together_are_passed_within_reach_of_each(feeds, way):
    """Of x = 9.9 and 9.1 the middle is nearest to both, and the second one, 0.54 mm beside the motion, is out of reach there."""
    m = machine(dt=0.0005, tolerance=0.6, acceleration=A)
    moves = Moves().line(9.9, feed=feeds[0]).line(9.1, 0.54, feed=feeds[0]).line(20, 0, feed=feeds[1])
    edge = 9.1 + np.sqrt(0.6**2 - 0.54**2)
    for shift, keeps in ((0.0, True), (20 * way * TOO_SOON, False), (-20 * way * TOO_SOON, True)):
        motion = Straight(feeds, (edge + shift, 20.0))
        samples = sample((motion.end, motion), m.dt)
        seen = verify(samples, moves.toolpath(m), m, motion=motion, not_limited=("jerk",))
        assert {fault.name for fault in seen.faults} == (set() if keeps else {"feed"})


def in_order(places):
    """Non-decreasing numbers, of which the squares of the differences from `places` have the least sum."""
    runs = []
    for place in places:
        runs.append([place])
        while len(runs) > 1 and np.mean(runs[-2]) >= np.mean(runs[-1]):
            last = runs.pop()
            runs[-1] += last
    return np.concatenate([np.full(len(run), np.mean(run)) for run in runs])


@pytest.mark.parametrize("seed", range(24))
def test_a_run_of_vertices_out_of_order_is_settled_as_a_whole(seed):
    """Twenty vertices beside a straight motion, to and fro by nine tenths of the tolerance: F changes at one of them, at the place that
    least squares in order give it, however many others were passed by then and however many are still to come."""
    random = np.random.default_rng(seed)
    tolerance = 10 ** random.uniform(-1.0, 0.3)
    along = 4.0 + 0.5 * np.arange(20) + 0.9 * tolerance * random.uniform(-1.0, 1.0, 20)
    beside = 0.2 * tolerance * random.uniform(-1.0, 1.0, 20)
    change = int(random.integers(20))
    rising = bool(random.integers(2))
    feeds = (2.0, 40.0) if rising else (40.0, 2.0)
    m = machine(dt=0.0005, tolerance=tolerance, acceleration=A)
    moves = Moves()
    for k, (x, y) in enumerate(zip(along, beside, strict=True)):
        moves = moves.line(x, y, feed=feeds[int(k > change)])
    toolpath = moves.line(20.0, 0.0, feed=feeds[1]).toolpath(m)
    place, way = in_order(along)[change], -1.0 if rising else 1.0
    for shift, keeps in ((0.0, True), (way * TOO_SOON, False), (-way * TOO_SOON, True)):
        motion = Straight(feeds, (place + shift, 20.0))
        samples = sample((motion.end, motion), m.dt)
        seen = verify(samples, toolpath, m, motion=motion, not_limited=("jerk",), seed=seed)
        assert {fault.name for fault in seen.faults} == (set() if keeps else {"feed"})


@pytest.mark.parametrize("seed", range(12))
def test_the_nearest_place_is_that_of_ten_thousand_places(seed):
    random = np.random.default_rng(seed)
    motion = cubics(seed)
    edge = motion.t[2]
    times = np.array([edge - random.uniform(0, 2e-3), edge + random.uniform(0, 2e-3)])
    h, cut = times[1] - times[0], edge - times[0]
    dense = motion.columns(np.linspace(*times, 10_001))[0]
    vertex = dense[random.integers(10_001)] + random.normal(size=3) * 10 ** random.uniform(-3, 1)
    ends = motion.columns(times).transpose(1, 0, 2).copy()
    found = nearest(vertex, ends, cut, h)
    apart = np.linalg.norm(dense - vertex, axis=1)
    assert apart.min() - 1e-4 <= found[0] <= apart.min() + 1e-12
    there = dense[apart.argmin()] - ends[0, 0]
    chord = ends[1, 0] - ends[0, 0]
    assert found[1] == pytest.approx(np.clip(there @ chord / (chord @ chord), 0, 1), abs=2e-3)
    # exact but for rounding, and for what a wrong cubic says
    if found[2] > 0.1:
        assert reach_of(found, ends, cut, h, A, 1e-13) < 1e-4
    ends[1, 1] *= 1.01
    assert (
        reach_of(found, ends, cut, h, A, 1e-13)
        > reach_of(nearest(vertex, ends, np.nan, h), ends, np.nan, h, A, 0) / 100
    )
