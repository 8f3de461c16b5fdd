"""Every limit of the planner against the judge's own code, on a circle: the speed at which the limit's object says that it is used up
is the speed at which the judge, who sees positions over time and shares no code with it, finds the ratio 1."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import numpy as np
import pytest
from judging import judge
from motions import Moves, along, chain, helix, rest_to_rest, sample, straight
from motions import machine as machine_with

from benchmarks.judge.setpoints import trajectory_of
from planner import JointLimit, PathLimit
from planner.corners.bezier import BezierCorner
from planner.corners.smooth import round_corners
from planner.feedrate.constraints.assemble import user_inside
from planner.feedrate.constraints.built_in import JUMP
from planner.feedrate.constraints.limit import RowPoint
from planner.feedrate.constraints.limits import (
    JERK,
    LIMITS,
    POWER,
    ROWS,
    TANGENTIAL,
    TANGENTIAL_JERK,
    Limits,
)
from planner.feedrate.constraints.on_grid import OnGrid
from planner.feedrate.sampling.samples import sample_path
from planner.motion.limits_used import ratios
from planner.verifier import verify
from planner.verifier.excess import Kind
from planner.verifier.filtered import filtered
from planner.verifier.given import Given

RADIUS, TURNS, ARC = 10.0, 3, 0.4 * np.pi
PROGRAMMED = 80.0  # [mm/s]
FIR = {"time_constants": [0.02, 0.008], "phase_lag_max": 4.0}
ROOT = Path(__file__).resolve().parent.parent.parent
FINE = 1e-4  # resolution of the grids [-]; the tolerance of the tests is ten times that
CLOSE = 1e-3


class Along(PathLimit):
    """60 mm/s along the path."""

    name = "along"

    def velocity(self, at):
        return 60.0


class Belt(JointLimit):
    """A drive that turns once for 5 mm of x - y."""

    name, unit = "belt", "rad"
    velocity = 70.0

    def joint(self, at):
        return 2.0 * np.pi / 5.0 * (at.x - at.y)


def circle():
    """The program of the circle."""
    return Moves((RADIUS, 0.0, 0.0)).arc((0.0, 0.0), 2.0 * np.pi * TURNS, feed=PROGRAMMED)


def on_grid(toolpath, machine) -> OnGrid:
    """The path as limits see it, on a fine grid."""
    path = round_corners(toolpath, machine, BezierCorner())
    return OnGrid(sample_path(path, machine, FINE, third_order=True), machine)


def at_speed(curve, speed):
    """A curve of `helix` or `straight` at a constant speed."""
    length, at = curve
    return along(length, at, (length / speed, lambda t: (speed * t, speed + 0 * t, 0 * t, 0 * t)))


def steady(speed):
    """Round the circle at a constant speed."""
    return at_speed(helix((RADIUS, 0.0, 0.0), (0.0, 0.0), 2.0 * np.pi * TURNS), speed)


def capped(limit, grid) -> float:
    """The speed at which the limit's caps or rows are used up along the circle [mm/s]."""
    found = [cap.feed_sq for cap in limit.at_points(grid)]
    found += [cap.feed_sq for side in grid.sides() for cap in limit.on_side(side, grid.machine)]
    if not found:  # rows, at a constant speed: of order n they go with the n-th power of the speed
        samples, nothing = grid.samples, np.zeros(len(grid.samples))
        for k, largest in enumerate(limit.of(grid.machine, grid.axes)):
            one = RowPoint(
                samples.d1[:, k],
                samples.d2_right[:, k],
                samples.d3_right[:, k],
                nothing + 1.0,
                nothing,
                nothing,
            )
            with np.errstate(divide="ignore"):
                found.append((largest / np.abs(limit.row(one))) ** (2.0 / limit.order))
    return float(np.sqrt(np.min(found)))


def largest(verdict, name) -> float:
    """The ratio that the judge finds: the largest of the axes."""
    return max(
        check.ratio for key, check in verdict.limits.items() if key == name or key.startswith(f"{name}.")
    )


@pytest.mark.shows(
    "axis-limits", "exact: the speed at which the judge finds a limit used up is the planner's"
)
@pytest.mark.parametrize("name", ["feed", "velocity", "normal_acceleration", "acceleration", "jerk"])
def test_the_judge_finds_the_limit_used_up_at_the_speed_of_the_planner(name):
    machine = machine_with(velocity=90.0, acceleration=300.0, jerk=4e3, normal_acceleration=250.0)
    toolpath, limit = circle().toolpath(machine), {limit.name: limit for limit in LIMITS}[name]
    verdict = judge(steady(capped(limit, on_grid(toolpath, machine))), toolpath, machine)
    assert largest(verdict, name) == pytest.approx(1.0, abs=CLOSE)
    units = {check.unit for key, check in verdict.limits.items() if key.split(".")[0] == name}
    assert units == {limit.unit}


@pytest.mark.parametrize("name", ["feed", "velocity", "normal_acceleration", "acceleration", "jerk"])
def test_spans_of_time_that_exceed_a_limit_are_of_that_limit(name):
    machine = machine_with(velocity=90.0, acceleration=300.0, jerk=4e3, normal_acceleration=250.0)
    toolpath, limit = circle().toolpath(machine), {limit.name: limit for limit in LIMITS}[name]
    verdict = judge(steady(1.1 * capped(limit, on_grid(toolpath, machine))), toolpath, machine)
    broken = {key.partition(".")[0] for key, check in verdict.limits.items() if check.broken}
    assert name in broken
    assert {one.name.partition(".")[0] for one in verdict.excesses if one.kind is Kind.LIMIT} == broken


@pytest.mark.parametrize("limit", ROWS, ids=lambda limit: limit.name)
def test_rows_are_what_the_judge_sees_of_a_motion_that_speeds_up_and_slows_down(limit):
    """All terms of the rows count, with their signs: the ramps last for all of the arc, which is no multiple of a quarter."""
    machine = machine_with(acceleration=300.0, jerk=4e3)
    toolpath = Moves((RADIUS, 0.0, 0.0)).arc((0.0, 0.0), ARC, feed=PROGRAMMED).toolpath(machine)
    length, curve = helix((RADIUS, 0.0, 0.0), (0.0, 0.0), ARC)
    end, profile = rest_to_rest(length, PROGRAMMED, 120.0, 1500.0)
    verdict = judge(along(length, curve, (end, profile)), toolpath, machine)
    s, v, u, jerk = profile(np.append(np.arange(0.0, end, machine.dt / 4), end))
    _, *derivatives = curve(s)
    for k, (axis, most) in enumerate(zip("xy", limit.of(machine, ("x", "y")), strict=True)):
        row = limit.row(RowPoint(*(d[:, k] for d in derivatives), v**2, u, jerk))
        check = verdict.limits[limit.called(axis)]
        assert check.ratio == pytest.approx(
            np.abs(row).max() / most, rel=CLOSE
        )  # the judge looks at other times


@pytest.mark.parametrize("fir", [None, FIR])
def test_the_judge_finds_the_chord_error_used_up(fir):
    machine = machine_with(dt=0.004, **({} if fir is None else {"fir": fir}))
    toolpath, limit = circle().toolpath(machine), {limit.name: limit for limit in LIMITS}["chord_error"]
    grid = on_grid(toolpath, machine)
    verdict = judge(steady(capped(limit, grid)), toolpath, machine)
    allowed = grid.sides()[0].tol_chord[1]
    assert verdict.contour_error_mm == pytest.approx(allowed, rel=CLOSE)  # of a motion on the path
    assert (allowed < 0.1 * machine.tolerance) == (fir is not None)  # the filters have the larger part


def test_the_judge_finds_the_filter_error_used_up():
    """To second order: kappa v T is 0.14 here, and the fourth order 1e-3 of the second."""
    machine = machine_with(fir=FIR)
    toolpath, limit = circle().toolpath(machine), {limit.name: limit for limit in LIMITS}["filter_error"]
    grid = on_grid(toolpath, machine)
    speed = capped(limit, grid)
    length, curve = helix((RADIUS, 0.0, 0.0), (0.0, 0.0), 2.0 * np.pi * TURNS)
    motion = along(length, curve, rest_to_rest(length, speed, 2000.0, 1e5))
    verdict = judge(motion, toolpath, machine)
    allowed = grid.sides()[0].tol_filter[1]
    assert verdict.after_filters.contour_error_mm == pytest.approx(allowed, rel=3e-3)


def test_the_judges_filters_lag_by_the_phase_that_is_allowed():
    """The judge does not look at the lag; its filters make it."""
    machine = machine_with(fir=FIR)
    toolpath, limit = circle().toolpath(machine), {limit.name: limit for limit in LIMITS}["phase_lag"]
    end, motion = steady(capped(limit, on_grid(toolpath, machine)))
    times = np.append(np.arange(0.0, end, machine.dt), end)
    setpoints = trajectory_of(times, *motion(times)[:2])
    (t, behind), *_ = filtered(setpoints, "linear", machine.fir.time_constants, machine.dt)
    steadily = (t > sum(FIR["time_constants"])) & (t < end)
    (here, *_), behind = motion(t[steadily]), behind[steadily]
    lag = np.arctan2(here[:, 1], here[:, 0]) - np.arctan2(behind[:, 1], behind[:, 0])
    lag = np.rad2deg((lag + np.pi) % (2.0 * np.pi) - np.pi)
    assert lag == pytest.approx(FIR["phase_lag_max"], rel=CLOSE)


def test_the_judge_finds_the_acceleration_used_up_where_a_line_meets_an_arc():
    """There it steps from nothing to v^2/R."""
    machine = machine_with()
    moves = Moves((-20.0, 0.0, 0.0)).line(0.0, 0.0, feed=1e3).arc((0.0, RADIUS), 0.5 * np.pi, feed=1e3)
    toolpath = moves.toolpath(machine)
    limit = {limit.name: limit for limit in LIMITS}["acceleration"]
    caps = {cap.name: cap.feed_sq for cap in limit.at_jumps(on_grid(toolpath, machine))}
    assert set(caps) == {f"{JUMP}.{axis}" for axis in "xyz"}
    speed = float(np.sqrt(min(feed_sq.min() for feed_sq in caps.values())))
    curves = straight((-20.0, 0.0, 0.0), (0.0, 0.0, 0.0)), helix((0.0, 0.0, 0.0), (0.0, RADIUS), 0.5 * np.pi)
    motion = chain(*(at_speed(curve, speed) for curve in curves))
    verdict = judge(motion, toolpath, machine)
    assert verdict.limits["acceleration.y"].ratio == pytest.approx(
        1.0, abs=1e-2
    )  # a sample falls behind the joint
    assert verdict.limits["acceleration.y"].position == pytest.approx([0.0, 0.0, 0.0], abs=speed * machine.dt)


def test_the_judge_finds_the_tangential_acceleration_used_up():
    """Of a motion that speeds up and slows down round the circle as fast as it may, and what the planner says that it uses."""
    pushed = 180.0
    machine = machine_with(tangential_acceleration=pushed)
    toolpath = circle().toolpath(machine)
    length, curve = helix((RADIUS, 0.0, 0.0), (0.0, 0.0), 2.0 * np.pi * TURNS)
    motion = along(length, curve, rest_to_rest(length, PROGRAMMED, pushed, 4e3))
    check = judge(motion, toolpath, machine).limits[TANGENTIAL.name]
    assert (check.ratio, check.unit) == (pytest.approx(1.0, abs=CLOSE), TANGENTIAL.unit)
    limits = Limits.of(machine, toolpath.axes)
    used = [ratio.max() for order, ratio in ratios(limits, sample(motion, machine.dt)) if order == 2]
    assert used == [pytest.approx(1.0, abs=CLOSE)]


@pytest.mark.parametrize("columns", [("velocity", "acceleration", "jerk"), ()], ids=["columns", "positions"])
def test_the_judge_finds_the_tangential_jerk_used_up_and_exceeded(columns):
    """Round the circle the way is run with a jerk of its own, whatever the jerks of the axes are; positions show the same, less
    what the curve may hide."""
    fastest = 4e4
    length, curve = helix((RADIUS, 0.0, 0.0), (0.0, 0.0), 2.0 * np.pi * TURNS)
    for by in (1.0, 1.2):
        machine = machine_with(tangential_jerk=fastest, normal_acceleration=PROGRAMMED**2 / RADIUS)
        motion = sample(
            along(length, curve, rest_to_rest(length, PROGRAMMED, 900.0, by * fastest)), machine.dt
        )
        verdict = verify(motion, circle().toolpath(machine), machine, given=Given(columns=columns))
        check = verdict.limits[TANGENTIAL_JERK.name]
        assert (check.ratio, check.unit) == (
            pytest.approx(by, abs=CLOSE if columns else 0.1),
            TANGENTIAL_JERK.unit,
        )
        assert columns or check.ratio <= by
        assert [fault.name for fault in verdict.faults] == [TANGENTIAL_JERK.name] * (by > 1.0)


@pytest.mark.parametrize("columns", [("velocity", "acceleration", "jerk"), ()], ids=["columns", "positions"])
def test_the_judge_finds_the_power_of_a_drive_used_up(columns):
    """Round the circle v_x a_x is v^3/2R at most; positions show it less what the speed may change by within a period."""
    machine = machine_with()
    driven = {name: axis.model_copy(update={"power": 0.0108}) for name, axis in machine.axes.items()}
    machine = machine.model_copy(update={"axes": driven})
    speed = float(np.cbrt(2.0 * RADIUS * POWER.of(machine, ("x",))[0]))
    delivered = sample(steady(speed), machine.dt)
    verdict = verify(delivered, circle().toolpath(machine), machine, given=Given(columns=columns))
    check = verdict.limits["power.x"]
    assert (check.ratio, check.unit) == (pytest.approx(1.0, abs=CLOSE if columns else 0.1), POWER.unit)
    assert columns or check.ratio < 1.0


@pytest.mark.parametrize("columns", [("velocity", "acceleration", "jerk"), ()], ids=["columns", "positions"])
def test_the_judge_finds_a_tangential_acceleration_beyond_its_limit(columns):
    """By a twentieth, also where positions are all that it has: then it takes off what the curve may hide."""
    machine = machine_with(tangential_acceleration=900.0)
    length, curve = helix((RADIUS, 0.0, 0.0), (0.0, 0.0), 2.0 * np.pi * TURNS)
    motion = along(length, curve, rest_to_rest(length, PROGRAMMED, 1.05 * 900.0, 4e4))
    delivered = sample(motion, machine.dt)
    verdict = verify(delivered, circle().toolpath(machine), machine, given=Given(columns=columns))
    assert verdict.limits[TANGENTIAL.name].ratio == pytest.approx(1.05, abs=CLOSE if columns else 0.03)
    assert [fault.name for fault in verdict.faults] == [TANGENTIAL.name]


@pytest.mark.parametrize("own", [Along(), Belt()], ids=lambda limit: limit.name)
def test_the_judge_finds_limits_of_ones_own_used_up(own):
    machine = machine_with().with_own([own])
    toolpath = circle().toolpath(machine)
    grid = on_grid(toolpath, machine)
    speed = float(np.sqrt(user_inside(grid.samples, Limits.of(machine, grid.axes)).min()))
    verdict = judge(steady(speed), toolpath, machine)
    check = verdict.limits[f"velocity.{own.name}"]
    assert check.ratio == pytest.approx(1.0, abs=CLOSE)
    assert check.unit == f"{own.unit}/s"


PAGE = (ROOT / "docs" / "extending.md").read_text(encoding="utf-8")
ROW = re.compile(
    r"^\| [^|]+ \| `([\w.]+?)(?:\.[xyz]|[^\w.`][^`]*)?` \| ([^|]+) \| ([^|]+) \| `([^`]+)` \| `(\w+)` \|$",
    re.MULTILINE,
)


def test_the_table_of_limits_is_that_of_the_objects():
    """docs/extending.md: names, units, files and tests of all limits."""
    rows = {name: rest for name, *rest in ROW.findall(PAGE)}
    assert set(rows) == {limit.name for limit in LIMITS}
    tests = {name for name in globals() if name.startswith("test_")}
    for limit in LIMITS:
        unit, _, file, test = rows[limit.name]
        home = type(limit).__module__.replace(".", "/") + ".py"
        assert (unit, file) == (limit.unit, home)
        assert test in tests


DOCUMENTED = (ast.Module, ast.ClassDef, ast.FunctionDef)


def test_a_limit_is_named_in_one_file():
    """Printed names are in the limit's own file, and in no other of the planner; the judge has its own."""
    single = {limit.name for limit in LIMITS if "." not in limit.name} - {
        "feed",
        "velocity",
        "acceleration",
        "jerk",
        "power",
    } | {JUMP}
    with_axes = tuple(f"{name}." for name in ("velocity", "acceleration", "jerk", JUMP))
    quoted = re.compile("[\"'](" + "|".join([*single, *map(re.escape, with_axes)]) + ")")
    found: dict[str, set[str]] = {name: set() for name in single}
    for file in sorted((ROOT / "planner").rglob("*.py")):
        text = file.read_text(encoding="utf-8")
        if not quoted.search(text) or "verifier" in file.parts:
            continue
        tree = ast.parse(text)
        docs = {
            ast.get_docstring(node, clean=False) for node in ast.walk(tree) if isinstance(node, DOCUMENTED)
        }
        for node in ast.walk(tree):
            if isinstance(node, ast.Constant) and isinstance(node.value, str) and node.value not in docs:
                assert not node.value.startswith(with_axes), f"{file}: {node.value}"
                if node.value in single:
                    found[node.value].add(file.name)
    assert {name: len(files) for name, files in found.items()} == dict.fromkeys(single, 1)


def test_rows_are_limits_of_the_list():
    assert all(limit in LIMITS for limit in ROWS)
    assert ROWS.index(JERK) == len(ROWS) - 1  # without jerk limits its indices are the ones left out
