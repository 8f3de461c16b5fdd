"""Where the path turns right back the tolerance asks for the vertex, not for rest: v = 0 along the way, a free."""

import numpy as np
import pytest

import planner
from planner.machine import Machine
from planner.nc.reader import parse_program

MILL = planner.load_machine("mill")
HEAD = "G21 G90 G64 P0.03 F{feed}\nG0 X0 Y0\n"


def planned(points, machine: Machine = MILL, feed: float = 5400.0, **more):
    moves = "\n".join(f"G1 X{x:.7f} Y{y:.7f}" for x, y in points)
    made = planner.plan(parse_program(HEAD.format(feed=feed) + moves + "\nM2\n"), machine, **more)
    assert made.verdict.passed, made.verdict.faults
    return made


def zigzag(degrees: float, length: float = 3.0, lines: int = 6):
    """Lines that turn by so much, to the left and to the right in turn."""
    heading = np.deg2rad(degrees) * (np.arange(lines) % 2)
    return np.cumsum(length * np.stack([np.cos(heading), np.sin(heading)], axis=1), axis=0)


@pytest.mark.shows("reversals", "sampled: the time hardly depends on the angle")
@pytest.mark.parametrize(("less", "more"), [(174.9, 175.1), (179.99, 180.0)])
def test_the_time_hardly_depends_on_the_angle(less, more):
    """On both sides of the angle at which fixed paths rest, and at a retrace."""
    times = [planned(zigzag(degrees)).cycle_time for degrees in (less, more)]
    assert times[1] == pytest.approx(times[0], rel=1e-3)


def test_a_retrace_is_no_slower_than_one_that_turns_at_its_largest_acceleration():
    """From rest to x = D, where it turns with all its jerk behind it, and back to rest: D is 47/24 j r^3 of the
    time r of a phase, and takes 7 r; D is so short here that no other limit is reached."""
    jerk, length = float(MILL.axes["x"].jerk), 0.4
    r = np.cbrt(24.0 / 47.0 * length / jerk)
    assert jerk * r < MILL.axes["x"].acceleration
    made = planned([(length, 0.0), (0.0, 0.0)])
    assert made.cycle_time <= 7.0 * r
    assert made.cycle_time < 0.85 * made.stop_time


def test_methods_on_a_fixed_path_rest_there():
    """The program does not ask for it: it is what their paths need."""
    for method in ("stop", "kinematic", "fir", "bezier"):
        made = planned(zigzag(180.0, lines=3), method=method)
        assert made.cycle_time == pytest.approx(made.stop_time, rel=1e-2 if method == "fir" else 1e-6)


def test_a_feed_as_fast_as_the_only_axis_is_searched():
    """One of both limits is enough, and one has to stay: along one axis they are the same."""
    feed = 60.0 * float(MILL.axes["x"].velocity)
    same, more = (
        planned([(60.0, 0.0), (0.0, 0.0), (60.0, 0.0)], feed=f).cycle_time for f in (feed, 1.01 * feed)
    )
    assert same == pytest.approx(more, rel=1e-4)


def test_feeds_that_change_where_it_turns_back_are_kept():
    text = HEAD.format(feed=3000) + "G1 X2 F3000\nX0 F600\nX2 F3000\nX0 F600\nM2\n"
    made = planner.plan(parse_program(text), MILL)
    assert made.verdict.passed, made.verdict.faults
    slow = 2 * (2.0 - 2 * 0.03) / 10.0
    assert slow < made.cycle_time < made.stop_time


@pytest.mark.parametrize("off", [0.0, 0.01], ids=["along the line", "beside it"])
def test_a_leg_back_that_one_place_is_within_the_tolerance_of_costs_nothing(off):
    """Of both its ends, so that the motion goes straight on while the place that it belongs to stays there."""
    straight, back = (
        planned(points).cycle_time for points in ([(15.0, off)], [(8.0, 0.0), (7.985, off), (15.0, off)])
    )
    assert back == pytest.approx(straight, rel=2e-4)
