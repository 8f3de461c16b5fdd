"""The lines of a program as an export needs them: their words, the blocks that they make, and which of them
chords may replace.

Chords are written in the program's own coordinates. They say where the tool is only as far as the program
does, so a line is replaced only if its words alone tell where it begins and ends: straight moves, arcs,
cycles and splines under G90 or G91 at a feed per minute, of axes that an absolute coordinate has placed
before. Everything else stays a line of its own:

    the first moves of each axis           wherever the machine stands, they lead to the same place
    G53, G28, G30, homing                  machine coordinates; what they move has no place in the program's coordinates afterwards
    M6                                     the control may go to where it changes tools, or the operator may move it
    G54 to G59.3, G10, G52, G92, G43, G49  they shift those coordinates: all axes are placed anew (G92 places those that it names)
    rotary and second axes                 chords have X, Y and Z only
    E of an extruder                       beside straight moves; arcs that a printer does not know share theirs among their chords
"""

import re
from dataclasses import dataclass

import numpy as np

from planner.machine import Machine
from planner.nc import codes
from planner.nc.integers import integers_of
from planner.nc.language.detect import without_leader
from planner.nc.lexer import FAULT, Words, split_words
from planner.nc.program import MOVES, Kind, Program
from planner.nc.set_limits import SPEED_FACTOR
from planner.nc.settings import AXES, EVERYTHING, TEXTS, setting
from planner.nc.writer import flat_number

LINEAR = "XYZ"
# G codes in tenths.
G4, G10, G53, G52, G92 = 40, 100, 530, 520, 920
HOMES = (280, 300)
RETRACTIONS = (G10, 110)  # without L
# Beside work offsets: what shifts the coordinates that follow (G52, G92.1 to G92.3, G10, tool lengths).
SHIFTS = frozenset((G52, 921, 922, 923, G10, 430, 431, 432, 434, 490))
LENGTHS = frozenset((431, 432))  # whose axis words are lengths of tools
COMPENSATION_ON, COMPENSATION_OFF = frozenset((410, 411, 420, 421)), 400
ENDS = frozenset((20, 300))  # M2 and M30, in tenths
_TOOL_CHANGE = 6
_LINE = 10  # G1, in tenths
_ROUGH_CYCLES = frozenset((730, 810, 820, 830, 850, 890))  # that neither stop nor turn the spindle
_FLAG = re.compile(r"([A-FH-LP-Z])[ \t]*([-+]?(?:\d+\.?\d*|\.\d+)|)[ \t]*", re.IGNORECASE)
_FLAGS = re.compile(f"(?:{_FLAG.pattern})+", re.IGNORECASE)
_IN_PLANE = {170: "XY", 180: "XZ", 190: "YZ"}


@dataclass(frozen=True, slots=True)
class Word:
    """A word: its letter, its number, and the number as it is written."""

    letter: str
    value: float
    text: str

    @property
    def code(self) -> int:
        """The number in tenths."""
        return round(self.value * 10)

    def __str__(self) -> str:
        return self.letter + self.text


@dataclass(slots=True)
class Row:
    """A line of a program with at least one word.

    words  : those of RS274NGC's moves, modes and switches; line numbers are left out
    others : codes of other kinds, each with the words that are its own: settings, names, messages, what the
             user leaves out
    text   : the line without its comments and number, where it is no words: homing, commands to the control;
             "" otherwise
    """

    line: int  # 1-based
    words: list[Word]
    others: list[list[Word]]
    text: str
    first: int  # its blocks are those from here ...
    last: int  # ... to before here
    motion: int = -1  # motion code in tenths that its coordinates belong to; -1 for none
    absolute: bool = True  # G90 is in force at its end ...
    inch: bool = False  # ... and G20 ...
    per_minute: bool = True  # ... and G94
    inch_before: bool = False  # G20 was in force before it, which its F word is read in
    plane: str = "XY"  # letters of the axes of arcs
    radius: bool = False  # cutter radius compensation acts on it, or ends with it
    placed: frozenset[str] = frozenset()  # letters of axes whose place words before it have told
    plain: bool = False  # chords may replace what it moves
    at_feed: bool = False  # its G0 runs at F, as printers run it: the motion code is that of G1

    def g(self) -> list[int]:
        """Its G codes in tenths."""
        return [word.code for word in self.words if word.letter == "G"]

    def m(self) -> list[int]:
        """Its M codes."""
        return [word.code // 10 for word in self.words if word.letter == "M"]

    def value(self, letter: str) -> Word | None:
        """Its word of a letter."""
        return next((word for word in self.words if word.letter == letter), None)

    @property
    def named(self) -> str:
        """Letters of its axis words."""
        return "".join(word.letter for word in self.words if word.letter in AXES)

    @property
    def feeds(self) -> bool:
        """Whether its E is an extruder's: not that of G76 and of M66 to M68."""
        own = any("E" in codes.WORDS.get((word.letter, word.code), "") for word in self.words)
        return self.value("E") is not None and not own

    @property
    def moves(self) -> bool:
        """Whether it makes blocks that have a motion code."""
        return self.motion >= 0 and self.last > self.first


@dataclass(frozen=True, kw_only=True)
class Source:
    """The rows of a program up to its end."""

    program: Program  # what the rows read as, block by block those of the plan
    data: bytes  # the text
    rows: list[Row]

    def dwell(self, row: Row) -> float:
        """How long a row dwells [s]."""
        return float(self.program.dwell[row.first : row.last].max(initial=0.0))


def rows_of(data: bytes, program: Program, machine: Machine | None) -> Source:
    """The rows of a text that reads as `program` on a machine."""
    reading = program.reading
    read = without_leader(reading.kept(data, program.source)[0], reading)[0]
    words = split_words(read, block_delete=reading.block_delete)
    applied = integers_of(machine).applied(words)
    rows = _rows(words, applied, program)
    axes = "".join(letter.upper() for letter in machine.axes) if machine else LINEAR
    _Follower(program, LINEAR + "".join(c for c in axes if c in AXES and c not in LINEAR)).follow(rows)
    return Source(program=program, data=data, rows=rows)


def _rows(words: Words, applied: Words, program: Program) -> list[Row]:
    letters, values, first = words.letter.tolist(), applied.value.tolist(), words.first.tolist()
    same = (applied.value == words.value).tolist()
    begin = np.searchsorted(program.line, words.line, side="left").tolist()
    end = np.searchsorted(program.line, words.line, side="right").tolist()
    ignored = frozenset(program.reading.ignore)
    rows, begun = [], False
    for r, line in enumerate(words.line.tolist()):
        found: list[Word] = []
        text = ""
        for w in range(first[r], first[r + 1]):
            if letters[w] == FAULT:
                flags = _flags(found, _text(words, w))
                found += flags
                text = text or ("" if flags else _text(words, first[r]))
            elif letters[w] != ord("N"):
                number = words.text(w)[1:].replace(" ", "").replace("\t", "").lstrip("+")
                found.append(Word(chr(letters[w]), values[w], number if same[w] else flat_number(values[w])))
        mine, others = _parted(found, ignored)
        if others and others[0][0].letter == "M" and others[0][0].code // 10 in TEXTS:
            others, text = [], _text(words, first[r])
        rows.append(Row(line, [] if text else mine, [] if text else others, text, begin[r], end[r]))
        ends = any(word.letter == "M" and word.code in ENDS for word in mine)
        if ends or (begun and found and found[0].letter == "%"):
            break
        begun = True
    return rows


def _flags(before: list[Word], rest: str) -> list[Word]:
    """The words of a line from a letter without a number on: M84 X Y E says which motors, M420 V only that it
    is told. None where the line is not that of a setting to which they all belong."""
    alone = [word.letter for word in before if word.letter in "GM"] == ["M"] and before[0].letter == "M"
    found = setting("M", before[0].code, "", "") if alone and _FLAGS.fullmatch(rest) else None
    if found is None or found.letters != EVERYTHING:
        return []
    return [Word(c.upper(), float(number or "nan"), number) for c, number in _FLAG.findall(rest)]


def _text(words: Words, word: int) -> str:
    """The line from a word on, without its comments and its number."""
    start = int(words.at[word])
    stop = words.data.find(b"\n", start)
    text = words.data[start : stop if stop >= 0 else len(words.data)].decode("utf-8", "replace")
    text = text.partition(";")[0].partition("(")[0].strip()
    return text[len(words.text(word)) :].strip() if words.letter[word] == ord("N") else text


def _parted(words: list[Word], ignored: frozenset[str]) -> tuple[list[Word], list[list[Word]]]:
    """The words of moves, modes and switches; and the others, each code with its own words behind it."""
    letters = "".join(word.letter for word in words)
    mine: list[Word] = []
    others: list[list[Word]] = []
    own = ""
    for k, word in enumerate(words):
        if word.letter in "%O$":
            others.append([word])
            own = EVERYTHING if word.letter == "%" else ""
        elif word.letter in "GM":
            known = word.code in (codes.G_GROUP if word.letter == "G" else codes.M_GROUP)
            left_out = f"{word.letter}{codes.number(word.code)}" in ignored
            behind = re.split("[GM]", letters[k + 1 :], maxsplit=1)[0]
            found = setting(word.letter, word.code, letters[:k].replace("M", ""), behind)
            if known and not left_out and found is None:
                mine.append(word)
                own = ""
            else:
                others.append([word])
                own = found.letters if found and not left_out else EVERYTHING
                own += "E" if word.code == G92 else ""
        elif word.letter in own:
            others[-1].append(word)
        else:
            mine.append(word)
    return mine, others


class _Follower:
    """Goes through the rows once, and fills in what is in force on each."""

    def __init__(self, program: Program, axes: str):
        self.program, self.axes, self.ignored = program, axes, frozenset(program.reading.ignore)
        self.motion, self.absolute, self.inch, self.per_minute, self.diameters = -1, True, False, True, False
        self.plane, self.radius, self.leaving = 170, False, False  # leaving: no move has come after G40
        self.factor = 100.0  # of F, in percent
        self.placed: frozenset[str] = frozenset()
        self.extrudes = False
        self.simple = np.isin(program.kind, MOVES)
        self.simple[program.synchronised] = False
        before = np.vstack([program.start, program.end])
        step = np.diff(before, axis=0) != 0.0
        letters = enumerate(map(str.upper, program.axes))
        self.turns = {letter: step[:, k] for k, letter in letters if letter not in LINEAR}

    def follow(self, rows: list[Row]) -> None:
        """Fill in the rows."""
        self.extrudes = any(row.feeds for row in rows)
        for row in rows:
            row.inch_before, row.placed = self.inch, self.placed
            for other in row.others:
                if f"{other[0]}" == SPEED_FACTOR:  # F words of chords would count by it once more
                    self.factor = next((word.value for word in other if word.letter == "S"), 0.0)
            g = row.g()
            self._modes(g)
            row.absolute, row.inch, row.per_minute = self.absolute, self.inch, self.per_minute
            if row.text:
                if row.last > row.first:  # homing
                    self.placed = frozenset()
                continue
            row.plane = _IN_PLANE[self.plane]
            row.radius = self.radius or not COMPENSATION_ON.isdisjoint(g)
            if any(codes.G_GROUP[code] == "work offset" or code in SHIFTS for code in g):
                self.placed = row.placed = frozenset()
            self._place(row, g)
            if _TOOL_CHANGE in row.m():
                self.placed = frozenset()
            self.radius = row.radius and not (self.leaving and row.moves)

    def _modes(self, g: list[int]) -> None:
        groups = {codes.G_GROUP[code]: code for code in g}
        if "motion" in groups or "cycle end" in groups:
            self.motion = groups.get("motion", -1)
        self.inch = groups.get("units", 200 if self.inch else 210) == 200
        self.absolute = groups.get("distance mode", 900 if self.absolute else 910) == 900
        self.per_minute = groups.get("feed mode", 940 if self.per_minute else 930) == 940
        self.diameters = groups.get("lathe diameter mode", 70 if self.diameters else 80) == 70
        self.plane = groups.get("plane", self.plane)
        if not COMPENSATION_ON.isdisjoint(g):
            self.leaving = False
        elif COMPENSATION_OFF in g:
            self.leaving = True

    def _place(self, row: Row, g: list[int]) -> None:
        """Which axes the row moves, whether chords may do it, and which are placed after it."""
        named = frozenset(row.named)
        one_shot = next((code for code in g if codes.G_GROUP[code] == "one-shot"), -1)
        if one_shot == G92:
            self.placed |= named
        elif one_shot in HOMES:
            self.placed -= named or frozenset(self.axes)
        elif one_shot == G53:
            row.motion = self.motion
            self.placed -= named
        elif one_shot == -1 and LENGTHS.isdisjoint(g) and (named or row.feeds or self._bends(row, g)):
            row.at_feed = self.motion == 0 and Kind.LINE in self.program.kind[row.first : row.last]
            row.motion = _LINE if row.at_feed else self.motion
            if row.moves:
                row.plain = self._is_plain(row, named)
            self.placed |= self._told(row, named) if self.absolute else frozenset()

    def _bends(self, row: Row, g: list[int]) -> bool:
        """Whether it moves without a coordinate: on a full circle, or along the NURBS of the lines behind it."""
        said = not codes.ARCS.isdisjoint(g) or any(word.letter in "IJKR" for word in row.words)
        along = self.motion in codes.SPLINES and bool(self.simple[row.first : row.last].any())
        return along or (self.motion in codes.ARCS and said)

    def _told(self, row: Row, named: frozenset[str]) -> frozenset[str]:
        """Axes of which a row's words tell where they are after it: not a cycle's depth, it comes back."""
        if row.motion <= 30 or row.motion in codes.SPLINES:
            return named
        return named & frozenset(row.plane) if row.motion in codes.CYCLES else frozenset()

    def _is_plain(self, row: Row, named: frozenset[str]) -> bool:
        blocks = slice(row.first, row.last)
        whole = row.motion in codes.CYCLES or row.radius
        needed = named | frozenset(LINEAR if whole else row.plane if row.motion > 10 else "")
        cycle = row.motion in _ROUGH_CYCLES
        known = row.motion <= 30 or cycle or row.motion in codes.SPLINES
        return bool(
            known
            and needed <= row.placed
            and self.per_minute
            and self.factor == 100.0
            and not self.diameters
            and not self.program.origins.at(row.first)[1]
            and (self.simple[blocks] | (cycle & (self.program.kind[blocks] >= Kind.DWELL))).all()
            and not any(self.turns[letter][blocks].any() for letter in self.turns)
            and (row.value("E") is None or row.motion not in codes.CYCLES)
            and (self.absolute or not self.extrudes)  # G90 and G91 between chords would change what E is
            and self.ignored.isdisjoint(named)
        )
