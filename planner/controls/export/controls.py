"""The tables of grbl, Klipper, Marlin and LinuxCNC: the words of each; one that stands in no table is
refused.

grbl      1.1h: gcode.c (gc_execute_line), protocol.c, wiki "Grbl v1.1 Commands", "Grbl v1.1 Laser Mode"
Klipper   docs/G-Codes.md, klippy/gcode.py, klippy/extras/gcode_move.py, homing.py
Marlin    2.1: marlinfw.org/meta/gcode, src/gcode/gcode.cpp, parser.cpp, queue.cpp, as Configuration.h comes: without
          CNC_COORDINATE_SYSTEMS, CNC_WORKSPACE_PLANES, INCH_MODE_SUPPORT, PAREN_COMMENTS
LinuxCNC  2.9: docs/src/gcode/g-code.adoc, m-code.adoc, overview.adoc
"""

import math
import re
from dataclasses import dataclass, field, replace

import numpy as np

from planner.base.units import MM_PER_INCH
from planner.controls.export.rows import G10, G92, RETRACTIONS, Row, Word
from planner.nc import codes
from planner.nc.program import Program
from planner.nc.reading import ABSOLUTE
from planner.nc.settings import EVERYTHING

_STAYS = "this control always stays on the path"
_STRAIGHT = "what it would choose is written out as straight moves"
_ALL_OFF = "this control does not look at its words, and would let go of all motors at once"
_NOT_USED = "the control has no such mode"


@dataclass(frozen=True, kw_only=True)
class Control:
    """A control's words. Codes are in tenths: G61.1 is 611."""

    name: str
    g: frozenset[int]  # codes that mean there what they mean in RS274NGC
    m: frozenset[int]
    arcs: bool = False  # it is given arcs as the program has them, else as straight moves
    cycles: bool = False  # the same of everything that moves besides G0 to G3
    settings: frozenset[int] = frozenset()  # M numbers that it knows beside those, kept with all their words
    commands: str = ""  # pattern of lines that are no words: homing, unlocking, messages, commands of its own
    idle: dict[str, str] = field(default_factory=dict)  # codes ("G64") that change nothing there, and why
    instead: dict[str, str] = field(default_factory=dict)  # M codes ("M6"), and what is written for them
    # settings ("M84") that mean more where it does not look at words of these letters, and why they are then
    # left out; "" where they are refused
    unheard: dict[str, tuple[str, str]] = field(default_factory=dict)
    letters: str  # of the words that it takes beside those of codes; axes are among them
    one_command: bool = False  # a line holds one code, at its start, and moves have G0 or G1 on every line
    rapid_feed: bool = False  # G0 moves at the F in force
    milliseconds: bool = False  # P of G4 counts them
    inch: bool = True  # it knows G20
    speed_by_code: bool = False  # S stands beside M3 and M4 only
    number: bool = True  # lines may begin with N
    percent: bool = False  # they may hold %
    paren: bool = True  # and comments in parentheses
    line_max: int = 0  # longest line [bytes]; 0 for no limit
    whole_line: bool = False  # blanks and comments count in it
    tool_max: float = math.inf  # highest number of a tool
    systems: int = 9  # work offsets from G54 on
    # pattern of characters that it obeys as they come in, in comments too
    at_once: str = r"(?!)"
    end: str = "M2"  # the last line of a program that has none, or whose M2 or M30 it does not know

    @property
    def extruder(self) -> bool:
        """Whether its E is an extruder's."""
        return self.one_command and "E" in self.letters

    def is_command(self, line: str) -> bool:
        """Whether it knows a line that is no words."""
        return bool(self.commands) and re.fullmatch(self.commands, line, re.IGNORECASE) is not None


_IDLE_ON_MILLS = {
    "G8": _NOT_USED,
    "G97": "S is in revolutions per minute there anyway",
    **dict.fromkeys(("M48", "M49"), "what the operator may override is this control's own"),
    **dict.fromkeys(("G64", "G61.1"), _STAYS),
}
_IDLE_ON_PRINTERS = {
    **_IDLE_ON_MILLS,
    **dict.fromkeys(("G17", "G18", "G19", "G80", "G91.1", "G98", "G99"), _STRAIGHT),
    **dict.fromkeys(("G40", "G49"), _NOT_USED),
    "G61": _STAYS,
    "G54": "this control has no work offsets: its zero is the program's",
    "G94": "F is always per minute there",
}
_PRINTER = {17, 18, 82, 83, 84, *range(104, 108), 109, 114, 115, *range(117, 120)}
_PRINTER |= {140, 190, 204, 220, 221, 400}
# How far the radii at the ends of an arc may be apart on grbl: [mm], or up to so much [mm] the share.
_RADII_APART, _RADII_APART_MAX, _RADII_SHARE = 0.004, 0.4, 0.9e-3  # of its 0.005, 0.5 and 0.001
_R_ROUNDING = 1e-3  # [mm], of 2 R: single precision at 1 m is 6e-5

GRBL = Control(
    name="grbl",
    g=frozenset((
        0, 10, 20, 30, 40, 100, 170, 180, 190, 200, 210, 280, 281, 300, 301, 400, 431, 490, 530, 540, 550, 560, 570, 580, 590,
        610, 800, 900, 910, 911, 920, 921, 930, 940,
    )),
    m=frozenset((0, 1, 2, 30, 3, 4, 5, 7, 8, 9)),
    commands=r"\$[HX]",
    arcs=True,
    idle={**_IDLE_ON_MILLS, "G98": _STRAIGHT, "G99": _STRAIGHT},
    instead={"M6": "M0", "M60": "M0"},
    letters="FIJKLNPRSTXYZ",
    line_max=79,  # LINE_BUFFER_SIZE 80 with its end
    tool_max=255.0,
    systems=6,
    at_once=r"[!~\x18\x80-\xff]",  # feed hold, cycle start, reset, safety door, overrides: serial.c
)  # fmt: skip
KLIPPER = Control(
    name="klipper",
    g=frozenset((0, 10, 40, 210, 280, 900, 910, 920)),
    m=frozenset(),
    settings=frozenset(_PRINTER - {17} | {73, 110, 112, *range(20, 28)}),
    commands=r"G28[XYZ\s]*0*|M11[78]\b.*|SET_VELOCITY_LIMIT\b.*",
    idle={**_IDLE_ON_PRINTERS, "M17": "motors are on from their first move"},
    unheard={
        **dict.fromkeys(("M18", "M84"), (EVERYTHING, _ALL_OFF)),  # klippy/extras/stepper_enable.py
        **dict.fromkeys(("M109", "M190"), ("R", "")),  # without S it would switch the heater off
    },
    instead=dict.fromkeys(("M0", "M1", "M60", "M6"), "PAUSE"),
    letters="FXYZE",
    one_command=True,
    rapid_feed=True,
    milliseconds=True,
    inch=False,
    speed_by_code=True,
    paren=False,
    end="M400",
)
MARLIN = replace(
    KLIPPER,
    name="marlin",
    m=frozenset((0, 1, 3, 4, 5, 7, 8, 9)),
    idle=_IDLE_ON_PRINTERS,
    unheard={},
    commands=r"G28[XYZ\s]*0*|M11[78]\b.*",
    settings=frozenset(
        _PRINTER | {73, 75, 76, 77, 85, *range(110, 114), 155, 201, 203, 205, 301, 302, 420, 851, 900}
    ),
    instead={"M60": "M0", "M6": "M0"},
    number=False,  # a line number needs a checksum on the serial line
)
LINUXCNC = Control(
    name="linuxcnc",
    g=frozenset(codes.G_GROUP)
    - {520, 541, 434, 62},  # G52, G54.1, G43.4, G6.2 are of other controls or later ones
    m=frozenset(code // 10 for code in codes.M_GROUP),
    arcs=True,
    cycles=True,
    settings=frozenset(range(100, 200)),
    letters="ABCDEFHIJKLPQRSTUVWXYZ",
    percent=True,
    line_max=253,  # LINELEN 255 with its end
    whole_line=True,
)


def is_setting(words: list[Word], control: Control) -> bool:
    """Whether the control knows a code that moves no axis, with its words: a setting, a retraction, G92 E."""
    first, letters = words[0], {word.letter for word in words}
    if first.letter == "M":
        known = first.code % 10 == 0 and first.code // 10 in control.settings
        unheard, _ = control.unheard.get(f"M{first.code // 10}", ("", ""))
        return known and letters.isdisjoint(unheard)
    retracts = first.code in RETRACTIONS and letters == {"G"}
    return control.one_command and (retracts or (first.code == G92 and letters <= set("GE")))


def sets_tools(row: Row) -> bool:
    """Whether G10 sets more than an origin up to G59 (L1, L10, L11; R; P7), or G43.1 more than a length in Z: grbl knows neither."""
    kind, g, system = row.value("L"), row.g(), row.value("P")
    more = kind is None or kind.value not in (2.0, 20.0) or row.value("R") is not None
    more |= system is not None and system.value > GRBL.systems
    return (G10 in g and more) or (431 in g and (row.value("X") or row.value("Y")) is not None)


def takes_move(row: Row, control: Control, program: Program) -> bool:
    """Whether the control is given a move in the program's own words."""
    if row.radius and not control.cycles:
        return False
    if row.motion in codes.ARCS:  # none with turns for grbl, none with absolute centres for any
        known = control.arcs and program.reading.arc_centres != ABSOLUTE
        return known and (control.cycles or (row.value("P") is None and _is_arc_of_grbl(row, program)))
    return row.motion <= 30 or (control.cycles and row.motion in control.g)


def _is_arc_of_grbl(row: Row, program: Program) -> bool:
    """Whether an arc passes the checks of grbl's gcode.c: it has a coordinate in its plane, the radii at its ends agree,
    and R reaches both, by more than what grbl's single precision rounds."""
    plane = ["XYZ".index(axis) for axis in row.plane]
    if frozenset(row.named).isdisjoint(row.plane):
        return False
    arcs = np.searchsorted(program.arc_block, [row.first, row.last])
    for block, centre in zip(program.arc_block[slice(*arcs)], program.arc_center[slice(*arcs)], strict=True):
        start, end = (program.end[block - 1] if block else program.start)[plane], program.end[block, plane]
        if (radius := row.value("R")) is not None:
            reach = 2.0 * abs(radius.value) * (MM_PER_INCH if row.inch else 1.0)
            return bool(reach > np.linalg.norm(end - start) + _R_ROUNDING)
        first, last = (float(np.linalg.norm(place - centre[plane])) for place in (start, end))
        apart = abs(first - last)
        if apart > _RADII_APART and apart > min(_RADII_APART_MAX, _RADII_SHARE * first):
            return False
    return True


CONTROLS = {control.name: control for control in (GRBL, KLIPPER, MARLIN, LINUXCNC)}
# What is said of codes that need a control built with an option.
OPTIONS = {
    ("grbl", "M7"): "M7 needs a grbl built with ENABLE_M7",
    ("klipper", "PAUSE"): "PAUSE needs [pause_resume] in printer.cfg",
    ("marlin", "M3"): "M3, M4 and M5 need a Marlin built with SPINDLE_FEATURE or LASER_FEATURE",
    ("marlin", "M420"): "M420 needs a Marlin built with bed leveling",
    ("marlin", "M900"): "M900 needs a Marlin built with LIN_ADVANCE",
    **{("marlin", m): "M7, M8 and M9 need a Marlin built with COOLANT_CONTROL" for m in ("M7", "M8", "M9")},
    **{("klipper", g): "G10 and G11 need [firmware_retraction] in printer.cfg" for g in ("G10", "G11")},
    **{("marlin", g): "G10 and G11 need a Marlin built with FWRETRACT" for g in ("G10", "G11")},
}
