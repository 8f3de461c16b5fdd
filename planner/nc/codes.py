"""Tables of G and M codes and letters: which modal group they belong to, or why they are refused and what to
do instead.

Codes are integers in tenths, as RS274NGC has them: G61.1 is 611. Two codes of one group on a line contradict
each other.
"""

import re
from dataclasses import dataclass

_ONE_OR_MANY = re.compile(r"\{(.*?)\|(.*?)\}")
G_GROUP: dict[int, str] = {
    **dict.fromkeys((0, 10, 20, 30), "motion"),
    **dict.fromkeys((50, 51, 52, 53, 62), "motion"),
    **dict.fromkeys((330, 331, 730, 740, 760, *range(810, 900, 10)), "motion"),
    **dict.fromkeys((40, 100, 280, 281, 300, 301, 520, 530, 920, 921, 922, 923), "one-shot"),
    **dict.fromkeys((170, 180, 190), "plane"),
    **dict.fromkeys((200, 210), "units"),
    **dict.fromkeys((900, 910), "distance mode"),
    **dict.fromkeys((901, 911), "arc centre mode"),
    **dict.fromkeys((1540, *range(1100, 1300, 10)), "work offset"),  # Haas' G154 P and G110 to G129
    **dict.fromkeys((540, 541, 550, 560, 570, 580, 590, 591, 592, 593), "work offset"),
    **dict.fromkeys((610, 611, 640), "path control"),
    **dict.fromkeys((430, 431, 432, 434, 490), "tool length"),
    **dict.fromkeys((400, 410, 411, 420, 421), "cutter compensation"),
    **dict.fromkeys((930, 940, 950), "feed mode"),
    **dict.fromkeys((960, 970), "spindle mode"),
    **dict.fromkeys((980, 990), "retract mode"),
    **dict.fromkeys((70, 80), "lathe diameter mode"),
    800: "cycle end",  # a motion code on its line beats it
}
# Codes that are kept as events: what S means, revolutions per minute or surface speed.
G_EVENTS = frozenset((960, 970))
# Motion codes of a kind, ten times the G code.
ARCS = frozenset((20, 30))
CUBIC, QUADRATIC, NURBS, NURBS_END, NURBS_WITH_KNOTS = 50, 51, 52, 53, 62
SPLINES = frozenset((CUBIC, QUADRATIC, NURBS, NURBS_END, NURBS_WITH_KNOTS))
THREADS = frozenset((330, 331))  # G33 and G33.1
THREADING = 760  # the cycle of many passes
CYCLES = frozenset((730, 740, *range(810, 900, 10)))  # G73, G74, G81 ... G89
# Words beside X Y Z F S T N that a code uses, by its group letter and tenths.
WORDS: dict[tuple[str, int], str] = {
    **{("G", code): "IJKRP" for code in ARCS},
    ("G", 50): "IJPQ", ("G", 51): "IJ", ("G", 52): "PL", ("G", 62): "PKR",
    ("G", 1540): "P",
    ("G", 541): "P", ("G", 40): "P", ("G", 100): "LPRQIJ", ("G", 640): "PQ", **{("G", code): "H" for code in (430, 432, 434)},
    ("G", 960): "D",
    **{("G", code): "D" for code in (410, 420)}, **{("G", code): "DL" for code in (411, 421)},
    ("G", 330): "K", ("G", 331): "KI", ("G", 760): "PIJKRQHEL",
    ("G", 730): "RLQPK", ("G", 740): "RPLQK", ("G", 810): "RLPK", ("G", 820): "RLPK", ("G", 830): "RLQPIJK", ("G", 840): "RLPQK",
    ("G", 850): "RLPK", ("G", 860): "RLP", ("G", 870): "RLIJK", ("G", 880): "RLP", ("G", 890): "RLP",
    **{("M", code): "P" for code in (620, 630, 640, 650)}, ("M", 190): "RPQ", ("M", 660): "PELQ", ("M", 670): "EQ", ("M", 680): "EQ",
    ("M", 610): "Q",
}  # fmt: skip
# That cycles of LinuxCNC have not.
FANUC_WORDS = {730: "PK", 740: "LQK", 810: "PK", 820: "K", 830: "PIJK", 840: "QK", 850: "PK"}
MOTION_WORDS = "IJKRPQLH"  # that a motion code in force may use
M_GROUP: dict[int, str] = {
    **dict.fromkeys((0, 10, 20, 300, 600), "stopping"),
    **dict.fromkeys((30, 40, 50), "spindle"),
    60: "tool change",
    190: "spindle orientation",
    **dict.fromkeys((70, 80, 90), "coolant"),
    **dict.fromkeys((480, 490, 500, 510, 520, 530), "override"),
    **dict.fromkeys(range(620, 690, 10), "signals"),
    610: "tool number",
}
_STRAIGHT = "write the moves out as G0, G1, G2 and G3 (in the CAM system, or with a converter)"
_POST = "give the machine a table of this axis, or choose a three-axis post-processor that writes G94 feeds in mm or inch per minute"
_EXTRUDER = "give the machine a table [axes.e], or --extruder ignore to plan the other axes without it"
_ANGLES = "choose a post-processor that writes the angles of the rotary axes, with G43.4"
# Axes that are not planned: they may be named as long as they stand still.
PARKABLE = "ABCUVW"
# Letters that only some words use: "I word without G2 or G3".
LETTER_NEEDS = {
    "I": "G2, G3, G5, G5.1, G10, G33.1, G76 or G87",
    "J": "G2, G3, G5, G5.1, G10, G76 or G87",
    "K": "G2, G3, G6.2, G33, G33.1, G76 or G87",
    "R": "G2, G3, G6.2, G10 or a canned cycle",
    "P": "G4, G10, G64, G2, G3, G5, G5.2, G6.2, a canned cycle that dwells or M62 to M66",
    "Q": "G10, G64, G5, G73, G76, G83, M61 or M66 to M68",
    "H": "G43, G43.2, G43.4 or G76",
    "D": "G41, G42 or G96",
    "L": "G10, G41.1, G42.1, G5.2, M66 or a canned cycle",
    "E": "G76 or M66 to M68",
}
# Characters that start no word, and what they mean in the dialects that use them.
CHARACTERS: dict[str, str] = {
    "#": "parameters are not supported; run the program through its control's interpreter and plan the resulting moves",
    "[": "expressions are not supported; write the number out",
    "<": "named parameters are not supported; write the number out",
    "$": "this command to the control is not supported: it may move ($J does); write what it moves as G0 or G1",
    "=": "assignments are not part of RS274NGC (is this a Siemens program?); choose an RS274NGC post-processor",
    '"': "texts (messages, questions of Centroid's and EdingCNC's; a Siemens program has them too) are not part of RS274NGC; "
    "write a message as a comment, an answer as its number, or choose an RS274NGC post-processor",
    "/": "block delete is allowed at the start of a line only",
    ")": "a comment is closed that was not opened",
    ",": "corner roundings and chamfers (,R and ,C) are not supported: write the arc or the line; a decimal comma is written as a "
    "point: 10.5",
    "!": "a comment starts with ( or ;",
}


@dataclass(frozen=True)
class Refusal:
    """A construct that is not read: what it is, and what to do."""

    what: str
    remedy: str
    takes_axes: bool = False  # the axis words beside it are its own and must not be read as a move

    def __str__(self) -> str:
        return f"{self.what} not supported; {self.remedy}"


@dataclass(frozen=True, slots=True)
class Assumption:
    """Something counted and said once: its name, in which {one|many} stands for what differs, what is assumed
    of it, and whether that may change geometry or time (docs/language.md)."""

    name: str
    meaning: str
    changes: bool = False

    def named(self, times: int) -> str:
        """How often it was met, and its name."""
        return f"{times:,} " + _ONE_OR_MANY.sub(lambda both: both[1 if times == 1 else 2], self.name)


# G codes in tenths that are refused, what they are, and what to do. Axis words beside them are their own, but for G51.
# fmt: off
_REFUSED = (
    ((60, 61), "a spline or transformation is", _STRAIGHT),
    ((310, 350, 360, 361, 370, 380, 382, 383, 384, 385, 1360), "a probing move, whose end only the machine knows, is",
     "plan the parts before and after it"),
    ((1500,), "a pocket round the contour of a subprogram, whose single passes are the control's, is",
     "let the CAM system write them; G13 reads a round pocket, G41 and M98 P its contour alone"),
    ((842, 843, 1740, 1840), "tapping of that kind is", "write G84 or G74"),
    ((71, 1070), "a contour round a cylinder is", "write the angles of the rotary axis"),
    ((121,), "milling in x and the angle of a spindle is", "write the moves in X and Y, or X and C"),
    ((542, 2540, 2680), "a frame that follows the rotary axes is", "write G68.2, or G43.4"),
    ((22, 23, 24, 32, 33, 34), "an involute, a spiral or an arc in space is", _STRAIGHT),
    ((440,), "taking the length of a tool off is", "write G43, with the other sign in [tools]"),
    ((450, 460, 480), "a move that is longer by the offset of a tool is", _STRAIGHT),
    ((470,), "engraving a text (Haas), or a move that is shorter by the offset of a tool (Fanuc), is", _STRAIGHT),
    ((661,), "a macro that each block calls is", "write its calls as G65"),
    ((1000,), "a change of tools with a move (Brother's G100) is", "write M6, and the move behind it"),
    ((770,), "a bore from below by I is", "write G87 with I J K"),
    ((535,), "a move in coordinates of Mazatrol is", "write G53 or G54"),
    ((2340,), "the tool centre point of Haas is", "write G43.4 H, with [kinematics] in the machine file"),
    ((412, 413, 414, 415, 422, 424, 425, 1410, 1430), "tool compensation in five axes is", _ANGLES),
    ((435,), "the tool's direction as a vector (G43.5 with I J K) is", _ANGLES),
    ((270, 290, 600), "a move by way of a reference point is", "write G0 to its end"),
    ((150,), "a G code that RS274NGC does not know (Okuma's G15 H is a work system) is", "write G54 to G59, or G54.1 P"),
    ((500,), "presetting coordinates with G50 is", "write G92"),
    ((510,), "scaling is", "write the scaled coordinates out"),
    ((680, 690), "rotating the coordinate system is", "write the rotated coordinates out"),
    ((700, 710, 711, 712, 720, 721, 722), "a lathe cycle whose contour is a subprogram (LinuxCNC: Q and its O number) is",
     "write the contour as blocks with N numbers and call it by P and Q, as Fanuc's lathes (G71 P10 Q20 U0.4 W0.1 D1), or "
     "write the moves out as G0, G1, G2 and G3"),
    ((929,), "setting the place of the motors, whatever offsets are in force (Marlin, Prusa), is",
     "write G92 where the coordinates are meant"),
)
# fmt: on
G_REFUSED = {code: Refusal(what, remedy, code != 510) for given, what, remedy in _REFUSED for code in given}
M_REFUSED: dict[int, Refusal] = {
    **dict.fromkeys((700, 710, 720, 730), Refusal("saving and restoring modes is", "write the modes out")),
    **dict.fromkeys((980, 990), Refusal("a subprogram is", "write its blocks out")),
    1980: Refusal("a subprogram on another device is", "put its file beside the program and write M98"),
    960: Refusal("a jump that an input decides is", "plan the parts before and after it"),
}


def unknown(letter: str, code: int, *, strict: bool) -> Refusal:
    """The refusal of a code that no table names; one that is not refused by `strict` alone may move. That it
    can be left out (--ignore) is not said: of a code that may move it would be the plan of another path."""
    if letter == "G":
        return Refusal("a G code that RS274NGC does not know is", "write it with the codes of RS274NGC", True)
    if not strict:
        what = "an M code that this reader does not know, and that may move with its words or by itself, is"
        return Refusal(what, "write what it moves as G0 or G1", True)
    own = 1000 <= code <= 1990
    what = (
        "a command that each machine defines for itself" if own else "an M code that RS274NGC does not know"
    )
    return Refusal(f"{what} is", "remove it if nothing moves")


# Letters that no supported code uses.
LETTERS_REFUSED: dict[str, Refusal] = {
    **dict.fromkeys("ABC", Refusal("a rotary axis that moves is", _POST)),
    **dict.fromkeys("UVW", Refusal("a second linear axis that moves is", _POST)),
    "E": Refusal("an extruder axis is", _EXTRUDER),
    "O": Refusal("a subprogram or O word is", "write its blocks out, or remove a mere program number"),
}


def number(code: int) -> str:
    """A code as it is written: 611 -> "61.1", 10 -> "1"."""
    return f"{code // 10}.{code % 10}" if code % 10 else str(code // 10)
