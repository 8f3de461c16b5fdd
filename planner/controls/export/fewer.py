"""The same program with fewer lines: successive straight moves as longer ones and arcs (fit.py).

Only lines are replaced that hold a straight move and nothing else, one directly behind the other, under one F:
so F words, S, T, M, comments and all other lines stay byte for byte where they stood, and every run between
them begins and ends where it did. A line that is left has the words of the last one that it replaces.

What must stay as it is, with the reason that a note names: `_why_kept`.
"""

import re
from dataclasses import dataclass

import numpy as np

from planner.base.arrays import FloatArray
from planner.base.errors import InputError
from planner.base.units import MM_PER_INCH
from planner.controls.export.chords import DECIMALS
from planner.controls.export.fit import STRAIGHT, Moves, fewest_moves
from planner.controls.export.output import INCH_DECIMALS
from planner.controls.export.rows import LINEAR, Row, rows_of
from planner.machine import Machine
from planner.nc import codes
from planner.nc.program import Kind, PathControl, Program, plain
from planner.nc.reading import ABSOLUTE

LINE = 10  # G1, in tenths
_ALONE = re.compile(rb"[ \t]*(N[ \t]*\d+)?(?:[ \t]*[GXYZF][ \t]*[-+]?[\d.]+)+[ \t]*\r?", re.IGNORECASE)
_ARC_WORDS = (("J", "K", "G19"), ("K", "I", "G18"), ("I", "J", "G17"))  # by the axis normal to the plane
_COMPUTES = "it has parameters, loops or calls; write it out first: planner expand JOB -o FILE"


@dataclass(frozen=True, kw_only=True)
class Fewer:
    """A program with fewer lines."""

    text: bytes
    before: int  # straight moves at a feed
    after: int  # straight moves and arcs in their place, and those that stay
    arcs: int
    kept: dict[str, tuple[int, int]]  # why lines that move stay: how many, and the first


def fewer_lines(
    data: bytes, program: Program, machine: Machine, within: float, *, arcs: bool = True
) -> Fewer:
    """Write a program with fewer lines.

    data    : its text, which reads as `program`
    within  : how far the new path may be from the old one, and the old from the new [mm]
    arcs    : whether arcs may be written, in all three planes

    Raises InputError for a program that computes, of another language than G-code, of points or plotters, and
    with the tool centre point on; and where no line can go.
    """
    for holds, why in (
        (program.pen, "it is a plotter file"),
        (program.expansion is not None, _COMPUTES),
        (program.tool_point is not None, "the tool centre point is on, and its lines are of the tip"),
    ):
        if holds:
            raise InputError(f"the program cannot be written with fewer lines: {why}", source=program.source)
    found = _Writer(data, program, machine, within, arcs=arcs).written()
    if found.after == found.before:
        many = [f"{why}: {n:,} line{'s' * (n > 1)}, first {line}" for why, (n, line) in found.kept.items()]
        said = "; ".join(many)
        text = f"no line can go within {plain(round(within, 6))} mm{': ' * bool(said)}{said}"
        raise InputError(text, source=program.source)
    return found


class _Writer:
    """Goes through the rows once and replaces runs of them."""

    def __init__(self, data: bytes, program: Program, machine: Machine, within: float, *, arcs: bool):
        self.program, self.within = program, within
        self.rows = rows_of(data, program, machine).rows
        self.lines: list[bytes | None] = [*data.split(b"\n")]
        told = any("arc centres read as absolute" in note for note in program.assumptions)
        absolute = program.reading.arc_centres == ABSOLUTE or told
        self.arcs = arcs and not absolute and not any(901 in row.g() for row in self.rows)
        self.place = np.vstack([program.start, program.end])[:, : len(LINEAR)]

    def written(self) -> Fewer:
        """The program."""
        kept: dict[str, tuple[int, int]] = {}
        run: list[Row] = []
        before = after = arcs = 0
        feed = self.program.feed

        def goes_on(last: Row, row: Row) -> bool:
            """Whether it is directly behind another, under the same F."""
            behind = row.line == last.line + 1 and row.first == last.last
            return behind and feed[row.first] == feed[last.first]

        for row in [*self.rows, None]:
            why = None if row is None else self._why_kept(row)
            if run and (why != "" or row is None or not goes_on(run[-1], row)):
                moves, bent = self._replace(run)
                after, arcs, run = after + moves, arcs + bent, []
            if row is None:
                break
            straight = row.moves and row.motion == LINE and not row.at_feed
            before += straight
            if why == "":
                run.append(row)
            elif straight or why:
                count, first = kept.get(str(why), (0, row.line))
                kept[str(why)] = (count + 1, first)
                after += straight
        lines = [line for line in self.lines if line is not None]
        return Fewer(text=b"\n".join(lines), before=before, after=after, arcs=arcs, kept=kept)

    def _why_kept(self, row: Row) -> str | None:
        """Why a line stays; "" if it may go, None for lines of which nobody asks that."""
        if not row.moves and not (row.text and row.last > row.first):
            return None
        program, first = self.program, row.first
        alone = _ALONE.fullmatch(self.lines[row.line - 1] or b"")
        for holds, why in (
            (row.text, "commands of the control"),
            (row.radius, "cutter radius compensation (G41, G42)"),
            (row.motion in codes.CYCLES, "canned cycles"),
            (row.motion not in (0, LINE), "arcs and curves of the program"),
            (not set(row.named) <= set(LINEAR), "rotary or second axes"),
            (row.feeds, "E of an extruder"),
            (not row.absolute, "incremental coordinates (G91)"),
            (not row.per_minute, "feed per revolution or inverse time (G93, G95)"),
            (program.path_control[first] != PathControl.BLEND, "exact path or exact stop (G61, G61.1)"),
            (not row.plain, "coordinates that the program has turned, or not told before"),
            (row.others or set(row.g()) - {LINE} or not alone, "other words or a comment beside them"),
        ):
            if holds:
                return None if row.motion == 0 or row.at_feed else why
        return None if row.motion == 0 or row.at_feed or program.kind[first] != Kind.LINE else ""

    def _replace(self, run: list[Row]) -> tuple[int, int]:
        """Write a run anew; returns the numbers of its moves and of its arcs."""
        first = run[0]
        unit, digits = (MM_PER_INCH, INCH_DECIMALS) if first.inch else (1.0, DECIMALS)
        offset, grid = self.program.origins.at(first.first)[0], unit * 10.0**-digits
        points = self.place[first.first : run[-1].last + 1] - offset
        moves = fewest_moves(points, self.within, grid, arcs=self.arcs)
        if moves.normal[-1] != STRAIGHT:  # what follows may count on G1 and the plane
            moves = fewest_moves(points[:-1], self.within, grid, arcs=self.arcs)
            moves = Moves(
                np.append(moves.end, len(run)),
                np.append(moves.normal, STRAIGHT),
                np.vstack([moves.center, np.zeros((1, 2))]),
                np.append(moves.sweep, 0.0),
            )
        if len(moves.end) == len(run):
            return len(run), 0
        self._write(run, moves, points, unit, digits)
        return len(moves.end), int((moves.normal != STRAIGHT).sum())

    def _write(self, run: list[Row], moves: Moves, points: FloatArray, unit: float, digits: int) -> None:
        """Write the moves in the lines of the last rows that they replace."""
        own = ["YZ", "XZ", "XY"].index(run[0].plane)
        plane, said = own, "" if run[0].g() else "G1"  # in force
        texts: dict[str, str] = {}
        at = 0
        for m, end in enumerate(moves.end.tolist()):
            rows, normal = run[at:end], int(moves.normal[m])
            words = []
            wanted = own if normal == STRAIGHT and m == len(moves.end) - 1 else normal
            if wanted not in (STRAIGHT, plane):
                plane = wanted
                words.append(_ARC_WORDS[plane][2])
            code = "G1" if normal == STRAIGHT else "G3" if moves.sweep[m] > 0 else "G2"
            same = len(rows) == 1 and not words and code == "G1" and (said == "G1" or bool(rows[0].g()))
            for row in rows:
                texts |= {word.letter: word.text for word in row.words if word.letter in LINEAR}
            if not same:
                words += [code] * (code != said)
                moved = zip(LINEAR, (points[at] != points[end]).tolist(), strict=True)
                words += [letter + texts[letter] for letter, far in moved if far and letter in texts]
                if normal != STRAIGHT:
                    center = zip(_ARC_WORDS[normal], moves.center[m].tolist(), strict=False)
                    words += [letter + plain(round(far / unit, digits) + 0.0) for letter, far in center]
                feed = rows[0].value("F") if at == 0 else None
                words += [str(feed)] * (feed is not None)
                self._put(rows, words)
            said, at = code, end

    def _put(self, rows: list[Row], words: list[str]) -> None:
        """Write words in the place of rows, with the number and the line end of the last."""
        old = self.lines[rows[-1].line - 1] or b""
        for row in rows:
            self.lines[row.line - 1] = None
        number = _ALONE.fullmatch(old)
        head = [number[1]] if number is not None and number[1] else []
        blank = b" " if b" " in old.strip() else b""
        end = b"\r" * old.endswith(b"\r")
        self.lines[rows[-1].line - 1] = blank.join([*head, *(word.encode() for word in words)]) + end
