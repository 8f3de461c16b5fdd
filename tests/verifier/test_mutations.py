"""Every mutation of a correct motion is found: twenty kinds, each at random places and sizes, from fixed seeds.

The motion: a random polyline, a dwell, a full circle, a line; all from rest to rest at the programmed feed and the machine's limits.
"""

import numpy as np
import pytest
from motions import Asked, Moves, along, chain, changed, helix, machine, polyline, rest_to_rest, sample, stay

from planner.verifier import Given, verify

M = machine()
FEED, A, J, DWELL, EPS = 50.0, 2000.0, 2e5, 0.03, 0.05
SEEDS = range(3)
COLUMNS = ("t", "position", "velocity", "acceleration", "jerk", "s", "feed", "block", "line")


class Job:
    """A program and the motion that runs it; `points` replaces the polyline that is run, not the program's."""

    def __init__(self, seed: int):
        self.random = np.random.default_rng(seed)
        sign = self.random.choice([-1, 1], (5, 3)) * [0, 1, 1] + [
            1,
            0,
            0,
        ]  # always on along x: no leg meets another
        legs = np.cumsum(self.random.uniform(3, 8, (5, 3)) * sign, axis=0)
        self.points = np.vstack([np.zeros(3), np.round(legs, 3)])
        self.radius = float(np.round(self.random.uniform(2, 5), 3))
        moves = Moves()
        for p in self.points[1:]:
            moves.line(*p, feed=FEED)
        self.corner = self.points[-1]
        center = self.corner[:2] - np.array([self.radius, 0.0])
        moves.dwell(DWELL).arc(center, 2 * np.pi, feed=FEED)
        self.last = self.corner + np.array([7.0, 0.0, 0.0])
        self.toolpath = moves.line(*self.last, feed=FEED).toolpath(M)

    def motion(self, points=None, *, dwell=DWELL, sweep=2 * np.pi, circle=True, feed=FEED):
        points = self.points if points is None else points
        parts = [polyline(points, feed=feed, jerk=J), stay(points[-1], dwell)]
        if circle:
            length, curve = helix(points[-1], points[-1][:2] - np.array([self.radius, 0.0]), sweep)
            top = min(feed, np.sqrt(0.5 * A * self.radius))
            parts.append(along(length, curve, rest_to_rest(length, top, 0.5 * A, 0.3 * J)))
        return chain(*parts, polyline([points[-1], self.last], feed=feed, jerk=J))

    def between(self, low, high):
        return self.random.uniform(low, high)

    def one_of(self, count):
        return int(self.random.integers(count))

    def direction(self):
        u = self.random.normal(size=3)
        return u / np.linalg.norm(u)


def only(trajectory, keep):
    return changed(trajectory, **{name: getattr(trajectory, name)[keep] for name in COLUMNS})


def passes(job, motion=None, trajectory=None, given=None):
    motion = job.motion() if motion is None else motion
    if trajectory is None:
        trajectory, asked = sample(motion, M.dt), Asked(motion, M.dt, fine=1)
    else:
        asked = None
    more = {} if given is None else {"given": given}
    return verify(trajectory, job.toolpath, M, motion=asked, **more)


# ---- of the motion: (job) -> motion --------------------------------------------------------------------------------------


def another(function):
    def mutated(job):
        duration, base = job.motion()
        return duration, lambda t: function(job, t, tuple(each.copy() for each in base(t)))

    return mutated


def shifted(job):
    off = 10 ** job.between(-4, 0) * job.direction()
    duration, base = job.motion()
    return duration, lambda t: (base(t)[0] + off, *base(t)[1:])


def scaled(job):
    by = 1.0 + 10 ** job.between(-5, -2)
    duration, base = job.motion()
    return duration, lambda t: tuple(by * each for each in base(t))


def faster(job):
    by = 1.0 + 10 ** job.between(-5, -1)
    duration, base = job.motion()
    return duration / by, lambda t: tuple(each * by**n for n, each in enumerate(base(t * by)))


def hurried(quantity):
    """A limit exceeded for less than a period, by 0.01 % to 30 %, between samples; the positions know nothing of it."""

    def mutated(job):
        duration, base = job.motion()
        limit = (100.0, A, J)[quantity - 1]
        value = limit * (1.0 + 10 ** job.between(-4, -0.5))
        axis, begin = job.one_of(3), (0.25 + job.one_of(int(duration / M.dt) - 1)) * M.dt

        def motion(t):
            columns = tuple(each.copy() for each in base(t))
            columns[quantity][(t > begin) & (t < begin + 0.5 * M.dt), axis] = value
            return columns

        return duration, motion

    mutated.__name__ = f"order_{quantity}_exceeded_between_samples"
    return mutated


def beside_a_vertex(job):
    points, k = job.points.copy(), 1 + job.one_of(3)
    u = [points[k] - points[k - 1], points[k + 1] - points[k]]
    u = [each / np.linalg.norm(each) for each in u]
    inward = u[1] - u[0]
    points[k] += EPS * job.between(1.02, 20) * inward / np.linalg.norm(inward)
    return job.motion(points)


def vertices_swapped(job):
    points, k = job.points.copy(), 1 + job.one_of(3)
    points[[k, k + 1]] = points[[k + 1, k]]
    if k + 1 == len(points) - 1:
        points[[k, k - 1]] = points[[k - 1, k]]
    return job.motion(np.vstack([points[:-1], job.corner]))


def vertex_left_out(job):
    return job.motion(np.delete(job.points, 1 + job.one_of(4), axis=0))


def leg_run_twice(job):
    k = 1 + job.one_of(4)
    return job.motion(np.insert(job.points, k, job.points[[k, k - 1]], axis=0))


def circle_left_out(job):
    return job.motion(circle=False)


def circle_turned(job):
    return job.motion(sweep=-2 * np.pi)


def circle_twice(job):
    return job.motion(sweep=4 * np.pi)


def dwell_cut_short(job):
    return job.motion(dwell=DWELL - job.between(0.003, DWELL))


def backwards(job):
    duration, base = job.motion()
    signs = (1, -1, 1, -1)
    return duration, lambda t: tuple(s * each for s, each in zip(signs, base(duration - t), strict=True))


@another
def mirrored(job, t, columns):
    for column in columns:
        column[:, 1] *= -1.0
    return columns


@another
def axes_exchanged(job, t, columns):
    return tuple(column[:, [1, 0, 2]] for column in columns)


MOTIONS = (
    shifted, scaled, faster, hurried(1), hurried(2), hurried(3), beside_a_vertex, vertices_swapped, vertex_left_out,
    leg_run_twice, circle_left_out, circle_turned, circle_twice, dwell_cut_short, backwards, mirrored, axes_exchanged,
)  # fmt: skip


# ---- of the samples: (job, trajectory) -> trajectory ---------------------------------------------------------------------


def end_cut_off(job, trajectory):
    return only(trajectory, slice(0, -1 - job.one_of(3) * job.one_of(30)))


def beginning_cut_off(job, trajectory):
    return only(trajectory, slice(1 + job.one_of(3) * job.one_of(30), None))


def sample_left_out(job, trajectory):
    return only(trajectory, np.delete(np.arange(len(trajectory)), 1 + job.one_of(len(trajectory) - 3)))


def _moving(job, trajectory):
    return job.random.choice(np.flatnonzero(trajectory.velocity[2:-2].any(axis=1))) + 2


def sample_displaced(job, trajectory):
    position = trajectory.position.copy()
    position[_moving(job, trajectory)] += 10 ** job.between(-3, 0) * job.direction()
    return changed(trajectory, position=position)


def sample_repeated(job, trajectory):
    position, fast = (
        trajectory.position.copy(),
        np.flatnonzero((np.abs(trajectory.velocity) > 10).any(axis=1)),
    )
    k = job.random.choice(fast[1:-1])
    position[k] = position[k - 1]
    return changed(trajectory, position=position)


def time_jittered(job, trajectory):
    t = trajectory.t.copy()
    t[1 + job.one_of(len(t) - 3)] += 10 ** job.between(-7, -4)
    return changed(trajectory, t=t)


SAMPLES = (
    end_cut_off, beginning_cut_off, sample_left_out, sample_displaced, sample_repeated, time_jittered
)  # fmt: skip


# ---- of the columns ------------------------------------------------------------------------------------------------------


def column_scaled(job, trajectory):
    name, least = (("velocity", -4), ("acceleration", -1))[job.one_of(2)]
    return changed(trajectory, **{name: getattr(trajectory, name) * (1.0 - 10 ** job.between(least, -0.5))})


def column_late(job, trajectory):
    name = ("velocity", "acceleration")[job.one_of(2)]
    column = getattr(trajectory, name)
    later = 3 + job.one_of(20)
    return changed(trajectory, **{name: np.vstack([column[:1].repeat(later, axis=0), column[:-later]])})


def columns_exchanged(job, trajectory):
    name = ("velocity", "acceleration")[job.one_of(2)]
    return changed(trajectory, **{name: getattr(trajectory, name)[:, [1, 2, 0]]})


def column_turned(job, trajectory):
    name = ("velocity", "acceleration")[job.one_of(2)]
    return changed(trajectory, **{name: -getattr(trajectory, name)})


COLUMN = (column_scaled, column_late, columns_exchanged, column_turned)


@pytest.mark.parametrize("seed", SEEDS)
def test_the_motion_itself_passes(seed):
    job = Job(seed)
    verdict = passes(job)
    assert verdict.passed, verdict.faults
    alone = passes(job, trajectory=sample(job.motion(), M.dt), given=Given(columns=()))
    assert alone.passed, alone.faults


@pytest.mark.shows("verify", "sampled: twenty kinds of proved faults at random places")
@pytest.mark.parametrize("mutation", MOTIONS, ids=lambda each: each.__name__)
def test_mutated_motions_are_found(mutation):
    missed = [seed for seed in SEEDS if passes(job := Job(seed), motion=mutation(job)).passed]
    assert missed == []


@pytest.mark.shows("verify", "sampled: twenty kinds of proved faults at random places")
@pytest.mark.parametrize("given", [Given(), Given(columns=())], ids=["with columns", "positions only"])
@pytest.mark.parametrize("mutation", SAMPLES, ids=lambda each: each.__name__)
def test_mutated_samples_are_found(mutation, given):
    missed = []
    for seed in SEEDS:
        job = Job(seed)
        trajectory = mutation(job, sample(job.motion(), M.dt))
        if passes(job, trajectory=trajectory, given=given).passed:
            missed.append(seed)
    assert missed == []


@pytest.mark.parametrize("mutation", COLUMN, ids=lambda each: each.__name__)
def test_mutated_columns_are_found_and_do_not_count_where_they_were_not_delivered(mutation):
    for seed in SEEDS:
        job = Job(seed)
        trajectory = mutation(job, sample(job.motion(), M.dt))
        assert not passes(job, trajectory=trajectory).passed, seed
        assert passes(job, trajectory=trajectory, given=Given(columns=())).passed, seed
