"""Plotter files: the same drawing in several dialects reads as the same path, and nothing is left out silently.

A drawing is made as a list of strokes, whose path follows from geometry alone (`expected`), and written in a dialect
(`written`); the reader must find the path again. Real files are compared with a reader of a dozen lines (`naive`).
"""

from __future__ import annotations

import json
import math
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.base.errors import InputError
from planner.geometry.build import toolpath_from_program
from planner.geometry.toolpath import Joint
from planner.machine import Machine, Plotter, load_machine
from planner.nc.dialects import is_plotter_file
from planner.nc.hpgl.instructions import FORMS, IGNORED, REFUSED
from planner.nc.info import inspect_program
from planner.nc.program import Kind, Program
from planner.nc.reader import parse_program, read_program
from planner.nc.text import program_text

UNIT = 0.025  # [mm]
FINE = 1e-9  # [mm] rounding of coordinates around 1e3 mm, added up over a relative drawing
MACHINE = load_machine("plotter")

# --- a drawing and its path -------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Move:
    """What the pen does next: a straight move or, with a sweep [rad], an arc; all in mm and mm/s."""

    down: bool
    end: tuple[float, float]
    feed: float
    centre: tuple[float, float] = (0.0, 0.0)
    sweep: float = 0.0


Stroke = tuple  # ("up" | "down", points) | ("arc", centre, degrees) | ("circle", radius) | ("box", corner) | ("speed", v)


def expected(strokes: list[Stroke]) -> list[Move]:
    """The path of a drawing, straight from the meaning of its strokes; coordinates in plotter units."""
    moves: list[Move] = []
    at, down, feed = np.zeros(2), False, math.inf

    def go(end, lowered, **arc):
        nonlocal at
        at = np.asarray(end, dtype=float)
        moves.append(Move(lowered, tuple(at * UNIT), feed if lowered else math.inf, **arc))

    for kind, *given_ in strokes:
        if kind in ("up", "down"):
            down = kind == "down"
            for point in given_[0]:
                go(point, down)
        elif kind == "arc":
            centre, sweep = np.array(given_[0], dtype=float), math.radians(given_[1])
            turn = np.array([[math.cos(sweep), -math.sin(sweep)], [math.sin(sweep), math.cos(sweep)]])
            end = centre + turn @ (at - centre)
            arc = {"centre": tuple(centre * UNIT), "sweep": sweep} if down else {}
            go(end, down, **arc)
        elif kind == "circle":
            centre = at
            go([centre[0] + given_[0], centre[1]], False)
            go(at, True, centre=tuple(centre * UNIT), sweep=2 * math.pi)
            go(centre, False)
        elif kind == "box":
            (x0, y0), (x1, y1) = at, given_[0]
            for corner in ((x1, y0), (x1, y1), (x0, y1), (x0, y0)):
                go(corner, True)
        else:
            feed = 10.0 * given_[0]
    return moves


@dataclass(frozen=True)
class Dialect:
    """How a program writes: between numbers, after instructions, capitals, absolute or relative, points per instruction."""

    comma: str
    end: str
    lower: bool
    relative: bool
    at_once: int
    decimals: bool
    by_plot: bool  # PD;PA1,2 in place of PD1,2

    def number(self, value: float) -> str:
        text = f"{value:.4f}" if self.decimals or value != round(value) else f"{value:.0f}"
        return "+" + text if self.comma == "" and not text.startswith("-") else text

    def line(self, name: str, *numbers: float) -> str:
        text = name + self.comma.join(self.number(value) for value in numbers)
        return (text.lower() if self.lower else text) + self.end


def written(strokes: list[Stroke], dialect: Dialect) -> str:
    """The drawing as HPGL. Relative coordinates are written to four decimals, which the strokes below have exactly."""
    said = [dialect.line("IN"), dialect.line("PR" if dialect.relative else "PA")]
    at, down = np.zeros(2), False
    for kind, *given_ in strokes:
        if kind in ("up", "down"):
            down = kind == "down"
            name = "PD" if down else "PU"
            points = np.array(given_[0], dtype=float).reshape(-1, 2)
            plotted = np.diff(points, axis=0, prepend=at[None]) if dialect.relative else points
            if dialect.by_plot or not len(points):
                said.append(dialect.line(name))
                name = "PR" if dialect.relative else "PA"
            for first in range(0, len(points), dialect.at_once):
                said.append(dialect.line(name, *plotted[first : first + dialect.at_once].ravel()))
            at = points[-1] if len(points) else at
        elif kind == "arc":
            centre = np.array(given_[0], dtype=float)
            said.append(
                dialect.line("AR", *(centre - at), given_[1])
                if dialect.relative
                else dialect.line("AA", *centre, given_[1])
            )
            at = 2 * centre - at  # the arcs below are half circles, or full ones
            at = at if abs(given_[1]) == 180 else 2 * centre - at
        elif kind == "circle":
            said.append(dialect.line("CI", given_[0]))
        elif kind == "box":
            corner = np.array(given_[0], dtype=float)
            said.append(
                dialect.line("ER", *(corner - at)) if dialect.relative else dialect.line("EA", *corner)
            )
        else:
            said.append(dialect.line("VS", given_[0]))
    return "".join(said)


whole = st.integers(-20000, 20000)
point = st.tuples(whole, whole)
stroke = st.one_of(
    st.tuples(st.sampled_from(["up", "down"]), st.lists(point, max_size=4)),
    st.tuples(st.just("arc"), point, st.sampled_from([180, -180, 360, -360])),
    st.tuples(st.just("circle"), st.integers(1, 5000)),
    st.tuples(st.just("box"), point),
    st.tuples(st.just("speed"), st.integers(1, 60)),
)
dialect = st.builds(
    Dialect,
    comma=st.sampled_from([",", " ", " , ", ",\r\n", ""]),
    end=st.sampled_from([";", "", ";\n", "\r\n;", " "]),
    lower=st.booleans(),
    relative=st.booleans(),
    at_once=st.integers(1, 3),
    decimals=st.booleans(),
    by_plot=st.booleans(),
)


def path_of(program: Program) -> list[Move]:
    """The moving blocks of a program."""
    arc = {block: row for row, block in enumerate(program.arc_block.tolist())}
    moves = []
    for k, kind in enumerate(program.kind):
        if kind <= Kind.ARC:
            end = tuple(program.end[k, :2])
            how = {}
            if k in arc:
                centre = tuple(program.arc_center[arc[k], :2])
                how = {"centre": centre, "sweep": program.arc_sweep[arc[k]]}
            moves.append(Move(kind != Kind.RAPID, end, program.feed[k], **how))
    return moves


def assert_same_path(found: list[Move], wanted: list[Move], atol: float, *, feeds: bool = True) -> None:
    assert [(m.down, m.sweep != 0) for m in found] == [(m.down, m.sweep != 0) for m in wanted]
    for name in ("end", "centre", "sweep", *(["feed"] if feeds else [])):
        a, b = (np.array([getattr(m, name) for m in moves]) for moves in (found, wanted))
        np.testing.assert_allclose(a, b, rtol=1e-12, atol=atol, err_msg=name)


def drawable(strokes: list[Stroke]) -> bool:
    """No arc about the point that the pen stands on."""
    at = np.zeros(2)
    for kind, *given_ in strokes:
        if kind in ("up", "down") and given_[0]:
            at = np.array(given_[0][-1])
        elif kind == "arc":
            if (at == given_[0]).all():
                return False
            at = 2 * np.array(given_[0]) - at if abs(given_[1]) == 180 else at
    return True


drawings = st.lists(stroke, min_size=1, max_size=12).filter(drawable)


@given(strokes=drawings, dialect=dialect)
@settings(max_examples=200)
def test_every_dialect_reads_as_the_same_path(strokes, dialect):
    program = parse_program(written(strokes, dialect), source="drawing.plt")
    assert_same_path(path_of(program), expected(strokes), FINE)


@given(
    strokes=drawings, dialect=dialect, scale=st.sampled_from([0.1, 0.5, 2.54, 40.0]), mirrored=st.booleans()
)
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
@settings(max_examples=60)
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


# --- the pen ------------------------------------------------------------------------------------------------------------------


def told(program: Program) -> list[str]:
    """Events and blocks in their order, in short."""
    events, said = list(program.events), []
    for k, kind in enumerate(program.kind):
        said += [e.text for e in events if e.block == k]
        said.append(Kind(kind).name)
    return said + [e.text for e in events if e.block == len(program)]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("PU0,40;PD0,80;PU;", ["M5", "RAPID", "M3", "STOP", "LINE", "M5", "STOP"]),
        ("PU;PU;PD;PD;PU", ["M5", "M3", "STOP", "M5", "STOP"]),  # a dot
        ("SP1;PD40,0;SP2;PA80,0;SP2;SP;", ["M5", "T1", "STOP", "M3", "STOP", "LINE", "M5", "STOP", "T2", "STOP", "M3", "STOP",
                                           "LINE", "M5", "STOP", "T0", "STOP", "M3", "STOP"]),
        ("PD40,0;CI40;", ["M5", "M3", "STOP", "LINE", "M5", "STOP", "RAPID", "M3", "STOP", "ARC", "M5", "STOP", "RAPID",
                          "M3", "STOP"]),
        ("EA40,40", ["M5", "M3", "STOP", "LINE", "LINE", "LINE", "LINE", "M5", "STOP"]),
        ("PD40,0;IN;PA0,0", ["M5", "M3", "STOP", "LINE", "M5", "STOP", "RAPID"]),  # IN raises the pen
        ("PU40,0;AA0,0,90", ["M5", "RAPID", "RAPID"]),  # pen up there is no need to follow the arc
        ("PD40,0;AA0,0,0.00001", ["M5", "M3", "STOP", "LINE", "LINE"]),  # too short for an arc
    ],
)  # fmt: skip
def test_the_pen(text, said):
    assert told(parse_program(text, source="x.plt")) == said


def test_the_motion_stops_where_the_pen_moves_for_as_long_as_the_machine_says():
    text = "VS10;PU400,0;PD800,0,800,400;PU0,0;"
    for blend in (False, True):
        machine = MACHINE.model_copy(update={"blend_rapids": blend})
        path = toolpath_from_program(parse_program(text, machine, source="x.plt"), machine)
        assert path.axes == ("x", "y")
        assert path.joint.tolist() == [Joint.STOP, Joint.STOP, Joint.CORNER, Joint.STOP, Joint.STOP]
        assert path.dwell.tolist() == [0, MACHINE.plotter.pen_down, 0, MACHINE.plotter.pen_up, 0]
    free = parse_program(text, load_machine("mill"), source="x.plt")
    assert free.dwell.sum() == 0
    assert (free.kind == Kind.STOP).sum() == 2


def test_speeds_are_those_of_the_pen_in_the_holder():
    text = "PD40,0;VS10;PA80,0;VS20,2;SP2;PA120,0;SP1;PA160,0;VS;PA200,0;VS5;IN;PD0,0"
    program = parse_program(text, source="x.plt")
    assert program.feed[program.kind == Kind.LINE].tolist() == [np.inf, 100, 200, 100, np.inf, np.inf]
    assert "line 1: no speed (VS) before it; the pen runs as fast as the machine allows" in program.notes
    assert not any("VS" in note for note in parse_program("VS1;PD40,0", source="x.plt").notes)


def test_the_plotter_unit_is_the_machines():
    data = MACHINE.model_dump() | {"plotter": Plotter(unit=0.01)}
    program = parse_program("PU100,-50;CI10", Machine(**data), source="x.plt")
    np.testing.assert_allclose(program.end[0], [1.0, -0.5, 0.0])
    assert program.arc_center[0].tolist() == [1.0, -0.5, 0.0]


@pytest.mark.parametrize(
    ("extra", "origin", "factor"),
    [
        (
            ",1",
            (50, 0),
            (1, 1),
        ),  # isotropic: 100 of 200 units are left over in x, half of them before the drawing
        (",1,0,0", (0, 0), (1, 1)),
        (",1,100,7", (100, 0), (1, 1)),
        (",0", (0, 0), (2, 1)),
    ],
)
def test_types_of_scaling(extra, origin, factor):
    program = parse_program(f"IP0,0,200,100;SC0,100,0,100{extra};PU10,20", source="x.plt")
    np.testing.assert_allclose(program.end[0, :2], UNIT * (np.array(origin) + np.array([10, 20]) * factor))


def test_scaling_goes_on_and_off():
    text = "IP0,0,100,100;SC0,1,0,1;PU1,1;IP10,10;PU1,1;SC;PU1,1;SC0,1,0,1;PU1,1;DF;PU1,1;SC0,1,0,1;IN;PU1,1"
    program = parse_program(text, source="x.plt")
    np.testing.assert_allclose(program.end[:, 0] / UNIT, [100, 110, 1, 110, 1, 1])


# --- faults -------------------------------------------------------------------------------------------------------------------

FAULTS = [
    ("IN;\nPU0,0;ZZ1;", 2, 7, ["ZZ1", "no such instruction", *FORMS]),
    ("IN;LBHello\x03;PD1,1", 1, 4, ["LB", "text", "outlines"]),
    ("PU1,2,3;", 1, 1, ["PU1,2,3", "3 numbers found", "PU x,y,..."]),
    ("PU1,2;AA1,2;", 1, 7, ["2 numbers found", "AA x,y,sweep"]),
    ("PU1,,2;", 1, 5, ["a number is missing before this comma"]),
    ("PU,1,2;", 1, 3, ["a number is missing"]),
    ("PU1.2.3,4", 1, 6, ["this is no number"]),
    ("PU1,--4", 1, 5, ["this is no number"]),
    ("PU1,2e9;", 1, 6, ["a letter by itself"]),
    ("PU1,2000000000;", 1, 5, ["too large", "1e+09"]),
    ("PU1,1-2000000000;", 1, 6, ["too large"]),
    ("PU1,1;#PD2,2", 1, 7, ["this character starts no instruction"]),
    ("PU1,1;12;PD2,2", 1, 7, ["a number without an instruction"]),
    ("PU1,1;AA1,1,90", 1, 7, ["no radius"]),
    ("PU1,1;AA0,0,0", 1, 7, ["a sweep of 0 degrees", "-360 to 360"]),
    ("PU1,1;AR0,1,361", 1, 7, ["a sweep of 361 degrees"]),
    ("CI0", 1, 1, ["radius 0"]),
    ("VS0;PD1,1", 1, 1, ["speed must be positive"]),
    ("SP1.5", 1, 1, ["whole number"]),
    ("SP-1", 1, 1, ["whole number"]),
    ("SC0,1,0,1;PD1,1", 1, 1, ["without IP", "paper"]),
    ("IP0,0;SC0,1,0,1;", 1, 7, ["without IP"]),
    ("SC0,1,0,1,2;", 1, 1, ["without IP"]),
    ("IP0,0,1,1;SC0,0,0,1", 1, 11, ["range of user units is empty"]),
    ("IP0,0,0,1;SC0,1,0,1", 1, 11, ["a scale of 0"]),
    ("IP0,0,1,1;SC0,1,0,1,3", 1, 11, ["type 3", "0, 1 and 2"]),
    ("IP0,0,20,10;SC0,1,0,1;CI1", 1, 23, ["ellipse", "x by 20 and y by 10"]),
    ("PD1,1;PG;PD2,2;PD3,3", 1, 7, ["PG", "one file for each page"]),
    ("RO90;PD1,1", 1, 1, ["turning"]),
    ("SM*;PD1,1", 1, 1, ["symbols"]),
    ("PE<=>;PD1,1", 1, 1, ["encoded"]),
    ("", 1, 1, ["no instruction in it"]),
    (";\n;", 1, 1, ["no instruction in it"]),
    ("PD1,1\0", 1, 6, ["NUL"]),
]  # fmt: skip


@pytest.mark.parametrize(("text", "line", "column", "parts"), FAULTS, ids=lambda v: str(v)[:30])
def test_faults(text, line, column, parts):
    with pytest.raises(InputError) as caught:
        parse_program(text, source="job.plt")
    assert (caught.value.source, caught.value.line, caught.value.column) == ("job.plt", line, column)
    for part in parts:
        assert part in caught.value.message


def test_all_faults_are_found_in_their_order(tmp_path):
    path = tmp_path / "job.plt"
    path.write_text("IN;PD1,1;\nXX;PD2,2;RO90;\n!PG;PD3,3;VS0;")
    found = inspect_program(path)
    assert [(fault.line, fault.column, fault.word) for fault in found.unsupported] == [
        (2, 1, "XX"), (2, 10, "RO90"), (3, 1, "!"), (3, 2, "PG"), (3, 11, "VS0"),
    ]  # fmt: skip
    assert found.blocks["line"] == 3


@pytest.mark.parametrize("name", sorted(IGNORED))
def test_ignored_instructions_are_noted(name):
    end = "text;\x03" if name in ("WD", "BL", "MG") else ";"
    program = parse_program(f"IN;PD40,0;{name}{end}\nPD80,0;{name}{end}PD80,40", source="x.plt")
    assert (program.kind == Kind.LINE).sum() == 3
    assert any(note.startswith(f"{name} ignored") and IGNORED[name] in note for note in program.notes)


@pytest.mark.parametrize("name", sorted(REFUSED))
def test_refused_instructions_say_what_to_do(name):
    with pytest.raises(InputError) as caught:
        parse_program(f"IN;{name}1;", source="x.plt")
    assert REFUSED[name] in caught.value.message


def test_what_is_left_out_is_noted():
    text = "\x1b.(;\x1b.I81;;17:\x1b%-12345X@PJL ENTER LANGUAGE=HPGL2\n\x1b%0BIN;SP1;PD40,40;SM;\x1b%0A$\x1a"
    program = parse_program(text)
    assert_same_path(path_of(program), [Move(True, (1.0, 1.0), math.inf)], FINE)
    assert "device control (ESC sequences, @PJL lines) is left out" in program.notes
    assert "the file ends with '$\\x1a', which is no instruction; left out" in program.notes
    assert any(note.startswith("SM ignored") for note in program.notes)
    assert "1 plotter unit = 0.025 mm" in program.notes[0]


# --- which language -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "text", "hpgl"),
    [
        ("a.plt", "IN;PD1,1;", True),
        ("a.ngc", "IN;SP1;PD1,1;", True),  # by content
        ("a", "\x1b.(;INSP1", True),
        ("a.PLT", ";PU1,1;PD2,2", True),  # by name
        ("a.ngc", ";PU1,1;PD2,2", False),  # a comment
        ("a.plt", "%\n(made by hand)\nG21 G1 X1 F100", False),
        ("a.hpgl", "N10 G0 X1", False),
        ("a.plt", "", True),
        ("a.MPF", "PROC MAIN\nG0 X1", False),
        ("a.nc", "G21\nG1 X1", False),
        ("a.nc", "S1000 M3", False),
    ],
)
def test_the_language_of_a_file(name, text, hpgl):
    assert is_plotter_file(text.encode(), name) is hpgl


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


def test_info_of_a_plotter_file(tmp_path):
    from typer.testing import CliRunner

    from planner.cli import app

    path = tmp_path / "job.plt"
    path.write_text("IN;SP1;PU0,0;PD400,0;CI200;")
    result = CliRunner().invoke(app, ["info", str(path), "-m", "plotter"])
    assert result.exit_code == 0, result.output
    assert "as fast as the machine allows" in result.stdout
    assert "every construct is supported" in result.stdout
    said = json.loads(CliRunner().invoke(app, ["info", str(path), "--json"]).stdout)
    assert said["blocks"] == {"rapid": 3, "line": 1, "arc": 1, "dwell": 0, "stop": 6}
    assert said["feed"] == [None, None]
