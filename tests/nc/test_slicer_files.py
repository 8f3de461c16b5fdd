"""Files as five slicers write them for fifty printers are read with no option, and lead where they should."""

from __future__ import annotations

import re

import numpy as np
import pytest
from same_program import machine
from slicer_files import AT, HEIGHT, LAYERS, LINE, SIDE, Printer, file_of, printers
from test_extruder import PRINTER

from planner.nc.program import Kind
from planner.nc.reader import parse_program

PRINTERS = printers()


def test_there_are_fifty_of_five_slicers() -> None:
    assert (len(PRINTERS), len({printer.slicer for printer in PRINTERS.values()})) == (50, 5)


@pytest.mark.shows("read-printers", "exact: the ends of moves in files as five slicers write them")
@pytest.mark.parametrize("name", PRINTERS)
def test_is_read_and_leads_where_it_should(name: str) -> None:
    printer = PRINTERS[name]
    text = file_of(printer)
    before, behind = (part.count("\n") for part in (printer.start, printer.end))
    lines = text.splitlines()
    body = range(before, len(lines) - behind)
    sides = [k + 1 for k in body if re.match(r"G[13] X\S+ Y\S+ .*E", lines[k])]
    corners = np.array([[AT + SIDE, AT], [AT + SIDE] * 2, [AT, AT + SIDE], [AT, AT]])
    height = np.repeat(HEIGHT * np.arange(1, LAYERS + 1), len(corners)) + _shift(printer)
    places = np.column_stack([np.tile(corners, (LAYERS, 1)), height])
    for program in (parse_program(text, machine()), parse_program(text, PRINTER)):
        side = np.isin(program.line, sides)
        np.testing.assert_allclose(program.end[side], places, atol=1e-9)
        assert program.line[side].tolist() == sides
    np.testing.assert_allclose(
        program.extruded[side], LINE * _factor(printer), rtol=1e-4
    )  # E has five digits
    back = (program.kind == Kind.STOP) & (program.extruded < 0.0) & np.isin(program.line, np.array(body) + 1)
    assert np.count_nonzero(back) >= (LAYERS if _retracts(printer) else 0)


def _shift(printer: Printer) -> float:
    """Height that SET_GCODE_OFFSET adds [mm]."""
    return 0.02 if "Z_ADJUST=0.02" in printer.start else 0.0


def _factor(printer: Printer) -> float:
    """Filament by E: the flow, or the area of volumetric E."""
    if "M200 D1.75" in printer.start:
        return 1.0 / (np.pi * 1.75**2 / 4.0)
    return 0.95 if "M221 S95" in printer.start else 1.0


def _retracts(printer: Printer) -> bool:
    """Whether the file says what a retraction is."""
    known = "M207 S" in printer.start or "SET_RETRACTION" in printer.start
    return known or "firmware" not in printer.how
