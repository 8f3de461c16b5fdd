"""Pen, speed, units and scaling of plotter files."""

from __future__ import annotations

import numpy as np
import pytest
from drawings import UNIT

from planner.geometry.build import toolpath_from_program
from planner.geometry.toolpath import Joint
from planner.machine import Machine, Plotter, load_machine
from planner.nc.program import Kind, Program
from planner.nc.reader import parse_program

MACHINE = load_machine("plotter")


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
        ("SP1;PD40,0;SP2;PA80,0;SP2;SP;", ["M5", "T1", "M6", "STOP", "M3", "STOP", "LINE", "M5", "STOP", "T2", "M6", "STOP",
                                           "M3", "STOP",
                                           "LINE", "M5", "STOP", "T0", "M6", "STOP", "M3", "STOP"]),
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


def test_relative_places_are_in_the_units_of_each_axis():
    """200 x 50 plotter units are 100 x 100 user units: a step of (10, 20) is one of (20, 10)."""
    program = parse_program("IP0,0,200,50;SC0,100,0,100;PU10,20;PR10,20;PU10,20", source="x.plt")
    np.testing.assert_allclose(program.end[:, :2] / UNIT, [(20, 10), (40, 20), (60, 30)])


def test_scaling_goes_on_and_off():
    text = "IP0,0,100,100;SC0,1,0,1;PU1,1;IP10,10;PU1,1;SC;PU1,1;SC0,1,0,1;PU1,1;DF;PU1,1;SC0,1,0,1;IN;PU1,1"
    program = parse_program(text, source="x.plt")
    np.testing.assert_allclose(program.end[:, 0] / UNIT, [100, 110, 1, 110, 1, 1])
