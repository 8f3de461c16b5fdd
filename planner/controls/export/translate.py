"""A program in the words of a control: line by line its own, with chords where a line's moves are replaced. A
line gives up to three things, in the order of RS274NGC: what it says before it moves (switches.py), its move,
and a stop.
"""

from collections.abc import Iterator

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.units import MM_PER_INCH, SECONDS_PER_MINUTE
from planner.controls.export.chords import DECIMALS, LINEAR, Polyline
from planner.controls.export.controls import GRBL, MARLIN, Control, sets_tools, takes_move
from planner.controls.export.output import INCH_DECIMALS
from planner.controls.export.rows import G4, G10, G53, HOMES, LENGTHS, Row, Source, Word
from planner.controls.export.switches import Switches
from planner.machine import Machine
from planner.nc import codes
from planner.nc.program import Kind, plain
from planner.nc.reading import FANUC, IGNORE
from planner.nc.settings import AXES
from planner.nc.writer import FEED_MIN

FILAMENT_DECIMALS = 5  # of E in mm, as slicers write it


class Filament:
    """The extruder of a control behind the rows followed so far, by the control's own rules: E is a step after M83 and
    under G91; Marlin's G90 also ends M83. Where E is at the start nothing tells, nor after a tool change or a macro; G92
    and places do."""

    def __init__(self, control: Control, machine: Machine):
        self.one_mode = control.name == MARLIN.name  # G90 and G91 set it for E too
        self.macros = machine.macros
        self.place = np.nan  # what its E is called [mm], NaN where nothing has told it
        self.steps = False  # E words are steps, whatever G90 and G91 say of the other axes

    def shared(self, row: Row, points: FloatArray) -> list[float] | None:
        """The E of a row for each of the chords between points (n+1, 3) [mm], in proportion to their lengths, in
        all the row's own; None where it is a place and the one before is not known, and without a length."""
        word = row.value("E")
        assert word is not None
        end, begin = _millimetres(word, row), 0.0 if self.steps else self.place
        along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
        if np.isnan(begin) or not along[-1] > 0.0:
            return None
        at = np.round(begin + along / along[-1] * (end - begin), FILAMENT_DECIMALS)
        at[-1] = end
        shares: list[float] = np.round(np.diff(at) if self.steps else at[1:], FILAMENT_DECIMALS).tolist()
        return shares

    def follow(self, row: Row) -> None:
        """Go on behind a row."""
        words = [*row.words, *(word for other in row.others for word in other)]
        said = {f"{word.letter}{codes.number(word.code)}" for word in words if word.letter in "GM"}
        if "M6" in said or not said.isdisjoint(self.macros):
            self.place = np.nan
        if not said.isdisjoint(("M82", "M83")):
            self.steps = "M83" in said
        if self.one_mode and not said.isdisjoint(("G90", "G91")):
            self.steps = "G91" in said
        amount = next((_millimetres(word, row) for word in words if word.letter == "E"), None)
        if amount is not None and ("G92" in said or row.feeds):
            adds = (self.steps or not (self.one_mode or row.absolute)) and "G92" not in said
            self.place = amount + (self.place if adds else 0.0)


def _millimetres(word: Word, row: Row) -> float:
    return word.value * (MM_PER_INCH if row.inch else 1.0)


class Translator(Switches):
    """Writes a program for a control; `translated` once. The moves of the rows `replaced` (R,) of the source
    are those of `line`, whose rapid ones have the speeds `rapid` (n,) [mm/s]."""

    def __init__(
        self,
        source: Source,
        control: Control,
        machine: Machine,
        replaced: Array,
        line: Polyline,
        rapid: FloatArray,
    ):
        super().__init__(source, control, machine)
        self.replaced, self.line, self.rapid = replaced, line, rapid
        self.move = 0  # of the polyline
        self.filament = Filament(control, machine)

    def translated(self) -> tuple[list[str], tuple[str, ...]]:
        """The lines of the file without its header, and what was left out, or is written another way, each with its first
        line. Raises InputError for the first line that the control has no words for."""
        for row, chords in zip(self.source.rows, self.replaced.tolist(), strict=True):
            self._row(row, chords=chords)
        if not self.ended:
            self._end(self.source.rows[-1])
        return self.lines, tuple(f"line {line}: {text}" for text, line in self.notes.values())

    def _row(self, row: Row, *, chords: bool) -> None:
        if row.text:
            if not self.control.is_command(row.text):
                self._refuse(row, row.text)
            self._say(row.text)
            self._pass(row)
            return
        for other in row.others:
            self._other(row, other)
        feeds = row.feeds and self.control.extruder
        if row.feeds and not feeds:
            word = row.value("E")
            if self.program.reading.extruder != IGNORE:
                self._refuse(row, f"{word}: an extruder")
            self._note("E", f"{word} is left out, as --extruder ignore says", row)
        feed = row.value("F")
        if feed is not None:
            self.programmed_feed, self.feed_inch = feed, row.inch_before
        self.speed = row.value("S") or self.speed
        self._switches(row)
        self._modes(row)
        if G4 in row.g():
            self._say_dwell(self.source.dwell(row))
        if chords:
            self._chords(row)
        elif row.named or row.moves or _one_shot(row) >= 0 or feeds:
            self._move(row)
        self.filament.follow(row)
        self._pass(row)
        self._stops(row)

    def _move(self, row: Row) -> None:
        """A line of its own that moves, or whose coordinates shift others, word for word."""
        one_shot = _one_shot(row)
        if self.control.name == GRBL.name and sets_tools(row):
            self._refuse(row, "G10 or G43.1 with more than an origin up to G59, or a length in Z")
        if not LENGTHS.isdisjoint(row.g()):
            return  # the coordinates are those of the tool length
        if one_shot == G10 and self.program.reading.dialect == FANUC:
            self._refuse(row, "G10, which other controls read otherwise than Fanuc's")
        away = row.named or self.program.origins.at(row.first)[0].any()
        if one_shot in HOMES and self.control.one_command and away:
            name = f"G{codes.number(one_shot)}"
            self._refuse(row, f"{name} with coordinates, or after G92 (this control homes there)")
        head, fed = self._head(row, one_shot)
        if head is None:
            return
        used = self._used(row)
        words = []
        for word in row.words:
            if word.letter in "GMFSTN":
                continue
            if word.letter in AXES and word.letter not in self.control.letters:
                self._parked(row, word)
            elif word.letter in used:
                words.append(word.letter + self._length(word, row))
        if fed:
            words += self._feed_words(row)
        elif row.motion == 0 and self.control.rapid_feed and row.named:
            axes = tuple(c for c in row.named.lower() if c in self.machine.axes)
            fastest = float(self.machine.limits("velocity", axes).min()) * SECONDS_PER_MINUTE
            words += self._feed_of(fastest, as_is=False)
        distance = self._distance(absolute=row.absolute) if row.named or row.moves else []
        self._say_move(row, distance, [*head, *words])
        self.motion = self.motion if one_shot < 0 else ""

    def _head(self, row: Row, one_shot: int) -> tuple[list[str] | None, bool]:
        """The codes of a move, None for what needs no line; and whether it has a feed."""
        name = f"G{codes.number(one_shot)}" if one_shot >= 0 else ""
        if one_shot >= 0 and one_shot not in self.control.g:
            self._refuse(row, name)
        if one_shot >= 0 and one_shot != G53:
            return [name], False
        if row.motion < 0:
            self._refuse(row, "coordinates without a motion code")
        code = f"G{codes.number(row.motion)}"
        if not takes_move(row, self.control, self.program):
            if row.motion in codes.SPLINES and not row.moves:
                return None, False  # a further line of a spline that is written as straight moves
            what = code if not row.radius else f"{code} under cutter radius compensation"
            self._refuse(row, f"{what} (it cannot be written as straight moves here: {self._why_kept(row)})")
        said = [name] if name else []
        if code != self.motion or self.control.one_command or name or row.motion > 30:
            said.append(code)
        self.motion = code
        return said, row.motion != 0 or row.feeds

    def _why_kept(self, row: Row) -> str:
        if not row.per_minute:
            return "its feed is not per minute"
        if self.extrudes and not row.absolute:
            return "it is under G91, where E is a step; write it under G90"
        away = [c for c in "XYZ" if c not in row.placed]
        verb = "are" if len(away) > 1 else "is"
        return (
            f"the program does not say where {' and '.join(away)} {verb} before it"
            if away
            else "it is no plain move"
        )

    def _used(self, row: Row) -> set[str]:
        """Letters of a row that belong to its move: not those of its modes."""
        modes = [code for code in row.g() if codes.G_GROUP[code] not in ("motion", "one-shot")]
        modal = set("".join(codes.WORDS.get(("G", code), "") for code in modes))
        shot = set(codes.WORDS["G", G10]) if G10 in row.g() else set()
        motion = set(codes.WORDS.get(("G", row.motion), "")) if row.motion >= 0 else set()
        if row.motion in codes.ARCS:  # many programs write K0 in G17, which is an error on LinuxCNC
            motion -= {"IJK"["XYZ".index(axis)] for axis in "XYZ" if axis not in row.plane}
        own = set(AXES + "E" * (row.feeds and self.control.extruder)) | shot | motion
        return own - (modal - motion - shot) - set("P" * (G4 in row.g()))

    def _parked(self, row: Row, word: Word) -> None:
        """An axis that the control does not have: its words may go where it stands still."""
        if word.letter.lower() in self.program.axes:
            self._refuse(row, f"{word}: axis {word.letter}")
        if word.letter in self.program.reading.ignore:
            self._refuse(row, f"{word}, which --ignore leaves out of the plan alone")
        self._note(word.letter, f"{word} is left out: axis {word.letter} stands still", row)

    def _chords(self, row: Row) -> None:
        """The straight moves of the polyline up to the end of the row's blocks, and its dwells."""
        line = self.line
        unit, decimals = (MM_PER_INCH, INCH_DECIMALS) if self.inch else (1.0, DECIMALS)
        offset = self.program.origins.at(row.first)[0]
        rests = [k for k in range(row.first, row.last) if self.program.kind[k] == Kind.DWELL]
        stop = int(np.searchsorted(line.block, row.last))
        fed = self._shared(row, line.points[self.move : stop + 1, :LINEAR])
        while self.move < stop or rests:
            k = self.move
            if rests and (k >= stop or line.block[k] > rests[0]):
                self._say_dwell(float(self.program.dwell[rests.pop(0)]))
                continue
            end, start = line.points[k + 1], line.points[k]
            words = [
                f"{letter}{plain(round(float((end[a] - offset[a]) / unit), decimals) + 0.0)}"
                for a, letter in enumerate("XYZ"[: len(end)])
                if end[a] != start[a]
            ]
            self.move += 1
            feeds = next(fed)
            if not words:
                continue
            words += feeds
            code = "G0" if line.rapid[k] else "G1"
            head = [code] if code != self.motion or self.control.one_command else []
            self.motion = code
            if not line.rapid[k] or self.control.rapid_feed:
                speed = float(self.rapid[k] if line.rapid[k] else line.feed[k])
                words += self._feed_of(max(speed, FEED_MIN) * SECONDS_PER_MINUTE / unit, as_is=False)
            self._say_move(row, self._distance(absolute=True), [*head, *words])

    def _shared(self, row: Row, points: FloatArray) -> Iterator[list[str]]:
        """The E words of the chords of a row between points (n+1, 3) [mm]."""
        if not (row.feeds and self.control.extruder):
            return iter([[]] * (len(points) - 1))
        shares = self.filament.shared(row, points)
        if shares is None:
            what = f"{row.value('E')} of an arc as chords, while nothing says where E is before it, as G92 E0 and M83 would"
            self._refuse(row, what)
        return iter([f"E{plain(share)}"] for share in shares)

    def _pass(self, row: Row) -> None:
        """Leave the moves of the polyline that the row's own words have made."""
        self.move = max(self.move, int(np.searchsorted(self.line.block, row.last)))


def _one_shot(row: Row) -> int:
    """The code of G10, G28, G53, G92 and the like on a row; -1 without one."""
    return next((code for code in row.g() if codes.G_GROUP[code] == "one-shot" and code != G4), -1)
