"""NC text for grbl, Klipper, Marlin and LinuxCNC: how each wants to be told the same moves.

grbl, LinuxCNC   rapids are G0 at the machine's own speed; G4 P in seconds
Klipper, Marlin  G0 is a G1: rapids get an F word; G4 P in milliseconds
LinuxCNC         the path mode is G64 P (corner) Q (joining of short lines), G61 or G61.1; the others know none, and stay on the path
Klipper          knows no arcs without [gcode_arcs]: they are written as chords
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planner.base.arrays import FloatArray
from planner.base.units import SECONDS_PER_MINUTE
from planner.control_files.chords import DECIMALS, Polyline
from planner.nc.events import plain
from planner.nc.program import Kind, Program
from planner.nc.text import STOPPING
from planner.nc.writer import round_down

PAUSE = "M0"
MILLISECONDS = 1e3  # in a second


@dataclass(frozen=True, kw_only=True)
class Dialect:
    """How a control is written to.

    modal_rapids : whether G0 takes an F word
    milliseconds : whether G4 P counts them
    footer       : its last line
    """

    name: str
    modal_rapids: bool
    milliseconds: bool
    footer: str


DIALECTS = {
    "grbl": Dialect(name="grbl", modal_rapids=False, milliseconds=False, footer="M2"),
    "linuxcnc": Dialect(name="linuxcnc", modal_rapids=False, milliseconds=False, footer="M2"),
    "klipper": Dialect(name="klipper", modal_rapids=True, milliseconds=True, footer="M400"),
    "marlin": Dialect(name="marlin", modal_rapids=True, milliseconds=True, footer="M400"),
}


def polyline_text(
    line: Polyline,
    program: Program,
    axes: tuple[str, ...],
    rapid: FloatArray,
    dialect: Dialect,
    path_mode: str,
) -> str:
    """The text of straight moves, with the words of the program that move nothing and its standstills in their places.

    axes      : letters of the coordinates
    rapid     : (n,) speed of each move if it is a rapid one [mm/s]
    path_mode : "G64 P0.01" and the like; "" for none
    """
    said = [_comment(f"{program.source.rpartition('/')[2]} for {dialect.name}", dialect)]
    said += [f"G21 G17 G90 G94 {path_mode}".strip() if dialect.name in ("grbl", "linuxcnc") else "G21\nG90"]
    words_between = _between(program, dialect)
    said_of = 0
    letters = [letter.upper() for letter in axes]
    position, feed, mode = line.points[0], "", ""
    if position.any():  # a path of points may begin anywhere, and nothing but this leads there
        rapid_speed = (
            f" F{round_down(float(np.min(rapid)) * SECONDS_PER_MINUTE)}" if dialect.modal_rapids else ""
        )
        there = " ".join(f"{letter}{_number(value)}" for letter, value in zip(letters, position, strict=True))
        said.append(f"G0 {there}{rapid_speed}")
    for k, end in enumerate(line.points[1:]):
        block = int(line.block[k])
        while said_of < len(words_between) and words_between[said_of][0] <= block:
            said.append(words_between[said_of][2])
            said_of, mode = said_of + 1, ""
        words = [f"{letter}{_number(end[a])}" for a, letter in enumerate(letters) if end[a] != position[a]]
        code = "G0" if line.rapid[k] else "G1"
        words = [code, *words] if code != mode else words
        if not line.rapid[k] or dialect.modal_rapids:
            new = round_down((rapid[k] if line.rapid[k] else line.feed[k]) * SECONDS_PER_MINUTE)
            words += [f"F{new}"] if new != feed else []
            feed = new
        said.append(" ".join(words) if dialect.name in ("klipper", "marlin") else "".join(words))
        mode, position = ("" if dialect.name in ("klipper", "marlin") else code), end
    said += [text for _, _, text in words_between[said_of:] if text != PAUSE]
    return "\n".join([*said, dialect.footer, ""])


def _between(program: Program, dialect: Dialect) -> list[tuple[int, int, str]]:
    """What stands between the moves, in order: the block before which it stands, a rank among those, and its text.

    A full stop is a change of tool where it is an M6, which of these controls only LinuxCNC has, and a pause anywhere else.
    """
    found = [(event.block, 0, event.text) for event in program.events if event.text not in STOPPING]
    tools = {event.block for event in program.events if event.text == "M6"}
    for k in np.flatnonzero((program.kind == Kind.DWELL) | (program.kind == Kind.STOP)).tolist():
        change = dialect.name == "linuxcnc" and k in tools
        stop = "M6" if change else PAUSE
        text = _dwell(float(program.dwell[k]), dialect) if program.kind[k] == Kind.DWELL else stop
        found.append((k, 1, text))
    return [(block + rank, rank, text) for block, rank, text in sorted(found, key=lambda one: one[:2])]


def _dwell(seconds: float, dialect: Dialect) -> str:
    return f"G4 P{plain(round(seconds * MILLISECONDS, 3) if dialect.milliseconds else seconds)}"


def _comment(text: str, dialect: Dialect) -> str:
    clean = "".join(letter if letter.isprintable() and letter not in "()" else "_" for letter in text)
    return f"; {clean}" if dialect.name in ("klipper", "marlin") else f"({clean})"


def _number(value: float) -> str:
    return plain(round(float(value), DECIMALS) + 0.0)  # + 0.0 turns -0 into 0
