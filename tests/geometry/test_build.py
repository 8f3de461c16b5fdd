"""From blocks to segments and joints: what stops, what is rounded, whose tolerance holds, and what is refused."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from benchmarks.jobs import problems
from planner.base.errors import InputError
from planner.geometry.build import COORDINATE_MAX, toolpath_from_program, turning_angle
from planner.geometry.legs import leg_dtype, leg_point, leg_tangent, legs_of
from planner.geometry.spline import span_dtype
from planner.geometry.toolpath import REVERSAL_ANGLE, Joint, Toolpath
from planner.nc.program import Kind
from planner.nc.reader import parse_program

MACHINE = problems.machine()
STOP, SMOOTH, CORNER = Joint.STOP, Joint.SMOOTH, Joint.CORNER


def build(text: str, machine=MACHINE, tolerance: float | None = None) -> Toolpath:
    return toolpath_from_program(parse_program("G21 G17 G90 G94 F6000\n" + text, machine), machine, tolerance)


def kinds(text: str, machine=MACHINE) -> list[int]:
    return build(text, machine).joint.tolist()


# --- joints ---------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("G1 X10\nY10\nX20", [STOP, CORNER, CORNER, STOP]),
        ("G1 X10\nX20\nY10", [STOP, SMOOTH, CORNER, STOP]),
        ("G61\nG1 X10\nX20\nY10", [STOP, SMOOTH, STOP, STOP]),  # exact path stops where the path turns
        ("G61.1\nG1 X10\nX20\nY10", [STOP, STOP, STOP, STOP]),  # exact stop stops everywhere
        ("G61\nG1 X10\nG64\nY10\nX0", [STOP, STOP, CORNER, STOP]),  # the mode at the end of the block holds
        ("G1 X10\nG61.1\nX20\nG64\nX30", [STOP, SMOOTH, STOP, STOP]),
        ("G1 X10\nX0\nY5", [STOP, CORNER, CORNER, STOP]),  # a reversal: its vertex is to be reached, not rested at
        ("G61\nG1 X10\nG64\nX0\nX5", [STOP, STOP, CORNER, STOP]),  # under exact path it is
        ("G1 X10\nG4 P1\nX20\nY3", [STOP, STOP, CORNER, STOP]),  # a dwell
        ("G1 X10\nM0\nX20\nY3", [STOP, STOP, CORNER, STOP]),  # a program stop
        ("G0 X10\nY10\nG1 X0\nY0", [STOP, CORNER, STOP, CORNER, STOP]),  # rapid and feed
        ("G1 X10\nG3 X20 Y10 J10\nG1 Y20", [STOP, SMOOTH, SMOOTH, STOP]),  # tangent arcs
        ("G1 X10\nG2 X20 Y0 I5\nG1 X30", [STOP, CORNER, CORNER, STOP]),  # sharp ones
        ("G1 X10\nG1 X10\nY10", [STOP, CORNER, STOP]),  # a zero-length move in a corner is not a joint
    ],
)  # fmt: skip
def test_kinds_of_joints(text, expected):
    assert kinds(text) == expected


def test_rapids_are_blended_where_the_machine_says_so():
    text = "G0 X10\nY10\nG1 X0\nY0"
    assert kinds(text, problems.machine(blend_rapids=True)) == [STOP, CORNER, CORNER, CORNER, STOP]


def test_the_machines_path_control_holds_before_the_programs():
    assert kinds("G1 X10\nY10", problems.machine(path_control="exact_stop")) == [STOP, STOP, STOP]
    assert kinds("G64\nG1 X10\nY10", problems.machine(path_control="exact_stop")) == [STOP, CORNER, STOP]


def test_dwells_stand_at_the_joint_before_the_next_move_and_add_up():
    path = build("G4 P0.5\nG1 X10\nG4 P1\nG4 P2\nX20\nX20\nG4 P3\nM2")
    np.testing.assert_allclose(path.dwell, [0.5, 3.0, 3.0])
    assert path.joint.tolist() == [STOP, STOP, STOP]
    assert build("G1 X10\nG4 P0\nX20").joint.tolist() == [STOP, STOP, STOP]


@pytest.mark.parametrize(
    ("degrees", "kind", "on_a_path"),
    [
        (174.9, CORNER, CORNER),
        (175.1, CORNER, STOP),
        (180.0, CORNER, STOP),
        (0.0, SMOOTH, SMOOTH),
        (1e-5, CORNER, CORNER),
    ],
)
def test_the_angle_decides(degrees, kind, on_a_path):
    """What the program asks for, and what a motion along a fixed path does, whose corner would be a cusp."""
    a = np.deg2rad(degrees)
    path = toolpath_from_program(
        problems.polyline([[0, 0], [10, 0], [10 + 10 * np.cos(a), 10 * np.sin(a)]]), MACHINE
    )
    assert path.joint[1] == kind
    assert path.resting().joint[1] == on_a_path
    assert path.theta[1] == pytest.approx(a, abs=1e-14 if degrees else 0)
    assert np.rad2deg(REVERSAL_ANGLE) == pytest.approx(175.0)


@given(theta=st.floats(0.0, np.pi), axis=st.integers(0, 1000))
def test_turning_angles_are_exact_at_both_ends(theta, axis):
    rng = np.random.default_rng(axis)
    u1 = rng.normal(size=3)
    u1 /= np.linalg.norm(u1)
    side = np.cross(u1, rng.normal(size=3))
    side /= np.linalg.norm(side)
    u2 = np.cos(theta) * u1 + np.sin(theta) * side
    assert (
        turning_angle(u1[None], u2[None])[0] == pytest.approx(theta, abs=1e-15, rel=1e-14)
        or theta > np.pi - 1e-7
        or (abs(turning_angle(u1[None], u2[None])[0] - theta) < 5e-16)
    )


# --- geometry -------------------------------------------------------------------------------------------------------------

ARCS = {
    "quarter": ("G3 X10 Y10 J10", 5 * np.pi, 0.1),
    "clockwise": ("G2 X10 Y-10 J-10", 5 * np.pi, 0.1),
    "full circle": ("G2 X0 Y0 I5", 10 * np.pi, 0.2),
    "three turns": ("G3 X0 Y0 I5 P3", 30 * np.pi, 0.2),
    "helix": ("G3 X0 Y0 Z6 I4", np.hypot(8 * np.pi, 6), None),
}


@pytest.mark.parametrize("name", ARCS)
def test_arcs_have_their_length_ends_and_curvature(name):
    text, length, curvature = ARCS[name]
    path = build(text)
    assert path.length[0] == pytest.approx(length, rel=1e-12)
    if curvature is None:  # helix: kappa = R w^2/(R^2 w^2 + p^2), here |p'| = 1
        curvature = 4 * (2 * np.pi) ** 2 / length**2
    assert path.curvature[0] == pytest.approx(curvature, rel=1e-9)
    legs = legs_of(path).table
    at = np.empty((4, 3))
    leg_point(legs, 0, 0.0, at)
    np.testing.assert_allclose(at[0], path.start[0], atol=1e-12)
    np.testing.assert_allclose(at[1], path.tangent_start[0], atol=1e-12)
    leg_point(legs, 0, path.length[0], at)
    np.testing.assert_allclose(at[0], path.end[0], atol=1e-12)
    np.testing.assert_allclose(at[1], path.tangent_end[0], atol=1e-12)


@pytest.mark.parametrize("text", ["G3 X10.003 Y10 J10", "G2 X4 Y4.004 I4 Z3", "G18\nG3 X8.002 Z0 I4 K0"])
def test_a_closing_gap_is_spread_over_the_arc(text):
    """The curve ends on the programmed point and is nearly parametrised by arc length: |p'| = 1 to gap/length."""
    path = build(text)
    legs = legs_of(path).table
    at, tangent = np.empty((4, 3)), np.empty(3)
    speeds, bends = [], []
    for x in np.linspace(0, path.length[0], 101):
        leg_point(legs, 0, x, at)
        leg_tangent(legs, 0, x, tangent)
        np.testing.assert_allclose(tangent, at[1], atol=1e-15)
        speeds.append(np.linalg.norm(at[1]))
        unit = at[1] / speeds[-1]
        bends.append(np.linalg.norm(at[2] - unit * (unit @ at[2])) / speeds[-1] ** 2)
    np.testing.assert_allclose(at[0], path.end[0], atol=1e-12)
    assert np.abs(np.array(speeds) - 1).max() < 0.01 / path.length[0]
    assert max(bends) <= path.curvature[0] * (1 + 1e-12)
    np.testing.assert_allclose(
        np.linalg.norm([path.tangent_start[0], path.tangent_end[0]], axis=1), 1.0, rtol=1e-14
    )


def test_leg_derivatives_against_differences():
    path = build("G3 X0 Y0.003 Z6 I4")
    legs = legs_of(path).table
    here, after, before = (np.empty((4, 3)) for _ in range(3))
    for x in np.linspace(1, path.length[0] - 1, 7):
        leg_point(legs, 0, x, here)
        leg_point(legs, 0, x + 1e-4, after)
        leg_point(legs, 0, x - 1e-4, before)
        for order in range(3):
            np.testing.assert_allclose((after[order] - before[order]) / 2e-4, here[order + 1], atol=2e-8)


def test_collinear_lines_are_one_leg_and_arcs_are_their_own():
    path = build("G1 X1\nX3\nX10\nG3 X20 Y10 J10\nG1 Y12\nY20\nX0")
    legs = legs_of(path)
    assert legs.first.tolist() == [0, 3, 4, 6, 7]
    np.testing.assert_allclose(legs.offset, [0, 1, 3, 0, 0, 2, 0])
    np.testing.assert_allclose(legs.length, [10, 5 * np.pi, 10, 20])


def test_a_stop_ends_a_leg():
    assert len(legs_of(build("G1 X1\nG4 P1\nX2\nX3"))) == 2


def test_moves_of_no_length_have_no_segment():
    path = build("G1 X10\nX10\nG0 X10\nY10\nZ0")
    assert len(path) == 2
    assert path.block.tolist() == [0, 3]


# --- feeds and tolerances -------------------------------------------------------------------------------------------------


def test_feeds_are_cut_to_the_machines_largest_but_rapids_are_not():
    path = build("G0 X10\nG1 Y10 F6000\nX0 F60", problems.machine(feed_max=50.0))
    assert path.feed.tolist() == [np.inf, 50.0, 1.0]
    assert path.rapid.tolist() == [True, False, False]


def test_whose_tolerance_holds():
    text = "G1 X10\nG64 P0.2\nY10\nG64 P0.03\nX20\nG64\nY20\nX30"
    np.testing.assert_allclose(
        build(text).tolerance[1:], [0.05, 0.2, 0.03, 0.05, 0.05]
    )  # the block that ends there
    np.testing.assert_allclose(build(text, tolerance=0.7).tolerance, 0.7)  # the call's beats all
    np.testing.assert_allclose(build("G1 X1\nY1", problems.machine(tolerance=0.4)).tolerance, 0.4)


# --- refusals -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("tolerance", [0.0, -1.0, float("nan"), float("inf")])
def test_impossible_tolerances_are_refused(tolerance):
    with pytest.raises(InputError, match="tolerance"):
        toolpath_from_program(problems.pentagon(), MACHINE, tolerance)


def test_programs_that_move_nowhere_are_refused():
    with pytest.raises(InputError, match="no move"):
        toolpath_from_program(dataclasses.replace(empty(), source="none.ngc"), MACHINE)
    with pytest.raises(InputError, match="moves nowhere"):
        toolpath_from_program(problems.polyline([[1, 2], [1, 2], [1, 2]]), MACHINE)
    with pytest.raises(InputError, match="moves nowhere"):
        toolpath_from_program(parse_program("G21 F100\nG4 P1\n"), MACHINE)


def empty():
    none = np.zeros(0)
    return dataclasses.replace(
        problems.polyline([[0, 0], [1, 0]]), kind=none, end=np.zeros((0, 3)), feed=none, dwell=none, line=none,
        path_control=none, tolerance=none,
    )  # fmt: skip


FLAT = MACHINE.model_copy(update={"axes": {k: MACHINE.axes[k] for k in "xy"}})


@pytest.mark.parametrize("text", ["G1 X10 Z1", "G18 G3 X0 Z0 I5"])
def test_a_machine_without_an_axis_that_moves_is_refused(text):
    with pytest.raises(InputError, match="no axis 'z'"):
        build(text, FLAT)


def test_an_axis_that_never_moves_may_be_missing():
    text = "G1 X10\nG3 X20 Y10 J10\nG1 Y20\nG2 X20 Y20 I5"
    flat, full = build(text, FLAT), build(text)
    assert (flat.axes, full.axes) == (("x", "y"), ("x", "y", "z"))
    for name in ("start", "end", "tangent_start", "tangent_end"):
        np.testing.assert_array_equal(getattr(flat, name), getattr(full, name)[:, :2])
    for name in ("center", "e1", "e2", "drift"):
        np.testing.assert_array_equal(getattr(flat.arcs, name), getattr(full.arcs, name)[:, :2])
    for name in ("length", "joint", "theta", "arc", "curvature"):
        np.testing.assert_array_equal(getattr(flat, name), getattr(full, name))


def test_coordinates_beyond_all_machines_are_refused_with_their_line():
    far = problems.polyline([[0, 0], [1, 0], [1, -2 * COORDINATE_MAX]])
    with pytest.raises(InputError, match=r"polyline:2: Y = -2e\+07 mm"):
        toolpath_from_program(far, MACHINE)


def test_an_arc_without_a_radius_is_refused_with_its_line():
    arc = dataclasses.replace(
        problems.polyline([[0, 0], [1, 0], [1, 0]]), kind=[Kind.LINE, Kind.ARC], arc_block=[1],
        arc_center=[[1.0, 0.0, 0.0]], arc_normal=[2], arc_sweep=[1.0],
    )  # fmt: skip
    with pytest.raises(InputError, match="polyline:2: arc of radius 0"):
        toolpath_from_program(arc, MACHINE)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"joint": [1, 0]}, "must be STOP"), ({"length": [0.0]}, "length > 0"), ({"theta": [0.0]}, "theta"),
        ({"start": [[np.nan, 0, 0]]}, "finite"),
    ],
)  # fmt: skip
def test_impossible_toolpaths_are_refused(change, message):
    path = toolpath_from_program(problems.polyline([[0, 0], [1, 0]]), MACHINE)
    with pytest.raises(ValueError, match=message):
        dataclasses.replace(path, **change)


@given(seed=st.integers(0, 10**6))
@settings(max_examples=25)
def test_random_walks_keep_their_points(seed):
    program = problems.random_polyline(np.random.default_rng(seed))
    path = toolpath_from_program(program, MACHINE)
    np.testing.assert_array_equal(path.end, program.end)
    np.testing.assert_array_equal(path.start[1:], path.end[:-1])
    np.testing.assert_allclose(path.length, np.linalg.norm(path.end - path.start, axis=1), rtol=1e-15)


@pytest.mark.parametrize("tolerance", [0.0, -1.0, 9e-6, 1e-320, 1e10, np.nan, np.inf])
def test_a_tolerance_of_no_machine_is_refused(tolerance):
    """Found by fuzzing: distances over a tolerance of 1e-320 mm overflow."""
    with pytest.raises(InputError, match=r"must be between 1e-05 and 1e\+07"):
        build("G1 X1\nY1", tolerance=tolerance)


@pytest.mark.parametrize("record", [leg_dtype, span_dtype])
def test_kernels_see_two_kinds_of_records_for_any_number_of_axes(record) -> None:
    """Each kind is half a minute of compiling."""
    assert {record(axes) for axes in (1, 2)} == {record(3)}
    assert {record(axes) for axes in range(4, 9)} == {record(9)}
    assert record(10).itemsize > record(9).itemsize
