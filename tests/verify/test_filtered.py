"""What the machine's filters make of a motion (planner/verify/filtered.py), against convolutions with the kernel itself."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from benchmarks import problems
from planner.fir.filters import Filters
from planner.machine import Fir
from planner.methods.registry import plan
from planner.verify import filtered as module
from planner.verify import verify
from planner.verify.filtered import filtered, motion_of_samples

FILTERS = [(0.01,), (0.01, 0.004), (0.013, 0.02), (0.0073, 0.011, 0.0251)]


def smooth(t):
    """A motion at rest until 0 and from 0.2 s on, with jumps of its jerk at both, and its velocity."""
    x = np.clip(t / 0.2, 0.0, 1.0)
    place = np.stack([50.0 * x**3 * (10 - 15 * x + 6 * x**2), 1e3 + 20.0 * x**2 * (3 - 2 * x)], axis=1)
    speed = np.stack([50.0 * 30 * x**2 * (1 - x) ** 2, 20.0 * 6 * x * (1 - x)], axis=1) / 0.2
    return place, speed


def by_quadrature(t, lengths):
    """The mean of `smooth` over the last Td with the kernel's step response as weight."""
    filters = Filters(tuple(lengths))
    ages = np.linspace(0.0, filters.delay, 20_001)
    weight = np.diff(filters.step(ages))
    middle = (ages[1:] + ages[:-1]) / 2
    return np.array([weight @ smooth(at - middle)[0] for at in t])


@pytest.mark.parametrize("lengths", FILTERS)
def test_it_is_the_mean_of_the_last_delay(lengths):
    t, p = (np.concatenate(column) for column in zip(*filtered(smooth, 0.2, lengths, 0.001), strict=True))
    assert t[0] == 0.0
    assert t[-1] >= 0.2 + sum(lengths)
    some = np.arange(0, len(t), 97)
    np.testing.assert_allclose(
        p[some], by_quadrature(t[some], lengths), atol=2e-6
    )  # the quadrature's own error
    np.testing.assert_allclose(p[-1], smooth(np.array([0.2]))[0][0], atol=1e-9)


def test_chunks_join(monkeypatch):
    """A chunk of few times makes the same motion as one of all; and 27 hours into a motion no digit is lost."""
    whole = np.concatenate([p for _, p in filtered(smooth, 0.2, (0.01, 0.004), 0.001)])
    monkeypatch.setattr(module, "CHUNK", 37)
    np.testing.assert_allclose(
        np.concatenate([p for _, p in filtered(smooth, 0.2, (0.01, 0.004), 0.001)]), whole, atol=1e-10
    )


def test_samples_are_enough_for_files_from_elsewhere():
    t = np.arange(0.0, 0.2005, 0.001)
    made = plan(problems.pentagon(), problems.machine(), method="stop")
    from_samples = verify(
        made.trajectory, made.toolpath, problems.machine(fir=Fir(time_constants=(0.02, 0.013)))
    ).after_filters
    asked = plan(
        problems.pentagon(), problems.machine(fir=Fir(time_constants=(0.02, 0.013))), method="stop"
    ).verdict.after_filters
    assert from_samples.vertex_error_mm == pytest.approx(asked.vertex_error_mm, abs=2e-5)
    assert from_samples.contour_error_mm == pytest.approx(asked.contour_error_mm, abs=2e-5)
    place, _ = motion_of_samples(made.trajectory)(t)
    inside = made.trajectory.t <= 0.2
    np.testing.assert_allclose(place[: inside.sum()], made.trajectory.position[inside], atol=1e-6)


def test_a_motion_that_leaves_the_tolerance_behind_the_filters_fails():
    """50 and 30 ms take 126 um off a stop of 2000 mm/s2: the setpoints are right, the verdict is not to pass."""
    made = plan(problems.pentagon(), problems.machine(), method="stop")
    assert made.verdict.passed
    assert made.verdict.after_filters is None
    for fir, passes in ((Fir(time_constants=(0.01, 0.004)), True), (Fir(time_constants=(0.05, 0.03)), False)):
        judged = verify(made.trajectory, made.toolpath, problems.machine(fir=fir))
        assert judged.passed == passes
        assert any("after the filters" in fault for fault in judged.faults) != passes
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
    assert any("after the filters" in fault for fault in judged.faults)
