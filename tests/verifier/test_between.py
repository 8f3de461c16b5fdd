"""Between the times at which a motion is looked at: extremes of its cubics, and what is said of how each figure is known."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import pytest
from motions import Asked, Moves, along, helix, machine, polyline, rest_to_rest, sample, straight

import planner
from planner.motion.trajectory import Trajectory
from planner.nc.reader import parse_program
from planner.verifier import Known, verify
from planner.verifier.between import OPEN, PARTS, UNKNOWN, Between, look_between
from planner.verifier.pieces import program_pieces

M = machine()
WITHIN = 1e-3 / PARTS  # by how much what is certified of a speed may be above it [-]
FREE = np.array([[1e3] * 3, [1e5] * 3, [1e7] * 3])


@dataclass(frozen=True)
class Cubics:
    """Pieces of constant jerk (L, 3) of so many seconds each (L,) from a state (3, 3) on."""

    lasting: np.ndarray
    jerk: np.ndarray
    state: np.ndarray
    jump: np.ndarray | float = 0.0  # (L, 3) of the acceleration where each piece begins

    @property
    def t(self):
        return np.append(0.0, np.cumsum(self.lasting))[:-1]

    @property
    def end(self):
        return float(self.lasting.sum())

    def columns(self, t):
        """(4, n, 3) position and its derivatives."""
        states, jumps = [np.array(self.state, float)], np.broadcast_to(self.jump, self.jerk.shape)
        for h, j, jump in zip(self.lasting, self.jerk, jumps, strict=True):
            x, v, a = states[-1]
            a = a + jump
            states[-1] = np.array([x, v, a])
            states.append(
                np.array([x + h * (v + h * (a / 2 + h * j / 6)), v + h * (a + h * j / 2), a + h * j])
            )
        on = np.searchsorted(self.t, t, side="right") - 1
        x, v, a = np.array(states)[on].transpose(1, 0, 2)
        j, h = self.jerk[on], (t - self.t[on])[:, None]
        return np.array([x + h * (v + h * (a / 2 + h * j / 6)), v + h * (a + h * j / 2), a + h * j, j])

    def at(self, times, dt):
        x, v, a, j = self.columns(times)
        none, zero = np.full(len(times), -1), np.zeros(len(times))
        return Trajectory(
            axes=("x", "y", "z"), dt=dt, t=times, position=x, velocity=v, acceleration=a, jerk=j,
            s=zero, feed=zero, block=none, line=none,
        )  # fmt: skip


def cubics(seed, **more):
    random = np.random.default_rng(seed)
    lasting = random.uniform(0.002, 0.02, 6)
    jerk = random.normal(size=(6, 3)) * 1e5
    state = np.stack([random.normal(size=3), random.normal(size=3) * 30, random.normal(size=3) * 500])
    return Cubics(lasting, jerk, state, **more)


def looked(motion, t, limits=FREE):
    pieces = program_pieces(Moves().line(1e3).toolpath(M))
    velocity, acceleration = np.zeros((2, len(t), 3))
    found, known = Between(velocity, acceleration, np.zeros(len(t)), np.full(len(t), np.nan)), np.zeros(3)
    columns, piece = motion.columns(t), np.zeros(len(t), dtype=np.int64)
    state = np.ascontiguousarray(columns.transpose(1, 0, 2))
    look_between(t, state, motion.t, 1, limits, 0, pieces, piece, np.empty((3, 3)), found, known)
    return found, known, columns


def times(motion, seed, count=30):
    return np.sort(
        np.append(np.random.default_rng(seed).uniform(0.0, motion.end, count), [0.0, motion.end * (1 - 1e-9)])
    )


@pytest.mark.shows("between", "exact: extremes of cubics")
@pytest.mark.parametrize("seed", range(20))
def test_extremes_between_places_are_those_of_the_motion(seed):
    motion = cubics(seed)
    t = times(motion, seed)
    found, known, columns = looked(motion, t)
    if known[UNKNOWN]:  # two pieces within one gap
        t = np.sort(np.append(t, motion.t[1:] + 1e-4))
        found, known, columns = looked(motion, t)
    assert not known[UNKNOWN]
    for k, (begin, end) in enumerate(pairwise(t), start=1):
        dense = motion.columns(np.linspace(begin, end, 2001))
        assert found.velocity[k] == pytest.approx(np.abs(dense[1]).max(axis=0), rel=1e-5)
        assert found.acceleration[k] == pytest.approx(np.abs(dense[2]).max(axis=0), rel=1e-3)
        speed = np.linalg.norm(dense[1], axis=1)
        ends = np.linalg.norm(columns[1, [k - 1, k]], axis=1).max()
        assert speed.max() <= max(found.speed[k], ends) * (1 + 1e-9)
        if found.speed[k] > 0.0 and len(set(np.searchsorted(motion.t, [begin, end]))) == 1:
            assert found.speed[k] <= speed.max() * (1 + WITHIN)
        chord = dense[0, 0] + np.linspace(0, 1, 2001)[:, None] * (dense[0, -1] - dense[0, 0])
        assert np.linalg.norm(dense[0] - chord, axis=1).max() <= known[OPEN] * (1 + 1e-9)


@pytest.mark.shows("between", "exact: extremes of cubics")
@pytest.mark.parametrize("share", [0.0, 0.1, 0.4, 0.6, 0.9])
def test_the_peak_of_a_velocity_between_two_places_is_found_exactly(share):
    """Wherever in a part it lies; y goes on evenly."""
    h, jerk, even = 0.01, 4e4, 5.0
    when = (PARTS // 2 + share) / PARTS * h
    motion = Cubics(
        np.array([h]),
        np.array([[-jerk, 0.0, 0.0]]),
        np.array([[0.0] * 3, [20.0, even, 0], [jerk * when, 0, 0]]),
    )
    found, known, _ = looked(motion, np.array([0.0, h * (1 - 1e-12)]))
    peak = 20.0 + jerk * when**2 / 2
    assert found.velocity[1, 0] == pytest.approx(peak, rel=1e-12)
    speed = np.hypot(peak, even)
    assert speed * (1 - 1e-12) <= found.speed[1] <= speed * (1 + WITHIN)
    assert not known[UNKNOWN]


@pytest.mark.parametrize("row", [1, 2])
def test_places_that_are_not_of_one_cubic_are_told(row):
    motion = cubics(3)
    t = np.sort(np.append(times(motion, 3), motion.t[1:] + 1e-4))
    assert not looked(motion, t)[1][UNKNOWN]

    class Other(Cubics):
        def columns(self, t):
            columns = Cubics.columns(self, t)
            columns[row, len(t) // 2] += 1e-3 * FREE[row - 1]
            return columns

    other = Other(motion.lasting, motion.jerk, motion.state)
    assert looked(other, t)[1][UNKNOWN] == 2  # before that place and behind it


def test_a_jump_of_the_acceleration_counts_only_where_jerk_is_limited():
    jump = np.zeros((6, 3))
    jump[3, 0] = 100.0
    motion = cubics(5, jump=jump)
    t = np.sort(np.append(times(motion, 5), motion.t[1:] + 1e-4))
    free = FREE.copy()
    free[2] = np.inf
    assert looked(motion, t)[1][UNKNOWN] == 1
    assert looked(motion, t, free)[1][UNKNOWN] == 0


# ---- what the verdict says -----------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class InPieces(Asked):
    """A motion that says where its own pieces begin."""

    begins: tuple[float, ...] = ()

    @property
    def t(self):
        return np.array(self.begins)


def on_a_line(feed=50.0):
    motion, path = polyline([(0, 0, 0), (9, 0, 0)], feed, jerk=2e5), Moves().line(9.0, feed=feed).toolpath(M)
    rounding, ramp = 2000.0 / 2e5, feed / 2000.0
    phases = np.array([0.0, rounding, ramp, ramp + rounding])
    begins = np.append(phases, motion[0] - phases[:0:-1])
    return motion, path, InPieces(motion, M.dt, begins=tuple(begins))


def test_a_motion_on_cubics_is_known_exactly():
    motion, path, asked = on_a_line()
    verdict = verify(sample(motion, M.dt), path, M, motion=asked)
    assert verdict.passed, verdict.faults
    known = verdict.claims.known
    assert {known[f"{name}.x"] for name in ("velocity", "acceleration", "jerk")} == {Known.EXACT}
    assert {known[name] for name in ("feed", "contour error", "corners")} == {Known.CERTIFIED}
    assert 0.0 < verdict.claims.open_mm < 0.01 * M.tolerance
    assert verdict.limits["acceleration.x"].ratio == pytest.approx(1.0, abs=1e-9)
    assert verdict.limits["feed"].ratio == pytest.approx(1.0, abs=1e-9)


@pytest.mark.parametrize("samples", [1, 2, 7])
def test_a_peak_above_f_is_seen_however_many_places_are_read_at_once(samples, monkeypatch):
    """The speed is largest within a piece, on the second of two blocks; the first one has more F."""
    length, first = 4.0, 1.0
    path = Moves().line(first, feed=80.0).line(length, feed=40.0).toolpath(M)
    motion = along(*straight((0, 0, 0), (length, 0, 0)), rest_to_rest(length, 1e3, 2000.0, 2e5))
    ramp = motion[0] / 2.0 - 0.01  # with the jerk j the acceleration a takes a/j = 10 ms
    asked = InPieces(motion, M.dt, begins=(0.0, 0.01, ramp, motion[0] - ramp, motion[0] - 0.01))
    whole = verify(sample(motion, M.dt), path, M, motion=asked).limits["feed"]
    peak = motion[1](np.array([motion[0] / 2.0]))[1][0, 0]
    assert peak * (1.0 - 1e-12) <= whole.ratio * 40.0 <= peak * (1.0 + WITHIN)
    monkeypatch.setattr("planner.verifier.stream.BLOCK_SAMPLES", samples)
    assert verify(sample(motion, M.dt), path, M, motion=asked).limits["feed"].ratio == whole.ratio


def test_one_whose_pieces_are_no_cubics_is_sampled():
    length, curve = helix((10.0, 0, 0), (0, 0), np.pi)
    motion = along(length, curve, rest_to_rest(length, 50.0, 500.0, 1e5))
    path = Moves((10.0, 0, 0)).arc((0, 0), np.pi).toolpath(M)
    verdict = verify(sample(motion, M.dt), path, M, motion=Asked(motion, M.dt))
    assert verdict.passed, verdict.faults
    assert set(verdict.claims.known.values()) == {Known.SAMPLED}
    assert verdict.claims.open_mm is None


def test_of_a_file_what_lies_between_rows_is_assumed():
    motion, path, _ = on_a_line()
    claims = verify(sample(motion, M.dt), path, M).claims
    assert claims.known["contour error"] is Known.ASSUMED
    assert claims.known["velocity.x"] is Known.SAMPLED
    assert claims.open_mm == pytest.approx(np.sqrt(3) * 2000.0 * M.dt**2 / 8.0)
    assert claims.between == "straight lines from row to row"
    held = verify(sample(motion, M.dt), path, M.model_copy(update={"interpolation": "hold"})).claims
    assert held.between == "steps from row to row"
    assert held.sentence().startswith(
        "sampled: velocity, acceleration, jerk, feed; assumed: contour error, corners, for steps"
    )


def test_where_jerk_is_not_limited_it_is_sampled():
    motion, path, asked = on_a_line()
    known = verify(sample(motion, M.dt), path, M, motion=asked, not_limited=("jerk",)).claims.known
    assert known["acceleration.x"] is Known.EXACT
    assert known["jerk.x"] is Known.SAMPLED


def test_the_words_stand_in_the_summary():
    motion, path, asked = on_a_line()
    verdict = verify(sample(motion, M.dt), path, M, motion=asked)
    said = verdict.summary()["known"]
    assert said["figures"]["velocity.x"] == "exact"
    assert said["open_mm"] == verdict.claims.open_mm
    assert verdict.claims.sentence().startswith(
        "exact: velocity, acceleration, jerk; certified: feed, contour error, corners to "
    )


def test_errors_beside_a_curve_of_the_program_are_sampled():
    curve = parse_program("G21 G64 F1000 G1 X1\nG5 I3 J3 P-3 Q3 X11\nM2\n", source="curve")
    claims = planner.plan(curve, "mill", effort="quick").verdict.claims
    assert claims.known["velocity.x"] is Known.EXACT
    assert claims.known["contour error"] is Known.SAMPLED
