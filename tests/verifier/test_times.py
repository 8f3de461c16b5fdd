"""The judge's own times: in every cell one, reproducible by their seed, and none that the planner could prepare for."""

import numpy as np
import pytest
from motions import JERK_FREE, Asked, Moves, changed, machine, polyline, sample

from planner.motion.timing import WATCHED
from planner.verifier import Given, verify
from planner.verifier.reading import PER_PERIOD, PER_PIECE, cells_per_period, motion_between

M = machine()
LINE = polyline([(0, 0, 0), (30, 0, 0)], jerk=2e5)


def times(motion, seed=0, dt=M.dt):
    return np.concatenate([chunk.t for chunk in motion_between(motion, dt, seed)])


@pytest.mark.parametrize("fine", [0.01, 1, 7])
def test_every_cell_of_pieces_and_periods_is_looked_at_once(fine):
    asked = Asked(LINE, M.dt, fine=fine)
    t = times(asked)
    assert t[0] == 0.0
    assert t[-1] == asked.end
    assert (np.diff(t) > 0).all()
    cells = np.maximum(PER_PIECE, np.ceil(PER_PERIOD / fine - 1e-9))
    edges = np.append(asked.t, asked.end)
    in_each = np.histogram(t[1:-1], edges)[0]
    assert in_each.min() >= min(cells, PER_PIECE)
    assert in_each[:-1].min() >= cells
    assert in_each.max() <= cells + 1  # a piece may be longer by its rounding
    assert np.diff(t).max() < M.dt


def test_the_seed_makes_the_times():
    asked = Asked(LINE, M.dt)
    np.testing.assert_array_equal(times(asked), times(asked))
    assert len(np.intersect1d(times(asked), times(asked, seed=1))) == 2  # the first and the last


def test_there_are_more_times_than_the_planner_looks_at_and_others():
    asked = Asked(LINE, M.dt)
    edges = np.append(asked.t, asked.end)
    prepared = edges[:-1, None] + np.diff(edges)[:, None] * WATCHED
    assert len(times(asked)) > prepared.size
    assert not len(np.intersect1d(times(asked), prepared))


@pytest.mark.slow
def test_chunks_make_no_difference(monkeypatch):
    from planner.verifier import reading as module

    asked, toolpath = Asked(LINE, M.dt), Moves().line(30).toolpath(M)
    whole = times(asked)
    verdict = verify(sample(LINE, M.dt), toolpath, M, motion=asked)
    monkeypatch.setattr(module, "CELLS", 11)
    np.testing.assert_array_equal(times(asked), whole)
    again = verify(sample(LINE, M.dt), toolpath, M, motion=asked)
    assert again.passed
    for name, check in verdict.limits.items():
        assert again.limits[name].ratio == check.ratio


def test_pieces_that_last_no_time_and_a_motion_without_any_are_no_trouble():
    class Standing(Asked):
        t = np.array([0.0, 0.004, 0.004, 0.004 + 5e-10])

    t = times(Standing((0.01, LINE[1]), M.dt))
    assert (np.diff(t) > 0).all()
    assert not ((t > 0.004) & (t < 0.004 + 5e-10)).any()
    assert not list(motion_between(Asked((0.0, LINE[1]), M.dt), M.dt, 0))


@pytest.mark.parametrize("seed", range(8))
def test_a_peak_hidden_from_the_planners_places_is_found(seed):
    """Acceleration that is 40 % too large around the middle between two watched places, in every tenth piece only, and zero at
    every sample, at every half period and at every watched place."""
    duration, base = polyline([(0, 0, 0), (30, 0, 0)], feed=50, acceleration=1000, jerk=1e5)
    piece = M.dt

    def hiding(t):
        r, v, a, j = (each.copy() for each in base(t))
        share, number = np.modf(t / piece)
        on = (number % 10 == 3) & (share > WATCHED[0] + 0.05) & (share < WATCHED[1] - 0.05)
        a[on, 0] += 2800.0
        return r, v, a, j

    toolpath = Moves().line(30).toolpath(M)
    asked = Asked((duration, hiding), M.dt, fine=1)
    verdict = verify(
        sample((duration, base), M.dt), toolpath, M, motion=asked, seed=seed, not_limited=JERK_FREE
    )
    assert verdict.limits["acceleration.x"].ratio > 1.3
    assert not verdict.passed


@pytest.mark.parametrize("dt", [0.001, 0.004, 0.02])
def test_chords_between_the_times_cut_no_corners(dt):
    """Two neighbouring times are less than two cells apart: the bow of an arc at that distance is a hundredth of the tolerance."""
    tolerance, acceleration = 0.01, 3000.0
    gap = 2.0 * dt / cells_per_period(dt, tolerance, acceleration)
    assert gap < dt * (1 + 1e-12)
    assert acceleration * gap**2 / 8.0 <= 0.01 * tolerance * (1 + 1e-9) or gap == 2.0 * dt / 16


def test_cells_per_period_are_bounded():
    assert cells_per_period(0.02, 1e-6, 1e9) == 16
    assert cells_per_period(0.001, 1.0, 1.0) == PER_PERIOD


def test_samples_of_a_clock_that_jitters_are_judged_at_their_own_times():
    # times off by up to 2 us, and rows 0.3 to 1 period apart: the motion is right, and is read where the samples are
    m = machine()
    toolpath = Moves().line(30, feed=50).toolpath(m)
    duration, at = polyline([(0, 0, 0), (30, 0, 0)], feed=50)
    random = np.random.default_rng(5)
    even = np.arange(m.dt, duration - 0.3 * m.dt, m.dt)
    jittering = np.concatenate([[0.0], even + random.uniform(-2e-6, 2e-6, len(even)), [duration]])
    uneven = np.cumsum(np.append(0.0, random.uniform(0.3, 1.0, 4000) * m.dt))
    uneven = np.append(uneven[uneven < duration - 0.3 * m.dt], duration)
    whole = sample((duration, at), m.dt)
    for t in (jittering, uneven):
        columns = dict(zip(("position", "velocity", "acceleration", "jerk"), at(t), strict=True))
        nothing = np.zeros(len(t))
        rows = {
            "t": t,
            "s": nothing,
            "feed": nothing,
            "block": nothing.astype(int),
            "line": nothing.astype(int),
        }
        read = changed(whole, **columns, **rows)
        verdict = verify(read, toolpath, m, given=Given(columns=()), not_limited=("jerk",))
        assert verdict.passed, verdict.faults
        # a sample that is missing still shows
        keep = np.arange(len(t)) != len(t) // 2
        if t is jittering:
            less = changed(whole, **{name: value[keep] for name, value in (columns | rows).items()})
            verdict = verify(less, toolpath, m, given=Given(columns=()), not_limited=("jerk",))
            assert any(text.startswith("period: ") for text in verdict.sentences)
