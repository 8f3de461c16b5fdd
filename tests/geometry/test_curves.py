"""Curves as segments of a toolpath: the same curve, in a parameter like its arc length, with bounds that hold."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from curves import circle, curve_named, wave

from planner.base.arrays import FloatArray
from planner.baselines.lookahead.rest_to_rest import parts_of
from planner.geometry.build import toolpath_from_program
from planner.geometry.chords import arc_sagitta, chorded, points_on
from planner.geometry.curves import PLACES, UNEVEN, CurveSegments, curve_segments
from planner.geometry.legs import leg_point, leg_tangent, legs_of
from planner.geometry.nurbs import Nurbs
from planner.geometry.toolpath import Joint, Toolpath
from planner.machine import load_machine
from planner.nc.bezier import at, cubic_pieces, homogeneous
from planner.nc.reader import parse_program

MACHINE = load_machine("router")
NEAR = 1e-4  # [mm]
HEAD = "G21 G17 G90 G64 P0.01\nG0 X0 Y0\nF600\n"
CURVES = {
    "butterfly": curve_named("butterfly"),
    "trident": curve_named("trident"),
    "circle": circle(7.0, (1.0, 2.0, 3.0)),
    "wave": wave(3),
    "wave in space": wave(5, axes=3),
}


def pieces_of(curve: Nurbs) -> FloatArray:
    return cubic_pieces(homogeneous(curve.points, curve.weights), curve.knots, curve.degree)


def divided(curve: Nurbs) -> CurveSegments:
    found = curve_segments(pieces_of(curve), np.full(len(pieces_of(curve)), NEAR))
    assert not found.chord.any()
    return found


def on_segments(found: CurveSegments, share: FloatArray) -> FloatArray:
    """(n, P, 4, A) points and derivatives at these shares (P,) of all segments."""
    row = np.repeat(np.arange(len(found.length)), len(share))
    out = found.curves.at(row, found.length[row], (found.length[:, None] * share).ravel())
    return out.reshape(len(found.length), len(share), 4, -1)


def toolpath_of(text: str) -> Toolpath:
    return toolpath_from_program(parse_program((HEAD + text + "\nM2\n").encode()), MACHINE)


@pytest.mark.parametrize("name", CURVES)
def test_segments_are_the_curve(name: str) -> None:
    """Every point is on the piece that it comes from, to rounding; found by Newton's method from the nearest of many."""
    curve, found = CURVES[name], divided(CURVES[name])
    pieces, u0 = pieces_of(curve), np.linspace(0, 1, 401)
    points = on_segments(found, np.array([0.0, 0.2, 0.6]))[:, :, 0]
    for owner in np.unique(found.owner):
        piece = pieces[owner : owner + 1]
        coarse = at(piece, u0)[0][0]
        for q in points[found.owner == owner].reshape(-1, points.shape[-1]):
            u = u0[np.linalg.norm(coarse - q, axis=1).argmin()]
            for _ in range(6):
                p, rate, bend = (part[0, 0] for part in at(piece, np.array([u])))
                u = np.clip(u - (p - q) @ rate / (rate @ rate + (p - q) @ bend), 0.0, 1.0)
            assert np.linalg.norm(at(piece, np.array([u]))[0][0, 0] - q) < 1e-12
    u = np.linspace(curve.knots[0], curve.knots[-1], 200_001)
    length = np.linalg.norm(np.diff(curve.at(u), axis=0), axis=1).sum()
    assert found.length.sum() == pytest.approx(length, rel=1e-6)


@pytest.mark.parametrize("name", CURVES)
def test_the_parameter_is_like_the_arc_length(name: str) -> None:
    found = divided(CURVES[name])
    p = on_segments(found, np.linspace(0, 1, 101))
    speed = np.linalg.norm(p[:, :, 1], axis=2)
    np.testing.assert_allclose(speed[:, [0, -1]], 1.0, atol=1e-12)
    assert np.abs(speed - 1.0).max() < 1.02 * UNEVEN
    ends = p[:, [0, -1]]
    along = (ends[:, :, 1] * ends[:, :, 2]).sum(axis=2)
    assert np.abs(along).max() < 1e-10 * max(found.curvature.max(), 1.0)
    np.testing.assert_allclose(p[1:, 0, 0], p[:-1, -1, 0], atol=1e-12)


@pytest.mark.parametrize("name", CURVES)
def test_bounds_hold_between_the_places_looked_at(name: str) -> None:
    found = divided(CURVES[name])
    p = on_segments(found, np.linspace(0, 1, 7 * PLACES))
    speed = np.linalg.norm(p[:, :, 1], axis=2)
    assert (np.linalg.norm(p[:, :, 2], axis=2) <= found.curvature[:, None]).all()
    # curvature and |r'''| by the arc length, by differences of unit tangents
    t = p[:, :, 1] / speed[..., None]
    ds = found.length[:, None] / (7 * PLACES - 1) * 0.5 * (speed[:, 1:] + speed[:, :-1])
    turned = np.linalg.norm(np.diff(t, axis=1), axis=2) / ds
    assert (turned <= found.curvature[:, None] * (1 + 1e-6)).all()
    second = np.diff(t, axis=1) / ds[..., None]
    third = np.linalg.norm(np.diff(second, axis=1), axis=2) / (0.5 * (ds[:, 1:] + ds[:, :-1]))
    assert (third <= found.curves.twist[:, None] * (1 + 1e-3) + 1e-6).all()


def test_legs_give_the_derivatives_of_their_points() -> None:
    toolpath = toolpath_of("G1 X5\nG5 X9 Y6 I2 J1 P1 Q-2\nG5.1 X15 Y2 I1 J3")
    legs = legs_of(toolpath)
    table, out, before, after, tangent = legs.table, *(np.empty((4, 3)) for _ in range(3)), np.empty(3)
    curved = np.flatnonzero(table["curve"])
    assert len(curved) >= 2
    h = 1e-4
    for leg in curved:
        for share in (0.1, 0.5, 0.8):
            x = share * legs.length[leg]
            leg_point(table, leg, x, out)
            leg_point(table, leg, x - h, before)
            leg_point(table, leg, x + h, after)
            np.testing.assert_allclose((after - before)[:3] / (2 * h), out[1:], atol=1e-6)
            leg_tangent(table, leg, x, tangent)
            np.testing.assert_allclose(tangent, out[1], atol=1e-14)


KINK = "G6.2 P3 K0 X0 Y0\nK0 X4 Y6\nK0 X8\nK1 X9 Y1\nK1 X15 Y8\nK2\nK2\nK2"  # the tangent turns at the double knot


@pytest.mark.parametrize(("mode", "how"), [("G64", Joint.CORNER), ("G61", Joint.STOP), ("G61.1", Joint.STOP)])
def test_a_spline_goes_on_smoothly_inside_and_turns_at_its_kinks(mode: str, how: Joint) -> None:
    toolpath = toolpath_of(mode + "\n" + KINK)
    inner = toolpath.joint[1:-1]
    assert (inner == how).sum() == 1
    assert (inner == Joint.SMOOTH).sum() == len(inner) - 1 > 0
    assert toolpath.theta[1:-1][inner == Joint.SMOOTH].max() < 1e-10
    assert parts_of(toolpath).still.sum() == 3  # two moves from rest to rest


def test_a_jump_of_the_curvature_parts_the_moves_of_stop() -> None:
    even = "\n".join(["G5.2 X1 Y6 L3", "X8 Y0", "X9 Y5", "X12 Y0", "G5.3"])
    toolpath = toolpath_of(even)
    assert (toolpath.joint[1:-1] == Joint.SMOOTH).all()
    assert parts_of(toolpath).still.sum() == 4  # three parabolas
    assert (
        parts_of(toolpath_of(even.replace("L3", "L4"))).still.sum() == 2
    )  # cubics meet with their curvature


def test_straight_splines_are_lines_whatever_their_control_points() -> None:
    toolpath = toolpath_of("G5 X10 Y5 I0 J0 P0 Q0")
    assert toolpath.length.sum() == pytest.approx(np.hypot(10, 5), rel=1e-12)
    assert toolpath.curvature.max() < 1e-8


@pytest.mark.parametrize(
    ("text", "chords"),
    [
        ("G5 X10 Y5 I0 J0 P0 Q4", 1),  # an arm of length zero
        ("G5 X10 Y0 I10 J10 P-10 Q10", 2),  # a cusp in the middle
        ("G5 X10 Y0 I12 J10 P-10 Q10", 0),  # a narrow loop
        ("G5 X0 Y0 I6 J0 P6 Q0", 0),  # there and back on a line
    ],
)
def test_where_a_spline_stands_still_short_chords_stand_for_it(text: str, chords: int) -> None:
    toolpath = toolpath_of(text)
    on_chord = toolpath.straight & (toolpath.block == 1)
    assert on_chord.sum() == chords
    assert toolpath.length[on_chord].sum() < 0.01
    np.testing.assert_allclose(toolpath.start[1:], toolpath.end[:-1], atol=1e-12)
    # every control point's curve is near: the ends of all segments are on the program's own curve
    program = parse_program((HEAD + text + "\nM2\n").encode())
    points = at(homogeneous(program.splines.points, program.splines.weights), np.linspace(0, 1, 200_001))[0][
        0
    ]
    for q in toolpath.start:
        assert np.linalg.norm(points - q, axis=1).min() < 2e-4
    reversal = (toolpath.resting().joint[1:-1] == Joint.STOP).sum()
    assert reversal == (1 if "I10" in text or "I6" in text else 0)


def test_chords_stay_within_their_sagitta() -> None:
    toolpath = toolpath_of("G1 X5\nG5 X29 Y6 I12 J1 P1 Q-12\nG1 X40")
    count, sagitta = arc_sagitta(toolpath, 0.5)
    curve = np.flatnonzero(toolpath.curve >= 0)
    assert (count[curve] > 1).all()
    assert (sagitta[curve] <= 0.5 * 0.01 * (1 + 1e-12)).all()
    for i in curve:
        ends = np.linspace(0, toolpath.length[i], count[i] + 1)
        for a, b in pairwise(ends):
            points = points_on(toolpath, np.full(9, i), np.linspace(a, b, 9))
            u = (points[-1] - points[0]) / np.linalg.norm(points[-1] - points[0])
            off = points - points[0]
            assert np.linalg.norm(off - (off @ u)[:, None] * u, axis=1).max() <= sagitta[i]
    lines = chorded(toolpath, 0.5, np.zeros(len(toolpath), bool))
    assert lines.straight.all()
    assert len(lines) == count.sum()
    np.testing.assert_allclose(lines.start[1:], lines.end[:-1])


def test_an_axis_that_only_control_points_move_is_an_axis() -> None:
    toolpath = toolpath_from_program(
        parse_program((HEAD + "G5.1 X4 Y0 I2 J3\nM2").encode()), load_machine("plotter")
    )
    assert toolpath.axes == ("x", "y")
    assert toolpath.curves.points.shape[2] == 2


def test_block_ends_have_the_length_of_their_segments() -> None:
    toolpath = toolpath_of("G1 X5\nG5 X29 Y6 I12 J1 P1 Q-12\nG1 X40")
    ends = toolpath.block_ends()
    assert ends.block.tolist() == [1, 2, 3]
    assert ends.length.sum() == pytest.approx(toolpath.length.sum(), rel=1e-14)
    assert toolpath_of("G1 X5").block_ends().straight.all()
