"""Plotter files: the same drawing in several dialects reads as the same path.

A drawing is made as a list of strokes, whose path follows from geometry alone (`expected`), and written in a dialect
(`written`); the reader must find the path again. Real files are compared with a reader of a dozen lines (`naive`).
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from drawings import FINE, UNIT, Move, assert_same_path, dialect, drawings, expected, path_of, written
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.geometry.build import toolpath_from_program
from planner.machine import load_machine
from planner.nc.program import Kind, Program
from planner.nc.reader import parse_program, read_program
from planner.nc.writer import program_text

MACHINE = load_machine("plotter")


@pytest.mark.shows("read-plotters", "exact: one drawing in several dialects is one path")
@pytest.mark.slow
@given(strokes=drawings, dialect=dialect)
@settings(max_examples=40)
def test_every_dialect_reads_as_the_same_path(strokes, dialect):
    program = parse_program(written(strokes, dialect), source="drawing.plt")
    assert_same_path(path_of(program), expected(strokes), FINE)


@pytest.mark.slow
@given(
    strokes=drawings, dialect=dialect, scale=st.sampled_from([0.1, 0.5, 2.54, 40.0]), mirrored=st.booleans()
)
@settings(max_examples=40)
def test_user_units_scale_the_drawing(strokes, dialect, scale, mirrored):
    """With P1 at (100, 200): user coordinates are plotter units * scale, mirrored about x = 0 where asked."""
    sx = -scale if mirrored else scale
    text = written(strokes, dialect)
    head, rest = text[: len(dialect.line("IN"))], text[len(dialect.line("IN")) :]
    window = "".join(
        [dialect.line("IP", 100, 200, 100 + 10 * sx, 200 + 10 * scale), dialect.line("SC", 0, 10, 0, 10)]
    )
    point_factor = "".join([dialect.line("IP", 100, 200), dialect.line("SC", 0, sx, 0, scale, 2)])
    turn = np.array([sx, scale])
    wanted = []
    for move in expected([("up", []), *strokes]):
        end, centre = (np.array(p) * turn + [100 * UNIT, 200 * UNIT] for p in (move.end, move.centre))
        sweep = -move.sweep if mirrored else move.sweep
        wanted.append(Move(move.down, tuple(end), move.feed, tuple(centre) if sweep else (0, 0), sweep))
    for scaling in (window, point_factor):
        # the first position is the plotter's origin, which is not the user's: go there first
        text = head + scaling + "PU;PA0,0;" + rest
        moves = path_of(parse_program(text, source="drawing.plt"))[1:]
        assert_same_path(moves, wanted, 1e-6 * scale + 1e-8)


@given(strokes=drawings, dialect=dialect, seed=st.integers(0, 1000))
@settings(max_examples=30)
def test_the_nc_text_of_a_drawing_reads_back_as_the_same_program(strokes, dialect, seed):
    """Blocks, dwells and events one by one; the path within 1e-6 mm; feeds as asked, rounded down by at most 0.1 %."""
    program = parse_program(written(strokes, dialect), MACHINE, source="drawing.plt")
    feeds = np.random.default_rng(seed).uniform(0.1, 900.0, len(program))
    read = parse_program(program_text(program, feeds, 0.05), MACHINE)
    np.testing.assert_array_equal(read.kind, program.kind)
    np.testing.assert_array_equal(read.dwell, program.dwell)
    assert [(e.block, e.text) for e in read.events] == [(e.block, e.text) for e in program.events]
    assert_same_path(path_of(read), path_of(program), 1e-6, feeds=False)
    cut = (read.kind == Kind.LINE) | (read.kind == Kind.ARC)
    assert (read.feed[cut] <= feeds[cut] * (1 + 1e-12)).all()
    assert (read.feed[cut] > feeds[cut] * 0.999).all()
    assert (read.tolerance == 0.05).all()


# --- real files ---------------------------------------------------------------------------------------------------------------


def naive(text: str) -> tuple[np.ndarray, np.ndarray]:
    """End points [mm] and pen of a file that has PU, PD with absolute coordinates and nothing else that moves."""
    ends, downs = [], []
    for name, field in re.findall(r"(P[UD])([^A-Z;]*)", text):
        values = [float(value) for value in field.replace(",", " ").split()]
        for k in range(0, len(values), 2):
            ends.append((values[k] * UNIT, values[k + 1] * UNIT))
            downs.append(name == "PD")
    return np.array(ends), np.array(downs)


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", ["aiten__CNCLib__hedgehog.hpgl", "straight-coding__gcode-hpgl-viewer__B_Fabric_Nesting.plt"]
)
def test_real_files(shared_dir: Path, name: str):
    path = shared_dir / "nc" / name
    program = read_program(path, MACHINE)
    ends, downs = naive(path.read_text())
    moving = program.kind <= Kind.LINE
    np.testing.assert_allclose(program.end[moving][:, :2], ends, rtol=0, atol=FINE)
    np.testing.assert_array_equal(program.kind[moving] == Kind.LINE, downs)
    assert (~moving).sum() == (np.diff(downs, prepend=False, append=False) != 0).sum() - int(
        downs[-1]
    ) + told_pens(program)
    path_length = toolpath_from_program(program, MACHINE).length.sum()
    np.testing.assert_allclose(
        path_length, np.linalg.norm(np.diff(ends, axis=0, prepend=[[0, 0]]), axis=1).sum()
    )


def told_pens(program: Program) -> int:
    return sum(event.text.startswith("T") for event in program.events)


@pytest.mark.parametrize("seed", range(20))
def test_arcs_through_three_points_are_those_about_their_centre(seed):
    """AT and RT draw what AA draws: the arc through a point of it, whichever way it turns."""
    rng = np.random.default_rng(seed)
    centre, start = rng.uniform(-4000, 4000, (2, 2))
    degrees = rng.uniform(5, 355) * rng.choice([-1, 1])
    through, end = (_turned(start, centre, angle) for angle in (rng.uniform(0.1, 0.9) * degrees, degrees))
    x, y = start
    about = f"IN;PU{x:.9f},{y:.9f};PD;AA{centre[0]:.9f},{centre[1]:.9f},{degrees:.9f};"
    absolute = f"IN;PU{x:.9f},{y:.9f};PD;AT{through[0]:.9f},{through[1]:.9f},{end[0]:.9f},{end[1]:.9f};"
    relative = "IN;PU{:.9f},{:.9f};PD;RT{:.9f},{:.9f},{:.9f},{:.9f};".format(
        x, y, *(through - start), *(end - start)
    )
    wanted = path_of(parse_program(about, source="x.plt"))
    for text in (absolute, relative):
        found = path_of(parse_program(text, source="x.plt"))
        radius = np.hypot(*(start - centre)) * 0.025
        assert_same_path(found, wanted, 1e-6 * max(radius, 1.0))


def _turned(point, centre, degrees):
    angle = np.deg2rad(degrees)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    return centre + turn @ (point - centre)


def test_three_points_on_a_line_and_a_circle():
    line = path_of(parse_program("IN;PD;AT400,0,800,0;", source="x.plt"))
    assert [(tuple(move.end), move.sweep) for move in line if move.down] == [((20.0, 0.0), 0.0)]
    (circle,) = [m for m in path_of(parse_program("IN;PD;AT800,0,0,0;", source="x.plt")) if m.down]
    assert circle.sweep == pytest.approx(2 * np.pi)
    assert tuple(circle.centre) == (10.0, 0.0)
