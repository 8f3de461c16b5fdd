"""What the machine's filters make of setpoints (planner/verifier/filtered.py), against means of the signal between them, and beside
what the planner expects of them (planner/delivery/filtered_setpoints.py): other code of the tests, and both."""

from __future__ import annotations

import dataclasses
from itertools import product

import numpy as np
import pytest

from benchmarks.jobs import problems
from benchmarks.judge.setpoints import behind, between, trajectory_of
from planner.delivery import filtered_setpoints
from planner.delivery.filtered_setpoints import FilteredSetpoints
from planner.machine import Fir
from planner.planning.methods.registry import plan
from planner.verifier import filtered as module
from planner.verifier import verify
from planner.verifier.filtered import filtered

FILTERS = [(0.01,), (0.01, 0.004), (0.013, 0.02), (0.0073, 0.011, 0.0251)]
KINDS = ["linear", "cubic", "hold"]


def smooth(dt):
    """Setpoints dt apart of a motion from rest to rest, with jumps of its jerk at both ends."""
    t = np.arange(0.0, 0.2 + dt / 2, dt)
    x = t / 0.2
    place = np.stack([50.0 * x**3 * (10 - 15 * x + 6 * x**2), 1e3 + 20.0 * x**2 * (3 - 2 * x)], axis=1)
    speed = np.stack([50.0 * 30 * x**2 * (1 - x) ** 2, 20.0 * 6 * x * (1 - x)], axis=1) / 0.2
    return trajectory_of(t, place, speed)


class Motion:
    """Asked at its setpoints alone."""

    def __init__(self, setpoints):
        self.setpoints, self.end = setpoints, setpoints.t[-1]

    def at(self, times, dt):
        np.testing.assert_allclose(times, self.setpoints.t, atol=1e-12)
        return self.setpoints


def joined(parts):
    return (np.concatenate(column) for column in zip(*parts, strict=True))


@pytest.mark.shows("filters", "exact: means of the motion, by the judge and by the planner")
@pytest.mark.parametrize(("kind", "lengths"), list(product(KINDS, FILTERS)))
@pytest.mark.parametrize("dt", [0.001, 0.005])
def test_judge_and_planner_find_the_mean_of_the_last_delay(kind, lengths, dt):
    """With "hold" the mean that they are compared with is good to a thousandth of a step, and the judge's second filter takes cubics
    for straight lines with kinks: off by some hundredths of a step, along the way."""
    setpoints = smooth(dt)
    step = np.abs(np.diff(setpoints.position, axis=0)).max() if kind == "hold" else 0.0
    for share, parts in (
        (0.02 if len(lengths) > 1 else 1e-3, filtered(setpoints, kind, lengths, dt)),
        (1e-3, FilteredSetpoints(kind, lengths, dt).of(Motion(setpoints))),
    ):
        t, p = joined(parts)
        off = 2e-6 + share * step
        assert t[0] == 0.0
        assert t[-1] > 0.2 + sum(lengths) - 1e-12
        some = np.arange(0, len(t), 29)
        np.testing.assert_allclose(p[some], behind(setpoints, kind, lengths, t[some]), atol=off)
        np.testing.assert_allclose(p[-1], setpoints.position[-1], atol=1e-9)


@pytest.mark.parametrize(
    ("dt", "long", "short"),
    [(0.002, 0.0203, 0.0107), (0.004, 0.0203, 0.0203), (0.009, 0.0251, 0.0073), (0.01, 0.0203, 0.0107)],
)
def test_a_kink_of_the_chords_is_filtered_to_what_steps_of_a_quarter_period_and_an_eighth_filter_leave(
    dt, long, short
):
    """Two means of a ramp are differences of its double integral, v t^3/6. A jump v/T1 of the second derivative is missed by
    h^2/32 of it, and h/T2 of that is left."""
    speed, count = 100.0, round(0.1 / dt)
    t = dt * np.arange(2 * count + 1)
    begin, end = t[count // 3], t[count]

    def ramps(t, power):
        return speed * (np.maximum(t - begin, 0.0) ** power - np.maximum(t - end, 0.0) ** power)

    place = ramps(t, 1)[:, None]
    at, found = joined(filtered(trajectory_of(t, place, 0 * place), "linear", (short, long), dt))
    exact = sum(
        sign * ramps(at - back, 3) / 6 for sign, back in ((1, 0), (-1, long), (-1, short), (1, long + short))
    )
    h = min(dt / 4, short / 8)
    left = h**2 / 32 * speed / long * h / short
    assert np.abs(found[:, 0] - exact / (long * short)).max() <= left


def test_the_cubic_is_that_of_both_ends():
    """A motion of constant jerk is its own cubic; by chords it is off by a dt^2 / 8."""
    t = np.arange(0.0, 0.0501, 0.005)
    motion = trajectory_of(t, np.stack([t**3, t**2], axis=1), np.stack([3 * t**2, 2 * t], axis=1))
    fine = np.linspace(0.0, 0.05, 401)
    np.testing.assert_allclose(
        between(motion, "cubic", fine), np.stack([fine**3, fine**2], axis=1), atol=1e-15
    )
    chords = between(motion, "linear", fine)[:, 1] - fine**2
    assert chords.max() == pytest.approx(2 * 0.005**2 / 8, rel=1e-6)


def test_linuxcnc_s_interpolator_is_linear_with_two_filters_of_a_period():
    """Its way points are (x0 + 4 x1 + x2)/6 of three setpoints, with the velocities (x2 - x0)/2dt: the uniform cubic B-spline, which is
    straight lines through two moving averages of dt (src/emc/kinematics/cubic.c)."""
    dt = 0.004
    setpoints = smooth(dt)
    t, p = joined(filtered(setpoints, "linear", (dt, dt), dt))
    x = setpoints.position
    found = p[np.searchsorted(t, setpoints.t[2:] - dt / 100)]
    np.testing.assert_allclose(found, (x[:-2] + 4 * x[1:-1] + x[2:]) / 6, atol=1e-9)


@pytest.mark.parametrize("kind", KINDS)
def test_parts_join(kind, monkeypatch):
    """Parts of few times, fewer than the filters last, make the same motion as one of all, in the judge and in the planner; none is
    empty."""
    setpoints, lengths = smooth(0.001), (0.01, 0.004)
    whole = [p for _, p in (joined(parts) for parts in both(setpoints, kind, lengths))]
    monkeypatch.setattr(module, "CHUNK", 37)
    monkeypatch.setattr(filtered_setpoints, "AT_ONCE", 5)
    for one, parts in zip(whole, both(setpoints, kind, lengths), strict=True):
        places = [p for _, p in parts]
        assert all(len(p) for p in places)
        np.testing.assert_allclose(np.concatenate(places), one, atol=1e-10)


def both(setpoints, kind, lengths):
    yield filtered(setpoints, kind, lengths, 0.001)
    yield FilteredSetpoints(kind, lengths, 0.001).of(Motion(setpoints))


def test_plan_and_file_have_the_same_numbers():
    """The verdict of a plan looks behind the filters at the setpoints alone, as that on its file does."""
    fir = problems.machine(fir=Fir(time_constants=(0.02, 0.013)))
    made = plan(problems.pentagon(), fir, method="stop")
    alone, asked = verify(made.trajectory, made.toolpath, fir).after_filters, made.verdict.after_filters
    assert alone.vertex_error_mm == asked.vertex_error_mm
    assert alone.contour_error_mm == asked.contour_error_mm


def test_a_motion_that_leaves_the_tolerance_behind_the_filters_fails():
    """50 and 30 ms take 126 um off a stop of 2000 mm/s2: the setpoints are right, the verdict is not to pass."""
    made = plan(problems.pentagon(), problems.machine(), method="stop")
    assert made.verdict.passed
    assert made.verdict.after_filters is None
    for fir, passes in ((Fir(time_constants=(0.01, 0.004)), True), (Fir(time_constants=(0.05, 0.03)), False)):
        judged = verify(made.trajectory, made.toolpath, problems.machine(fir=fir))
        assert judged.passed == passes
        assert any("after the filters" in fault for fault in judged.sentences) != passes
        assert judged.summary()["vertex_error_after_filters_mm"] == judged.after_filters.vertex_error_mm
    assert judged.after_filters.vertex_error_mm == pytest.approx(0.126, abs=5e-4)
    assert judged.contour_error_mm < 1e-5


def test_a_lost_motion_has_no_number():
    made = plan(problems.pentagon(), problems.machine(), method="stop")
    half = made.trajectory
    kept = slice(0, len(half) // 2)
    names = ("t", "position", "velocity", "acceleration", "jerk", "s", "feed", "block", "line")
    cut = dataclasses.replace(half, **{name: getattr(half, name)[kept] for name in names})
    judged = verify(cut, made.toolpath, problems.machine(fir=Fir(time_constants=(0.01,))))
    assert not judged.passed
    assert any("after the filters" in fault for fault in judged.sentences)
