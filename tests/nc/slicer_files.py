"""Files of five slicers for fifty printers: start and end blocks with the commands that the slicers' profiles have,
and between them layers of a square with walls, arcs, retractions and travels in the slicer's own way.

The blocks stand in `slicers/*.txt`: `### NAME` begins a part that `{NAME}` stands for, `=== PRINTER | how` a
printer with its start block, `--- layer` what comes with each layer, `--- end` the end block.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

SIDE, LAYERS, HEIGHT = 20.0, 3, 0.2  # of the square [mm], layers, of a layer [mm]
AT = 100.0  # the square's first corner, x and y [mm]
LINE = 0.66  # filament for a side [mm]
RETRACTION = 0.8  # [mm]
_FOLDER = Path(__file__).parent / "slicers"
_FIRST_TYPE = {"cura": ";TYPE:WALL-OUTER", "bambu": "; FEATURE: Outer wall", "orca": ";TYPE:Outer wall"}


class Printer(NamedTuple):
    """A printer's profile: its slicer, the blocks, and how the slicer writes what is between them: "absolute" E,
    "firmware" retraction, "arcs", "klipper"."""

    slicer: str
    start: str
    layer: str
    end: str
    how: tuple[str, ...]


def printers() -> dict[str, Printer]:
    """All printers by name."""
    found = {}
    for file in sorted(_FOLDER.glob("*.txt")):
        parts, *sections = re.split(r"^=== ", file.read_text(), flags=re.MULTILINE)
        named = re.split(r"^### (\w+)\n", parts, flags=re.MULTILINE)
        texts = dict(zip(named[1::2], named[2::2], strict=True))
        for section in sections:
            for name, text in texts.items():
                section = section.replace(f"{{{name}}}\n", text)
            title, _, body = section.partition("\n")
            name, _, how = title.partition(" | ")
            start, layer, end = re.split(r"^--- (?:layer|end)\n", body, flags=re.MULTILINE)
            found[name.rstrip(" |")] = Printer(file.stem, start, layer, end, tuple(how.split()))
    return found


def file_of(printer: Printer) -> str:
    """The whole file of a printer."""
    mode = "M82" if "absolute" in printer.how else "M83"
    body = "\n".join((mode, "G92 E0", "G21", "G90", *_Body(printer).layers(), ""))
    return printer.start + body + printer.end


class _Body:
    """Lines of layers; E is counted as the printer counts it."""

    def __init__(self, printer: Printer):
        self.printer, self.place = printer, 0.0

    def layers(self) -> Iterator[str]:
        """All lines between start and end."""
        for layer in range(LAYERS):
            z = round(HEIGHT * (layer + 1), 3)
            yield from self._change(layer, z)
            yield from self.printer.layer.replace("[layer]", str(layer)).splitlines()
            yield from self._square(z)
            yield f"M106 S{85 * layer}" if layer else "M107"

    def _e(self, amount: float) -> str:
        self.place += amount
        return f"E{self.place if 'absolute' in self.printer.how else amount:.5f}"

    def _change(self, layer: int, z: float) -> Iterator[str]:
        if self.printer.slicer == "cura":
            yield f";LAYER:{layer}"
        elif self.printer.slicer == "bambu":
            yield from (
                "; CHANGE_LAYER",
                f"; Z_HEIGHT: {z}",
                f"; LAYER_HEIGHT: {HEIGHT}",
                "M622.1 S1 ; for prev firmware",
            )
            yield from (
                "M1002 judge_flag timelapse_record_flag",
                "M622 J1",
                "M623",
                f"M73 L{layer + 1}",
                "M991 S0 P0",
            )
        else:
            yield from (";LAYER_CHANGE", f";Z:{z}", f";HEIGHT:{HEIGHT}", ";BEFORE_LAYER_CHANGE")
            yield from (f"G92 {self._e(0.0)}", f"M73 P{20 * layer} R{LAYERS - layer}")

    def _square(self, z: float) -> Iterator[str]:
        slicer, how = self.printer.slicer, self.printer.how
        yield self._retraction(-RETRACTION)
        if slicer == "bambu":  # spiral lift
            yield from (
                "G17",
                f"G3 Z{z + 0.4:g} I1.217 J0 P1  F60000",
                f"G1 X{AT:g} Y{AT:g} F60000",
                f"G1 Z{z:g}",
            )
        elif slicer == "cura":
            yield f"G0 F7200 X{AT:g} Y{AT:g} Z{z:g}"
        else:
            yield f"G1 X{AT:g} Y{AT:g} Z{z:g} F7200"
        yield self._retraction(RETRACTION)
        yield _FIRST_TYPE.get(slicer, ";TYPE:External perimeter")
        if slicer != "cura":
            yield "SET_VELOCITY_LIMIT ACCEL=3000 ACCEL_TO_DECEL=1500" if "klipper" in how else "M204 S1500"
        end = AT + SIDE
        for number, (x, y) in enumerate([(end, AT), (end, end), (AT, end), (AT, AT)]):
            arc = "arcs" in how and number == 1
            code, centre = ("G3", f" I0 J{SIDE / 2:g}") if arc else ("G1", "" if number else " F1800")
            yield f"{code} X{x:g} Y{y:g}{centre} {self._e(LINE)}"

    def _retraction(self, amount: float) -> str:
        if "firmware" in self.printer.how:
            return "G10 ; retract" if amount < 0.0 else "G11 ; unretract"
        if self.printer.slicer == "cura":
            return f"G1 F2700 {self._e(amount)}"
        return f"G1 {self._e(amount)} F2100"
