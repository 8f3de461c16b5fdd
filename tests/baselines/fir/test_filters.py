"""FIR filters by brute force: convolution, Fourier integrals, a simulated oscillator; and the misprints of paper 000, eq. 5 to 9."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from oracles import residual_vibration

from planner.motion.filters import (
    Filters,
    damped_period,
    lengths_from_limits,
    suppressing,
)

V = 100.0
lengths = st.lists(st.floats(1e-3, 0.2), min_size=1, max_size=5)


def convolved(signal_in, times, step):
    """Moving averages of whole numbers of steps, of a signal that is zero before."""
    out = signal_in
    for T in times:
        taps = round(T / step)
        total = np.concatenate([np.zeros(taps), np.cumsum(out)])
        out = (total[taps:] - total[:-taps]) / taps
    return out


# --- kernel, step and ramp --------------------------------------------------------------------------------------------


def printed_kernel(t, T1, T2):
    """docs/papers.md 0, row by row."""
    return np.select(
        [t < 0, t <= T2, t <= T1, t <= T1 + T2], [0.0, t / (T1 * T2), 1 / T1, (T1 + T2 - t) / (T1 * T2)], 0.0
    )


def printed_step(t, T1, T2):
    Td = T1 + T2
    rows = [0.0, t**2 / (2 * T1 * T2), (2 * t - T2) / (2 * T1), 1 - (Td - t) ** 2 / (2 * T1 * T2)]
    return np.select([t < 0, t <= T2, t <= T1, t <= Td], rows, 1.0)


def printed_ramp(t, T1, T2):
    Td = T1 + T2
    rows = [
        0.0,
        t**3 / (6 * T1 * T2),
        (3 * t**2 - 3 * T2 * t + T2**2) / (6 * T1),
        t - Td / 2 + (Td - t) ** 3 / (6 * T1 * T2),
    ]
    return np.select([t < 0, t <= T2, t <= T1, t <= Td], rows, t - Td / 2)


@given(T1=st.floats(1e-3, 0.2), ratio=st.floats(0.01, 1.0))
@settings(max_examples=60)
def test_two_filters_are_the_printed_rows(T1, ratio):
    filters, T2 = Filters((T1, T1 * ratio)), T1 * ratio
    t = np.linspace(-0.1, 1.3, 700) * filters.delay
    np.testing.assert_allclose(filters.kernel(t), printed_kernel(t, T1, T2), atol=1e-9 / T1)
    np.testing.assert_allclose(filters.step(t), printed_step(t, T1, T2), atol=1e-12)
    np.testing.assert_allclose(filters.ramp(t), printed_ramp(t, T1, T2), atol=1e-12 * T1)


@given(times=lengths)
@settings(max_examples=40)
def test_step_and_ramp_integrate_the_kernel_for_any_number_of_filters(times):
    filters = Filters(tuple(times))
    t = np.linspace(0.0, filters.delay, 2001)
    middle = (t[1:] + t[:-1]) / 2
    kernel = filters.kernel(middle)
    assert (kernel >= -1e-6 * kernel.max()).all()
    step = t[1]
    np.testing.assert_allclose(
        np.diff(filters.step(t)) / step, kernel, atol=np.abs(np.diff(kernel)).max() + 1e-6 * kernel.max()
    )
    np.testing.assert_allclose(np.diff(filters.ramp(t)) / step, filters.step(middle), atol=1e-5)
    np.testing.assert_allclose(filters.step(t) + filters.step(filters.delay - t), 1.0, atol=1e-9)
    assert filters.ramp(np.array([filters.delay])) == pytest.approx(filters.delay / 2)
    mean = (middle * kernel).sum() * step
    assert mean == pytest.approx(filters.delay / 2, rel=1e-3)
    assert ((middle - mean) ** 2 * kernel).sum() * step == pytest.approx(filters.variance, rel=5e-3)


@pytest.mark.parametrize(
    "times", [(0.05,), (0.05, 0.03), (0.05, 0.03, 0.02), (0.04, 0.04), (0.03, 0.02, 0.02, 0.01)]
)
@pytest.mark.parametrize("Tv", [0.005, 0.05, 0.06, 0.2])
def test_a_pulse_of_any_length_is_its_convolution(times, Tv):
    step = 1e-5
    filters = Filters(times)
    t = np.arange(0.0, Tv + filters.delay, step)
    expected = convolved(V * (t < Tv - step / 2), times, step)
    assert np.abs(filters.pulse(t, V, Tv) - expected).max() <= 3 * V * step / min(times)
    area = filters.ramp(np.array([10.0])) - filters.ramp(np.array([10.0 - Tv]))
    assert V * area == pytest.approx(V * Tv)


def test_misprint_equation_5_holds_for_long_pulses_only():
    """The eight rows, taken for Tv > T1 > T2 as printed: right from Tv = Td on, wrong below by what docs/papers.md A1 measured."""
    T1, T2 = 0.05, 0.03
    Td = T1 + T2

    def printed(t, Tv):
        rows = [
            (t < T2, t**2 / (2 * T1 * T2)),
            (t < T1, (2 * t - T2) / (2 * T1)),
            (t < Td, 1 - (Td - t) ** 2 / (2 * T1 * T2)),
            (t < Tv, np.ones_like(t)),
            (t < Tv + T2, 1 - (t - Tv) ** 2 / (2 * T1 * T2)),
            (t < Tv + T1, 1 - (2 * (t - Tv) - T2) / (2 * T1)),
            (t < Tv + Td, (Td + Tv - t) ** 2 / (2 * T1 * T2)),
        ]
        return V * np.select([row[0] for row in rows], [row[1] for row in rows], 0.0)

    filters = Filters((T1, T2))
    for Tv, wrong in ((0.2, 0.0), (0.08, 0.0), (0.07, 3.33), (0.06, 13.3), (0.05, 30.0), (0.005, 99.0)):
        t = np.linspace(0, Tv + Td, 20_001)
        assert np.abs(printed(t, Tv) - filters.pulse(t, V, Tv)).max() == pytest.approx(wrong, abs=0.7)


# --- spectra ----------------------------------------------------------------------------------------------------------


def test_misprint_equation_8_lacks_the_absolute_value():
    """sin(x)/x as printed is negative over 42 % of 1..600 rad/s for T = 50 ms; the magnitude never is (docs/papers.md A9)."""
    w, T = np.linspace(1.0, 600.0, 60_000), 0.05
    printed = np.sin(w * T / 2) / (w * T / 2)
    assert (printed < 0).mean() == pytest.approx(0.42, abs=0.01)
    np.testing.assert_allclose(Filters((T,)).magnitude(w), np.abs(printed), atol=1e-12)


@given(times=lengths, w=st.floats(0.0, 500.0))
@settings(max_examples=40)
def test_the_magnitude_is_the_fourier_integral_of_the_kernel(times, w):
    filters = Filters(tuple(times))
    t = np.linspace(0, filters.delay, 4001)
    middle = (t[1:] + t[:-1]) / 2
    integral = (filters.kernel(middle) * np.exp(-1j * w * middle)).sum() * t[1]
    assert filters.magnitude(np.array([w]))[0] == pytest.approx(abs(integral), abs=5e-3)


def acceleration_spectrum(t, acceleration, w):
    """|integral of a(t) exp(-i w t) dt| (W, A) [mm/s] of accelerations (T, A), with a straight between the samples."""
    h, slope = np.diff(t)[:, None], np.diff(acceleration, axis=0) / np.diff(t)[:, None]
    out = np.empty((len(w), acceleration.shape[1]))
    for n, wn in enumerate(np.asarray(w, float)):
        z = 1j * wn * h
        # integral over one period, in (a0 + slope tau): phi1 = int exp(-z x), phi2 = int x exp(-z x) over [0, 1]
        small = np.abs(z) < 1e-3  # below, the closed forms cancel; the series are good to 1e-13
        safe = np.where(small, 1.0, z)
        phi1 = np.where(small, 1 - z / 2 + z**2 / 6 - z**3 / 24, (1 - np.exp(-safe)) / safe)
        phi2 = np.where(small, 0.5 - z / 3 + z**2 / 8 - z**3 / 30, (1 - (1 + safe) * np.exp(-safe)) / safe**2)
        terms = np.exp(-1j * wn * t[:-1])[:, None] * h * (acceleration[:-1] * phi1 + slope * h * phi2)
        out[n] = np.abs(terms.sum(axis=0))
    return out


def test_misprint_equations_6_and_9_the_height_of_a_move():
    """The acceleration of a move is two Dirac impulses of h = V: its filtered spectrum is h |1 - exp(-i w Tv)| prod |sinc|.

    A finite value at one instant (eq. 6) has no spectrum at all, and without h (eq. 9) or the second impulse it would be too small
    or as large at low frequencies as at the first peak.
    """
    filters, Tv = Filters((0.05, 0.03)), 0.11
    t = np.linspace(0, Tv + filters.delay, 10_001)
    acceleration = V * (filters.kernel(t) - filters.kernel(t - Tv))
    w = np.array([0.5, 5.0, 20.0, 60.0, 100.0])
    measured = acceleration_spectrum(t, acceleration[:, None], w)[:, 0]
    move = V * np.abs(1.0 - np.exp(-1j * w * Tv)) * filters.magnitude(w)
    np.testing.assert_allclose(move, measured, rtol=1e-4)
    assert measured[0] < 0.1 * V * filters.magnitude(w)[0]


def test_the_spectrum_of_sampled_accelerations_is_exact_between_the_samples():
    """Against a sum over a thousand times as many samples of the same broken line; w h large, small and zero."""
    rng = np.random.default_rng(1)
    t = np.concatenate([[0.0], np.cumsum(rng.uniform(1e-4, 5e-3, 40))])
    a = rng.normal(size=(41, 2))
    fine = np.linspace(0, t[-1], 100_001)
    w = np.array([0.0, 1e-3, 3.0, 200.0, 3000.0])
    between = np.stack([np.interp(fine, t, column) for column in a.T], axis=1)
    weight = np.full(len(fine), fine[1])
    weight[[0, -1]] /= 2
    expected = np.abs((np.exp(-1j * np.outer(w, fine)) * weight) @ between)
    np.testing.assert_allclose(acceleration_spectrum(t, a, w), expected, rtol=1e-4, atol=1e-6)


# --- discrete filters -------------------------------------------------------------------------------------------------


def test_filters_in_discrete_time():
    """Moving averages of N_i periods: delay sum (N_i - 1)/2, variance dt^2 (sum N_i^2 - n)/12 (docs/papers.md A10), so less than the
    continuous filters' by n dt^2/12."""
    dt, counts = 1e-3, (50, 30)
    taps = np.convolve(*(np.full(N, 1.0 / N) for N in counts))
    t = np.arange(len(taps)) * dt
    mean = (taps * t).sum()
    assert mean == pytest.approx(dt * (49 + 29) / 2)
    less = Filters(tuple(N * dt for N in counts)).variance - len(counts) * dt**2 / 12
    assert (taps * (t - mean) ** 2).sum() == pytest.approx(less)


# --- vibration --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("damping", "residue"), [(0.0, 0.0), (0.01, 0.0103), (0.05, 0.0588), (0.10, 0.139)])
def test_what_a_filter_of_one_period_leaves_of_a_mode(damping, residue):
    """Equation 10: T = 2 pi/w_r is exact for an undamped mode; docs/papers.md A9 for damped ones, up to the exact damped period."""
    frequency = 25.0
    filters = Filters((1.0 / frequency,))
    assert filters.residue(frequency, damping) == pytest.approx(residue, rel=0.3, abs=1e-12)
    exact = Filters((damped_period(frequency, damping),))
    assert exact.residue(frequency, damping) == pytest.approx(residue, rel=0.3, abs=1e-12)


@pytest.mark.slow
@given(
    frequency=st.floats(5.0, 80.0),
    damping=st.floats(0.0, 0.2),
    times=st.lists(st.floats(5e-3, 0.1), min_size=2, max_size=3),
)
@settings(max_examples=15)
def test_residual_vibration_against_a_simulated_oscillator(frequency, damping, times):
    """x'' + 2 z w x' + w^2 x = -a(t): scipy's lsim, straight between the samples like ours, and its state's envelope at the end."""
    from scipy import signal  # takes a second

    filters, w = Filters(tuple(times)), 2 * np.pi * frequency
    t = np.linspace(0, 0.15 + filters.delay, 1200)
    a = V * (filters.kernel(t) - filters.kernel(t - 0.15))
    system = signal.StateSpace(
        [[0, 1], [-(w**2), -2 * damping * w]], [[0], [-1]], np.eye(2), np.zeros((2, 1))
    )
    _, state, _ = signal.lsim(system, a, t)
    x, v = state[-1]
    wd = w * np.sqrt(1 - damping**2)
    expected = np.hypot(x, (v + damping * w * x) / wd)
    found = residual_vibration(t, a[:, None], frequency, damping)[0]
    assert found == pytest.approx(expected, rel=1e-6, abs=1e-12)


@pytest.mark.parametrize("damping", [0.0, 0.02])
def test_filters_matched_to_a_mode_leave_little_of_it(damping):
    """Before and after: the same move through filters that know nothing of the mode, and through matched ones of the same delay."""
    frequency, Tv = 30.0, 0.21
    period = damped_period(frequency, damping)
    left = {}
    for name, filters in {
        "unmatched": Filters((1.5 * period, 0.5 * period)),
        "matched": Filters((period, period)),
    }.items():
        t = np.linspace(0, Tv + filters.delay, 10_001)
        a = V * (filters.kernel(t) - filters.kernel(t - Tv))
        left[name] = residual_vibration(t, a[:, None], frequency, damping)[0]
    assert left["matched"] < (0.01 if damping else 1e-5) * left["unmatched"]


@given(
    T1=st.floats(1e-3, 0.2),
    ratio=st.floats(0.05, 1.0),
    periods=st.lists(st.floats(2e-3, 0.1), min_size=1, max_size=2),
)
@settings(max_examples=80)
def test_suppressing_lengthens_to_whole_periods(T1, ratio, periods):
    T2 = T1 * ratio
    a, b = (float(T) for T in suppressing(np.array(T1), np.array(T2), tuple(periods)))
    assert a >= b
    assert a >= T1 * (1 - 1e-8)
    assert b >= T2 * (1 - 1e-8)
    for period in periods:
        assert min(abs(a / period - round(a / period)), abs(b / period - round(b / period))) < 1e-9
    # no more than a period is added to each filter that is matched, or the mode's first one
    assert a + b <= T1 + T2 + sum(periods) + 1e-12


def test_suppressing_takes_one_or_two_modes():
    with pytest.raises(ValueError, match="3 periods"):
        suppressing(np.array(0.05), np.array(0.03), (0.01, 0.02, 0.03))


# --- lengths from limits ----------------------------------------------------------------------------------------------


def test_lengths_from_limits():
    T1, T2 = lengths_from_limits(np.array(100.0), np.array(2000.0), np.array(66_667.0))
    assert (float(T1), float(T2)) == pytest.approx((0.05, 0.03), rel=1e-4)  # paper 000's filters
    T1, T2 = lengths_from_limits(np.array(10.0), np.array(2000.0), np.array(66_667.0))
    assert (
        float(T1) == float(T2) == pytest.approx(np.sqrt(10 / 66_667.0))
    )  # too slow to reach the acceleration


@given(
    theta=st.floats(0.01, 3.13),
    turn=st.floats(0.0, 6.3),
    T1=st.floats(0.01, 0.1),
    ratio=st.floats(0.05, 1.0),
    share=st.floats(0.0, 1.0),
)
@settings(max_examples=150)
def test_the_margin_of_an_isolated_corner_is_its_largest_axis_jerk(theta, turn, T1, ratio, share):
    """docs/papers.md, peaks inside the corner: the jerk of two overlapped pulses by differences, over V/(T1 T2)."""
    T2 = T1 * ratio
    Td, Tk = T1 + T2, share * (T1 + T2)
    u1 = np.array([np.cos(turn), np.sin(turn)])
    u2 = np.array([np.cos(turn + theta), np.sin(turn + theta)])
    # edges of h' of both pulses: the jerk is constant between them
    edges = np.unique(np.round([0, T2, T1, Td, Td - Tk, Td - Tk + T2, Td - Tk + T1, 2 * Td - Tk], 9))
    middle = (edges[1:] + edges[:-1]) / 2
    middle = middle[np.diff(edges) > 1e-6]

    def slope(t):
        return np.where((t > 0) & (t < T2), 1.0, np.where((t > T1) & (t < Td), -1.0, 0.0))

    jerk = -np.outer(slope(middle), u1) + np.outer(slope(middle - (Td - Tk)), u2)
    plus = np.abs(u1 + u2).max() if 0 < Tk < 2 * T2 else 0.0
    found = max(1.0, plus, np.abs(u2 - u1).max() if Tk > T1 else 0.0)
    near = min(abs(Tk - T1), abs(Tk - 2 * T2), abs(Tk - Td), Tk) < 1e-5
    if not near:  # at these the peaks come and go
        assert max(1.0, np.abs(jerk).max()) == pytest.approx(found, rel=1e-9)


@pytest.mark.parametrize("times", [(), (0.0,), (0.05, -0.01), (float("nan"),), (float("inf"), 0.1)])
def test_impossible_filters_are_refused(times):
    with pytest.raises(ValueError, match="positive and finite"):
        Filters(times)


@pytest.mark.parametrize("damping", [0.0, 0.01, 0.05, 0.2])
@pytest.mark.parametrize("times", [(0.04,), (0.037, 0.021), (0.01, 0.03, 0.015)])
def test_the_residue_is_what_the_kernel_excites_of_a_mode(damping, times):
    """x'' + 2 z w x' + w^2 x = h(t) rings after Td as after an impulse at 0, times the integral of h(t) exp(-pole t)."""
    frequency = 25.0
    w = 2.0 * np.pi * frequency
    step = 1e-6
    impulse = np.zeros(round(sum(times) / step) + 1)
    impulse[0] = 1.0
    kernel = convolved(impulse, times, step)
    t = step * (np.arange(len(kernel)) + len(times) / 2.0)  # a mean of n steps is of their middle
    wanted = abs((kernel * np.exp((damping - 1j * np.sqrt(1.0 - damping**2)) * w * t)).sum())
    assert Filters(times).residue(frequency, damping) == pytest.approx(wanted, rel=1e-4, abs=1e-4)
