"""The verifier's own curves: distances against a search, motions along them that pass, and motions that leave them, which do not."""

from __future__ import annotations

import numpy as np
import pytest
from curves import chord_error
from judging import M, distance_from, fault, judge
from motions import along, rest_to_rest, sample
from scipy.optimize import brentq, minimize_scalar

from planner.base.kernels import njit
from planner.geometry.build import toolpath_from_program
from planner.geometry.toolpath import Toolpath
from planner.nc.reader import parse_program
from planner.verifier.bends import CURVE_TURN
from planner.verifier.pieces import PIECE_ANGLE, program_pieces, reach_piece

CONTROL = np.array([[0.0, 0, 0], [8, 0, 0], [10, 4, 0], [12, 12, 0]])
WEIGHT = np.array([1.0, 2.5, 0.7, 1.0])


def toolpath(feed: float = 3000.0) -> Toolpath:
    """One rational cubic with the control points above."""
    rows = "\n".join(f"K0 X{p[0]} Y{p[1]} R{w}" for p, w in zip(CONTROL, WEIGHT, strict=True))
    text = f"G21 F{feed}\nG6.2 P4 {rows}\nK1\nK1\nK1\nK1\nM2\n"
    return toolpath_from_program(parse_program(text.encode()), M)


def curve_at(u):
    """Point and three u-derivatives (T, 3) each, from the formula."""
    poly = np.polynomial.polynomial
    bernstein = np.array([(1, -3, 3, -1), (0, 3, -6, 3), (0, 0, 3, -3), (0, 0, 0, 1)], float)

    def derivatives(coefficients):
        return [poly.polyval(u, poly.polyder(coefficients @ bernstein, d)) for d in range(4)]

    n = list(zip(*(derivatives(WEIGHT * CONTROL[:, k]) for k in range(3)), strict=True))
    w = derivatives(WEIGHT)
    n, w = [np.stack(row, axis=1) for row in n], [each[:, None] + np.zeros((1, 3)) for each in w]
    r = n[0] / w[0]
    r1 = (n[1] - w[1] * r) / w[0]
    r2 = (n[2] - 2 * w[1] * r1 - w[2] * r) / w[0]
    r3 = (n[3] - 3 * w[1] * r2 - 3 * w[2] * r1 - w[3] * r) / w[0]
    return r, r1, r2, r3


def run_along(first=0.0, last=1.0, aside=0.0):
    """A motion along the curve, its parameter from rest to rest, up to `aside` [mm] beside it in the middle."""

    def beside(s):
        r, r1, r2, r3 = curve_at(first + (last - first) * s)
        scale = last - first
        rise = np.zeros((4, len(s), 3))
        for d, wave in enumerate(
            (1 - np.cos(2 * np.pi * s), np.sin(2 * np.pi * s), np.cos(2 * np.pi * s), -np.sin(2 * np.pi * s))
        ):
            rise[d, :, 2] = 0.5 * aside * (2 * np.pi) ** d * wave
        return r + rise[0], r1 * scale + rise[1], r2 * scale**2 + rise[2], r3 * scale**3 + rise[3]

    return along(1.0, beside, rest_to_rest(1.0, 1.0, 2.0, 4.0))


@pytest.mark.slow
def test_the_distance_from_a_curve_is_the_searched_one() -> None:
    pieces = program_pieces(toolpath())
    assert len(pieces.piece) > len(toolpath())
    rng = np.random.default_rng(1)
    for i, piece in enumerate(pieces.piece):
        k = -2 - piece["arc"]
        control, weights = pieces.frame[k], np.array([1, *pieces.turn[k], 1])

        def point(u, control=control, weights=weights):
            basis = weights * np.array([(1 - u) ** 3, 3 * u * (1 - u) ** 2, 3 * u**2 * (1 - u), u**3])
            return basis @ control / basis.sum()

        ends = (piece["x0"], piece["x1"])
        for near in (0.02, 0.5):
            q = point(rng.uniform(*ends)) + rng.uniform(-near, near, 3)
            far = lambda u, q=q: float(np.linalg.norm(point(u) - q))  # noqa: E731
            searched = minimize_scalar(far, bounds=ends, method="bounded", options={"xatol": 1e-10}).fun
            assert distance_from(pieces, i, q) == pytest.approx(min(searched, *map(far, ends)), abs=1e-8)


@njit(cache=True)
def part_within(pieces, i, q, radius):
    return reach_piece(pieces, i, q, radius)


def test_the_part_of_a_curve_within_a_radius_is_the_searched_one() -> None:
    """Of a point beside the curve, on its hollow side and on the other: its nearest place is known, and so is how fast the distance
    grows from there, which the bend of the curve changes by a tenth."""
    pieces = program_pieces(toolpath())
    seen = 0
    for i, piece in enumerate(pieces.piece):
        k = -2 - piece["arc"]
        control, weights = pieces.frame[k], np.array([1, *pieces.turn[k], 1])

        def point(u, control=control, weights=weights):
            basis = weights * np.array([(1 - u) ** 3, 3 * u * (1 - u) ** 2, 3 * u**2 * (1 - u), u**3])
            return basis @ control / basis.sum()

        span = piece["x1"] - piece["x0"]
        for part in (0.3, 0.7):
            u = piece["x0"] + part * span
            tangent = point(u + 1e-6) - point(u - 1e-6)
            across = np.array([-tangent[1], tangent[0], 0.0]) / np.linalg.norm(tangent)
            for side in (0.5, -0.5):
                q = point(u) + side * across
                radius = np.linalg.norm(point(u) - q) + 1e-6
                beyond = lambda v, q=q, radius=radius: float(np.linalg.norm(point(v) - q) - radius)  # noqa: E731
                ends = [brentq(beyond, u, u + way * 0.25 * span, xtol=1e-13) for way in (-1, 1)]
                low, high, _ = part_within(pieces, i, q, radius)
                width = ends[1] - ends[0]
                assert piece["x0"] + low * span == pytest.approx(ends[0], abs=0.01 * width)
                assert piece["x0"] + high * span == pytest.approx(ends[1], abs=0.01 * width)
                seen += 1
    assert seen >= 8


def test_pieces_turn_by_little() -> None:
    pieces = program_pieces(toolpath())
    u = np.linspace(0, 1, 9)
    for piece in pieces.piece:
        k = -2 - piece["arc"]
        x = piece["x0"] + (piece["x1"] - piece["x0"]) * u
        basis = np.stack([(1 - x) ** 3, 3 * x * (1 - x) ** 2, 3 * x**2 * (1 - x), x**3], axis=1)
        basis *= np.array([1, *pieces.turn[k], 1])
        t = np.diff(basis @ pieces.frame[k] / basis.sum(axis=1)[:, None], axis=0)
        t /= np.linalg.norm(t, axis=1)[:, None]
        assert np.arccos(np.clip(t[0] @ t[-1], -1, 1)) < PIECE_ANGLE
    assert CURVE_TURN < 1.0


def test_a_motion_along_the_curve_passes_and_has_no_contour_error() -> None:
    verdict = judge(run_along(), toolpath())
    assert verdict.passed, verdict.faults
    assert (
        verdict.contour_error_mm <= 1.001 * chord_error(sample(run_along(), M.dt)) + 1e-9
    )  # between samples
    assert verdict.limits["acceleration.x"].ratio < 1.0


@pytest.mark.parametrize("aside", [0.6, 0.99])
def test_a_motion_beside_the_curve_is_measured(aside: float) -> None:
    verdict = judge(run_along(aside=aside * M.tolerance), toolpath())
    assert verdict.passed, verdict.faults
    assert verdict.contour_error_mm == pytest.approx(aside * M.tolerance, rel=1e-3)


def test_a_motion_that_leaves_the_curve_is_refused() -> None:
    text = fault(judge(run_along(aside=1.02 * M.tolerance), toolpath()), "contour")
    assert "line 2" in text


@pytest.mark.slow
def test_a_motion_along_the_chord_is_refused() -> None:
    def chord(s):
        zero = np.zeros((len(s), 3))
        step = CONTROL[3] - CONTROL[0]
        return s[:, None] * step, zero + step, zero, zero

    assert not judge(along(1.0, chord, rest_to_rest(1.0, 1.0, 2.0, 4.0)), toolpath()).passed


def test_a_motion_that_ends_before_the_curve_is_refused() -> None:
    assert not judge(run_along(last=0.9), toolpath()).passed
    assert not judge(run_along(first=0.1), toolpath()).passed


def test_a_closed_curve_cannot_be_left_out() -> None:
    text = "G21 F3000\nG6.2 P4 K0 X0 Y0\nK0 X20 Y0\nK0 X0 Y20\nK0 X0 Y0\nK1\nK1\nK1\nK1\nG1 X-5 Y0\nM2\n"
    closed = toolpath_from_program(parse_program(text.encode()), M)

    def straight_on(s):
        zero = np.zeros((len(s), 3))
        step = np.array([-5.0, 0, 0])
        return s[:, None] * step, zero + step, zero, zero

    verdict = judge(along(1.0, straight_on, rest_to_rest(1.0, 1.0, 2.0, 4.0)), closed)
    assert not verdict.passed
