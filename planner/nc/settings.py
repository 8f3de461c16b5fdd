"""Codes that set something of the control and move nothing: which they are, and which words of their line are
theirs.

RS274NGC knows none of them, so each is an `Assumption`, counted in a note, and refused by `--strict`. If it
stands first on its line, its own words are

    settings of the axes of a 3-D printer (M92 M201 ...)  all
    M100 to M199, which RS274NGC leaves to each machine   all but X Y Z F T: those move and set as anywhere
    other M codes                                         all; with X Y Z it may be a move, and is refused

and P and Q behind a G code or a coordinate.
"""

from dataclasses import dataclass

from planner.nc.codes import G_GROUP, M_GROUP, M_REFUSED, Assumption

AXES = "XYZABCUVW"
_MOVED = frozenset(AXES + "IJK")
EVERYTHING = "ABCDEFHIJKLNPQRSTUVWXYZ"
# Commands that set a factor of F or limits (set_limits.py): M codes, Klipper's, settings of grbl with what they limit.
SETS_LIMITS = frozenset((201, 202, 203, 204, 220))
VELOCITY_LIMIT = "SET_VELOCITY_LIMIT"
SET_RETRACTION = "SET_RETRACTION"
RETRACTIONS = ("M207", "M208", SET_RETRACTION)  # what G10 and G11 do on printers
PRINTER_FEED = 25.0  # before the first F [mm/s]: Marlin's motion.cpp and Klipper's gcode_move.py
SMOOTHNESS = "G187"  # of Haas: its E is a tolerance
# Of grbl and grblHAL, which has six axes; of TinyG and g2core; of FluidNC.
GRBL = {
    name: (quantity, axis)
    for k, axis in enumerate("xyzabc")
    for quantity, names in (
        ("velocity", (f"$11{k}", f"${axis}vm", f"$/axes/{axis}/max_rate_mm_per_min")),
        ("acceleration", (f"$12{k}", f"$/axes/{axis}/acceleration_mm_per_sec2")),
    )
    for name in names
}
CORNERS = "no limit of this plan, which goes around corners within the tolerance and the machine's acceleration and jerk"
# fmt: off
UNKNOWN_M = Assumption("M code{|s} that this reader does not know", "assumed not to move anything", changes=True)
TOOL_POINT_M = Assumption("switch{|es} to the tool centre point, as some controls have {it|them} (M128, M428)",
                          "not followed: every axis is planned as a joint, and with the switch on the tool takes another path",
                          changes=True)
# M codes that switch the tool centre point on and off, by number: Heidenhain's and LinuxCNC's.
TOOL_POINT_ON, TOOL_POINT_OFF = (128, 428), (129, 429)
_TOOL_LENGTH_POINT = 434  # G43.4, read where the machine has kinematics
PRINTER_M = Assumption("code{|s} of a 3-D printer that move{s|} nothing",
                       "temperatures, fans, messages; they take no time in this plan")
WAIT_M = Assumption("wait{|s} for a temperature", "full stops; how long they last no plan knows", changes=True)
CORNER_M = Assumption("speed{|s} of corners (M205, M566)", CORNERS, changes=True)
SCALE_M = Assumption("code{|s} of a 3-D printer that shift{s|} or scale{s|} its axes, or change{s|} how they move",
                     "not followed: positions are those of the program", changes=True)
SPINDLE_LIMIT = Assumption("largest spindle speed{|s}", "they change nothing in the path")
PROBES = frozenset((310, 350, 360, 361, 370, *range(380, 386)))  # G31, G35 to G37, G38.2 to G38.5 in tenths
PROBING = Assumption("probing move{|s}",
                     "left out, as --ignore says: a full stop; the axes are assumed to stay where they are", changes=True)
SPINDLE_WORD = Assumption("word{|s} beside M3 to M5 (P, I)", "power, gear or mode of the spindle, left out")
EXACT_STOP = Assumption("exact stop{|s} of one block (G9)", "a full stop behind it")
LEFT_OUT_BY_USER = Assumption("word{|s}", "left out, as --ignore says")
EXTRUDER_ZERO = Assumption("zero{|s} of the extruder", "left out with its words")
RETRACTION = Assumption("retraction{|s} of an extruder (G10, G11)", "they take no time in this plan", changes=True)
G_SETTING = Assumption("G code{|s} that set{s|} the control or cancel{s|} what this reader does not have",
                       "assumed not to move anything", changes=True)
_STOPS = "a full stop; what it moves is not planned, and the head is assumed to come back"
PARKS = Assumption("code{|s} that change{s|} or load{s|} filament, or park{s|} the head", _STOPS, changes=True)
MACRO = Assumption("macro{|s} of the printer", _STOPS, changes=True)
LEVELLING = Assumption("code{|s} of a 3-D printer that level{s|}, wipe{s|} or probe{s|}", _STOPS, changes=True)
TOOLS = Assumption("change{|s} of the extruder (T)", "a full stop; what it moves and lasts is not planned", changes=True)
# M codes of printers by number: what is said of them. Waits and parking are full stops.
_MEANING: dict[int, Assumption] = {
    **dict.fromkeys((
        17, 18, 73, *range(82, 85), *range(104, 112), 114, 115, *range(117, 122), 126, 127, *range(140, 146), 149, 150, 155, 163, 164,
        200, 201, 202, 203, 204, 207, 208, 220, 221, 240, 250, 280, 300, 301, 302, 304, 305, 400, 412, 413, 486, 500, 503, 504, 557,
        558, 569, 572, 574, 575, 584, 851, 862, 900, 906, 907, 913, 914, 928,
    ), PRINTER_M),
    **dict.fromkeys((109, 116, 190, 191, 303), WAIT_M),
    **dict.fromkeys((205, 566), CORNER_M),
    # Steps per mm and their parts, offsets, skew, scale, delta geometry, bed mesh, backlash, settings that are
    # loaded, shaping, and which carriage follows.
    **dict.fromkeys((92, 206, 218, 350, 420, 425, 501, 502, 556, 579, 593, 605, 665, 666, 667, 852), SCALE_M),
    **dict.fromkeys((125, 600, 701, 702), PARKS),
}
# Whose words are axes, which do not move.
_OF_AXES = frozenset((
    17, 18, 84, 92, 201, 202, 203, 204, 205, 206, 207, 208, 218, 301, 304, 350, 425, 557, 558, 566, 569,
    574, 579, 584, 593, 665, 666, 851, 906, 907, 913, 914,
))
# fmt: on
_MOVES_FINISHED = 400  # waits until the axes stand
TEXTS = frozenset((117, 118))  # a message to the end of the line
MAY_MOVE = frozenset((96, 97, 198, 290, 401, 402))  # jumps, and codes of printers that move
# G codes in tenths that set or cancel something, where no axis word stands beside them: polar coordinates
# off, polar interpolation off, stored stroke and spindle speed checks, mirror image off, slower corners,
# tapping, output, look-ahead of Haas and its smoothness, rotation off.
G_SETTINGS = frozenset((131, 150, 220, 230, 250, 260, 501, 620, 630, 690, 1020, 1030, 1130, 1870))
# Codes of the groups that are settings beside some words.
_SOMETIMES = frozenset((50, 51, 80, 100, 920))
ALWAYS_READ = {"G": frozenset(G_GROUP) - _SOMETIMES, "M": frozenset(M_GROUP) - {730}}


@dataclass(frozen=True, slots=True)
class Setting:
    """A command that sets something ("M204", "$110")."""

    name: str
    values: dict[str, float]  # by letter or key in small letters
    word: int
    slot: str = ""  # the name of what it keeps


@dataclass(frozen=True, slots=True)
class CodeSetting:
    """A code that moves nothing."""

    what: Assumption | None  # what is said of it; None of one that is read, set_limits.py
    letters: str  # behind it on its line that are its own
    stops: bool = False  # it is a full stop


def setting(letter: str, code: int, before: str, behind: str) -> CodeSetting | None:
    """The setting that a code (in tenths) is beside the letters before it on its line, and those behind it up
    to the next code; None for a code that is read, or refused."""
    if letter == "M":
        return _m_setting(code, before, behind)
    if code == 220 and behind:
        return CodeSetting(G_SETTING, EVERYTHING)  # the limits of travel that it checks
    if code == 90:
        return CodeSetting(EXACT_STOP, "", stops=True)
    if _MOVED.intersection(before + behind):
        return None
    if code in (500, 920) and "S" in behind:
        return CodeSetting(SPINDLE_LIMIT, "SPQR")
    if code == 1870 and "E" in behind:
        return CodeSetting(None, "EP")
    if code == 500 or (code in G_SETTINGS and not (code == 150 and "H" in behind)):
        return CodeSetting(G_SETTING, "DEHLPQRS")
    if code in (100, 110) and "L" not in behind and ("P" not in behind or "S" in behind):
        return CodeSetting(RETRACTION, "PRS")
    if code == 920 and "E" in behind:
        return CodeSetting(EXTRUDER_ZERO, "")
    # look-ahead of Fanuc controls: G5 P10000, G5.1 Q1, G8 P1
    if (code in (50, 80) and "P" in behind) or (code == 51 and "Q" in behind):
        return CodeSetting(G_SETTING, "PQR")
    return None


def _m_setting(code: int, before: str, behind: str) -> CodeSetting | None:
    number = code // 10
    progress = number == 73 and ("P" in behind or "R" in behind)
    is_read = (code in M_GROUP or code in M_REFUSED) and not progress
    if code % 10 or code < 0 or number in MAY_MOVE or is_read:
        return None
    what, stops = meaning(number)
    if number in SETS_LIMITS:
        return None if before else CodeSetting(None, EVERYTHING)
    if before and what is not PARKS:
        return CodeSetting(what, "PQ", stops)
    if number in _OF_AXES or stops:
        return CodeSetting(what, EVERYTHING, stops)
    if 100 <= number <= 199:
        return CodeSetting(what, "".join(c for c in EVERYTHING if c not in "XYZFT"))
    return None if set("XYZ").intersection(behind) else CodeSetting(what, EVERYTHING)


def meaning(number: int) -> tuple[Assumption, bool]:
    """What is said of an M code that moves nothing, and whether it is a full stop."""
    what = _MEANING.get(number, UNKNOWN_M)
    return what, what in (WAIT_M, PARKS) or number == _MOVES_FINISHED


def may_be_ignored(name: str) -> bool:
    """True if a code can be left out: no G code that is read or moves, no end of a program, no call."""
    letter, number = name[0], name[1:]
    if letter not in "GM" or not number[:1].isdigit():
        return True
    code = round(float(number) * 10)
    if letter == "M":
        return code not in (20, 300, 970, 980, 990)
    moving = 50 <= code <= 69 or 330 <= code <= 389 or 700 <= code <= 899  # splines, threads, cycles
    return code in PROBES or ((code not in G_GROUP or code == _TOOL_LENGTH_POINT) and not moving)
