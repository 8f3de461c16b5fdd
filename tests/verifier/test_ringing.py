"""Vibration modes under a motion: the recursion against an integrated oscillator, closed forms, the planner's own function."""

from __future__ import annotations

import dataclasses
import itertools
import time

import numpy as np
import pytest
from oracles import residual_vibration
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicHermiteSpline

from benchmarks.jobs import problems
from planner.machine import Mode
from planner.motion.trajectory import Trajectory
from planner.planning.methods.registry import plan
from planner.verifier.ringing import ringing_of

AMPLITUDE, PULSE = 2000.0, 0.05  # [mm/s2], [s]: to and fro, at rest in the end


def machine(*modes: Mode):
    return problems.machine(modes=modes)


def motion(dt: float, end: float = 0.23) -> Trajectory:
    """One axis that accelerates by half a sine and brakes by another; the second axis stands."""
    t = np.append(np.arange(0.0, end, dt), end)
    w = np.pi / PULSE
    t1 = np.clip(t, 0.0, PULSE), np.clip(t - 2 * PULSE, 0.0, PULSE)
    a = AMPLITUDE * (np.sin(w * t1[0]) - np.sin(w * t1[1]))
    v = AMPLITUDE / w * ((1 - np.cos(w * t1[0])) - (1 - np.cos(w * t1[1])))
    p = AMPLITUDE / w * ((t1[0] - np.sin(w * t1[0]) / w) - (t1[1] - np.sin(w * t1[1]) / w))
    p = p + 2 * AMPLITUDE / w * (np.clip(t, PULSE, None) - PULSE - np.clip(t - 3 * PULSE, 0.0, None))
    both = [np.column_stack([column, np.zeros_like(t)]) for column in (p, v, a, np.zeros_like(t))]
    return Trajectory(
        axes=("x", "y"), dt=dt, t=t, position=both[0], velocity=both[1], acceleration=both[2], jerk=both[3],
        s=p, feed=v, block=np.zeros(len(t), int), line=np.ones(len(t), int),
    )  # fmt: skip


def integrated(frequency: float, damping: float, end: float) -> tuple[float, float]:
    """Largest deflection and amplitude at the end, by a general integrator."""
    w = 2 * np.pi * frequency
    turn, phase = w * np.sqrt(1 - damping**2), np.pi / PULSE

    def slope(t: float, state: np.ndarray) -> list[float]:
        inside = np.sin(phase * t) * (t < PULSE) - np.sin(phase * (t - 2 * PULSE)) * (
            2 * PULSE < t < 3 * PULSE
        )
        return [state[1], -2 * damping * w * state[1] - w * w * state[0] - AMPLITUDE * inside]

    found = solve_ivp(slope, (0, end), [0.0, 0.0], rtol=1e-9, atol=1e-12, max_step=1e-3, dense_output=True)
    y, speed = found.y[:, -1]
    most = np.abs(found.sol(np.linspace(0, end, 20001))[0]).max()
    return float(most), float(np.hypot(y, (speed + damping * w * y) / turn))


@pytest.mark.shows("shaped", "sampled: an integrated oscillator under the motions")
@pytest.mark.parametrize(("frequency", "damping"), [(7.0, 0.0), (18.0, 0.02), (45.0, 0.2), (160.0, 0.05)])
def test_ringing_is_that_of_an_integrated_oscillator(frequency, damping):
    (found,) = ringing_of(motion(0.001), machine(Mode(frequency=frequency, damping=damping)))
    most, after = integrated(frequency, damping, 0.23)
    assert found.during[0] == pytest.approx(most, rel=6e-3)
    assert found.after[0] == pytest.approx(after, rel=1e-3, abs=1e-7)
    assert found.after[1] == found.during[1] == 0.0


def test_a_slow_motion_bends_a_stiff_mode_by_its_acceleration():
    """y = -a/w^2 where the mode is far above the motion."""
    (found,) = ringing_of(motion(0.001), machine(Mode(frequency=400.0, damping=0.1)))
    assert found.during[0] == pytest.approx(AMPLITUDE / (2 * np.pi * 400.0) ** 2, rel=0.01)


@pytest.mark.parametrize("dt", [0.001, 0.004])
def test_coarse_samples_ring_like_fine_ones(dt):
    mode = machine(Mode(frequency=18.0, damping=0.01))
    (coarse,), (fine,) = ringing_of(motion(dt), mode), ringing_of(motion(1e-4), mode)
    assert coarse.after[0] == pytest.approx(fine.after[0], rel=2e-4)


def test_every_method_says_what_it_leaves():
    """The pentagon on a machine that rings at 18 Hz: the planner's own function, of the accelerations, finds the same."""
    shaken = problems.machine(modes=(Mode(frequency=18.0),))
    made = plan(problems.all_jobs()["pentagon"], shaken, method="stop")
    (found,) = made.verdict.ringing
    expected = residual_vibration(made.trajectory.t, made.trajectory.acceleration, 18.0, 0.0)
    assert found.after == pytest.approx(expected, rel=0.01)
    assert found.after.max() > 0.1
    assert made.verdict.summary()["ringing"][0]["after"]["x"] == found.after[0]


@pytest.mark.parametrize("damping", [0.0, 0.05])
def test_modes_that_turn_often_in_a_period_are_bounded(damping):
    """A mode of 200 rad and more in a period: its bound holds, and is near, beside the same cubics at ten times as many samples."""
    coarse = motion(0.01)
    fine_t = np.unique(np.concatenate([np.linspace(a, b, 11) for a, b in itertools.pairwise(coarse.t)]))
    cubic = CubicHermiteSpline(coarse.t, coarse.position, coarse.velocity)
    still = np.zeros((len(fine_t), 2))
    fine = dataclasses.replace(
        coarse, dt=0.001, t=fine_t, position=cubic(fine_t), velocity=cubic(fine_t, 1), acceleration=still,
        jerk=still, s=fine_t, feed=np.zeros(len(fine_t)), block=np.zeros(len(fine_t), int), line=np.ones(len(fine_t), int),
    )  # fmt: skip
    fast = machine(Mode(frequency=4000.0, damping=damping))
    (bounded,), (stepped,) = ringing_of(coarse, fast), ringing_of(fine, fast)
    assert stepped.during[0] * (1 - 5e-3) <= bounded.during[0] <= stepped.during[0] * (1.01 + 4 * damping)
    assert bounded.after[0] == pytest.approx(stepped.after[0], rel=1e-3, abs=1e-12)


def test_a_mode_of_gigahertz_takes_no_time():
    """Found by benchmarks/fuzz, in settings of Klipper: a second's motion was shaken for minutes."""
    began = time.process_time()
    (ringing,) = ringing_of(motion(0.001), machine(Mode(frequency=3.6e9, damping=0.1)))
    assert np.isfinite(ringing.during).all()
    assert time.process_time() - began < 5.0
