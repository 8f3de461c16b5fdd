"""Writing a program back with other feeds: F words are put in or replaced, every other byte stays as it is.

An F word is written where a block's feed is not the one in force, in the units that F has there: those before a
G20 or G21 beside it, or behind, as the program was read. A block that keeps its programmed feed keeps the source's word, or
gets it written out where one of ours is in force. Lines under G93 and G95, threads, and F words without a
feed move stay. A block of rotary axes can be given under G93 instead, by how often it could be run in a
minute; the next other one has G94 and its feed.

Numbers are rounded down to `SIGNIFICANT` digits: each move takes up to 0.1 % longer than asked.

What was read from something else (HPGL) is written out as RS274NGC in mm, which reads back as the same program:
coordinates are rounded to `DECIMALS`, a tenth of what the reader may be off.

The expanded program as text: the words of every executed line, in their order, as any control reads them.

Resolved are parameters, expressions, loops, branches, subprograms and saved modes. Everything else stays as
the program has it: moves, arcs, feeds, dwells, canned cycles, work offsets, tools, spindle, coolant. Line
numbers and comments are left out. Numbers are rounded to `DECIMALS`.
"""

import math
import re
from collections.abc import Sequence
from functools import cache
from pathlib import PurePath
from typing import NamedTuple

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.units import MM_PER_INCH, SECONDS_PER_MINUTE
from planner.machine import Machine
from planner.nc.faults import require_none
from planner.nc.integers import LENGTHS, DwellWords
from planner.nc.language.detect import without_leader
from planner.nc.lexer import NUMBER, Words, split_words
from planner.nc.program import FEED_MOVES, Kind, PathControl, Program, extruder_alone, plain
from planner.nc.reader import execute, interpret, rewritten
from planner.nc.reading import CL, FANUC, KLIPPER, Reading

SIGNIFICANT = 4  # digits of a feed
FEED_MIN = 0.01  # the lowest feed that is written [mm/s]: no control moves slower, and F0 is an error
SAME_FEED = 1e-6  # a feed within this share of the programmed one is that [-]: rounding of lengths and times
DWELL, G93, G94, G95, _PERCENT = 4, 93, 94, 95, 220  # codes, the last one of M
_F, _G, _SECONDS = ord("F"), ord("G"), frozenset(b"XU")
_NUMBER = re.compile(NUMBER)
STOPPING = frozenset(("M0", "M1", "M6", "M60"))  # events with a full stop of their own
_CONTROL = {PathControl.EXACT_PATH: "G61", PathControl.EXACT_STOP: "G61.1"}
DECIMALS = 7  # of a number
_LEFT_OUT = frozenset(ord(letter) for letter in "N%O")
_ENDS = ("M2", "M02", "M30")
# Characters that must not stand in a comment, and what stands there instead.
_NO_COMMENT = {ord(letter): "_" for letter in "()"} | dict.fromkeys(range(32), "_")
Edit = tuple[int, int, bytes]  # bytes from ... to ... of the source become the text


def retimed(source: bytes, program: Program, feeds: FloatArray, inverse: FloatArray | None = None) -> bytes:
    """The program `source` with new feeds. Raises ValueError if the lines of `program` are not those of
    `source`, or a feed is negative.

    program : what the reader made of `source`, with the settings that it was read with
    feeds   : (B,) feed of each block [mm/s]; NaN or inf where the programmed one stays. The program's feed
              and its caps are never exceeded, and below `FEED_MIN` none is written. Ignored where nothing moves at a feed.
    inverse : (B,) how often a block could be run in a minute, to be written under G93; NaN for blocks with a
              feed
    """
    alone = extruder_alone(program)  # keeps its feed, written out where one of ours is in force
    moving = np.flatnonzero(np.isin(program.kind, FEED_MOVES) | alone)
    new_feed = np.asarray(feeds, dtype=np.float64)
    if new_feed.shape != (len(program),):
        raise ValueError(f"retimed: {new_feed.size} feeds for {len(program)} blocks")
    if (new_feed < 0).any():
        raise ValueError(f"retimed: a feed of {np.nanmin(new_feed):g} mm/s; none may be negative")
    new_feed = np.where(alone, np.nan, new_feed)
    reading = program.reading
    source = reading.kept(source, program.source)[0]
    words = split_words(without_leader(source, reading)[0], block_delete=reading.block_delete)
    line = program.line[moving]
    row = np.searchsorted(words.line, line)
    if len(line) and (row[-1] >= len(words.line) or (words.line[row] != line).any()):
        raise ValueError("retimed: the program has blocks on lines where the source has no word")
    asked = (program.uncapped if len(program.uncapped) else program.feed)[moving] * SECONDS_PER_MINUTE

    def off(rows: _SourceRows) -> Array:
        feed = rows.feed[row] * rows.unit[row]  # [mm per minute]
        wrong: Array = ~(np.abs(asked - feed) <= SAME_FEED * feed)
        return wrong

    in_source = min(
        (_SourceRows(words, behind=behind) for behind in (False, True)), key=lambda rows: off(rows).sum()
    )
    programmed, per_minute = in_source.feed[row], in_source.mode[row] == G94
    often = np.full(len(moving), np.nan) if inverse is None else np.asarray(inverse, dtype=np.float64)[moving]
    often[~per_minute | (in_source.mode_word[row] >= 0)] = np.nan
    # F is not that of a move under G93 and G95, and in a thread
    changeable = (per_minute & ~off(in_source)) | ~np.isnan(often)
    moving, row, programmed, often = (column[changeable] for column in (moving, row, programmed, often))
    wanted = np.maximum(new_feed[moving], FEED_MIN) * SECONDS_PER_MINUTE / in_source.unit[row]

    slower = wanted < programmed * (1.0 - SAME_FEED)  # False for NaN and inf
    # the blocks of a row (a cycle, corners of a compensated path) share its F word: the fastest of them
    # decides, but for the lowest cap on them
    rows, first, place = np.unique(row, return_index=True, return_inverse=True)
    fastest = np.zeros(len(rows))
    np.maximum.at(fastest, place, np.where(slower, wanted, np.inf))
    cap = program.feed[moving] * SECONDS_PER_MINUTE / in_source.unit[row]
    np.minimum.at(fastest, place, np.where(cap < programmed * (1.0 - SAME_FEED), cap, np.inf))
    fastest[np.isinf(fastest)] = np.nan
    new = _New(rows, fastest, programmed[first], often[first])
    pieces, done = [], 0
    for start, end, text in _edits(words, in_source, new):
        pieces += [source[done:start], text]
        done = end
    return b"".join([*pieces, source[done:]])


class _SourceRows:
    """Units, F words and feed modes on the R rows of the source.

    behind : F is read in the unit of a G20 or G21 beside it, as on Fanuc's controls and in grbl
    """

    def __init__(self, words: Words, *, behind: bool):
        rows = np.arange(len(words.line))
        of_word = np.repeat(rows, np.diff(words.first))
        code = np.where(words.letter == _G, np.rint(words.value * 10.0), -1.0)
        switch = np.flatnonzero(np.isin(code, (200.0, 210.0)))
        unit = np.append(1.0, np.where(code[switch] == 200.0, MM_PER_INCH, 1.0))
        # (R,) length unit in force before the row [mm], or behind it: what its F word is read in
        self.unit = unit[np.searchsorted(of_word[switch], rows, side="right" if behind else "left")]
        # (R,) index of its F word, and of its word for the feed mode, or -1
        self.f_word, self.mode_word = np.full((2, len(rows)), -1)
        given = np.flatnonzero(words.letter == _F)
        self.f_word[of_word[given]] = given
        last = np.maximum.accumulate(np.where(self.f_word >= 0, rows, -1))
        feed = words.value[self.f_word[last]] * (self.unit[last] / self.unit)
        # (R,) F in force, in the row's own units; NaN before one
        self.feed = np.where(last >= 0, feed, np.nan)
        switch = np.flatnonzero(np.isin(code, (10.0 * G93, 10.0 * G94, 10.0 * G95)))
        self.mode_word[of_word[switch]] = switch
        mode = np.append(G94, np.rint(code[switch] / 10.0)).astype(np.int64)
        # (R,) G93, G94 or G95 in force
        self.mode = mode[np.searchsorted(of_word[switch], rows, side="right")]


class _New(NamedTuple):
    """Feeds to write on the rows (n,) of feed moves."""

    row: Array
    wanted: FloatArray  # (n,) feeds in each row's units, as `programmed`; NaN where that holds
    programmed: FloatArray
    often: FloatArray  # (n,) runs per minute, under G93; NaN for a feed


def _edits(words: Words, in_source: _SourceRows, new: _New) -> list[Edit]:
    """The F words, and those of the feed mode, to write on rows of feed moves, in the order of the source."""
    edits: list[Edit] = []
    rounded, as_given = cache(round_down), cache(plain)
    move = np.full(len(in_source.f_word), -1)
    move[new.row] = np.arange(len(new.row))
    in_force, ours = 0.0, False  # [mm per minute]; under a G93 that was written here
    for r in np.flatnonzero((in_source.f_word >= 0) | (move >= 0) | (in_source.mode_word >= 0)).tolist():
        k, word, number = int(move[r]), int(in_source.f_word[r]), ""
        if in_source.mode_word[r] >= 0:
            ours = False
            in_force = 0.0 if k >= 0 else in_force  # in_source anew
        if k >= 0 and not math.isnan(new.often[k]):
            edits += _edited(words, r, word, round_down(float(new.often[k])), "" if ours else "G93")
            in_force, ours = 0.0, True
            continue
        if k < 0 and word < 0:
            continue
        if k >= 0 and not math.isnan(new.wanted[k]):
            number = rounded(float(new.wanted[k]))
        elif k >= 0 and (word < 0 or ours):
            number = as_given(float(new.programmed[k]))
        given = float(number or words.value[word]) * in_source.unit[r]
        if k >= 0 and ours:
            edits += _edited(words, r, word, number, "G94")
            ours = False
        elif number and (word >= 0 or abs(given - in_force) > SAME_FEED * in_force):
            edits += _edited(words, r, word, number, "")
        in_force = given
    return edits


def round_down(value: float) -> str:
    """A positive number in `SIGNIFICANT` digits, not above `value`: 1234.56 -> "1234"."""
    place = math.floor(math.log10(value)) + 1 - SIGNIFICANT  # of the last digit
    digits = math.floor(value * 10.0**-place * (1.0 + 1e-12))  # 0.3 is 0.3, not 0.2999
    text = f"{digits * 10**place}" if place >= 0 else f"{digits / 10**-place:.{-place}f}".rstrip("0")
    return text.rstrip(".") if "." in text else text


def _edited(words: Words, row: int, f_word: int, number: str, mode: str) -> list[Edit]:
    """Replace the row's F number, or append an F word, and the word of a feed mode behind it."""
    last = int(words.first[row + 1]) - 1
    at, end = int(words.at[last]), _end(words, last)
    tight = words.data[at - 1 : at].isalnum() or words.data[at - 1 : at] == b"."  # written X1Y2
    added = [mode] if mode else []
    edits = []
    if f_word >= 0:
        edits.append((int(words.at[f_word]) + 1, _end(words, f_word), number.encode()))
    else:
        added.append(f"F{number}")
    if added:
        text = "".join(("" if tight else " ") + word for word in added)
        lower = words.data[at : at + 1].islower()
        edits.append((end, end, (text.lower() if lower else text).encode()))
    return edits


def _end(words: Words, word: int) -> int:
    after = int(words.at[word]) + 1
    match = _NUMBER.match(words.data, after)
    assert match is not None
    return after + len(match.group().rstrip(b" \t"))


def program_text(program: Program, feeds: FloatArray, tolerance: float) -> str:
    """The NC text of a program in the plane z = 0.

    feeds     : (B,) feed of each block [mm/s]; looked at where a block moves at a feed, and finite and not
                negative there
    tolerance : contour error budget [mm], for G64 P
    """
    mode = PathControl(int(program.path_control[0])) if len(program) else PathControl.BLEND
    head = f"({in_comment(program.source)}, written by feedrate-planner)", "G21 G17 G90 G91.1 G94 G40 G49"
    control = _CONTROL.get(mode, f"G64 P{plain(tolerance)}")
    return "\n".join([*head, control, *_blocks(program, feeds), "M2", ""])


def _blocks(program: Program, feeds: FloatArray) -> list[str]:
    lines: list[str] = []
    position = program.start
    arc = dict(zip(program.arc_block.tolist(), range(len(program.arc_block)), strict=True))
    events = list(program.events)
    next_event, last_feed = 0, ""
    for block, kind in enumerate(program.kind.tolist()):
        stopped = False
        while next_event < len(events) and events[next_event].block <= block:
            stopped = events[next_event].text in STOPPING
            lines.append(events[next_event].text)
            next_event += 1
        end = program.end[block]
        if kind == Kind.STOP and stopped:
            pass  # by the last event
        elif kind in (Kind.STOP, Kind.DWELL):
            lines.append(f"G4 P{plain(float(program.dwell[block]))}")
        elif kind == Kind.RAPID:
            lines.append(f"G0 {_xy(end)}")
        else:
            feed = round_down(max(float(feeds[block]), FEED_MIN) * SECONDS_PER_MINUTE)
            code = f"G1 {_xy(end)}" if kind == Kind.LINE else _arc(program, arc[block], position, end)
            lines.append(code if feed == last_feed else f"{code} F{feed}")
            last_feed = feed
        position = end
    return [*lines, *(event.text for event in events[next_event:])]


def _xy(end: FloatArray) -> str:
    return f"X{flat_number(end[0])} Y{flat_number(end[1])}"


def _arc(program: Program, row: int, position: FloatArray, end: FloatArray) -> str:
    centre, code = program.arc_center[row] - position, 3 if program.arc_sweep[row] > 0 else 2
    return f"G{code} {_xy(end)} I{flat_number(centre[0])} J{flat_number(centre[1])}"


class _Flat:
    """Collects the lines of a program while it is expanded. With `points` lengths and the times of dwells are
    written with a point, because the machine reads them otherwise without. The percent of F that a Sinumerik's
    program sets (OVR, here M220) is in the F words: other controls have no such code."""

    def __init__(self, source: str, points: bool):
        self.points, self._dwells = points, DwellWords()
        # share of F; F in force, 0 for none; whether G93 is
        self._share, self._feed, self._inverse = 1.0, 0.0, False
        head = f"{in_comment(source)}, expanded by feedrate-planner: parameters, loops and calls written out"
        self.lines = [f"({head})"]

    def add(self, words: Words) -> None:
        """Write the rows of a chunk as lines."""
        letters, values, first = words.letter.tolist(), words.value.tolist(), words.first.tolist()
        written = cache(flat_number)
        dwells = set(self._dwells.find(words)) if self.points else set()
        for row in range(len(first) - 1):
            line = []
            mine = self._counted(range(first[row], first[row + 1]), letters, values)
            waits = any(letters[w] == _G and values[w] == DWELL for w in mine)
            for w in mine:
                if letters[w] not in _LEFT_OUT:
                    number = written(values[w])
                    is_length = self.points and letters[w] in LENGTHS and "." not in number
                    with_point = is_length or (w in dwells and values[w].is_integer())
                    seconds = waits and letters[w] in _SECONDS  # Fanuc's G4 X and U, which others have as P
                    line.append(("P" if seconds else chr(letters[w])) + number + "." * with_point)
            if line:
                self.lines.append(" ".join(line))

    def _counted(self, row: range, letters: list[int], values: list[float]) -> Sequence[int]:
        """The words of a row to write, with the share of F in the values; of M220 F, if one is in force."""
        for w in row:
            if letters[w] == _G and values[w] in (G93, G94, G95):
                self._feed, self._inverse = 0.0, values[w] == G93
        percent = next((values[w] for w in row if letters[w] == ord("S")), 0.0)
        if percent and any(letters[w] == ord("M") and values[w] == _PERCENT for w in row):
            self._share = percent / 100.0
            letters[row[0]], values[row[0]] = _F, self._feed * self._share
            return row[:1] if self._feed else ()
        for w in row:
            if letters[w] == _F:
                self._feed = 0.0 if self._inverse else values[w]
                values[w] *= self._share
        return row

    def text(self) -> str:
        """The program, with M2 at its end if it has no end of its own."""
        ended = bool(set(self.lines[-1].split()) & set(_ENDS))
        return "\n".join([*self.lines, *([] if ended else ["M2"]), ""])


def in_comment(source: str) -> str:
    """The name of a program as it may stand in a comment."""
    return PurePath(source).name.translate(_NO_COMMENT)


def flat_number(value: float) -> str:
    """A number without exponent, rounded to `DECIMALS`."""
    text = repr(round(float(value), DECIMALS) + 0.0)  # + 0.0 turns -0 into 0
    return plain(float(text)) if "e" in text else text.removesuffix(".0")


def flat_program(
    data: bytes, machine: Machine | None, reading: Reading, *, source: str
) -> tuple[str, Program] | None:
    """The text of an expanded program and the program itself; None if it has nothing to expand. Raises
    InputError for the first construct that is not supported or not valid."""
    program, faults = interpret(data, machine, reading, source=source)
    require_none(faults, source)
    if program.expansion is None:
        return None
    if program.expansion.dialect in (KLIPPER, CL):
        called = rewritten(data, machine, reading, source)
        return ("" if called is None else called.data.decode("utf-8", "replace")), program
    fanuc = program.expansion.dialect == FANUC
    flat = _Flat(source, fanuc or (machine is not None and machine.dialect is not None))
    # once more, now that it is known how arc centres are read
    execute(data, machine, program.reading, source, flat.add)
    return flat.text(), program
