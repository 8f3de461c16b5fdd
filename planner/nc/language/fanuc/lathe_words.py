"""Words of Fanuc's and Haas' lathes (G code system A) as those of LinuxCNC's lathes.

    X, U            diameters (G7), in the plane G18;  U W: X and Z from where the tool is;  H: refused unless 0
    G98 G99         feed per minute and per turn (G94, G95)
    G32             thread of the lead F (G33 K)
    G50 S           largest spindle speed (D of G96);  G96 G97 S
    G4 X U          dwell in seconds
    T0203           tool 2 with the offset 3 of the machine file (T2 M6, G43 H3); T0200 without one (G49); a full stop

Refused: drilling cycles, G50 with coordinates.
"""

from __future__ import annotations

from planner.nc.language.fanuc.calls import code_of
from planner.nc.language.fanuc.parser import FanucParser
from planner.nc.language.source import Source, SourceLine
from planner.nc.language.system_variables import FanucVariables
from planner.nc.language.tree import Expression, Line, Number, Numbered, Parameter, Word, row, word

CYCLES = ("G70", "G71", "G72", "G73", "G76")
X_HERE, Z_HERE = (
    Numbered(Number(5001.0)),
    Numbered(Number(5002.0)),
)  # parameters that hold the end of the last block
_TOOL_DIGITS = 100  # T0203: tool 2, offset 3
# Codes that are not read, and why.
_REFUSED = {**dict.fromkeys((f"G{n}" for n in range(81, 90)), "drilling cycles of lathes are")}


class LatheVariables(FanucVariables):
    """Fanuc's numbers on a lathe: the second axis is z, and x is a diameter."""

    def here(self, axis: int) -> float:
        """The position in the program's coordinates and unit."""
        found = super().here((0, 2, 1)[axis] if axis < 3 else axis)
        return 2.0 * found if axis == 0 and self.interpreter.state.diameters else found


class LatheWords(FanucParser):
    """Statements of a lathe's program without cycles."""

    def __init__(self, source: Source):
        super().__init__(source)
        self.feed: Expression | None = None
        self.threading = False  # G32 is in force
        self.surface: Expression | None = None  # S of G96
        self.speed_max: Expression | None = None
        self.tool = -1

    def _cycle(self, cycle: str, words: tuple[Word, ...], line: SourceLine) -> None:
        """A line with a cycle."""
        raise NotImplementedError

    def _single(self, words: tuple[Word, ...], codes: set[str], line: SourceLine) -> bool:
        """Read a line with a cycle without a profile. False if it is none."""
        raise NotImplementedError

    def _words(
        self, words: tuple[Word, ...], assignments: tuple[tuple[Parameter, Expression], ...], line: SourceLine
    ) -> None:
        codes = {code_of(word) for word in words}
        for code in sorted(codes & set(_REFUSED)):
            raise line.fault(f"{_REFUSED[code]} not read; write the moves out")
        given = {chr(word.letter): word.value for word in words if chr(word.letter) not in "GM"}
        self.feed = given.get("F", self.feed)
        if self._single(words, codes, line):
            return
        cycle = next((code for code in CYCLES if code in codes), "")
        if cycle:
            self._cycle(cycle, words, line)
            return
        if "T" in given:
            words = self._tool(words, given["T"], line)
        words = self._speeds(words, given, codes, line)
        if "G4" in codes and "P" not in given:
            words = tuple(
                word._replace(letter=ord("P")) if chr(word.letter) in "XU" else word for word in words
            )
            self.body.append(Line(line.place, tuple(word for word in words if chr(word.letter) != "H")))
            return
        words = tuple(changed for word in words if (changed := self._changed(word, line)) is not None)
        super()._words(self._threads(words, codes), assignments, line)

    def _changed(self, word: Word, line: SourceLine) -> Word | None:
        """The word as LinuxCNC's lathes have it; None for one that says nothing."""
        letter, code = chr(word.letter), code_of(word)
        if letter in "UW":
            axis, here = ("X", X_HERE) if letter == "U" else ("Z", Z_HERE)
            return word._replace(letter=ord(axis), value=here + word.value)
        if letter == "H":
            if word.value != Number(0.0):
                raise line.fault("H moves the axis C, which is not planned; X and Z are", word.at)
            return None
        if code in ("G98", "G99"):
            return word._replace(value=Number(94.0 if code == "G98" else 95.0))
        return word

    def _threads(self, words: tuple[Word, ...], codes: set[str]) -> tuple[Word, ...]:
        """G32 with the lead F as G33 with K, on each of its lines."""
        if "G32" in codes:
            self.threading = True
        elif codes & {"G0", "G1", "G2", "G3", "G00", "G01", "G02", "G03"}:
            self.threading = False
        if not self.threading or not any(chr(word.letter) in "XZ" for word in words):
            return words
        kept = [word._replace(value=Number(33.0)) if code_of(word) == "G32" else word for word in words]
        kept = [word for word in kept if chr(word.letter) != "F"]
        if self.feed is not None:
            kept.append(Word(ord("K"), kept[-1].at, self.feed))
        return tuple(kept)

    def _tool(self, words: tuple[Word, ...], number: Expression, line: SourceLine) -> tuple[Word, ...]:
        """T0203 as rows of its own; the other words are left."""
        if not isinstance(number, Number) or number.value < 0 or number.value != int(number.value):
            raise line.fault("T takes a number, such as T0203 (tool 2, offset 3)")
        tool, offset = (
            divmod(int(number.value), _TOOL_DIGITS)
            if number.value >= _TOOL_DIGITS
            else (int(number.value),) * 2
        )
        if tool != self.tool:
            self.body.append(row(line.place, ("T", float(tool)), ("M", 6.0)))
        self.tool = tool
        length = (("G", 43.0), ("H", float(offset))) if offset else (("G", 49.0),)
        self.body.append(row(line.place, *length))
        return tuple(word for word in words if chr(word.letter) != "T" and code_of(word) != "M6")

    def _speeds(
        self, words: tuple[Word, ...], given: dict[str, Expression], codes: set[str], line: SourceLine
    ) -> tuple[Word, ...]:
        """G50 S is kept and becomes D of G96."""
        if "G50" in codes or "G92" in codes:
            if "S" not in given or given.keys() & set("XZUW"):
                raise line.fault("G50 that sets a position is not read; write a work system (G54)")
            self.speed_max = given["S"]
            words = tuple(
                word for word in words if chr(word.letter) != "S" and code_of(word) not in ("G50", "G92")
            )
            if self.surface is None:
                return words
            return (*words, *self._surface(line))
        if "G97" in codes:
            self.surface = None
        if "G96" in codes or (self.surface is not None and "S" in given):
            self.surface = given.get("S", self.surface)
            words = tuple(word for word in words if chr(word.letter) != "S" and code_of(word) != "G96")
            return (*words, *self._surface(line))
        return words

    def _surface(self, line: SourceLine) -> list[Word]:
        at, speeds = line.place.at, (("S", self.surface), ("D", self.speed_max))
        return [word("G", at, 96.0), *(word(c, at, speed) for c, speed in speeds if speed is not None)]
