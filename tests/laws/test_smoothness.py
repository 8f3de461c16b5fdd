"""Where time does not depend on it, jerk is small and the motion stays near the path; `smooth` trades time for jerk."""

from __future__ import annotations

import numpy as np
import pytest

import planner
from planner.joint import step_limits

# 80 chords of a sine at a feed that the axes keep all along.
FEED = 30.0  # [mm/s]
AT = 0.98 * FEED
X = np.linspace(0.0, 40.0, 81)
WAVE = f"G21 G90 G64 P0.02\nF{60 * FEED:g}\n" + "\n".join(
    f"G1 X{x:.3f} Y{2.0 * np.sin(x / 5.0):.3f}" for x in X[1:]
)
# Rapids up from a pocket and across: x has nothing to do on the way up.
RETRACT = "G21 G90 G64 P0.02\nF6000\nG1 Y15\nG0 Z9\nG0 X30\nM2\n"


def planned(text: str, **settings: float) -> planner.Plan:
    made = planner.plan(planner.read_program(text=text + "\nM2\n"), "mill", **settings).require()
    assert made.verdict.passed
    return made


def rms_jerk(plan: planner.Plan, least: float = 0.0) -> float:
    """Of the samples that are so fast at least [mm/s3]."""
    seen = plan.trajectory
    at = seen.feed >= least
    return float(np.sqrt((seen.jerk[at] ** 2).mean()))


@pytest.mark.shows("smoothness", "sampled: on chosen jobs")
def test_at_the_feed_jerk_is_small_for_no_time(monkeypatch: pytest.MonkeyPatch):
    """Against a search that does not mind it: a quarter less jerk, at less than 1e-4 of the time."""
    smooth = planned(WAVE)
    monkeypatch.setattr(step_limits, "SMOOTH_AT_FEED", 0.0)
    monkeypatch.setattr(step_limits, "SMOOTH", 0.0)
    rough = planned(WAVE)
    assert rms_jerk(smooth, AT) <= 0.75 * rms_jerk(rough, AT)
    assert smooth.cycle_time <= rough.cycle_time * (1.0 + 1e-4)


def test_a_rapid_straight_up_stays_on_its_line(monkeypatch: pytest.MonkeyPatch):
    """On the first half of the way up x winds up by a few micrometres; without the pull to the leg by most of the tolerance."""

    def aside(plan: planner.Plan) -> float:
        seen = plan.trajectory
        z = seen.position[:, 2]
        return float(np.ptp(seen.position[(z > 0.05) & (z < 4.5), 0]))

    near = planned(RETRACT)
    monkeypatch.setattr(step_limits, "CENTRE", 0.0)
    free = planned(RETRACT)
    assert aside(near) < 0.3 * aside(free)
    assert near.cycle_time <= free.cycle_time * (1.0 + 1e-4)


@pytest.mark.shows("smoothness", "sampled: on chosen jobs")
def test_smooth_trades_time_for_jerk():
    plans = [planned(RETRACT, smooth=weight) for weight in (0.0, 0.03, 0.3)]
    times, jerks = [one.cycle_time for one in plans], [rms_jerk(one) for one in plans]
    assert times == sorted(times)
    assert jerks == sorted(jerks, reverse=True)
    assert jerks[-1] < 0.9 * jerks[0]
    assert times[-1] < 1.1 * times[0]


def test_smooth_without_the_joint_search_is_said():
    made = planned(RETRACT, smooth=0.1, geometry="spline")
    assert any("smooth has no effect" in note for note in made.notes)


def test_the_pull_to_the_path_costs_no_time():
    """Circles at the feed: time is what the tolerance saves, 5e-4 of it; the pull leaves a quarter of its weight at most."""
    radius, feed, tolerance = 20.0, 20.0, 0.01

    def lasting(turns: int) -> float:
        text = f"G21 G90 G64 P{tolerance}\nF{60 * feed:g}\n" + f"G2 X0 Y0 I{radius} J0\n" * turns
        return planned(text).cycle_time

    least = 2.0 * 2.0 * np.pi * (radius - tolerance) / feed
    assert least * (1.0 - 1e-5) <= lasting(3) - lasting(1) <= least * (1.0 + 1e-4)
