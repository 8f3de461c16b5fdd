"""Threads: motions in step with the spindle between run-in and run-out pass; others are named, with how far they are off."""

from __future__ import annotations

import numpy as np
import pytest
from judging import M, fault, judge
from motions import along, rest_to_rest

from benchmarks.jobs import problems
from planner.geometry.build import toolpath_from_program
from planner.geometry.run_in import run_in
from planner.machine import Fir, Mode
from planner.nc.reader import parse_program
from planner.planning.job.choice import IN_STEP, thread_remedy
from planner.planning.methods.registry import plan
from planner.verifier.spindle_sync import room_of

LENGTH, FEED = 30.0, 25.0


def toolpath():
    """One thread along z."""
    return toolpath_from_program(parse_program(f"G21 G90 M3 S{60 * FEED}\nG33 Z-{LENGTH} K1\nM2"), M)


def down(speed: float, wave: float = 0.0):
    """A motion down the thread that reaches `speed`, times 1 - `wave` in its middle."""
    law = rest_to_rest(LENGTH, speed, 2000.0, 2e5)

    def curve(s):
        zero = np.zeros_like(s)
        return tuple(np.stack([zero, zero, -part], axis=1) for part in (s, zero + 1, zero, zero))

    if not wave:
        return along(LENGTH, curve, law)

    def bent(s):
        """The speed is off by `wave` at most, in a wave from 10 to 20 mm."""
        k, inside = 2 * np.pi / 10.0, wave * ((s > 10.0) & (s < 20.0))
        u, zero = k * (s - 10.0), np.zeros_like(s)
        parts = (
            s - inside * (1 - np.cos(u)) / k,
            1 - inside * np.sin(u),
            -inside * k * np.cos(u),
            inside * k**2 * np.sin(u),
        )
        return tuple(np.stack([zero, zero, -part], axis=1) for part in parts)

    return along(LENGTH, bent, law)


def threads(verdict):
    return [text for text in verdict.sentences if text.startswith("thread")]


def test_a_thread_at_its_feed_passes() -> None:
    assert not threads(judge(down(FEED), toolpath()))


@pytest.mark.shows("threads", "sampled: motions out of step are named")
@pytest.mark.parametrize("share", [0.5, 0.9, 0.99, 0.999])
def test_a_thread_below_its_feed_falls_out_of_step(share: float) -> None:
    """At the share q of the feed the tool is (1/q - 1) l behind at the end of the stretch l, half of it about the mean."""
    verdict = judge(down(share * FEED), toolpath())
    stretch = LENGTH - 2 * 1.02 * run_in(toolpath(), M)[0]
    off = 0.5 * (1 / share - 1) * stretch
    if off < 0.05:
        assert not threads(verdict)
        return
    said = fault(verdict, "thread")
    assert float(said.split()[1]) == pytest.approx(off, rel=0.01)
    assert said.endswith("line 2")


def test_the_verdict_has_a_field_for_threads() -> None:
    """Nobody has to read its sentences."""
    (kept,) = judge(down(FEED), toolpath()).threads
    assert (kept.line, kept.feed, kept.allowed_mm, kept.broken) == (2, FEED, 0.05, False)
    verdict = judge(down(0.9 * FEED), toolpath())
    (lost,) = verdict.threads
    assert lost.broken
    assert str(lost.fault()) in verdict.sentences
    assert verdict.summary()["thread_error_mm"] == lost.error_mm == pytest.approx(lost.ratio * 0.05)
    straight = toolpath_from_program(parse_program(f"G21 G90 F1500\nG1 Z-{LENGTH}\nM2"), M)
    assert judge(down(FEED), straight).threads == ()
    assert "thread_error_mm" not in judge(down(FEED), straight).summary()


def test_a_thread_whose_speed_wavers_falls_out_of_step() -> None:
    """By wave / k with the wave number k."""
    said = fault(judge(down(FEED, 0.1), toolpath()), "thread")
    assert float(said.split()[1]) == pytest.approx(0.1 * 10 / (2 * np.pi), rel=0.01)
    assert not threads(judge(down(FEED, 0.01), toolpath()))


def test_the_verifier_finds_the_same_run_in_as_the_planner() -> None:
    for feed in (1.0, 10.0, 40.0):
        text = f"G21 G90 M3 S{60 * feed}\nG33 X-5 Z-20 K1\nG33 Z-60 K1\nM2"
        path = toolpath_from_program(parse_program(text), M)
        held = np.flatnonzero(path.held)
        np.testing.assert_allclose(room_of(path, M, held), run_in(path, M)[held], rtol=1e-12)


@pytest.mark.parametrize("method", ["kinematic", "bezier", "fir", "stop", "optimal"])
def test_before_filters_a_thread_is_run_into_as_fast_as_the_machine_can(method):
    """Found by the campaign of random jobs: two methods accelerated only as much as filters round a full stop within the tolerance."""
    machine = problems.machine(
        velocity=600.0,
        acceleration=6e4,
        jerk=2e7,
        tolerance=0.0034,
        dt=0.002,
        fir=Fir(time_constants=(0.011,)),
    )
    text = "G21 G18 S8000 M3\nG0 X0 Z5\nG33 Z-30 K1.5\nG0 X5\nG0 Z5\nM2\n"
    made = plan(parse_program(text, machine), machine, method=method)
    assert made.verdict.passed, made.verdict.faults


def test_a_thread_that_cannot_be_kept_in_step_is_not_delivered():
    """Found by the campaign of random jobs: motions 20 mm out of step, with a verdict that failed."""
    machine = problems.machine(
        velocity=600.0, acceleration=6e4, jerk=2e7, tolerance=0.0034, dt=0.002, modes=(Mode(frequency=30.0),)
    )
    text = "G21 G18 S8000 M3\nG0 X0 Z5\nG33 Z-30 K1.5\nG0 X5\nG0 Z5\nM2\n"
    made = plan(parse_program(text, machine), machine, effort="quick", shaped=True)
    assert made.trajectory is None
    assert made.sentence.startswith("thread: ")
    assert made.sentence.endswith("plan threads without --shaped")
    assert plan(parse_program(text, machine), machine, effort="quick").verdict.passed
    made = plan(parse_program(text, machine), machine, method="fir")
    assert made.sentence.endswith("plan threads by method optimal or kinematic")
    assert plan(parse_program(text, machine), machine, method="kinematic").verdict.passed


def test_the_remedy_is_never_the_method_that_was_asked() -> None:
    made = plan(parse_program(f"G21 G90 M3 S{60 * FEED}\nG33 Z-{LENGTH} K1\nM2"), M, method="kinematic")
    assert IN_STEP == ("optimal", "kinematic")
    assert thread_remedy(made.method, shaped=False) == "plan threads by method optimal"
