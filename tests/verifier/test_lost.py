"""Numbers of failing motions are true or None: against a search that knows nothing but points."""

import numpy as np
import pytest
from judging import fault
from motions import JERK_FREE, Asked, Moves, along, chain, helix, machine, polyline, rest_to_rest, sample

from planner.verifier import verify

M = machine()


def nearest(points, corners):
    """Distance of each point (n, 3) from the polyline through corners (m, 3)."""
    a, u = corners[:-1], np.diff(corners, axis=0)
    best = np.full(len(points), np.inf)
    for k in range(len(a)):
        w = points - a[k]
        x = np.clip(w @ u[k] / (u[k] @ u[k]), 0.0, 1.0)
        best = np.minimum(best, np.linalg.norm(w - x[:, None] * u[k], axis=1))
    return best


def with_middles(trajectory):
    q = trajectory.position
    return np.vstack([q, 0.5 * (q[1:] + q[:-1])])


def chord_circle(radius, count=90):
    angle = np.linspace(0, 2 * np.pi, count + 1)
    points = radius * np.stack([np.cos(angle), np.sin(angle), 0 * angle], 1)
    moves = Moves(tuple(points[0]))
    for p in points[1:]:
        moves.line(*p)
    return points, moves.toolpath(M)


@pytest.mark.parametrize("off", [0.03, 0.07, 0.108, 0.35, 1.0])
def test_a_motion_that_is_off_by_many_tolerances_is_measured(off):
    points, toolpath = chord_circle(10.0)
    length, curve = helix((10.0 - off, 0, 0), (0, 0), 2 * np.pi)
    motion = along(length, curve, rest_to_rest(length, 40.0, 1000.0, 1e5))
    trajectory = sample(motion, M.dt)
    verdict = verify(trajectory, toolpath, M)
    assert not verdict.passed
    between = verify(trajectory, toolpath, M, motion=Asked(motion, M.dt))
    assert verdict.contour_error_mm <= between.contour_error_mm <= off * (1 + 1e-9)
    assert verdict.contour_error_mm == pytest.approx(
        nearest(with_middles(trajectory), points).max(), rel=1e-6
    )
    assert verdict.vertex_error_mm == pytest.approx(nearest(points, trajectory.position).max(), rel=1e-4)
    assert verdict.contour.limit == pytest.approx(0.05)
    assert verdict.contour.ratio == pytest.approx(verdict.contour_error_mm / 0.05, rel=1e-3)
    assert verdict.lost_after is not None or off < 0.1


@pytest.mark.parametrize("seed", range(6))
def test_detours_are_measured_or_unknown_but_never_wrong(seed):
    """A polyline with one vertex moved aside, by a tenth of the budget to a hundred times it."""
    rng = np.random.default_rng(seed)
    sign = rng.choice([-1, 1], (7, 3)) * [0, 1, 1] + [
        1,
        0,
        0,
    ]  # always on along x, so that no leg comes near another
    points = np.cumsum(rng.uniform(3, 9, (7, 3)) * sign, axis=0)
    points -= points[0]
    moves = Moves()
    for p in points[1:]:
        moves.line(*p, feed=90.0)
    toolpath = moves.toolpath(M)
    known = 0
    for size in 0.05 * np.array([0.1, 0.9, 1.5, 4.0, 10.0, 100.0]):
        aside = points.copy()
        direction = rng.normal(size=3)
        aside[3] += size * direction / np.linalg.norm(direction)
        trajectory = sample(polyline(aside, jerk=2e5), M.dt)
        verdict = verify(trajectory, toolpath, M)
        far = nearest(with_middles(trajectory), points).max(), nearest(points, trajectory.position).max()
        assert verdict.passed == (max(far) < 0.05)
        if verdict.contour_error_mm is not None:
            known += 1
            # in order a sample before the vertex may not lie on the leg after it, which can be a little nearer
            assert far[0] * (1 - 1e-9) <= verdict.contour_error_mm <= 1.01 * far[0]
        if verdict.vertex_error_mm is not None:
            assert verdict.vertex_error_mm == pytest.approx(far[1], rel=1e-6, abs=1e-9)
        if None in (verdict.contour_error_mm, verdict.vertex_error_mm):
            assert verdict.lost_after in (20, 30, 40)
            assert any("lost after line" in text for text in verdict.sentences)
    assert known >= 4


def test_a_program_run_in_part_has_no_vertex_error():
    points = [(0, 0, 0), (10, 0, 0), (10, 10, 0), (0, 10, 0), (0, 20, 0)]
    moves = Moves(points[0])
    for p in points[1:]:
        moves.line(*p)
    verdict = verify(sample(polyline(points[:3], jerk=2e5), M.dt), moves.toolpath(M), M)
    assert verdict.vertex_error_mm is None
    assert verdict.lost_after == 30
    assert verdict.contour_error_mm < 1e-3  # as far as it runs it is on the path
    assert "line 40" in fault(verdict, "order")


def test_a_motion_that_comes_back_is_still_not_known():
    """5 mm aside between two points of a line: what is known is the part that can be followed."""
    toolpath = Moves().line(30).toolpath(M)
    points = [(0, 0, 0), (10, 0, 0), (10, 5, 0), (12, 5, 0), (12, 0, 0), (30, 0, 0)]
    verdict = verify(sample(chain(polyline(points)), M.dt), toolpath, M, not_limited=JERK_FREE)
    assert not verdict.passed
    assert verdict.contour_error_mm is None
    assert verdict.lost_after == 10
    assert verdict.contour.value <= 2 * 0.05 * (1 + 1e-6)
