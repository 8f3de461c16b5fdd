"""Programs of 3-D printers, as slicers write them: a line is one command, and all behind it is the command's own.

    M862.3 P "MK3S"      G29 P1 X10 W30      M486 A"cube (1)"      SET_VELOCITY_LIMIT ACCEL=5000      T1      M1006 A0 M60 N50

A program is one if it says how E counts (M82, M83), sets a heater, fan, limit or flow to a number (M104 S200; M104
and M109 alone are codes of mills), or has a command of Klipper: a name of two words or more, or with KEY=VALUE
behind it. G codes that RS274NGC shares with printers are read as those of any program. Of the others, those that
set limits and coordinates act (set_limits.py), all else is an event: counted where it moves
nothing, and said first where it may move, for what it moves is not known.
"""

import math
import re
from typing import NamedTuple

import numpy as np

from planner.nc import settings
from planner.nc.codes import Assumption
from planner.nc.extruder import Retraction
from planner.nc.faults import IgnoredWords
from planner.nc.lexer import FAULT, Words
from planner.nc.moves import Block
from planner.nc.unreadable import META

# M codes that only printers have, and those that only printers have with a number on a line of their own.
_COUNTS = (82.0, 83.0)
_SETS = (104.0, 106.0, 109.0, 140.0, 141.0, 190.0, 191.0, 201.0, 202.0, 203.0, 204.0, 220.0, 221.0)
_NUMBERS = b"SRXYZE"  # letters of such numbers
# G codes of mills, of which printers have G61 alone: back to what G60 has kept.
_PATH_MODES = (61.0, 61.1, 64.0)
_CODE = r"[GMTP]\s*-?\d+(?:\.\d+)?(?![\d.])"
_NAME = r"@[\w-]+|[A-Za-z]*_\w+(?=\s|$)|[A-Za-z]{2}[A-Za-z\d]*(?=\s+[A-Za-z]\w*\s*=)"
_FIRST = rf"{_CODE}|{_NAME}|[A-Za-z]{{3,}}(?=\s|$)|T"
_COMMAND = re.compile(rf"\s*(?:N\s*\d+\s*)?(?!(?:{META})\b)({_FIRST})", re.IGNORECASE)
_EXTENDED = re.compile(rf"\s*(?:{_NAME})", re.IGNORECASE)
_KEY = re.compile(r"([A-Za-z]\w*)\s*=\s*(\"[^\"]*\"|\S*)")
_LETTER = re.compile(r"([A-Za-z])\s*([-+]?(?:\d+\.?\d*|\.\d+)|)")
# G codes that are read as in any program, by number; of the others those that level, wipe, park or probe.
_ANY = frozenset((0, 1, 2, 3, 4, 5, 10, 11, 17, 18, 19, 20, 21, *range(52, 60), 90, 91, 92, 93, 94))
# G0 and G1 of RepRapFirmware with H, which end at a switch, among them.
_LEVELS = frozenset((
    0, 1, 12, *range(26, 36), 39, 42, 76, *range(80, 90), 130, 150, 212, 280, 375, 380, 383, 392, 425,
))  # fmt: skip
_FEED_STAYS = ("G0", "G1")  # ... whose F is modal, too
_BAMBU = 1000  # G2811, G9111 and others from here on, too
_STOPPING = {"M0": 0, "M1": 10, "M2": 20, "M30": 300}
_HOMING = ("G28", "G161", "G162")
# Commands that set coordinates, or keep them (set_limits.py).
SAVE, RESTORE = "SAVE_GCODE_STATE", "RESTORE_GCODE_STATE"
OFFSET, PLACE = "SET_GCODE_OFFSET", "SET_KINEMATIC_POSITION"
OF_STATE = frozenset((SAVE, RESTORE, OFFSET, PLACE, "G60", "G61"))
# Names of Klipper by what is said of them, in this order; of others (macros of the machine) settings.MACRO.
_NAMES = {
    settings.PARKS: r"@?PAUSE|RESUME|(UN)?LOAD_FILAMENT|FILAMENT_(UN)?LOAD|CANCEL_PRINT|ACTIVATE_EXTRUDER",
    settings.WAIT_M: r"TEMPERATURE_WAIT",
    settings.SCALE_M: r"BED_MESH_(PROFILE|CLEAR|OFFSET)|SKEW_PROFILE|SET_(SKEW|INPUT_SHAPER|DUAL_CARRIAGE"
    r"|STEPPER_\w+|TMC_\w+|EXTRUDER_\w+)",
    settings.PRINTER_M: r"@.+|SET_\w+|EXCLUDE_OBJECT\w*|RESPOND|_?TIMELAPSE_\w+|SAVE_\w+|CLEAR_PAUSE|ENABLE_\w+|(QUERY|GET|DUMP|STATUS"
    r"|SDCARD|UPDATE|START_PRINT_TIMER|PRINT_STATS)_\w+|TURN_OFF_HEATERS|SYNC_EXTRUDER_MOTION|MMU_\w*STATS|ACTION_\w+",
}
_MEANT = {
    **dict.fromkeys((98, 401, 402), settings.LEVELLING),
    **dict.fromkeys((25, 226, 601), settings.PARKS),
    290: settings.SCALE_M,
}
_REFUSED = ("FORCE_MOVE", "MANUAL_STEPPER")
_CALLS = (96, 97, 98, 198)


class Command(NamedTuple):
    """A command of a printer: its name ("M104", "G29.1", "T1", "PRINT_START"), and what stands behind it."""

    name: str
    rest: str

    @property
    def extended(self) -> bool:
        """True for a name, not a code."""
        return len(self.name) > 1 and re.match(r"[GMTP][-\d]", self.name) is None

    def values(self) -> dict[str, str]:
        """Values by key, in small letters: of KEY=VALUE, or of letters."""
        found = (_KEY if self.extended else _LETTER).findall(self.rest)
        return {key.lower(): value.strip('"') for key, value in found}


def command_of(text: str) -> Command | None:
    """The command of a line; None for a line that begins otherwise."""
    text = text.partition(";")[0]
    match = _COMMAND.match(text)
    if match is None:
        return None
    name = "".join(match[1].upper().split())
    if len(name) > 1 and name[0] in "GMTP" and name[1].isdigit() and len(name) < 9:
        name = f"{name[0]}{float(name[1:]):g}"
    return Command(name, text[match.end() :].strip())


def is_printer(words: Words, *, extruder: bool) -> bool:
    """True for a program of a 3-D printer: of none that has a number or changes tools (M6), where M83 and M109
    are others. On a machine with an extruder it needs no other mark, but G61 without G60 and G64 are of mills."""
    begin = words.first[:-1]
    numbers = (words.letter[begin] == ord("O")) & (words.value[begin] >= 0.0)
    if numbers.any() or len(words.find("M", 6.0)):
        return False
    if extruder and not (len(words.find("G", *_PATH_MODES)) and not len(words.find("G", 60.0))):
        return True
    if len(words.find("M", *_COUNTS)):
        return True
    for row in words.rows_with(words.find("M", *_SETS)):
        letters = words.of_rows(row)[0].tolist()
        if ord("G") not in letters and letters.count(ord("M")) == 1 and set(letters) & set(_NUMBERS):
            return True
    rows = words.rows_with(np.flatnonzero(words.letter == FAULT))
    return any(_EXTENDED.match(words.row_text(row)) for row in rows)


def is_command(text: str) -> bool:
    """True if a line of a printer's program is a command that is not split into words."""
    found = command_of(text)
    return found is not None and (found.extended or found.name[0] != "G")


def take(words: Words, row: int, block: Block, ignored: IgnoredWords) -> bool:
    """Execute a row of a printer's program into `block`; False for one that is read as in any program."""
    word = int(words.first[row])
    if words.letter[word] == ord("N") and word + 1 < words.first[row + 1]:
        word += 1
    found = command_of(words.row_text(row))
    if found is None or (found.name in _REFUSED and found.name not in ignored.reading.ignore):
        return False
    name, values = found.name, found.values()
    code = -1 if found.extended or len(name) == 1 else int(name[1:].partition(".")[0])
    limits = name == settings.VELOCITY_LIMIT or (name == f"M{code}" and code in settings.SETS_LIMITS)
    given = {key: _number(value) for key, value in values.items()}
    if limits or name in OF_STATE:
        slot = values.get("name" if found.extended else "s", "")
        block.settings.append(settings.Setting(name, given, word, slot))
    elif name[0] == "G" and code in _ANY and not given.get("h"):
        return False
    elif name in ignored.reading.ignore:
        ignored.count(settings.LEFT_OUT_BY_USER, name, block.line)
    elif name in _STOPPING:
        block.m["stopping"], block.at["stopping"] = _STOPPING[name], word
        return True
    elif name in _HOMING:
        block.homing = "".join(axis for axis in "XYZ" if axis.lower() in values) or "XYZ"
    else:
        if name in settings.RETRACTIONS and (found.extended or "s" in given):
            before = ignored.retractions[-1] if ignored.retractions else Retraction()
            now = before.changed(name, given, row)
            ignored.retractions += [now] * (now.length > 0.0)
            if given.get("z"):
                ignored.count(settings.SCALE_M, name, block.line)
        what, stops = _meaning(found, code, ignored)
        if what is None:
            return False
        ignored.count(what, name, block.line)
        block.stops = stops
        if name in _FEED_STAYS and math.isfinite(given.get("f", math.nan)):  # for the moves behind it
            block.value["F"], block.at["F"] = given["f"], word
    if code >= 0 and name[0] != "P":
        block.events.append((name[0], float(name[1:])))
    return True


def _meaning(found: Command, code: int, ignored: IgnoredWords) -> tuple[Assumption | None, bool]:
    """What is said of a command that nothing else reads, and whether it is a full stop; None for one that is
    read as in any program."""
    name = found.name
    if found.extended:
        of = (what for what, names in _NAMES.items() if re.fullmatch(names, name))
        what = next(of, settings.MACRO)
        return what, what in (settings.MACRO, settings.PARKS, settings.WAIT_M)
    if name[0] in "TP":
        changed = name[0] == "P" or ignored.extruder not in ("", name)
        ignored.extruder = name if name[0] == "T" else ""
        return (settings.TOOLS if changed else settings.PRINTER_M), changed
    if name[0] == "G":
        return (settings.LEVELLING if code in _LEVELS or code >= _BAMBU else None), True
    if 3 <= code <= 9 or (code in _CALLS and '"' not in found.rest):
        return None, False
    what, stops = settings.meaning(code)
    return _MEANT.get(code, what), stops or code in _MEANT


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return math.nan
