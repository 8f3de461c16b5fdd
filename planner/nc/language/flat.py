"""The expanded program as text: the words of every executed line, in their order, as any control reads them.

Resolved are parameters, expressions, loops, branches, subprograms and saved modes. Everything else stays as
the program has it: moves, arcs, feeds, dwells, canned cycles, work offsets, tools, spindle, coolant. Line
numbers and comments are left out. Numbers are rounded to `DECIMALS`.
"""

from pathlib import PurePath

from planner.machine import Machine
from planner.nc.faults import require_none
from planner.nc.integers import LENGTHS, DwellWords
from planner.nc.lexer import Words
from planner.nc.program import Program, plain
from planner.nc.reader import execute, interpret, rewritten
from planner.nc.reading import CL, FANUC, KLIPPER, Reading

DECIMALS = 7  # of a number
_LEFT_OUT = frozenset(ord(letter) for letter in "N%O")
_LENGTHS = "".join(map(chr, sorted(LENGTHS)))
_ENDS = ("M2", "M02", "M30")
# Characters that must not stand in a comment, and what stands there instead.
_NO_COMMENT = {ord(letter): "_" for letter in "()"} | dict.fromkeys(range(32), "_")


class Flat:
    """Collects the lines of a program while it is expanded: `add` is the `tee` of `expand`.

    points : write lengths and the times of dwells with a point, because the machine reads them otherwise
             without
    """

    def __init__(self, source: str, *, points: bool = False):
        self.points = points
        self._dwells = DwellWords()
        self.lines = [
            f"({in_comment(source)}, expanded by feedrate-planner: parameters, loops and calls written out)"
        ]

    def add(self, words: Words) -> None:
        """Write the rows of a chunk as lines, which are added to `lines`."""
        letters, values, first = words.letter.tolist(), words.value.tolist(), words.first.tolist()
        known: dict[float, str] = {}
        dwells = set(self._dwells.find(words)) if self.points else set()
        for row in range(len(first) - 1):
            text = " ".join(
                chr(letters[w])
                + (known.get(values[w]) or known.setdefault(values[w], flat_number(values[w])))
                + ("." if w in dwells and values[w].is_integer() else "")
                for w in range(first[row], first[row + 1])
                if letters[w] not in _LEFT_OUT
            )
            if text:
                if self.points:  # lengths have a point
                    words_of_row = text.split(" ")
                    text = " ".join(w if "." in w or w[0] not in _LENGTHS else f"{w}." for w in words_of_row)
                self.lines.append(text)

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
    flat = Flat(source, points=fanuc or (machine is not None and machine.dialect is not None))
    # once more, now that it is known how arc centres are read
    execute(data, machine, program.reading, source, flat.add)
    return flat.text(), program
