"""CL files (APT), what CAM systems give to post-processors, as programs: a line of codes for each record.

    GOTO/x,y,z[,i,j,k]  GODLTA/dx,dy,dz  FROM/x,y,z   the tool's tip and direction; FROM is a rapid to there
    RAPID  FEDRAT/f,MMPM                              the next move is a rapid; also IPM, MMPR, IPR
    CIRCLE/x,y,z,i,j,k,r  MOVARC/...                  the next GOTO ends an arc, right-handed about (i, j, k)
    INDIRV/u,v,w  TLON,GOFWD/(CIRCLE/x,y,z,r),ON,(LINE/x,y,z,xe,ye,ze)      of CATIA: an arc that begins along (u, v, w)
    UNITS LOADTL SPINDL COOLNT DELAY STOP OPSTOP GOHOME AUXFUN END FINI

A direction off (0, 0, 1) needs [kinematics]: the rotary axes turn as machine/kinematics/directions.py has it, with
the tool centre point on. What may move and is not read (CYCLE, CUTCOM, TRANS ...) is refused. A record ends with
its line, unless a $ goes on; $$ begins a comment.
"""

import re
from collections import Counter

import numpy as np

from planner.base.errors import InputError
from planner.base.units import MM_PER_INCH, RAD_PER_DEG
from planner.machine import Machine
from planner.machine.kinematics.chain import kinematics_of
from planner.machine.kinematics.directions import rotary_along
from planner.nc.macros import Called
from planner.nc.moves import NUMBER_MAX
from planner.nc.reading import CL

_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_OF_CATIA = re.compile(
    rf"TLON,GOFWD/\(CIRCLE/((?:{_NUMBER},){{3}}){_NUMBER}\),ON,(?:\d,INTOF,)?\(LINE/((?:{_NUMBER},){{5}}{_NUMBER})\)"
)
_UP = (0.0, 0.0, 1.0)
_ALONG = 1e-6  # by which a unit vector may miss an axis
# Records that move nothing, as a text.
_STILL = """ MULTAX MACHIN CUTTER INTOL OUTTOL TOLER SEQNO LEADER REWIND TLDATA MSYS PAINT DISPLY VIEW END-OF-PATH SELCTL
CLEARP INDIRP PSIS AUTOPS TOOLNO OPSKIP CLPRNT NOPOST LINTOL CLRSRF SYN ISN """
_TEXTS = ("PPRINT", "PARTNO", "TPRINT", "REMARK", "TOOLPATH")
_CODES = {"STOP": "M0", "OPSTOP": "M1", "GOHOME": "G28", "END": "M2", "FINI": "M2"}
_COOLANT = {"OFF": "M9", "MIST": "M7"}
_PER = dict.fromkeys(("MMPM", "MMPR"), 1.0) | dict.fromkeys(("IPM", "IPR"), MM_PER_INCH)  # [mm]
_SPINDLE = {"OFF": "M5", "CCLW": "M4", "CCW": "M4"}


def codes_of(data: bytes, machine: Machine | None, source: str) -> Called:
    """The program of a CL file, its lines where the records stand. Raises InputError for a record that is not read,
    and for directions that the machine cannot have."""
    lines = data.decode("utf-8", "replace").replace("\r", "").split("\n")
    units = re.search(rb"(?mi)^\s*UNITS\s*/\s*(MM|IN)", data)
    units = units or re.search(rb"(?mi)^\s*FEDRAT\b.*(MM|I)P[MR]", data)
    records = _Records(1.0 if units is None or units[1].upper() == b"MM" else MM_PER_INCH)
    text, codes = "", [""] * len(lines)
    for number, line in enumerate(lines, start=1):
        text += line.partition("$$")[0].strip()
        if text.endswith("$"):
            text = text[:-1]
            continue
        try:
            codes[number - 1] = records.take(number, text)
        except ValueError as fault:
            raise InputError(f"{text[:60]}: {fault}", source=source, line=number) from None
        text = ""
    head = "" if units is None else "G20 " if records.unit > 1.0 else "G21 "
    codes[0] = f"{head}G90 G91.1 G17 G94 {codes[0]}".strip()
    if any(axis != _UP for axis in records.directions.values()):
        _turn(codes, records.directions, machine, source)
    return Called("\n".join(codes).encode(), np.arange(len(lines)) + 1, (), Counter(), {}, CL)


Directions = dict[int, tuple[float, ...]]


def _turn(codes: list[str], directions: Directions, machine: Machine | None, source: str) -> None:
    """Write the rotary axes' places into the moves, whose directions are known by line. Raises InputError."""
    if machine is None or not machine.kinematics:
        line = next(line for line, axis in directions.items() if axis != _UP)
        said = "a direction of the tool needs a machine file with a table [kinematics]; add it (type, rotary axes, offsets)"
        raise InputError(f"GOTO: {said}", source=source, line=line)
    chain, on = kinematics_of(machine), list(directions)
    angles = rotary_along(chain, np.array(list(directions.values())), machine.tolerance / machine.radius, on)
    letters = [c.upper() for c in chain.data.rotary]
    for line, places in zip(on, (angles / RAD_PER_DEG).tolist(), strict=True):
        words = (f"{c}{_text(round(v, 9))}" for c, v in zip(letters, places, strict=True))
        codes[line - 1] += " " + " ".join(words)
    codes[on[0] - 1] += " M128"


def _text(value: float) -> str:
    return np.format_float_positional(value + 0.0, trim="0")  # with a point: none is in least increments


class _Records:
    """The records so far, in units of `unit` [mm]. `directions` of the moves are by line."""

    def __init__(self, unit: float) -> None:
        self.unit = unit
        self.directions: dict[int, tuple[float, ...]] = {}
        self._tip = np.zeros(3)
        self._axis = _UP
        self._rapid = False
        self._circle: list[float] = []  # centre and axis of the arc that comes
        self._heading = np.zeros(3)  # of INDIRV

    def take(self, line: int, text: str) -> str:
        """The codes of a record. Raises ValueError."""
        word, _, rest = "".join(text.upper().split()).partition("/")
        given = [part for part in rest.split(",") if part]
        numbers = [float(part) for part in given if re.fullmatch(_NUMBER, part)]
        if max(map(abs, numbers), default=0.0) > NUMBER_MAX:
            raise ValueError(f"a number beyond {NUMBER_MAX:g}")
        if found := _OF_CATIA.fullmatch("".join(text.upper().split())):
            centre, end = (np.array(part.strip(",").split(","), dtype=float) for part in found.groups())
            axis = np.cross(self._tip - centre, self._heading)
            self._circle = [*centre, *(axis / max(float(np.linalg.norm(axis)), _ALONG))]
            return self._move(line, end[3:])
        if word in ("GOTO", "FROM", "GODLTA", "TLAXIS"):
            return self._place(line, word, numbers, len(given))
        if word == "INDIRV" and len(numbers) == 3:
            self._heading = np.array(numbers)
        elif word in ("CIRCLE", "MOVARC") and len(numbers) >= 6:
            self._circle = numbers[:6]
        elif word == "RAPID":
            self._rapid = True
        else:
            return self._switch(word, given, numbers, rest)
        return ""

    def _switch(self, word: str, given: list[str], numbers: list[float], rest: str) -> str:
        value = _text(numbers[0]) if numbers else ""
        if word == "FEDRAT" and numbers:
            unit = next((_PER[part] for part in given if part in _PER), self.unit)
            feed = _text(float(f"{numbers[0] * unit / self.unit:.12g}"))
            self._rapid = False
            return f"G9{5 if {'MMPR', 'IPR', 'PERREV'} & set(given) else 4} F{feed}"
        if word == "SPINDL" and not {"SFM", "SMM"} & set(given):
            turns = next((_SPINDLE[part] for part in given if part in _SPINDLE), "M3")
            return f"S{value} {turns}" if value and turns != "M5" else turns
        if word in ("LOADTL", "AUXFUN") and numbers:
            return f"T{numbers[0]:g} M6" if word == "LOADTL" else f"M{numbers[0]:g}"
        if word == "DELAY" and numbers and "REV" not in given:
            return f"G4 P{value}"
        if word == "COOLNT":
            return next((_COOLANT[part] for part in given if part in _COOLANT), "M8")
        none = rest[:3] == "OFF" if word in ("CUTCOM", "CYCLE") else bool(numbers) and not any(numbers)
        if word == "UNITS" or (none and word in ("CUTCOM", "CYCLE", "TRANS", "ORIGIN")):
            return ""
        if word in _CODES and not numbers:
            return _CODES[word]
        if not word or f" {word} " in _STILL.replace("\n", " ") or word.startswith(_TEXTS):
            return ""
        what = "a record that may move the tool and is not read"
        raise ValueError(f"{what}; write the moves out in the CAM system, or give G code")

    def _place(self, line: int, word: str, numbers: list[float], count: int) -> str:
        """A record of places: GOTO and FROM with a direction or without, GODLTA, TLAXIS."""
        if count != len(numbers) or count not in ((3, 6) if word in ("GOTO", "FROM") else (3,)):
            raise ValueError("three numbers are needed, or x, y, z, i, j, k of GOTO and FROM")
        if count == 6 or word == "TLAXIS":
            size = float(np.linalg.norm(numbers[-3:]))
            if not size:
                raise ValueError("a direction without a length")
            x, y, z = (round(value / size, 12) + 0.0 for value in numbers[-3:])
            self._axis = x, y, z
        if word == "TLAXIS":
            return ""
        self._rapid |= word == "FROM"
        return self._move(line, np.array(numbers[:3]) + (self._tip if word == "GODLTA" else 0.0))

    def _move(self, line: int, end: np.ndarray) -> str:
        circle, self._circle = self._circle, []
        code = "G0" if self._rapid else "G1"
        if circle and not self._rapid:
            axis = np.array(circle[3:]) / max(float(np.linalg.norm(circle[3:])), _ALONG)
            normal = int(np.abs(axis).argmax())
            if abs(axis[normal]) < 1.0 - _ALONG:
                about = ", ".join(f"{part:g}" for part in axis)
                raise ValueError(f"an arc about ({about}); arcs lie in X/Y, Z/X or Y/Z")
            centre = np.array(circle[:3]) - self._tip
            code = f"G{19 - normal} G{3 if axis[normal] > 0.0 else 2}"
            code += "".join(f" {'IJK'[k]}{_text(float(centre[k]))}" for k in range(3) if k != normal)
        self._rapid = False
        self._tip = end
        self.directions[line] = self._axis
        return code + "".join(f" {letter}{_text(float(end[k]))}" for k, letter in enumerate("XYZ"))
