"""Zero-vibration shapers: what remains of a mode, what they keep, and the motion that comes out of them."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner.machine import Mode
from planner.motion.axis_motion import AxisMotion
from planner.motion.filters import damped_period
from planner.motion.shaping import ShapedMotion, shaper_of

MODES = st.builds(Mode, frequency=st.floats(2.0, 200.0), damping=st.floats(0.0, 0.5))


def remains(shaper, mode):
    """The rest of a mode's ringing, as a fraction of the ringing without shaping [-]."""
    w = 2.0 * np.pi * mode.frequency
    pole = w * (-mode.damping + 1j * np.sqrt(1.0 - mode.damping**2))
    return abs((shaper.weight * np.exp(-pole * (shaper.delay - shaper.length))).sum())


@pytest.mark.shows("shaped", "exact: nothing remains of a mode behind its shaper")
@given(st.lists(MODES, min_size=1, max_size=3))
def test_nothing_remains_of_any_mode(modes):
    shaper = shaper_of(tuple(modes))
    assert shaper.weight.sum() == pytest.approx(1.0)
    assert shaper.length == pytest.approx(sum(damped_period(m.frequency, m.damping) for m in modes) / 2)
    assert all(remains(shaper, mode) < 1e-9 * np.exp(60 * mode.damping) for mode in modes)


def test_another_frequency_rings():
    shaper = shaper_of((Mode(frequency=18.0),))
    assert remains(shaper, Mode(frequency=20.0)) > 0.15
    assert remains(shaper_of(()), Mode(frequency=18.0)) == pytest.approx(1.0)


def test_the_papers_moving_average_is_this_shaper_and_a_shorter_average():
    """T = 2 pi/w of paper 000, eq. 10: the same zero; twice the delay, 4/3 of the variance."""
    shaper, period = shaper_of((Mode(frequency=18.0),)), 1.0 / 18.0
    w = np.linspace(1.0, 600.0, 50)
    copies = (shaper.weight[:, None] * np.exp(-1j * np.outer(shaper.delay, w))).sum(axis=0)
    average = [(1 - np.exp(-1j * w * T)) / (1j * w * T) for T in (period, period / 2)]
    assert copies * average[1] == pytest.approx(average[0])
    variance = shaper.weight @ (shaper.delay - shaper.middle) ** 2
    assert period**2 / 12 == pytest.approx(4 / 3 * variance)


def hop(jerk: float = 2e4) -> AxisMotion:
    """From rest to rest in eight equal phases of jerk, on two axes."""
    h, signs = 0.02, np.array([1.0, 0.0, -1.0, 0.0, -1.0, 0.0, 1.0])
    state = np.zeros((len(signs) + 1, 3))
    for n, sign in enumerate(signs):
        p, v, a = state[n]
        j = sign * jerk
        state[n + 1] = p + h * (v + h * (a / 2 + h * j / 6)), v + h * (a + h * j / 2), a + h * j
    both = np.array([1.0, -0.5])
    return AxisMotion(
        axes=("x", "y"), t=h * np.arange(len(signs)), position=state[:-1, :1] * both, velocity=state[:-1, 1:2] * both,
        acceleration=state[:-1, 2:] * both, jerk=jerk * signs[:, None] * both,
        block=np.arange(len(signs)), line=np.arange(1, len(signs) + 1), end=h * len(signs),
    )  # fmt: skip


def test_the_shaped_motion_is_the_mean_of_its_copies():
    motion, shaper = hop(), shaper_of((Mode(frequency=18.0, damping=0.03), Mode(frequency=31.0)))
    shaped = ShapedMotion(motion, shaper)
    times = np.sort(np.random.default_rng(5).uniform(0.0, shaped.end, 400))
    seen = shaped.at(times, 1e-3)
    fine = np.linspace(-0.2, 0.4, 600_001)
    there = motion.at(np.clip(fine, 0, motion.end)[(fine >= 0) & (fine <= motion.end)], 1e-3).position
    padded = np.concatenate(
        [
            np.repeat(there[:1], (fine < 0).sum(), 0),
            there,
            np.repeat(there[-1:], (fine > motion.end).sum(), 0),
        ]
    )
    for axis in range(2):
        mean = sum(
            A * np.interp(times - t, fine, padded[:, axis])
            for A, t in zip(shaper.weight, shaper.delay, strict=True)
        )
        assert seen.position[:, axis] == pytest.approx(mean, abs=1e-7)
    slope = np.gradient(seen.position[:, 0], times)[5:-5]
    assert seen.velocity[5:-5, 0] == pytest.approx(slope, abs=0.05 * seen.velocity.max())
    for name in ("velocity", "acceleration", "jerk"):
        given_ = getattr(motion.at(np.linspace(0, motion.end, 3000), 1e-3), name)
        assert np.abs(getattr(seen, name)).max() <= np.abs(given_).max() * (1 + 1e-12)


def test_it_begins_and_ends_at_rest_where_the_motion_does():
    motion = hop()
    shaped = ShapedMotion(motion, shaper_of((Mode(frequency=25.0),)))
    ends = shaped.at(np.array([0.0, shaped.end]), 1e-3)
    last = motion.at(np.array([motion.end]), 1e-3)
    assert shaped.end == pytest.approx(motion.end + 0.02)
    assert ends.position[1] == pytest.approx(last.position[0])
    assert not ends.position[0].any()
    assert not ends.velocity.any()
    assert (np.diff(shaped.t) > 0).all()
    assert shaped.t[0] == 0.0


def test_times_next_to_each_other_may_be_one_after_a_delay():
    motion, shaper = hop(), shaper_of((Mode(frequency=18.0, damping=0.03),))
    times = np.random.default_rng(0).uniform(0.05, 0.1, 10_000)
    after = np.nextafter(times, 1.0)
    one = np.flatnonzero(times - shaper.delay[1] == after - shaper.delay[1])
    assert len(one)
    seen = ShapedMotion(motion, shaper).at(np.array([times[one[0]], after[one[0]]]), 1e-3)
    assert seen.position[1] == pytest.approx(seen.position[0], abs=1e-9)
