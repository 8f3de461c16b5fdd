"""Splines of a program: G5, G5.1, G5.2 with G5.3 and G6.2 against scipy's B-splines, by laws, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import BSpline

from planner.base.arrays import FloatArray
from planner.base.errors import InputError
from planner.geometry.nurbs import Nurbs
from planner.machine import machine_from_dict
from planner.nc.bezier import at, evenly_weighted, halves, homogeneous, lengths, raised
from planner.nc.info import describe
from planner.nc.program import Kind, Program
from planner.nc.reader import interpret, parse_program
from planner.planning.methods.registry import plan
from planner.report.planned import planned_program

HEAD = "G21 G17 G90 G64 P0.01\nG0 X1 Y2\nF600\n"
U = np.linspace(0.0, 1.0, 23)


def read(text: str) -> Program:
    return parse_program((HEAD + text + "\nM2\n").encode())


def curve(program: Program, block: int) -> FloatArray:
    """(K, 23, 3) points of the pieces of a block."""
    rows = program.splines.block == block
    return at(homogeneous(program.splines.points[rows], program.splines.weights[rows]), U)[0]


def rational(points: FloatArray, weights: FloatArray, knots: FloatArray, degree: int) -> FloatArray:
    """(K, 23, A) what scipy makes of a NURBS, on each of its spans."""
    spline = BSpline(knots, np.column_stack([points * weights[:, None], weights]), degree)
    cuts = np.unique(knots[degree : len(points) + 1])
    inside = np.linspace(0.0, 1.0 - 1e-12, len(U))
    value = spline(cuts[:-1, None] + inside * np.diff(cuts)[:, None])
    return value[..., :-1] / value[..., -1:]


@pytest.mark.shows("read-splines", "exact: scipy's B-splines")
def test_a_cubic_has_its_control_points_from_both_ends() -> None:
    program = read("G5 X5 Y2 I1 J3 P-1 Q2\nG5 X9 Y2 P0 Q1")
    assert program.kind.tolist() == [Kind.RAPID, Kind.SPLINE, Kind.SPLINE]
    np.testing.assert_array_equal(program.splines.points[0, :, :2], [[1, 2], [2, 5], [4, 4], [5, 2]])
    # without I J it goes on as the one before: its first arm is minus (P, Q)
    np.testing.assert_array_equal(program.splines.points[1, :, :2], [[5, 2], [6, 0], [9, 3], [9, 2]])
    assert (program.feed[1:] == 10.0).all()
    assert (program.splines.weights == 1.0).all()


def test_a_quadratic_is_the_parabola_of_its_control_point() -> None:
    p0, p1, p2 = np.array([1, 2, 0.0]), np.array([3, 7, 0.0]), np.array([6, 2, 0.0])
    u = U[:, None]
    expected = (1 - u) ** 2 * p0 + 2 * u * (1 - u) * p1 + u**2 * p2
    np.testing.assert_allclose(curve(read("G5.1 X6 Y2 I2 J5"), 1)[0], expected, atol=1e-14)


@pytest.mark.parametrize("order", [2, 3, 4])
def test_nurbs_with_even_knots_are_those_of_scipy(order: int) -> None:
    rng = np.random.default_rng(order)
    points, weights = np.zeros((7, 3)), rng.uniform(0.3, 3.0, 7)
    points[:, :2] = rng.uniform(-9, 9, (7, 2)).round(3)
    points[0, :2] = 1, 2
    weights = weights.round(3)
    lines = [f"G5.2 P{weights[0]} L{order}"]
    lines += [f"X{p[0]} Y{p[1]} P{w}" for p, w in zip(points[1:], weights[1:], strict=True)]
    inner = np.arange(1, 7 - order + 1)
    knots = np.concatenate([np.zeros(order), inner, np.full(order, 7 - order + 1)]).astype(float)
    program = read("\n".join([*lines, "G5.3"]))
    np.testing.assert_allclose(curve(program, 1), rational(points, weights, knots, order - 1), atol=1e-9)
    assert program.line[1] == 4  # where it begins


def with_knots(points: FloatArray, weights: FloatArray, knots: FloatArray, order: int) -> str:
    lines = [
        f"K{knots[i]:.9f} X{p[0]:.9f} Y{p[1]:.9f} Z{p[2]:.9f} R{w:.9f}"
        for i, (p, w) in enumerate(zip(points, weights, strict=True))
    ]
    lines += [f"K{k:.9f}" for k in knots[len(points) :]]
    return f"G6.2 P{order} " + "\n".join(lines)


@pytest.mark.shows("read-splines", "exact: scipy's B-splines")
@pytest.mark.parametrize("order", [2, 3, 4])
def test_nurbs_with_knots_are_those_of_scipy(order: int) -> None:
    rng = np.random.default_rng(10 + order)
    points, weights = rng.uniform(-9, 9, (9, 3)).round(6), rng.uniform(0.3, 3.0, 9).round(6)
    points[0] = 1, 2, 0
    inner = np.sort(rng.uniform(0, 5, 9 - order)).round(3)
    if order > 2:
        inner[1] = inner[0]  # a knot of multiplicity two: the curve has less derivatives there
    knots = np.concatenate([np.zeros(order), inner, np.full(order, 5.0)])
    program = read(with_knots(points, weights, knots, order))
    np.testing.assert_allclose(curve(program, 1), rational(points, weights, knots, order - 1), atol=1e-9)
    np.testing.assert_allclose(program.end[-1], points[-1], atol=1e-12)


def test_a_circle_is_round_and_as_long_as_one() -> None:
    side = np.sqrt(0.5)
    rows = [(1, -3, 1), (6, -3, side), (6, 2, 1), (6, 7, side), (1, 7, 1)]
    text = "\n".join(f"K{(0, 0, 0, 1, 1)[i]} X{x} Y{y} R{w:.17f}" for i, (x, y, w) in enumerate(rows))
    program = parse_program(("G21 G0 X1 Y-3\nF60\nG6.2 P3 " + text + "\nK2\nK2\nK2\nM2").encode())
    points = curve(program, 1)[..., :2] - [1, 2]
    np.testing.assert_allclose(np.linalg.norm(points, axis=-1), 5.0, atol=1e-14)
    info = describe(program, lines=9)
    assert info.length["spline"] == pytest.approx(5 * np.pi, rel=1e-12)
    np.testing.assert_allclose(info.extent_max[:2], [6, 7], atol=1e-5)
    assert info.blocks["spline"] == 1


def test_units_offsets_and_incremental_ends_act_on_splines() -> None:
    metric = read("G5 X5 Y2 I1 J3 P-1 Q2").splines.points
    inch = parse_program(
        b"G20\nG0 X[1/25.4] Y[2/25.4]\nF10\nG5 X[5/25.4] Y[2/25.4] I[1/25.4] J[3/25.4] P[-1/25.4] Q[2/25.4]\nM2"
    )
    np.testing.assert_allclose(inch.splines.points, metric, atol=1e-12)
    moved = read("G92 X0 Y0\nG5 X4 Y0 I1 J3 P-1 Q2").splines.points
    np.testing.assert_allclose(moved, metric, atol=1e-12)
    steps = read("G91 G5 X4 Y0 I1 J3 P-1 Q2").splines.points
    np.testing.assert_allclose(steps, metric, atol=1e-12)


def test_a_rotated_work_system_turns_the_control_points() -> None:
    text = "G21 G17 G90\nG10 L2 P1 R90\nG0 X1 Y2\nF600\nG5 X5 Y2 I1 J3 P-1 Q2\nM2\n"
    turned = parse_program(text.encode()).splines.points[0, :, :2]
    plain = read("G5 X5 Y2 I1 J3 P-1 Q2").splines.points[0, :, :2]
    np.testing.assert_allclose(turned, np.column_stack([-plain[:, 1], plain[:, 0]]), atol=1e-12)


def test_corners_of_splines_are_counted_at_their_tangents() -> None:
    straight_on = "G1 X5 Y2\nG5 X9 Y6 I2 J0 P0 Q-2\nG1 Y9"
    assert describe(read(straight_on), lines=6).corners[1.0] == 0
    turned = "G1 X5 Y2\nG5 X9 Y6 I0 J2 P0 Q-2\nG1 Y9"
    assert describe(read(turned), lines=6).corners[60.0] == 1


def test_halving_raising_and_weighing_keep_the_curve() -> None:
    rng = np.random.default_rng(3)
    pieces = homogeneous(rng.uniform(-5, 5, (6, 3, 3)), rng.uniform(0.3, 3, (6, 3)))
    cubic = raised(pieces)
    v = 1.0 - U
    basis = np.stack([v**2, 2 * U * v, U**2], axis=1) @ pieces
    np.testing.assert_allclose(at(cubic, U)[0], basis[..., :-1] / basis[..., -1:], atol=1e-13)
    left, right = halves(cubic)
    np.testing.assert_allclose(at(left, U)[0], at(cubic, U / 2)[0], atol=1e-13)
    np.testing.assert_allclose(at(right, U)[0], at(cubic, 0.5 + U / 2)[0], atol=1e-13)
    even = evenly_weighted(cubic)
    np.testing.assert_allclose(even[:, [0, 3], -1], 1.0, atol=1e-14)
    np.testing.assert_allclose(lengths(even), lengths(cubic), rtol=1e-9)


def test_derivatives_are_those_of_the_points() -> None:
    rng = np.random.default_rng(4)
    pieces = homogeneous(rng.uniform(-5, 5, (5, 4, 3)), rng.uniform(0.3, 3, (5, 4)))
    u, h = np.linspace(0.1, 0.9, 9), 1e-5
    before, now, after = (at(pieces, u + shift) for shift in (-h, 0.0, h))
    np.testing.assert_allclose(now[1], (after[0] - before[0]) / (2 * h), atol=1e-6)
    np.testing.assert_allclose(now[2], (after[1] - before[1]) / (2 * h), atol=1e-5)


REFUSED = {
    "G5 P0 Q1 X4": ("needs I and J", 4),
    "G5 I0 J3 P0 Q1 X4\nG1 X5\nG5 P0 Q1 X6": ("needs I and J", 6),
    "G5 I1 P0 Q1 X4": ("both I and J", 4),
    "G5 I1 J1 P1 X4": ("P and Q", 4),
    "G5 I1 J1 P0 Q1": ("end point", 4),
    "G5 I1 J1 P0 Q1 X4 Z1": ("Z does not move", 4),
    "G18 G5 I1 J1 P0 Q1 X4": ("G17", 4),
    "G5 I1 J1 P0 Q1 X4 K2": ("K word", 4),
    "G93 G5 I1 J1 P0 Q1 X4 F2": ("G93", 4),
    "G5.1 X4 I1": ("I and J", 4),
    "G5.1 X4 I0 J0": ("not both 0", 4),
    "G5.2 P2 L4\nX1 Y1\nX2 Y0\nG5.3": ("4 control points or more; 3", 7),
    "G5.2 X1 Y1 L5": ("order 2, 3 and 4", 4),
    "G5.2 X1 Y1 P-1": ("positive", 4),
    "G5.2 X1 Y1 P0": ("positive", 4),
    "G5.2 X1 Y1\nX2\nX3 Y3\nG5.3": ("both X and Y", 5),
    "G5.2 X2 Y2\nX3 Y3\nP2\nG5.3": ("weight without", 6),
    "G5.2 X2 Y2\nX3 Y3\nG1 X9": ("does not end", 6),
    "G5.2 X2 Y2\nX3 Y3\nG0 X9": ("does not end", 6),
    "G5.2 X2 Y2\nX3 Y3": ("does not end", 4),
    "G5.2 X2 Y2\nX3 Y3\nG4 P1\nG5.3": ("inside the spline", 7),
    "G5.2 X2 Y2\nX3 Y3\nG5.3\nX9 Y9": ("after its G5.3", 7),
    "G91 G5.2 X2 Y2": ("G90", 4),
    "G5.3": ("none is open", 4),
    "G6.2 P5 K0 X1": ("order 2, 3 and 4", 4),
    "G6.2 P3 K0 X2": ("from where the machine stands", 4),
    "G6.2 P3 K0 X1 R0": ("positive", 4),
    "G6.2 P3 K0 X1\nX5": ("needs its knot", 5),
    "G6.2 P3 K0 X1\nK0 X5 P3": ("first line", 5),
    "G6.2 P3 K0 X1\nK0 X2\nK-1 X3": ("must not decrease", 6),
    "G6.2 P3 K0 X1\nK0 X2 Y5\nK1 X3\nK2\nK2\nK2": ("first 3 knots", 9),
    "G6.2 P3 K0 X1\nK0 X2 Y5\nK0 X3\nK1 X4 Y0\nK1 X5 Y1\nK1 X6\nK2\nK2\nK2": ("2 times at most", 12),
    "G6.2 P3 K0 X1\nK0 X2 Y5\nK0 X3\nK1\nX4": ("before", 8),
    "G6.2 P3 K0 X1\nK0 X2 Y5\nK0 X3\nK1\nK1": ("5 knots", 4),
    "G6.2 P3 K0 X1\nK0 X2 Y5\nK0 X3\nK1\nK1\nK1\nK1": ("after its last knot", 10),
    "G91 G6.2 P3 K0 X1": ("G90", 4),
}  # fmt: skip


@pytest.mark.parametrize("text", REFUSED)
def test_what_is_no_spline_is_refused_with_line_and_sentence(text: str) -> None:
    says, line = REFUSED[text]
    _, faults = interpret((HEAD + text + "\nM2\n").encode(), None, source="x")
    assert faults
    assert says in faults[0].message
    assert faults[0].line == line
    with pytest.raises(InputError):
        read(text)


def test_a_spline_needs_a_feed() -> None:
    with pytest.raises(InputError, match="feed"):
        parse_program(b"G21 G5 X5 Y2 I1 J3 P-1 Q2\nM2")


def test_planned_feeds_are_written_on_the_line_where_a_spline_begins(tmp_path) -> None:
    job = tmp_path / "job.ngc"
    job.write_text(HEAD + "F6000\nG5.2 X2 Y12 L4\nX5 Y-8\nX9 Y9\nG5.3\nG1 X30\nM2\n")
    made = plan(job, "router", method="stop")
    text, _ = planned_program(made)
    lines = text.decode().splitlines()
    assert "F" in lines[4]
    assert not any("F" in line for line in lines[5:8])
    again = parse_program(text)
    np.testing.assert_array_equal(again.splines.points, made.program.splines.points)
    assert again.feed[1] < made.program.feed[1]


def test_a_curve_of_its_own_is_an_exact_program() -> None:
    rng = np.random.default_rng(8)
    knots = np.array([0, 0, 0, 0, 1, 2, 2.5, 3, 3, 3, 3])
    given = Nurbs(degree=3, points=rng.uniform(-5, 5, (7, 2)), knots=knots, weights=rng.uniform(0.5, 2, 7))
    program = given.exact_program(50.0)
    cuts = np.unique(knots)
    u = cuts[:-1, None] + np.diff(cuts)[:, None] * np.linspace(0, 1 - 1e-12, len(U))
    np.testing.assert_allclose(curve(program, 0).reshape(-1, 2), given.at(u.ravel()), atol=1e-10)
    with pytest.raises(InputError, match="degree 4"):
        Nurbs(
            degree=4, points=np.eye(5, 2), knots=np.repeat([0.0, 1.0], 5), weights=np.ones(5)
        ).exact_program(5.0)


@pytest.mark.parametrize(
    "text", ["G41 D1 G1 X9 Y9\nG5 X15 I1 J1 P0 Q1", "G41 D1 G1 X9 Y9\nX20\nG40\nG5 X30 I1 J1 P0 Q1"]
)
def test_a_spline_is_no_move_of_cutter_compensation(text: str) -> None:
    axes = {a: {"velocity": 1, "acceleration": 1, "jerk": 1} for a in "xyz"}
    machine = machine_from_dict(
        {"name": "m", "axes": axes, "tolerance": 0.01, "dt": 1e-3, "tools": {"1": {"diameter": 1.0}}}
    )
    with pytest.raises(InputError, match=r"G5: .*(G40|straight)"):
        parse_program((HEAD + text + "\nM2\n").encode(), machine)
