"""Loops of Fanuc's and Haas' macros: WHILE [c] DO 1 ... END 1."""

from __future__ import annotations

from planner.nc.language.source import SourceLine
from planner.nc.language.spelling import LineReader
from planner.nc.language.tree import Expression, Loop, Number, SourcePlace, Statement

_NESTED_MAX = 3  # DO 1 to DO 3 in each other, as the control allows
_ALWAYS = Number(1.0)  # the condition of DO without WHILE


class FanucControl:
    """The statements so far, and the loops that are open.

    body : where the next statement goes
    open : of each loop, the outermost first: its DO number, place, condition, and the body around it
    """

    def __init__(self) -> None:
        self.body: list[Statement] = []
        self.open: list[tuple[int, SourcePlace, Expression, list[Statement]]] = []

    def _while(self, reader: LineReader, line: SourceLine) -> None:
        condition = reader.bracket()
        at = reader.at
        if reader.keyword() != "do":
            raise reader.refused("WHILE [condition] is followed by DO and a number", at)
        self._do(reader, line, condition)

    def _do(self, reader: LineReader, line: SourceLine, condition: Expression = _ALWAYS) -> None:
        number = _loop_number(reader)
        if any(number == known for known, _, _, _ in self.open) or len(self.open) >= _NESTED_MAX:
            raise line.fault(
                f"DO {number} inside another DO {number}, or more than {_NESTED_MAX} in each other"
            )
        self.open.append((number, line.place, condition, self.body))
        self.body = []

    def _end(self, reader: LineReader, line: SourceLine) -> None:
        number = _loop_number(reader)
        if not self.open or self.open[-1][0] != number:
            raise line.fault(f"END {number} has no DO {number} before it")
        _, place, condition, around = self.open.pop()
        around.append(Loop(place, "while", f"DO {number}", condition, self.body))
        self.body = around


def _loop_number(reader: LineReader) -> int:
    at = reader.at
    value = reader.number()
    if value is None or value != int(value):
        raise reader.refused("DO and END are followed by a whole number", at)
    return int(value)
