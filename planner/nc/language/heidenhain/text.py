"""Lines of a conversational program: blocks, values, formulas.

A block begins with its number and a function word; `~` at its end, or the parameters of a cycle, continue it on the next line. What
follows `;` is a comment, and a line that begins with `*` is a heading.

    value   = [+|-] number | [+|-] Q number
    formula = values with + - * / ^ and brackets; SIN COS TAN ASIN ACOS ATAN SQRT SQ ABS INT FRAC NEG LN LOG EXP; PI
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass

from planner.nc.language import tree
from planner.nc.language.arithmetic import ARITHMETIC, COMPARISONS
from planner.nc.language.expression_reader import Token, TokenReader, ranked
from planner.nc.language.system_variables import FIRST_POSITION, PositionVariables

PARAMETERS = 2000  # Q0 to Q1999; parameter n of the tree is Q(n-1)
LANGUAGE = tree.Language(
    operations=ARITHMETIC,
    conditions=COMPARISONS,
    locals=0,
    largest=FIRST_POSITION + 2,
    vacant=0.0,
    system_numbers=PositionVariables.numbers,
)

_NUMBER = re.compile(r"[+-]?(?:\d+(?:\.\d*)?|\.\d+)")
_Q = re.compile(r"([+-]?)\s*Q(\d+)(?!\d)", re.IGNORECASE)
_FUNCTIONS = frozenset(
    ["SIN", "COS", "TAN", "ASIN", "ACOS", "ATAN", "SQRT", "ABS", "INT", "FRAC", "LN", "LOG", "EXP"]
)


def own(name: str) -> tree.Named:
    """A variable of the reader's own: the position, the pole, what a cycle needs."""
    return tree.Named(f"_{name}", True)


def parameter(number: int) -> tree.Numbered:
    """Q of that number."""
    return tree.Numbered(tree.Number(float(number + 1)))


@dataclass(frozen=True)
class ConversationalBlock:
    """A block of the program: its place, and its text without number and comment, parts of continued lines joined by blanks.

    at : byte offset of the first character of each part, and where the part begins in `text`
    """

    place: tree.SourcePlace
    text: str
    at: tuple[tuple[int, int], ...]

    def fault(self, message: str, column: int = 0) -> tree.ProgramFault:
        """A fault of the character at `column` of the text."""
        start, begin = [pair for pair in self.at if pair[1] <= column][-1]
        return tree.ProgramFault(self.place._replace(at=start + column - begin), message)

    def byte(self, column: int) -> int:
        """Byte offset of a character of the text."""
        start, begin = [pair for pair in self.at if pair[1] <= column][-1]
        return start + column - begin


_CONTINUED = re.compile(r"\s*Q\d+\s*=", re.IGNORECASE)
_NUMBERED = re.compile(r"\s*(\d+)\s+(?=\S)")


def blocks(data: bytes, file: int, begin: int) -> Iterator[ConversationalBlock]:
    """The blocks of a program.

    file, begin : its number among the files, and where its bytes begin in the words' data
    """
    waiting: tuple[tree.SourcePlace, str, list[tuple[int, int]]] | None = None
    open_end = False
    at = 0
    for number, raw in enumerate(data.split(b"\n"), start=1):
        text = raw.decode("latin-1")
        start = begin + at
        at += len(raw) + 1
        body = text.split(";", 1)[0].rstrip()
        numbered = _NUMBERED.match(body)
        first = numbered.end() if numbered else len(body) - len(body.lstrip())
        content = "" if body.strip().isdigit() else body[first:]  # a number alone stands before a comment
        ends_open = content.endswith("~")
        content = content.rstrip("~ \t\r\x1a")
        cycle = waiting is not None and waiting[1].upper().startswith("CYCL DEF") and not numbered
        if waiting is not None and content and (open_end or (cycle and _CONTINUED.match(body))):
            waiting = (
                waiting[0],
                waiting[1] + " " + content,
                [*waiting[2], (start + first, len(waiting[1]) + 1)],
            )
        elif content:
            if waiting is not None:
                yield ConversationalBlock(waiting[0], waiting[1], tuple(waiting[2]))
            waiting = (tree.SourcePlace(file, number, start + first), content, [(start + first, 0)])
        open_end = ends_open or (open_end and not content)
    if waiting is not None:
        yield ConversationalBlock(waiting[0], waiting[1], tuple(waiting[2]))


def value(block: ConversationalBlock, column: int) -> tuple[tree.Expression, int]:
    """The number or parameter at a column of the block's text, and the column after it. Raises ProgramFault."""
    while block.text[column : column + 1] == " ":
        column += 1
    match = _Q.match(block.text, column)
    if match:
        number = int(match.group(2))
        if number >= PARAMETERS:
            raise block.fault(f"Q{number}: there are Q0 to Q{PARAMETERS - 1}", column)
        q = parameter(number)
        return (-q if match.group(1) == "-" else q), match.end()
    match = _NUMBER.match(block.text, column)
    if match is None:
        raise block.fault("a number or a Q parameter is expected here, such as +12.5 or Q3", column)
    return tree.Number(float(match.group())), match.end()


class Formula(TokenReader):
    """Reads a formula from a column of a block's text to its end."""

    pattern = re.compile(
        r"\s*(?:(?P<number>\d+(?:\.\d*)?|\.\d+)|(?P<name>Q[LRS]?\d*|[A-Z]+)|(?P<sign>.))", re.IGNORECASE
    )
    ranks = ranked("+ -", "* /", "^")
    meant = {"^": "**"}  # noqa: RUF012
    pieces = "blocks"
    ends = "the formula ends too early"
    no_value = "is no value, Q parameter or function of a formula"

    def __init__(self, block: ConversationalBlock, column: int):
        self.block = block
        super().__init__(block.text, column)

    def read(self) -> tree.Expression:
        """The formula. Raises ProgramFault."""
        found = self.expression()
        if not self.ended:
            raise self.fault("an operator is expected here: + - * / ^")
        return found

    def fault(self, message: str, at: int | None = None) -> tree.ProgramFault:
        return self.block.fault(message, self.column() if at is None else at)

    def expect(self, text: str) -> None:
        if not self.take(text):
            raise self.fault(f"{text} is missing")

    def operand(self, token: Token) -> tree.Expression | None:
        text = token.text
        if token.kind == "number":
            return tree.Number(float(text))
        if re.fullmatch(r"Q\d+", text) and int(text[1:]) < PARAMETERS:
            return parameter(int(text[1:]))
        if text == "PI":
            return tree.Number(math.pi)
        if text == "SQ":
            operand = self.value()
            return operand * operand
        if text == "NEG":
            return -self.value()
        return tree.op(text, self.value()) if text in _FUNCTIONS else None
