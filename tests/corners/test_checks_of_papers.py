"""Numerical checks of docs/papers.md that nothing else repeats, by brute force: sums of pulses, moving averages, quadrature, search."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import minimize_scalar
from scipy.special import ellipe, ellipk

from planner.baselines.fir.rules import corner_error
from planner.motion.filters import Filters

V, T1, T2 = 100.0, 0.050, 0.030
Td = T1 + T2
FILTERS = Filters((T1, T2))
A, TS, EPS = 1e4, 0.004, 0.05  # paper 002's setting
STEP = 1e-5  # of brute force [s]


def direction(angle: float) -> np.ndarray:
    return np.array([np.cos(angle), np.sin(angle)])


def averaged(signal: np.ndarray, taps: int) -> np.ndarray:
    """Moving average over the last `taps` samples; before the first, the first stands."""
    padded = np.concatenate([np.repeat(signal[:1], taps, axis=0), signal])
    total = np.cumsum(padded, axis=0)
    return (total[taps:] - total[:-taps]) / taps


def overlapped(turns: list[float], lengths: list[float], overlap: list[float], t: np.ndarray) -> np.ndarray:
    """(n, 2) motion of pulses through both filters, each begun `overlap` before those before it are over."""
    angles, start = np.cumsum([0.0, *turns]), 0.0
    at = np.zeros((len(t), 2))
    for k, (angle, length) in enumerate(zip(angles, lengths, strict=True)):
        lasting = length / V
        at += (V * (FILTERS.ramp(t - start) - FILTERS.ramp(t - start - lasting)))[:, None] * direction(angle)
        start += lasting + Td - (overlap[k] if k < len(overlap) else 0.0)
    return at


def pair(turn: float, d: float, w: np.ndarray) -> np.ndarray:
    """(n, 2) paper 002's pair as the one cubic that it is, its vertex at 0."""
    return -d * (1 - w[:, None]) ** 3 * direction(0.0) + d * w[:, None] ** 3 * direction(turn)


@pytest.mark.parametrize("lasting", [0.005, 0.015, 0.02, 0.03, 0.05, 0.06, 0.075, 0.08, 0.2])
def test_the_peaks_of_a_short_move(lasting: float) -> None:
    """docs/papers.md A2: velocity, acceleration and jerk of one pulse, also below Td."""
    t = np.arange(-0.001, lasting + Td + 0.001, STEP)
    v = averaged(averaged(np.where((t >= 0) & (t < lasting), V, 0.0), round(T1 / STEP)), round(T2 / STEP))
    a, j = np.diff(v) / STEP, np.diff(v, 2) / STEP**2
    peak = V
    if lasting < Td:
        peak = V * (1 - (Td - lasting) ** 2 / (4 * T1 * T2)) if lasting >= T1 - T2 else V * lasting / T1
    assert v.max() == pytest.approx(peak, rel=2e-3)
    assert np.abs(a).max() == pytest.approx(V / T1 * min(1.0, lasting / T2), rel=2e-3)
    twice = abs(lasting - T1) < T2 - STEP
    assert np.abs(j).max() * T1 * T2 / V == pytest.approx(2.0 if twice else 1.0, rel=1e-3)


@pytest.mark.parametrize("degrees", [5, 30, 60, 90, 120, 150, 175])
@pytest.mark.parametrize("overlap", [0.02, 0.045, 0.08])
def test_the_vertex_error_is_the_distance_of_the_legs_from_the_motion(degrees: float, overlap: float) -> None:
    """docs/papers.md H1: eps is the largest distance of a point of the polyline from the motion."""
    turn, leg = np.deg2rad(degrees), 20.0
    start = leg / V + Td - overlap
    t = np.linspace(start - 0.15, start + overlap + 0.15, 12_001)
    path = overlapped([turn], [leg, leg], [overlap], t)
    along = np.linspace(0.0, 4.0, 101)[:, None]
    vertex = leg * direction(0.0)
    legs = np.vstack([vertex - along * direction(0.0), vertex + along * direction(turn)])
    chord = np.diff(path, axis=0)
    off = legs[:, None] - path[None, :-1]
    share = np.clip((off * chord).sum(axis=2) / (chord**2).sum(axis=1), 0.0, 1.0)
    apart = np.linalg.norm(off - share[..., None] * chord, axis=2).min(axis=1)
    eps = float(corner_error(np.array(overlap), V, np.sin(turn / 2), np.array(T1), np.array(T2)))
    assert apart.max() == pytest.approx(eps, rel=1e-3)


@pytest.mark.parametrize("overlap", [0.03, 0.05, 0.07])
@pytest.mark.parametrize("share", [0.2, 0.5, 0.9])
def test_eq_14_over_estimates_where_a_neighbour_is_near(overlap: float, share: float) -> None:
    """docs/papers.md A7: the middle leg is shorter than half an overlap; blends of two corners do not touch (condition 2)."""
    middle = V * share * overlap / 2
    other = max(0.0, min(overlap, middle / V + Td - overlap))
    first = 20.0
    t = np.linspace(0.0, 0.8, 80_001)
    for turns in ([1.2, 0.9], [1.2, -0.9]):
        path = overlapped(turns, [first, middle, first], [overlap, other], t)
        missed = np.linalg.norm(path - first * direction(0.0), axis=1).min()
        eps = float(corner_error(np.array(overlap), V, np.sin(0.6), np.array(T1), np.array(T2)))
        assert missed <= eps * (1 + 1e-6)


def test_a_chain_of_corners_without_dwell() -> None:
    """docs/papers.md A8: the filters' error is a sum of psi over the corners; the largest psi and its integral."""
    turns, lasting = [0.4, -1.1, 2.0, 0.3], [0.09, 0.013, 0.04, 0.027, 0.12]
    u = np.array([direction(angle) for angle in np.cumsum([0.0, *turns])])
    begun = np.concatenate([[0.0], np.cumsum(lasting)])
    t = np.arange(0.0, begun[-1], STEP)
    leg = np.searchsorted(begun, t, side="right") - 1
    at = np.concatenate([[np.zeros(2)], np.cumsum(V * np.array(lasting)[:, None] * u, axis=0)])
    p = at[leg] + V * (t - begun[leg])[:, None] * u[leg]
    q = averaged(averaged(p, round(T1 / STEP)), round(T2 / STEP))

    def psi(t: np.ndarray) -> np.ndarray:
        return FILTERS.ramp(t) - np.maximum(t - Td / 2, 0.0)

    summed = sum(V * psi(t - begun[k + 1])[:, None] * (u[k + 1] - u[k]) for k in range(len(turns)))
    delayed = np.stack([np.interp(t - Td / 2, t, p[:, k]) for k in range(2)], axis=1)
    settled = t > Td
    assert np.abs((q - delayed - summed)[settled]).max() < 3e-3  # of 0.4 mm; a step of brute force is 1e-3 mm
    fine = np.linspace(0.0, Td, 80_001)
    assert psi(fine).max() == pytest.approx((3 * T1**2 + T2**2) / (24 * T1), rel=1e-6)
    assert np.trapezoid(psi(fine), fine) == pytest.approx((T1**2 + T2**2) / 24, rel=1e-6)
    assert psi(fine).min() >= -1e-15


@pytest.mark.parametrize("degrees", [1, 10, 45, 90, 120, 150, 175])
def test_the_length_of_the_pair(degrees: float) -> None:
    """docs/papers.md C2: by complete elliptic integrals, against quadrature."""
    turn = np.deg2rad(degrees)

    def speed(w: float) -> float:
        return 3.0 * float(np.linalg.norm((1 - w) ** 2 * direction(0.0) + w**2 * direction(turn)))

    m, sec = np.sin(turn / 2) ** 2, 1 / np.cos(turn / 2) ** 2
    closed = 2 * sec + ellipk(m) - (2 * sec - 1) * ellipe(m)
    assert closed == pytest.approx(quad(speed, 0.0, 1.0, points=[0.5], epsabs=1e-12)[0], rel=1e-9)


def test_torsion_at_the_end_of_a_rational_cubic() -> None:
    """docs/papers.md C8: tau(1) = sigma1 sigma2 tau_polynomial(1), for any points and weights."""
    rng = np.random.default_rng(8)
    for _ in range(20):
        points, w = rng.normal(size=(4, 3)), rng.uniform(0.3, 3.0, 4)
        sigma = w[0] * w[2] / w[1] ** 2 * (w[1] * w[3] / w[2] ** 2)
        assert torsion(points, w) == pytest.approx(sigma * torsion(points, np.ones(4)), rel=1e-9)


def torsion(points: np.ndarray, w: np.ndarray) -> float:
    """At the end of the curve, by derivatives of numerator and denominator."""
    top = power_basis(w[:, None] * points)
    below = power_basis(w[:, None])
    n = [sum(np.prod(range(i, i - k, -1)) * top[i] for i in range(k, 4)) for k in range(4)]
    d = [float(sum(np.prod(range(i, i - k, -1)) * below[i, 0] for i in range(k, 4))) for k in range(4)]
    r = [n[0] / d[0]]
    r.append((n[1] - d[1] * r[0]) / d[0])
    r.append((n[2] - 2 * d[1] * r[1] - d[2] * r[0]) / d[0])
    r.append((n[3] - 3 * d[1] * r[2] - 3 * d[2] * r[1] - d[3] * r[0]) / d[0])
    cross = np.cross(r[1], r[2])
    return float(cross @ r[3] / (cross @ cross))


def power_basis(points: np.ndarray) -> np.ndarray:
    """(4, A) coefficients of 1, t, t^2, t^3 of a cubic Bezier."""
    return np.array([[1, 0, 0, 0], [-3, 3, 0, 0], [3, -6, 3, 0], [-1, 3, -3, 1]]) @ points


@pytest.mark.parametrize(("degrees", "chord"), [(90, 0.01875), (120, 0.0125)])
def test_the_allocation_with_the_formula_of_chord_lengths(degrees: float, chord: float) -> None:
    """docs/papers.md D4: with eq. 19's exact form the best share depends on the angle."""
    K = 2 / 3 * np.tan(np.deg2rad(degrees) / 2) ** 2

    def slowness(e: float) -> float:
        kappa = K / (EPS - e)
        return -min(np.sqrt(A / kappa), 2 / TS * np.sqrt(max(2 * e / kappa - e**2, 0.0)))

    tried = np.linspace(1e-4, EPS - 1e-4, 2001)
    best = tried[np.argmin([slowness(e) for e in tried])]
    found = minimize_scalar(
        slowness, bounds=(best - 1e-4, best + 1e-4), method="bounded", options={"xatol": 1e-9}
    )
    assert found.x == pytest.approx(chord, abs=1e-5)


@pytest.mark.parametrize("filters", [(0.004, 0.002), (0.02, 0.01), (0.05, 0.03)])
@pytest.mark.parametrize("degrees", [30, 90, 150])
def test_the_bound_on_what_filters_add_at_a_corner(filters: tuple[float, float], degrees: float) -> None:
    """docs/papers.md D7: at constant speed through the pair the error is below both bounds."""
    turn, d, speed = np.deg2rad(degrees), 0.3, 20.0
    w = np.linspace(0.0, 1.0, 200_001)
    curve = pair(turn, d, w)
    length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(curve, axis=0), axis=1))])
    s = np.arange(-speed * 0.2, length[-1] + speed * 0.2, speed * STEP)
    p = np.stack([np.interp(s, length, curve[:, k]) for k in range(2)], axis=1)
    p += np.minimum(s, 0.0)[:, None] * direction(0.0)
    p += np.maximum(s - length[-1], 0.0)[:, None] * direction(turn)
    one, two = (round(T / STEP) for T in filters)
    q = averaged(averaged(p, one), two)
    delay = (one + two - 2) // 2
    error = np.linalg.norm(q[delay:] - p[: len(p) - delay], axis=1)[one + two : -one - two].max()
    half, (a, b) = np.sin(turn / 2), filters
    kappa = 8 * half / (3 * d * np.cos(turn / 2) ** 2)
    normal = speed**2 * kappa * (a**2 + b**2) / 24
    corner = speed * half * (3 * a**2 + b**2) / (12 * a)
    assert error <= min(normal, corner) * (1 + 1e-3) + 2 * speed * STEP


@pytest.mark.parametrize(
    ("degrees", "largest"), [(48.5, 0.0170), (73.7, 0.0160), (90, 0.0151), (120, 0.0125), (150, 0.0080)]
)
def test_the_real_chord_error_at_the_speed_of_eq_20(degrees: float, largest: float) -> None:
    """docs/papers.md D8: of a period that lies evenly about the joint, below the 0.02 mm that the allocation gives it."""
    turn = np.deg2rad(degrees)
    half, eps_ap = np.sin(turn / 2), 0.03
    d, kappa = 4 * eps_ap / half, 2 / 3 * np.tan(turn / 2) ** 2 / eps_ap
    step = np.sqrt(A / kappa) * TS
    w = np.linspace(0.0, 1.0, 40_001)
    curve = pair(turn, d, w)
    length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(curve, axis=0), axis=1))])
    s = np.linspace(-step, length[-1] + step, 40_001)
    p = np.stack([np.interp(s, length, curve[:, k]) for k in range(2)], axis=1)
    p += np.minimum(s, 0.0)[:, None] * direction(0.0)
    p += np.maximum(s - length[-1], 0.0)[:, None] * direction(turn)
    near = np.abs(s - length[-1] / 2) <= step / 2
    off = p[near] - p[near][0]
    chord = off[-1]
    across = np.abs(off[:, 0] * chord[1] - off[:, 1] * chord[0]) / np.linalg.norm(chord)
    assert across.max() == pytest.approx(largest, abs=1e-4)
