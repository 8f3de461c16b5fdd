"""The program written for a control so far, and what it has in force there: G90, G91, the motion code and F
are said again wherever straight moves have changed them. S waits for the line that it belongs to: grbl
empties its buffer at an S on a line of its own.
"""

import re
from pathlib import PurePath
from typing import NoReturn

import numpy as np

from planner.base.errors import InputError
from planner.base.units import MM_PER_INCH, SECONDS_PER_MINUTE
from planner.controls.export.chords import DECIMALS
from planner.controls.export.controls import OPTIONS, Control
from planner.controls.export.rows import Row, Source, Word
from planner.machine import Machine
from planner.nc import codes
from planner.nc.program import plain
from planner.nc.state import system_name
from planner.nc.writer import round_down
from planner.planning.job.plan import Plan

INCH_DECIMALS = DECIMALS + 2  # a hundredth of an inch is about a quarter of a millimetre
_LENGTHS = frozenset("XYZIJKRUVWQE")


class Output:
    """The lines of a file, and the state of the control after them."""

    def __init__(self, source: Source, control: Control, machine: Machine):
        self.source, self.control, self.machine = source, control, machine
        self.program = source.program
        self.lines: list[str] = []
        self.notes: dict[str, tuple[str, int]] = {}  # by what they are about, each once, with its line
        self.motion = ""  # the motion code, "" for none that lines could leave out
        self.absolute, self.inch = True, False  # G90, G20
        self.feed: float | None = None  # F per minute in force
        self.programmed_feed: Word | None = None  # the program's last F word ...
        self.feed_inch = False  # ... and whether it was given in inches
        self.speed: Word | None = None  # an S word that waits for its line
        self.spindle = 0  # 3 or 4 after M3 and M4, 0 after M5
        self.extrudes = control.extruder and any(row.feeds for row in source.rows)

    def _say_move(self, row: Row, distance: list[str], words: list[str]) -> None:
        """A line of a move, with the speed that waits for it."""
        speed: list[str] = []
        if self.speed is not None and row.motion >= 0:
            if not self.control.speed_by_code:
                speed, self.speed = [str(self.speed)], None
            elif self.spindle:
                self._flush_speed()
        if self.control.one_command:
            self.lines += [*distance, " ".join(words)]
        else:
            self.lines.append(" ".join([*distance, *words, *speed]))

    def _flush_speed(self) -> None:
        """Say the speed on a line of its own, before what does not take it."""
        if self.speed is None or (self.control.speed_by_code and not self.spindle):
            return
        turning = f"M{self.spindle} {self.speed}" if self.control.speed_by_code else str(self.speed)
        macro = self.machine.macros.get(f"M{self.spindle}") if self.control.speed_by_code else None
        self._say(turning if macro is None else called(macro, [self.speed]))
        self.speed = None

    def _distance(self, *, absolute: bool) -> list[str]:
        if absolute == self.absolute:
            return []
        self.absolute = absolute
        return ["G90" if absolute else "G91"]

    def _length(self, word: Word, row: Row) -> str:
        if row.inch and not self.control.inch and word.letter in _LENGTHS:
            return plain(round(word.value * MM_PER_INCH, INCH_DECIMALS) + 0.0)
        return word.text

    def _feed_words(self, row: Row) -> list[str]:
        """The F word of a move of the program, where the control does not have that feed in force."""
        given = self.programmed_feed
        if not row.per_minute:
            own = row.value("F")
            self.feed = None
            return [str(own)] if own is not None else []
        unit = MM_PER_INCH if self.inch else 1.0
        if given is None:  # the machine's default
            feeds = self.program.feed[row.first : row.last]
            known = feeds[np.isfinite(feeds)].tolist()
            return self._feed_of(known[0] * SECONDS_PER_MINUTE / unit) if known else []
        if self.feed_inch == self.inch:
            return self._feed_of(given.value, given.text)
        return self._feed_of(given.value * (MM_PER_INCH if self.feed_inch else 1.0) / unit)

    def _feed_of(self, value: float, text: str = "", *, as_is: bool = True) -> list[str]:
        written = text or (plain(round(value, INCH_DECIMALS)) if as_is else round_down(value))
        if self.feed is not None and float(written) == self.feed:
            return []
        self.feed = float(written)
        return [f"F{written}"]

    def _say(self, text: str) -> None:
        """A line that is no move; the next move says its code again."""
        self.lines.append(text)
        self.motion = ""

    def _option(self, name: str, row: Row) -> None:
        said = OPTIONS.get((self.control.name, name))
        if said is not None:
            self._note(said, said, row)

    def _note(self, key: str, text: str, row: Row) -> None:
        self.notes.setdefault(key, (text, row.line))

    def _refuse(self, row: Row, what: str) -> NoReturn:
        name = self.control.name
        where = " or a line [macros] of the machine file" if self.control.one_command else ""
        raise InputError(
            f"{what}: {name} does not know it, and nothing else does the same; export for another control, or take it out of the "
            f"program{where}",
            source=self.program.source,
            line=row.line,
        )


def comment(text: str, control: Control) -> str:
    """A comment of a control, in ASCII."""
    text = text.replace("µ", "u")
    obeyed = re.compile(control.at_once)
    clean = "".join(
        c if c.isascii() and c.isprintable() and c not in "()" and not obeyed.match(c) else "_" for c in text
    )
    return f"({clean})" if control.paren else f"; {clean}"


def called(macro: str, words: list[Word]) -> str:
    """A call of a macro with the words that it gets: as they are where its name is a code (M3 S900), else as
    parameters (S=900)."""
    traditional = re.fullmatch(r"[A-Za-z]\d+(\.\d+)?", macro) is not None
    return " ".join([macro, *(str(w) if traditional else f"{w.letter}={w.text}" for w in words)])


FIRST_RUN = "First run: above the work, a hand on feed hold."
_MODES = {"units": 210, "plane": 170, "distance mode": 900, "feed mode": 940}


def head_of(source: Source, control: Control, plan: Plan, tolerance: float, what: str) -> list[str]:
    """The first lines of the file."""
    said = [
        f"{PurePath(plan.program.source).name}: {what}",
        f"for {control.name}, machine {plan.machine.name}, within {plain(tolerance)} mm of the program",
        *assumptions(source),
        FIRST_RUN,
    ]
    return [*(comment(text, control) for text in said), *_modes(source, control)]


def assumptions(source: Source, *, as_it_is: bool = False) -> list[str]:
    """The assumptions on coordinates and start; `as_it_is` where all lines are the program's own."""
    program = source.program
    used = sorted({code for row in source.rows for code in row.g() if codes.G_GROUP[code] == "work offset"})
    system = " ".join(system_name(code) for code in used) or "the work offset in force"
    first = 0 if as_it_is else next((row.line for row in source.rows if row.plain), 0)
    own = f"up to line {first - 1} the moves" if first else "all lines"
    own += " are the program's own"
    axes = zip(program.axes, program.start.tolist(), strict=True)
    start = " ".join(f"{axis.upper()}{plain(at)}" for axis, at in axes)
    return [
        f"Coordinates are the program's, in {system}; G53, G28, G30 stay as they are.",
        f"Planned from machine position {start}; {own}, from any start.",
    ]


def _modes(source: Source, control: Control) -> list[str]:
    """Units, plane, distance and feed mode, as far as no line says them up to the first that moves."""
    said: set[str] = set()
    for row in source.rows:
        said |= {codes.G_GROUP[code] for code in row.g() if code in control.g}
        if row.moves or row.text:
            break
    said -= {"distance mode"}  # which waits for a move
    words = [f"G{code // 10}" for group, code in _MODES.items() if group not in said and code in control.g]
    return words if control.one_command else [" ".join(words)] * bool(words)
