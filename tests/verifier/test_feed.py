"""F holds, block by block: the feed is that of the block on which the motion is, whatever the tolerance and the period."""

import dataclasses

import numpy as np
import pytest
from motions import Moves, along, chain, helix, machine, polyline, rest_to_rest, sample, stay

import planner
from planner.machine import Axis, load_machine
from planner.nc.reader import parse_program
from planner.verifier import Given, verify

A, J = 2000.0, 2e5
POSITIONS = Given(columns=())


def ramp(machine, feeds, ends):
    """(duration, motion) along x through `ends` [mm] at `feeds` [mm/s], each kept exactly; speeds change at half the acceleration, in
    the faster block."""
    top = 0.5 * A
    times, places, speeds, pushes = [0.0], [0.0], [0.0], []
    bounds = [0.0, *feeds, 0.0]
    x = 0.0
    for k, (feed, end) in enumerate(zip(feeds, ends, strict=True)):
        begin_v = min(bounds[k], feed)
        end_v = min(bounds[k + 2], feed)
        up, down = (feed**2 - begin_v**2) / (2 * top), (feed**2 - end_v**2) / (2 * top)
        assert up + down <= end - x, "too short for its feed"
        for way, v0, v1 in ((up, begin_v, feed), (end - x - up - down, feed, feed), (down, feed, end_v)):
            lasts = 2 * way / (v0 + v1)
            if lasts > 0:
                times.append(times[-1] + lasts)
                pushes.append((v1 - v0) / lasts)
                places.append(places[-1] + way)
                speeds.append(v1)
        x = end
    times, places, speeds, pushes = map(np.array, (times, places, speeds, pushes))

    def at(t):
        k = np.clip(np.searchsorted(times, t, side="right") - 1, 0, len(pushes) - 1)
        dt = np.clip(t, 0, times[-1]) - times[k]
        out = np.zeros((4, len(t), 3))
        out[0, :, 0] = places[k] + dt * (speeds[k] + dt * pushes[k] / 2)
        out[1, :, 0] = speeds[k] + dt * pushes[k]
        out[2, :, 0] = pushes[k]
        return tuple(out)

    return times[-1], at


def shifted(motion, later):
    """The same motion `later` seconds after t = 0, at rest before: other phases of the samples."""
    duration, at = motion
    return duration + later, lambda t: at(np.maximum(t - later, 0.0))


def judged(motion, toolpath, machine, **more):
    given = more.pop("given", POSITIONS)
    return verify(sample(motion, machine.dt), toolpath, machine, given=given, not_limited=("jerk",), **more)


@pytest.mark.parametrize("tolerance", [0.005, 0.5, 2.0])
@pytest.mark.parametrize("dt", [0.001, 0.004])
def test_changes_of_feed_that_are_kept_pass_at_every_phase_and_tolerance(tolerance, dt):
    # oracle: a motion in closed form that has each F exactly between its vertices; no phase of the samples shows more
    m = machine(dt=dt, tolerance=tolerance, acceleration=A)
    toolpath = Moves().line(10, feed=80).line(10.5, feed=1.5).line(20, feed=80).toolpath(m)
    for phase in (0.0, 0.23, 0.61):
        verdict = judged(shifted(ramp(m, [80, 1.5, 80], [10, 10.5, 20]), phase * dt), toolpath, m)
        assert verdict.passed, verdict.faults
        assert verdict.limits["feed"].ratio == pytest.approx(1.0, abs=2e-3)


@pytest.mark.parametrize("length", [0.03, 0.07, 0.13, 0.4, 1.0])
@pytest.mark.parametrize("tolerance", [0.005, 0.5])
def test_a_slow_block_run_fast_is_found_however_short_it_is(length, tolerance):
    # at 80 mm/s a period of 1 ms is 0.08 mm long: the block of F60 lies in a chord or two; it takes length / 1 mm/s
    m = machine(tolerance=tolerance, acceleration=A)
    toolpath = Moves().line(10, feed=80).line(10 + length, feed=1.0).line(20, feed=80).toolpath(m)
    for phase in np.linspace(0.0, 0.875, 8):
        fast = shifted(ramp(m, [80], [20]), phase * m.dt)
        verdict = judged(fast, toolpath, m)
        fault = [text for text in verdict.sentences if text.startswith("feed: ")]
        assert fault, phase
        # a chord of 0.08 mm of which the share `length` is at 1 mm/s may last 0.08 / 80 + length (1 - 1/80) at least
        in_chord = min(length, 0.08)
        assert verdict.limits["feed"].ratio >= 0.45 * in_chord / 0.001


@pytest.mark.parametrize("given", [Given(), POSITIONS], ids=["columns", "positions"])
def test_too_fast_by_one_percent_just_behind_a_vertex_is_found(given):
    # inside the tolerance of 1 mm, on either side of the change
    m = machine(tolerance=1.0, acceleration=A)
    toolpath = Moves().line(10, feed=60).line(10.3, feed=10).line(20, feed=60).toolpath(m)
    right = judged(ramp(m, [60, 10, 60], [10, 10.3, 20]), toolpath, m, given=given)
    assert right.passed, right.faults
    wrong = judged(ramp(m, [60, 10.1, 60], [10, 10.3, 20]), toolpath, m, given=given)
    assert wrong.limits["feed"].ratio == pytest.approx(1.01, abs=1e-3)
    late = judged(ramp(m, [60, 10, 60], [10.1, 10.3, 20]), toolpath, m, given=given)
    assert late.limits["feed"].ratio > 1.5


def test_a_retrace_is_told_apart_from_the_way_there():
    # there at 60 mm/s, back at 5: the same places, in order
    m = machine(tolerance=0.5, acceleration=A)
    toolpath = Moves().line(4, feed=60).line(0, feed=5).line(4, feed=60).toolpath(m)
    legs = [(0.0, 4.0, 60), (4.0, 0.0, 5), (0.0, 4.0, 60)]

    def motion(feeds):
        parts = [
            polyline([(a, 0, 0), (b, 0, 0)], feed=f, acceleration=A, jerk=J)
            for (a, b, _), f in zip(legs, feeds, strict=True)
        ]
        return chain(*parts)

    assert judged(motion([60, 5, 60]), toolpath, m).passed
    assert judged(motion([60, 6, 60]), toolpath, m).limits["feed"].ratio == pytest.approx(1.2, abs=2e-3)
    assert judged(motion([5, 60, 60]), toolpath, m).limits["feed"].ratio == pytest.approx(12, rel=1e-2)


def test_a_circle_inside_the_tolerance_has_its_own_feed():
    # its start and its end are one place, and all of it is within the tolerance of every vertex
    m = machine(tolerance=0.5, acceleration=A)
    moves = Moves().line(5, feed=60)
    toolpath = moves.arc((5, 0.2), 2 * np.pi, feed=4).line(10, feed=60).toolpath(m)

    def motion(feed):
        length, curve = helix((5, 0, 0), (5, 0.2), 2 * np.pi)
        return chain(
            polyline([(0, 0, 0), (5, 0, 0)], feed=60, acceleration=A, jerk=J),
            along(length, curve, rest_to_rest(length, feed, 300.0, 1e4)),
            polyline([(5, 0, 0), (10, 0, 0)], feed=60, acceleration=A, jerk=J),
        )

    assert judged(motion(4.0), toolpath, m).passed
    assert judged(motion(5.0), toolpath, m).limits["feed"].ratio == pytest.approx(1.25, abs=1e-2)


def test_a_dwell_and_a_rapid_beside_a_slow_block_are_no_excess():
    m = machine(tolerance=0.5, acceleration=A)
    toolpath = Moves().rapid(5).dwell(0.05).line(5.2, feed=2).rapid(10).toolpath(m)
    motion = chain(
        polyline([(0, 0, 0), (5, 0, 0)], feed=95, acceleration=A, jerk=J),
        stay((5, 0, 0), 0.05),
        polyline([(5, 0, 0), (5.2, 0, 0)], feed=2, acceleration=A, jerk=J),
        polyline([(5.2, 0, 0), (10, 0, 0)], feed=95, acceleration=A, jerk=J),
    )
    verdict = judged(motion, toolpath, m)
    assert verdict.passed, verdict.faults
    assert verdict.limits["feed"].ratio == pytest.approx(1.0, abs=1e-3)


def test_blocks_of_samples_do_not_change_what_is_seen(monkeypatch):
    # what waits for the next samples waits across blocks of any length
    m = machine(tolerance=0.5, acceleration=A)
    toolpath = Moves().line(10, feed=80).line(10.05, feed=1.0).line(20, feed=80).toolpath(m)
    motion = ramp(m, [80], [20])
    whole = judged(motion, toolpath, m).limits["feed"]
    for samples in (2, 7, 64):
        monkeypatch.setattr("planner.verifier.stream.BLOCK_SAMPLES", samples)
        part = judged(motion, toolpath, m).limits["feed"]
        assert (part.ratio, part.time, part.line) == (whole.ratio, whole.time, whole.line)


def test_room_for_chords_grows_with_a_motion_that_lingers(monkeypatch):
    # many chords between vertices that are all within reach: the same with little room as with much
    m = machine(tolerance=2.0, acceleration=A)
    moves = Moves()
    for k in range(1, 41):
        moves.line(0.02 * k, feed=1.0 if k % 2 else 2.0)
    toolpath = moves.toolpath(m)
    motion = ramp(m, [1.0], [0.8])
    wide = judged(motion, toolpath, m)
    assert wide.passed, wide.faults
    monkeypatch.setattr("planner.verifier.switches.ROOM", 4)
    narrow = judged(motion, toolpath, m)
    assert narrow.limits["feed"].ratio == wide.limits["feed"].ratio


@pytest.mark.parametrize("swing", [0.0, 0.2])
def test_f_counts_x_y_and_z_alone_where_they_move_with_a_rotary_axis(swing):
    """Inside the tolerance x may not take what the rotary axis need not: of a motion at 0.8 of the feed in all axes, whose parts in x
    and in A swing against each other, x reaches 1.8 F."""
    mill, F = load_machine("mill"), 10.0
    turning = {"a": Axis(velocity=3600.0, acceleration=1e5, jerk=1e7)}
    mill = mill.model_copy(update={"axes": mill.axes | turning, "tolerance": 1.0})
    program = parse_program(f"G21 G64 P1\nG1 X20 A{np.rad2deg(40.0 / mill.radius):.9f} F{60 * F}\n", mill)
    plan = planner.plan(program, mill, method="stop")
    made = plan.trajectory
    t = made.t / 0.8
    across = np.zeros(len(made.axes))
    across[[made.axes.index("x"), made.axes.index("a")]] = np.array([2.0, -1.0]) / np.sqrt(5.0)
    rate = F / (across.max() * 0.2)
    inner = np.clip(np.minimum(t, t[-1] - t) / 0.3, 0.0, 1.0)
    position = made.position + (swing * inner * np.sin(rate * t))[:, None] * across
    moved = dataclasses.replace(made, t=t, position=position)
    verdict = verify(
        moved, plan.toolpath, mill, given=POSITIONS, not_limited=("acceleration", "jerk", "velocity")
    )
    assert verdict.limits["feed"].ratio == pytest.approx(1.8 if swing else 0.8, rel=0.02)
