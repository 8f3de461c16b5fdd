"""Motions that begin and end in motion: against closed forms, backwards, in halves, and as the judge sees them."""

import numpy as np
import pytest
from typer.testing import CliRunner

import planner
from planner.commands.app import app
from planner.controls.export.program import write_program
from planner.controls.export.tables import Table, write_stream, write_table
from planner.motion.pulses import pulses_of
from planner.report.trajectory_file import write_pulses

MILL = planner.load_machine("mill")
FEED = 100.0
LEGS = np.array([[0.0, 0.0], [30.0, 4.0], [32.0, 30.0], [70.0, 24.0]])


def planned(points, machine=MILL, **ends):
    return planner.plan(planner.path(points, FEED, **ends), machine, effort="quick")


def ramp(change):
    """Time to change the speed along x by so much from no acceleration to none [s]."""
    x = MILL.axes["x"]
    return (
        change / x.acceleration + x.acceleration / x.jerk
        if change > x.acceleration**2 / x.jerk
        else 2.0 * np.sqrt(change / x.jerk)
    )


@pytest.mark.parametrize(("start", "end"), [(0.0, 40.0), (25.0, 0.0), (60.0, 80.0), (FEED, FEED)])
def test_along_a_line_the_time_is_that_of_its_ramps(start, end):
    plan = planned([[0, 0], [60, 0]], start_speed=start, end_speed=end)
    ramps = [(ramp(FEED - v), v) for v in (start, end)]
    length = sum(t * (FEED + v) / 2.0 for t, v in ramps)
    wanted = sum(t for t, _ in ramps) + (60.0 - length) / FEED
    assert plan.cycle_time == pytest.approx(wanted, rel=5e-4)  # in long steps
    assert plan.trajectory.velocity[[0, -1], 0] == pytest.approx([start, end], rel=1e-5)
    assert not plan.trajectory.acceleration[[0, -1]].round(6).any()


def test_backwards_it_takes_as_long():
    there = planned(LEGS, start_speed=70.0, end_speed=20.0)
    back = planned(LEGS[::-1], start_speed=20.0, end_speed=70.0)
    assert there.verdict.passed
    assert back.verdict.passed
    assert back.cycle_time == pytest.approx(there.cycle_time, rel=2e-4)


@pytest.mark.parametrize("ends", [{"start_speed": 40.0}, {"end_speed": 40.0}])
@pytest.mark.parametrize("control", ["linuxcnc-stream", "pvt", "twincat", "linuxcnc"])
def test_it_is_not_exported_to_what_starts_from_rest(ends, control, tmp_path):
    planned(LEGS, **ends).save(tmp_path / "plan")
    asked = ["export", str(tmp_path / "plan"), "--for", control, "-o", str(tmp_path / "out")]
    result = CliRunner().invoke(app, asked)
    assert result.exit_code == 2
    assert "begins or ends in motion" in result.stderr
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("ends", [{}, {"start_speed": 40.0}, {"end_speed": 40.0}])
def test_whoever_writes_files_of_it_is_refused(ends, tmp_path):
    plan = planned(LEGS, **ends)
    motion, written = plan.trajectory, tmp_path / "pulses.csv"
    trains = pulses_of(motion, {"x": 400.0, "y": 400.0})
    for write in (
        lambda: write_program(tmp_path, plan, "grbl", 0.02),
        lambda: write_stream(tmp_path, motion),
        lambda: write_table(tmp_path, motion, Table()),
        lambda: write_pulses(written, trains, {}),
    ):
        if not ends:
            write()
            continue
        with pytest.raises(planner.InputError, match="begins or ends in motion"):
            write()
    assert written.exists() == (not ends)


def test_to_begin_in_motion_takes_less_time_the_faster_it_is():
    times = [planned(LEGS, start_speed=v).cycle_time for v in (0.0, 30.0, 60.0, 90.0)]
    assert np.all(np.diff(times) < 0.0)


@pytest.mark.parametrize("share", [0.35, 0.5, 0.85])
def test_two_halves_take_no_less_than_the_whole_and_join_to_a_motion_that_passes(share):
    whole = planned(LEGS)
    cut = LEGS[1] + share * (LEGS[2] - LEGS[1])
    moving = whole.trajectory
    at = np.argmin(np.linalg.norm(moving.position[:, :2] - cut, axis=1))
    speed = float(np.linalg.norm(moving.velocity[at]))
    first = planned(np.vstack([LEGS[:2], cut]), end_speed=speed)
    second = planned(np.vstack([cut, LEGS[2:]]), start_speed=speed)
    halves = first.cycle_time + second.cycle_time
    assert halves >= whole.cycle_time * (1.0 - 2e-4)
    assert halves <= whole.cycle_time * 1.01  # of what no acceleration at the cut costs
    pieces = first.trajectory, second.trajectory
    t = np.append(pieces[0].t, pieces[1].t[1:] + first.cycle_time)
    q = np.vstack([pieces[0].position, pieces[1].position[1:]])
    judged = planner.verify(t, q, planner.path(LEGS, FEED), MILL)
    assert judged.passed, judged.faults


def test_where_the_whole_runs_at_its_feed_two_halves_take_as_long():
    line = [[0, 0], [40, 0], [80, 0]]
    halves = planned(line[:2], end_speed=FEED).cycle_time + planned(line[1:], start_speed=FEED).cycle_time
    assert halves == pytest.approx(planned([line[0], line[2]]).cycle_time, rel=5e-4)


@pytest.mark.parametrize("name", ["start", "end"])
def test_the_judge_wants_the_speed_that_was_asked_for_and_rest_elsewhere(name):
    asked, rest = planned(LEGS, **{f"{name}_speed": 50.0}), planned(LEGS)
    at_rest, in_motion = planner.path(LEGS, FEED), planner.path(LEGS, FEED, **{f"{name}_speed": 50.0})
    other = planner.path(LEGS, FEED, **{f"{name}_speed": 49.0})

    def faults(plan, program):
        found = planner.verify(plan.trajectory.t, plan.trajectory.position, program, MILL)
        return {fault.name for fault in found.faults}

    assert not faults(asked, in_motion)
    assert not faults(rest, at_rest)
    assert name in faults(asked, at_rest)
    assert name in faults(rest, in_motion)
    assert name in faults(asked, other)


def test_a_path_too_short_for_its_speed_says_how_fast_it_can_be():
    plan = planned([[0, 0], [1, 0]], start_speed=90.0)
    assert not plan.solved
    assert "cannot be left so fast" in plan.sentence
    less = float(plan.sentence.rpartition("less than ")[2].split()[0])
    most = np.cbrt(MILL.axes["x"].jerk)  # v sqrt(v/j), the way to rest with jerk -j and then j, is 1 mm
    assert most < less < 90.0
    assert planned([[0, 0], [1, 0]], start_speed=0.99 * most).verdict.passed
    assert not planned(
        [[0, 0], [1, 0]], start_speed=1.05 * most
    ).solved  # within the tolerance it may overshoot


@pytest.mark.parametrize(
    ("ends", "said"),
    [
        ({"start_speed": 101.0}, "the feed there allows 100 mm/s"),
        ({"end_speed": -1.0}, "0 mm/s or more"),
        ({"end_speed": np.inf}, "finite"),
    ],
)
def test_speeds_that_cannot_be_are_refused(ends, said):
    with pytest.raises(planner.InputError, match=said):
        planned(LEGS, **ends)


def test_a_speed_above_that_of_an_axis_names_it_and_what_is_possible():
    fast = planner.path([[0, 0], [200, 0]], 1e4, start_speed=2.0 * MILL.axes["x"].velocity)
    with pytest.raises(planner.InputError, match=f"the axis X allows {MILL.axes['x'].velocity:g} mm/s"):
        planner.plan(fast, MILL)


def test_a_rapid_has_no_speed_to_begin_with_and_other_methods_begin_at_rest():
    with pytest.raises(planner.InputError, match="need a feed"):
        planner.path(LEGS, start_speed=10.0)
    with pytest.raises(planner.InputError, match="methods optimal and second-order"):
        planner.plan(planner.path(LEGS, FEED, start_speed=10.0), MILL, method="kinematic")


def test_second_order_splines_and_turning_axes_begin_in_motion_too():
    curve = planner.path(LEGS, FEED, spline=True, start_speed=60.0, end_speed=30.0)
    bare = planner.plan(curve, MILL, method="second-order", effort="quick")
    full = planner.plan(curve, MILL, effort="quick")
    assert bare.verdict.passed
    assert full.verdict.passed
    assert bare.cycle_time < full.cycle_time


def test_saved_and_read_again_it_is_judged_as_it_was(tmp_path):
    plan = planned(LEGS, start_speed=50.0, end_speed=30.0)
    plan.save(tmp_path)
    again = planner.read_program(tmp_path / "program.json")
    assert again.speeds == (50.0, 30.0)
