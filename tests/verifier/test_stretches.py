"""What is decided for a stretch of samples is what each sample by itself decides, also of faults in the middle of a long cruise."""

from dataclasses import replace

import numpy as np
import pytest
from motions import Asked, Moves, changed, machine, polyline, sample

from planner.verifier import Given, Kind, stream, verify
from planner.verifier.limits import (
    FEED_AT_REST,
    GAP_BY_ACCELERATION,
    GAP_BY_JERK,
    GAP_OF_ACCELERATION,
    GROUPS,
    NORMAL,
    limits_of,
    look_at_axes,
    rows_of,
)
from planner.verifier.passing import Bounds, Chords
from planner.verifier.pieces import RATIO_ROUNDING, program_pieces
from planner.verifier.switches import Switches
from planner.verifier.worst import (
    DIFFERENCE,
    SampleBlock,
    Worst,
    differences,
    less_error,
    position_error,
    state_of,
)

M = machine()
FEED, JERK = 50.0, 1e5


def walk(seed, longest=8.0, count=9):
    """Corners of a way of legs from a hundredth of a millimetre on, of which some turn back."""
    random = np.random.default_rng(seed)
    steps = random.normal(size=(count, 3))
    steps *= 10.0 ** random.uniform(-2.0, np.log10(longest), (count, 1)) / np.linalg.norm(
        steps, axis=1, keepdims=True
    )
    return np.vstack([np.zeros(3), np.round(np.cumsum(steps, axis=0), 3)])


def programmed(points, feed=FEED):
    moves = Moves(tuple(points[0]))
    for point in points[1:]:
        moves.line(*point, feed=feed)
    return moves.toolpath(M)


def shaken(trajectory, seed):
    """Some setpoints displaced, by up to twice the tolerance."""
    random = np.random.default_rng(seed)
    position = trajectory.position.copy()
    some = random.choice(len(position), 3)
    position[some] += random.uniform(-0.1, 0.1, (3, 3))
    return changed(trajectory, position=position)


def passed(trajectory, toolpath, at_once):
    """Where `Switches` finds the vertices passed, so many samples at a time."""
    n = len(trajectory)
    segment = np.searchsorted(joints(trajectory, toolpath), np.arange(n), "right") - 1
    piece = np.clip(segment, 0, len(toolpath) - 1)
    first, last = np.maximum(piece - 1, 0), np.minimum(piece + 1, len(toolpath) - 1)
    far = np.linalg.norm(trajectory.position - toolpath.end[piece], axis=1) > M.tolerance
    last = np.where(far, piece, last)
    first = np.where(np.linalg.norm(trajectory.position - toolpath.start[piece], axis=1) > 0.05, piece, first)
    on = piece, np.maximum.accumulate(first), np.maximum.accumulate(last)
    return switched(trajectory.t, trajectory.position, on, toolpath, at_once)


def switched(t, position, on, toolpath, at_once):
    """The same of places (n, A) at times t, with their piece, and the first and the last that each can be on."""
    switches = Switches(program_pieces(toolpath), Bounds(np.full(3, 100.0), np.zeros(4), 3464.0))
    for low in range(0, len(t), at_once):
        skip = min(low, 1)
        part = slice(low - skip, low + at_once)
        none = np.zeros(len(t[part]))
        columns = *(each[part] for each in on), np.full(len(none), np.nan), position[part, None].copy()
        switches.take(Chords(t[part], none, none.copy(), none, *columns), skip)
    switches.finish()
    return switches.found.switch[["place", "begin", "end", "group"]].tolist()


def joints(trajectory, toolpath):
    """(M+1,) samples at which a motion that rests at every vertex is there."""
    at = [int(np.linalg.norm(trajectory.position - vertex, axis=1).argmin()) for vertex in toolpath.end[:-1]]
    return np.maximum.accumulate([0, *at, len(trajectory)])


@pytest.mark.parametrize("seed", range(12))
def test_vertices_are_passed_at_the_same_places_however_many_samples_are_taken_together(seed):
    points = walk(seed)
    toolpath = programmed(points)
    right = sample(polyline(points, FEED, jerk=JERK), M.dt)
    for motion in (right, shaken(right, seed)):
        whole = passed(motion, toolpath, len(motion))
        assert whole == passed(motion, toolpath, 1)
        assert whole == passed(motion, toolpath, 7)


@pytest.mark.parametrize("seed", range(40))
def test_a_chord_that_comes_nearer_than_its_ends_is_not_left_out(seed):
    random = np.random.default_rng(seed)
    toolpath = programmed(np.array([(0.0, 0.0, 0.0), (10.0, 0.0, 0.0), (10.0, 10.0, 0.0)]))
    n, behind = 60, 8
    away = random.normal(size=(n, 3))
    away *= (np.linspace(1.0, 0.3, n) + random.uniform(0.0, 0.2, n) ** 2)[:, None] / np.linalg.norm(
        away, axis=1, keepdims=True
    )
    on = (np.arange(n) >= n - behind).astype(np.int64)
    motion = 1e-3 * np.arange(n), toolpath.end[0] + away, (on, on, on), toolpath
    whole = switched(*motion, n)
    assert whole == switched(*motion, 1)
    assert whole == switched(*motion, 5)


def seen(verdict):
    """What a verdict says, its ratios to nine digits."""
    limits = {name: (f"{check.ratio:.9g}", check.line, check.limit) for name, check in verdict.limits.items()}
    errors = verdict.contour_error_mm, verdict.vertex_error_mm, verdict.lost_after
    return verdict.passed, [fault.kind for fault in verdict.faults], limits, errors


def bumped(trajectory, at, by):
    position = trajectory.position.copy()
    position[at] += by
    return changed(trajectory, position=position)


def in_cruise(kind):
    """A fault in the middle of a cruise of half a second, and what it is about: motion, program, kinds."""
    points = np.array([(0.0, 0.0, 0.0), (30.0, 0.0, 0.0), (30.0, 20.0, 0.0)])
    program = programmed(points)
    motion = sample(polyline(points, FEED, jerk=JERK), M.dt)
    t, middle = motion.t, 300
    if kind == "bump of one setpoint":
        return bumped(motion, middle, [0.0, 2e-3, 0.0]), program, {Kind.LIMIT}
    if kind == "bump beyond the tolerance":
        return bumped(motion, middle, [0.0, 0.06, 0.0]), program, {Kind.LIMIT, Kind.CONTOUR}
    if kind == "slow drift":
        off = 0.051 * np.sin(np.pi * np.clip((t - 0.1) / 0.4, 0.0, 1.0)) ** 4
        return bumped(motion, slice(None), np.outer(off, [0.0, 1.0, 0.0])), program, {Kind.CONTOUR}
    if kind == "leg left out":
        there = np.array([(0, 0, 0), (15, 0, 0), (15, 0.2, 0), (15, 0, 0), (30, 0, 0), (30, 20, 0)], float)
        return motion, programmed(there), {Kind.VERTEX, Kind.ORDER}
    assert kind == "feed exceeded for two setpoints"
    position = motion.position.copy()
    position[middle:, 0] += 1e-6
    position[middle + 1 :, 0] += 1e-6
    return changed(motion, position=np.minimum(position, [30.0, 99.0, 99.0])), program, {Kind.LIMIT}


@pytest.mark.parametrize(
    "kind",
    [
        "bump of one setpoint",
        "bump beyond the tolerance",
        "slow drift",
        "leg left out",
        "feed exceeded for two setpoints",
    ],
)
def test_a_fault_in_the_middle_of_a_cruise_is_found_the_same_way_in_stretches(kind, monkeypatch):
    motion, program, kinds = in_cruise(kind)
    given = Given(columns=())
    verdict = verify(motion, program, M, given=given)
    assert not verdict.passed
    assert verdict.kinds & kinds
    monkeypatch.setattr(stream, "BLOCK_SAMPLES", 1)
    assert seen(verdict) == seen(verify(motion, program, M, given=given))


@pytest.mark.parametrize("seed", range(2))
def test_a_verdict_on_a_motion_is_the_same_sample_by_sample(seed, monkeypatch):
    points = walk(seed, longest=0.4, count=3)
    toolpath, motion = programmed(points), polyline(points, FEED, jerk=JERK)
    right = sample(motion, M.dt)
    asked = Asked(motion, M.dt)
    subjects = (right, shaken(right, seed))
    verdicts = [verify(one, toolpath, M, motion=asked) for one in subjects]
    assert [verdict.passed for verdict in verdicts] == [True, False]
    monkeypatch.setattr(stream, "BLOCK_SAMPLES", 1)
    for verdict, one in zip(verdicts, subjects, strict=True):
        assert seen(verdict) == seen(verify(one, toolpath, M, motion=asked))


@pytest.mark.parametrize("digits", [0.0, 1e-7])
@pytest.mark.parametrize("seed", range(6))
def test_the_worst_of_axes_and_columns_is_that_of_arrays(seed, digits):
    random = np.random.default_rng(seed)
    n, skip = 40, int(random.integers(0, 4))
    t = np.cumsum(random.uniform(5e-4, 2e-3, n))
    zero = np.zeros(n)
    motion = sample(polyline(walk(seed), FEED, jerk=JERK), M.dt).rows(np.arange(n))
    scale = np.array([1.0, 60.0, 1500.0, 1.5e5])[:, None, None]
    position, velocity, acceleration, jerk = scale * random.normal(size=(4, n, 3))
    motion = replace(
        motion, t=t, position=position, velocity=velocity, acceleration=acceleration, jerk=jerk, s=zero
    )
    limits = limits_of(M, motion, Given(), ())
    limits = replace(limits, normal=500.0, time_rounding=digits)
    block = SampleBlock(
        t=t, state=state_of(motion)[1], piece=np.arange(n), skip=skip, travelled=random.uniform(0.0, 1e3)
    )
    found, wanted = Worst(rows_of(limits), 3), Worst(rows_of(limits), 3)
    run = look_at_axes(block, limits, found)
    assert run == block.travelled_to()[-1]
    v_max, a_max, j_max = limits.per_axis
    h = np.diff(t, prepend=-np.inf)[:, None]
    for order, column in enumerate((velocity, acceleration, jerk)):
        wanted.take(3 * order, np.abs(column), limits.per_axis[order], 0, block, span=order)
    by = differences(t, position, position_error(block, limits))
    for order, difference in enumerate(by):
        wanted.take(3 * order, less_error(difference), limits.per_axis[order], DIFFERENCE, block)

    def mean(column):
        return 0.5 * (column + np.concatenate([column[:1], column[:-1]]))

    gap = np.maximum(np.abs(by[0][0] - mean(velocity)) - by[0][1] - RATIO_ROUNDING * v_max, 0.0) / h
    wanted.take(3 * GAP_BY_ACCELERATION, gap, a_max / 4.0, 0, block)
    wanted.take(3 * GAP_BY_JERK, gap / h, j_max / 12.0, 0, block)
    change = np.diff(velocity, axis=0, prepend=velocity[:1]) / h
    noise = RATIO_ROUNDING * (v_max / h + a_max)
    gap = np.maximum(np.abs(change - mean(acceleration)) - noise, 0.0) / h
    wanted.take(3 * GAP_OF_ACCELERATION, gap, j_max / 4.0, 0, block)
    speed_sq = (velocity**2).sum(axis=1)
    assert (speed_sq > FEED_AT_REST**2).all()
    along = (velocity * acceleration).sum(axis=1) / speed_sq
    normal = np.linalg.norm(acceleration - along[:, None] * velocity, axis=1)
    wanted.take(3 * GROUPS + NORMAL, normal[:, None], limits.normal, 0, block, span=4)
    np.testing.assert_allclose(found.row, wanted.row, rtol=1e-12)
    assert (found.piece == wanted.piece).all()
    assert (found.time == wanted.time).all()
    assert (found.at == wanted.at).all()
    assert (found.least == wanted.least)[[bool(name) for name, _ in wanted.names]].all()
    assert sorted(zip(found.over.column, found.over.begin, found.over.end, strict=True)) == sorted(
        zip(wanted.over.column, wanted.over.begin, wanted.over.end, strict=True)
    )
    assert len(found.over.column)
