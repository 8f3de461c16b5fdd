"""How a program is read: what is refused, what is left out, and what is assumed where the program does not
say it.

Without settings a reader is lenient where nothing moves and strict where something does: what it does not
know and what cannot move an axis is counted in a note (nc/faults.py), and what may move is refused.
"""

from __future__ import annotations

import dataclasses
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from planner.base.errors import InputError
from planner.nc.feed_caps import FeedCaps, read_feed_caps
from planner.nc.settings import may_be_ignored

AUTO, ABSOLUTE, INCREMENTAL = "auto", "absolute", "incremental"
ARC_CENTRES = (AUTO, ABSOLUTE, INCREMENTAL)
REFUSE, IGNORE = "refuse", "ignore"
EXTRUDERS = (AUTO, REFUSE, IGNORE)
LINUXCNC, FANUC, HEIDENHAIN, SIEMENS = "linuxcnc", "fanuc", "heidenhain", "siemens"
KLIPPER, CL = "klipper", "apt"  # whose macros a program calls; CL files
LATHE = "lathe"  # Fanuc's on a lathe, which the program's words tell
PRINTER = "printer"  # a program is one for a 3-D printer, whatever its words tell
GRBL = "grbl"  # LinuxCNC's language with another meaning of F
_ALIASES = {"haas": FANUC, "sinumerik": SIEMENS}
MARLIN, REPRAP = "marlin", "reprapfirmware"  # printers whose unit of M203 is known
PRINTERS = (PRINTER, MARLIN, REPRAP)
_ALIASES[KLIPPER] = PRINTER
DIALECTS = (AUTO, LINUXCNC, GRBL, FANUC, HEIDENHAIN, SIEMENS, *PRINTERS, *_ALIASES)
_CODE = re.compile(r"([GM])(\d{1,4})(?:\.(\d))?")
_OTHER = re.compile(r"[ABCUVW]|\$[A-Z$#]?|[A-Z]*_\w+")
_LINES = re.compile(r"(\d+)(?:-(\d+))?")
_NAME = re.compile(r"[A-Z$][A-Z_$]\w*(?: \w+)*")
# Words and commands that move, set coordinates or decide what comes next, by their beginning.
_MOVES = re.compile(
    r"(?:L[PN]|C[CPRT]|CTP|CIP|RND|CHF|APPR|DEP|F(?:LT?|CT?|POL|SELECT)|LBL|CALL|TOOL|CYCL|PLANE|PATTERN|BEGIN|END|"
    r"FUNCTION (?:TCPM|RESET)|FN ?(?!1[4-79])\d+|A?(?:TRANS|ROTS?|SCALE|MIRROR)|CROTS|TRA\w+|TO(?:FRAME|ROT)\w*|PAROT|SUPA|DIAM\w+|"
    r"[ABC]?SPLINE|POLY|INVC?CW|KONT|OFFN|ANG|AR|AP|RPL?|PW|PL|SD|PO|FMAX|C?(?:AC|IC|DC)|C?AC[PN]|CH[RF]|RNDM|TURN|GEOAX|CYCLE(?!832)\d+|POCKET\d|SLOT\d|HOLES\d|LONGHOLE|"
    r"POS[AP]?|MOV|DEF|PROC|RET|CASE|MCALL|"
    r"(?:EL|ELSE|END)?IF|ELSE|(?:END)?(?:WHILE|FOR|LOOP|SUB)|REPEATB?|UNTIL|GO(?:TO[BFC]?|SUB)|DO|SET|VAR|GLOBAL|EXTCALL|PCALL)\b"
)
_COORDINATES = re.compile(r"(?i)(?<!\w)I?[XYZABCUVW](?:[-+]?[\d.]+|[-+]?Q\d+|\s*=)")
_WRITTEN: dict[type, type] = {tuple: list, FeedCaps: str}  # settings in JSON
_WHY = "it moves the axes, or what follows it has another meaning without it"
_SAY = (
    "write G and M codes, rotary or second axes (A B C U V W), words and commands of the control ($X, PRINT_START, WMAT, ACC) "
    "that move nothing or lines (12-20), such as M428,G187,A,12-20"
)


@dataclass(frozen=True, kw_only=True)
class Reading:
    """Settings of the reader, kept in `Program.reading`. Raises InputError for values that are none."""

    strict: bool = False  # refuse everything that would be assumed
    # what the user knows to be harmless: codes ("M428", "G187"), axis letters ("A"), commands and words ("$X",
    # "PRINT_START", "ACC"), lines of the file ("12-20"); in one normal form
    ignore: tuple[str, ...] = ()
    # what I J K mean in a program that has neither G90.1 nor G91.1: "incremental", "absolute", or "auto", which is
    # incremental unless arcs on more than one line close with absolute centres only, as all of the program do
    arc_centres: str = AUTO
    # what is done with the E words of 3-D printers: "auto" follows them on a machine with an axis e, and else leaves
    # them out and says so; "refuse" or "ignore"
    extruder: str = AUTO
    # whose language parameters, expressions and subprograms are, and the unit of dwells: "linuxcnc", "fanuc" (Haas
    # too), "heidenhain", "siemens", "printer" (Marlin, Klipper), or "auto", by what the program holds
    dialect: str = AUTO
    block_delete: bool = True  # leave out the lines that start with "/"
    ignore_travel: bool = False  # plan what the travel of the machine's axes does not reach
    # file of feeds that hold where they are below F, or what was read from one
    feed_caps: FeedCaps | str | Path | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "dialect", _ALIASES.get(self.dialect, self.dialect))
        if isinstance(self.feed_caps, str | Path):
            object.__setattr__(self, "feed_caps", read_feed_caps(self.feed_caps))
        for name, allowed in (("arc_centres", ARC_CENTRES), ("extruder", EXTRUDERS), ("dialect", DIALECTS)):
            if getattr(self, name) not in allowed:
                raise InputError(f"{name} = {getattr(self, name)!r}; allowed are {', '.join(allowed)}")
        if isinstance(self.ignore, str):
            raise InputError(f"ignore = {self.ignore!r} is one text; give a tuple, such as ('M428', 'A')")
        object.__setattr__(self, "ignore", tuple(dict.fromkeys(map(_normal, self.ignore))))

    @property
    def caps(self) -> FeedCaps | None:
        """The feed caps, read."""
        return self.feed_caps if isinstance(self.feed_caps, FeedCaps) else None

    @property
    def unjudged(self) -> tuple[str, ...]:
        """What the verdict leaves out: the travel, where it is to be ignored."""
        return ("travel",) if self.ignore_travel else ()

    @property
    def lines(self) -> list[tuple[int, int]]:
        """The first and last of the lines that are left out, 1-based."""
        found = filter(None, map(_LINES.fullmatch, self.ignore))
        return [(int(lines[1]), int(lines[2] or lines[1])) for lines in found]

    @property
    def names(self) -> list[str]:
        """Words and commands that are left out before words are split; those of printers (PRINT_START) are not."""
        return [name for name in self.ignore if _NAME.fullmatch(name) and not _OTHER.fullmatch(name)]

    def kept(self, data: bytes, source: str) -> tuple[bytes, list[tuple[int, str]]]:
        """A program with blanks for the lines and words that are left out, and those with their line; offsets
        stay. Raises InputError for lines beyond its end, and for a command beside coordinates."""
        rows = data.split(b"\n") if self.ignore else []
        count = len(rows) - (rows[-1:] == [b""])
        for first, last in self.lines:
            if not 1 <= first <= last <= count:
                raise InputError(f"ignore: {first}-{last}: the program has lines 1 to {count}", source=source)
            rows[first - 1 : last] = [b" " * len(row) for row in rows[first - 1 : last]]
        left = [(first, f"lines {first} to {last} are") for first, last in self.lines]
        for name in self.names:
            lines = _without(name, rows, source)
            left += [(line, f"{name} is") for line in lines] or [(1, f"{name}, which is nowhere in it, is")]
        return (b"\n".join(rows) if rows else data), left

    def changed(self) -> dict[str, Any]:
        """The settings that are not the usual ones, ready for JSON; `Reading.saved` reads them, all but feed caps."""
        return {
            field.name: _WRITTEN.get(type(value := getattr(self, field.name)), type(value))(value)
            for field in dataclasses.fields(self)
            if getattr(self, field.name) != field.default
        }

    @classmethod
    def saved(cls, changed: object) -> Reading:
        """The settings that a file says; entries that are none are left out."""
        given = changed if isinstance(changed, dict) else {}
        settings: dict[str, Any] = {}
        for field in dataclasses.fields(cls):
            value = given.get(field.name)
            value = tuple(value) if isinstance(value, list) else value
            if isinstance(value, type(getattr(AS_USUAL, field.name))):
                settings[field.name] = value
        try:
            return cls(**settings)
        except (InputError, AttributeError, TypeError):
            return AS_USUAL


def ignore_list(text: str) -> tuple[str, ...]:
    """The entries of a list such as "M428,G187,A". Raises InputError for an entry that is none."""
    return Reading(ignore=tuple(part for part in text.split(",") if part.strip())).ignore


def _without(name: str, rows: list[bytes], source: str) -> list[int]:
    """Put blanks for a word with its brackets and value, or for a command with all behind it; its lines.
    Raises InputError for one with coordinates behind it."""
    spelled = r"[ \t]*".join(map(re.escape, re.findall(r"\d+|[A-Z_$]+", name)))
    own = r"(?:[ \t]*(?:\[[^\]]*\]|\([^)]*\)))*(?:[ \t]*=(?!=)[ \t]*[^\s;]+)?"
    defined = re.compile(rf"(?i)\s*(?:N\d+\s*)?DEF\b[^;]*(?<![\w$.]){spelled}(?!\w)")
    word = re.compile(rf'(?i)([^;("]*?(?<![\w$.]))(?:{spelled})(?!\w)({own})')
    found = []
    for k, row in enumerate(rows):
        text = row.decode("latin-1")
        if defined.match(text):
            what = f"ignore: {name} is a variable of the program, and what follows it has another meaning without it"
            raise InputError(what, source=source, line=k + 1, column=1)
        while match := word.match(text):
            end = match.end()
            if not match[2] and re.fullmatch(r"\s*(?:/\d?)?\s*N?\d*\s*", match[1], re.IGNORECASE):
                end = len(text.partition(";")[0].rstrip("\r"))
                if beside := _COORDINATES.search(text, match.end(), end):
                    what = f"ignore: {name} stands beside {beside[0]}, which may move; write it on a line of its own"
                    raise InputError(what, source=source, line=k + 1, column=len(match[1]) + 1)
            text = match[1] + " " * (end - len(match[1])) + text[end:]
            found.append(k + 1)
        rows[k] = text.encode("latin-1")
    return found


def _normal(entry: str) -> str:
    """The one way to write an entry: "m007" is "M7"."""
    text = "".join(entry.upper().split())
    if match := _CODE.fullmatch(text):
        letter, whole, tenth = match.groups()
        name = f"{letter}{int(whole)}" + (f".{tenth}" if tenth and tenth != "0" else "")
        if not may_be_ignored(name):
            raise InputError(f"ignore: {name} cannot be left out: {_WHY}")
        return name
    if _OTHER.fullmatch(text) or _LINES.fullmatch(text):
        return text
    if _MOVES.match(name := " ".join(entry.upper().split())):
        raise InputError(f"ignore: {name} cannot be left out: {_WHY}")
    if _NAME.fullmatch(name):
        return name
    raise InputError(f"ignore: '{entry}' is nothing that can be ignored; {_SAY}")


AS_USUAL = Reading()
