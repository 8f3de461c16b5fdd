"""The filtered command against brute force, at any gaps, speeds and lengths; and after hours as exact as at the start."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from guides import guide_through, machine_of, overlapping
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.baselines.fir.command import VelocityPulses, command_of
from planner.baselines.fir.guide import guide_of_legs
from planner.baselines.fir.slow_down import make
from planner.baselines.fir.superpose import superpose
from planner.geometry.build import toolpath_from_program
from planner.motion.filters import Filters
from planner.nc.reader import parse_program
from planner.planning.methods.fir import motion_of

MACHINE = machine_of(velocity=1e5)


def by_superposition(command, run, t):
    """Position, velocity, acceleration (3, n, A+1) at local times t, one edge after the other."""
    low, high = command.first[run], command.first[run + 1]
    filters = Filters((command.T1[run], command.T2[run]))
    w = np.vstack([np.zeros(command.velocity.shape[1]), command.velocity[low:high]])
    out = np.zeros((3, len(t), w.shape[1]))
    out[0] = command.position[low]
    for edge, step in zip(command.t[low:high], np.diff(w, axis=0), strict=True):
        for row, response in enumerate((filters.ramp, filters.step, filters.kernel)):
            out[row] += np.outer(response(t - edge), step)
    return out


legs = st.lists(
    st.tuples(st.floats(0.01, 100.0), st.floats(1.0, 300.0), st.floats(0.0, 0.3), st.floats(0.0, 6.28)),
    min_size=1,
    max_size=12,
)


@pytest.mark.shows("fir", "exact: the filtered command by brute force")
@pytest.mark.slow
@given(legs=legs, T1=st.floats(2e-3, 0.1), ratio=st.floats(0.05, 1.0))
@settings(max_examples=30)
def test_pieces_are_the_superposition_of_the_edges(legs, T1, ratio):
    """Lengths, speeds, gaps and directions as they come: short pulses, long gaps, none."""
    length, speed, gap, turn = (np.array(column) for column in zip(*legs, strict=True))
    steps = np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1) * length[:, None]
    guide = guide_through(np.vstack([np.zeros(3), np.cumsum(steps, axis=0)]), MACHINE, speed)
    pulses = VelocityPulses(leg=np.arange(len(guide)), length=guide.length, speed=guide.feed)
    gaps = np.append(gap, 0.1)[: len(guide) + 1] * guide.inner
    ones = np.ones(guide.runs)
    command = command_of(guide, pulses, gaps, T1 * ones, T1 * ratio * ones)
    pieces = superpose(command)
    for k in range(guide.runs):
        at = slice(pieces.first[k], pieces.first[k + 1])
        t = pieces.t[at] - command.begin[k]
        expected = by_superposition(command, k, t)
        size = speed.max()
        np.testing.assert_allclose(pieces.state[0, at], expected[0], atol=1e-10 * size)
        np.testing.assert_allclose(pieces.state[1, at], expected[1], atol=1e-10 * size)
        np.testing.assert_allclose(pieces.state[2, at], expected[2], atol=1e-10 * size / (T1 * ratio))
        # pieces join: what one ends with, the next begins with
        h = np.diff(t)[:, None]
        p, v, a, j = pieces.state[:, at][:, :-1]
        np.testing.assert_allclose(p + h * (v + h * (a / 2 + h * j / 6)), pieces.state[0, at][1:], atol=1e-9)
        np.testing.assert_allclose(a + h * j, pieces.state[2, at][1:], atol=1e-8 * size / (T1**2 * ratio))


def test_edges_that_close_within_rounding_lose_nothing():
    """Found by the campaign of random jobs: of a piece of 0.3 ps that was left out the change of the acceleration was left out, too; 42
    ms later the motion jumped by 1.6e-9 mm, in which a verdict saw 1.0005 of the jerk."""
    T1, T2, speed = 0.04, 3e-4, 50.0
    lasting = np.array([T1 + 3e-13, 0.2])  # the first leg ends when its first edge leaves T1
    x = np.append(0.0, np.cumsum(speed * lasting))
    guide = guide_through(np.stack([x, 0 * x, 0 * x], axis=1) * [[1, 0, 0]], MACHINE, [speed, 2 * speed])
    pulses = VelocityPulses(leg=np.arange(2), length=guide.length, speed=np.array([speed, 2 * speed]))
    command = command_of(guide, pulses, np.zeros(len(guide) + 1), T1 * np.ones(1), T2 * np.ones(1))
    pieces = superpose(command)
    h = np.diff(pieces.t)[:, None]
    assert h.min() > 1e-12
    p, v, a, j = pieces.state[:, :-1]
    np.testing.assert_allclose(p + h * (v + h * (a / 2 + h * j / 6)), pieces.state[0, 1:], rtol=0, atol=1e-13)
    np.testing.assert_allclose(v + h * (a + h * j / 2), pieces.state[1, 1:], rtol=0, atol=1e-11)


def test_the_universal_identity():
    """|a| <= 2 V/T1 and |j| <= 4 V/(T1 T2), both attained by zig-zags without gap (docs/papers.md G7: 119 and 70 ms, T1 = 50, T2 =
    30)."""
    T1, T2, V = 0.05, 0.03, 100.0
    machine = machine_of(velocity=1e4, acceleration=V / T1, jerk=V / (T1 * T2))
    for duration, quantity, peak in ((0.119, "acceleration", 2.0), (0.070, "jerk", 4.0)):
        up = np.arange(13) * duration * V * np.sin(1e-4)
        across = np.where(np.arange(13) % 2, duration * V, 0.0) * np.cos(1e-4)
        guide = guide_through(np.stack([across, up, 0 * up], axis=1), machine)
        assert (
            not guide.inner.any()
        )  # a fixed path rests at reversals; here they are run through all the same
        through = dataclasses.replace(guide, first=np.array([0, 12]), dwell=np.zeros(2))
        pulses = VelocityPulses(leg=np.arange(12), length=guide.length, speed=guide.feed)
        command = command_of(through, pulses, np.zeros(13), np.array([T1]), np.array([T2]))
        pieces = superpose(command)
        row = ("position", "velocity", "acceleration", "jerk").index(quantity)
        seen = np.abs(pieces.state[row, :, 0]).max() / (
            V / T1 if quantity == "acceleration" else V / (T1 * T2)
        )
        assert seen == pytest.approx(peak, rel=1e-3)


def test_nothing_adds_up_over_a_long_program():
    """20,000 short legs and long ones between: at the end the motion is where the program ends, to rounding."""
    rng = np.random.default_rng(3)
    length = np.where(np.arange(20_000) % 500 == 0, 5000.0, 0.05)
    turn = np.cumsum(rng.normal(0, 0.2, 20_000))
    steps = np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1) * length[:, None]
    guide = guide_through(np.vstack([np.zeros(3), np.cumsum(steps, axis=0)]), MACHINE, 20.0)
    made = make(overlapping(guide, 0.09, 0.06, 0.03), MACHINE)
    motion = motion_of(guide, made.motion)
    end = motion.at(np.array([motion.end]), 1.0)
    assert motion.end > 10_000
    np.testing.assert_allclose(end.position[0], guide.point[-1], atol=2e-9)
    p, v, a, j = made.motion.state
    assert np.abs(v[-1]).max() < 20.0
    h = np.diff(made.motion.t)[:, None]
    onward = p[:-1] + h * (v[:-1] + h * (a[:-1] / 2 + h * j[:-1] / 6))
    assert np.abs(onward - p[1:]).max() < 5e-9


def test_dwells_and_full_stops():
    program = parse_program("G21 G64 P0.01 F6000\nG4 P0.5\nG1 X10\nG4 P1\nY10\nG61.1\nX20\nG4 P0.25\nM2\n")
    machine = machine_of()
    guide = guide_of_legs(toolpath_from_program(program, machine), machine)
    np.testing.assert_allclose(guide.dwell, [0.5, 1.0, 0.25])  # the exact stop comes after the corner at Y10
    made = make(overlapping(guide, 0.0, 0.05, 0.03), machine)
    motion = motion_of(guide, made.motion)
    assert made.command.begin[0] == 0.5
    assert motion.end == pytest.approx(1.75 + guide.length.sum() / 100.0 + len(guide) * 0.08)
    rest = made.motion.state[1, made.motion.t >= motion.end - 0.25 - 1e-9]
    assert not rest.any()
