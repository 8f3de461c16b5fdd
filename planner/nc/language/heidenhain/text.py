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

from planner.nc.language.arithmetic import ARITHMETIC, DEGREES
from planner.nc.language.asked import FIRST_POSITION, PositionAsked
from planner.nc.language.spelling import NEGATIVE, NESTED_MAX, OPERATIONS_MAX
from planner.nc.language.tree import (
    Expression,
    Language,
    Named,
    Number,
    Numbered,
    Operation,
    ProgramFault,
    SourcePlace,
)

PARAMETERS = 2000  # Q0 to Q1999; parameter n of the tree is Q(n-1)

# What operators and functions mean.
LANGUAGE = Language(
    name="heidenhain",
    operations=ARITHMETIC
    | {
        ("**", 2): "power({0},{1})",
        ("EQ", 2): "({0}=={1})",
        ("NE", 2): "({0}!={1})",
        ("ATAN", 2): "atan2({0},{1})",
        ("LEN", 2): "hypot({0},{1})",
        ("INT", 1): "float(trunc({0}))",
        ("FRAC", 1): "({0}-trunc({0}))",
        ("LOG", 1): "log10({0})",
        ("MIN", 2): "min({0},{1})",
        ("MAX", 2): "max({0},{1})",
        ("UP", 1): "float(ceil({0}))",
    },
    conditions=frozenset(("EQ", "NE", "GT", "GE", "LT", "LE")),
    functions={
        **DEGREES,
        "exp": math.exp,
        "log": math.log,
        "log10": math.log10,
        "sqrt": math.sqrt,
        "power": math.pow,
        "hypot": math.hypot,
        "trunc": math.trunc,
        "ceil": math.ceil,
    },
    locals=0,
    largest=FIRST_POSITION + 2,
    vacant=0.0,
    asked=PositionAsked.numbers,
)

_NUMBER = re.compile(r"[+-]?(?:\d+(?:\.\d*)?|\.\d+)")
_Q = re.compile(r"([+-]?)\s*Q(\d+)(?!\d)", re.IGNORECASE)
_TOKEN = re.compile(r"\s*(?:(\d+(?:\.\d*)?|\.\d+)|(Q[LRS]?\d*|[A-Z]+)|(.))", re.IGNORECASE)
# Operators of a higher rank bind first.
_RANKS = {"+": 1, "-": 1, "*": 2, "/": 2, "^": 3}
_NAMES = {"^": "**"}
_FUNCTIONS = ("SIN", "COS", "TAN", "ASIN", "ACOS", "ATAN", "SQRT", "ABS", "INT", "FRAC", "LN", "LOG", "EXP")


def of(name: str, *operands: Expression) -> Operation:
    """An operation of the language."""
    return Operation(name, operands)


def own(name: str) -> Named:
    """A variable of the reader's own: the position, the pole, what a cycle needs."""
    return Named(f"_{name}", True)


def parameter(number: int) -> Numbered:
    """Q of that number."""
    return Numbered(Number(float(number + 1)))


def plus(a: Expression, b: Expression) -> Expression:
    """The sum, put together where both are numbers."""
    if isinstance(a, Number) and isinstance(b, Number):
        return Number(a.value + b.value)
    return of("+", a, b)


def minus(a: Expression, b: Expression) -> Expression:
    """The difference."""
    return of("-", a, b)


def times(a: Expression, b: Expression) -> Expression:
    """The product."""
    return of("*", a, b)


def quotient(a: Expression, b: Expression) -> Expression:
    """The quotient."""
    return of("/", a, b)


@dataclass(frozen=True)
class ConversationalBlock:
    """A block of the program: its place, and its text without number and comment, parts of continued lines joined by blanks.

    at : byte offset of the first character of each part, and where the part begins in `text`
    """

    place: SourcePlace
    text: str
    at: tuple[tuple[int, int], ...]

    def fault(self, message: str, column: int = 0) -> ProgramFault:
        """A fault of the character at `column` of the text."""
        start, begin = [pair for pair in self.at if pair[1] <= column][-1]
        return ProgramFault(self.place._replace(at=start + column - begin), message)

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
    waiting: tuple[SourcePlace, str, list[tuple[int, int]]] | None = None
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
            waiting = (SourcePlace(file, number, start + first), content, [(start + first, 0)])
        open_end = ends_open or (open_end and not content)
    if waiting is not None:
        yield ConversationalBlock(waiting[0], waiting[1], tuple(waiting[2]))


def value(block: ConversationalBlock, column: int) -> tuple[Expression, int]:
    """The number or parameter at a column of the block's text, and the column after it. Raises ProgramFault."""
    while block.text[column : column + 1] == " ":
        column += 1
    found = _Q.match(block.text, column)
    if found:
        number = int(found.group(2))
        if number >= PARAMETERS:
            raise block.fault(f"Q{number}: there are Q0 to Q{PARAMETERS - 1}", column)
        q = parameter(number)
        return (of(NEGATIVE, q) if found.group(1) == "-" else q), found.end()
    found = _NUMBER.match(block.text, column)
    if found is None:
        raise block.fault("a number or a Q parameter is expected here, such as +12.5 or Q3", column)
    return Number(float(found.group())), found.end()


class Formula:
    """Reads a formula from a column of a block's text to its end."""

    def __init__(self, block: ConversationalBlock, column: int):
        self.block = block
        self.tokens: list[tuple[str, int]] = []
        text, at = block.text, column
        while at < len(text):
            found = _TOKEN.match(text, at)
            if found is None:
                break
            self.tokens.append((found.group().strip().upper(), found.end() - len(found.group().strip())))
            at = found.end()
        self.next, self.nested = 0, 0

    def read(self) -> Expression:
        """The formula. Raises ProgramFault."""
        found = self._sum(0)
        if self.next < len(self.tokens):
            raise self.block.fault("an operator is expected here: + - * / ^", self.tokens[self.next][1])
        return found

    def _peek(self) -> str:
        return self.tokens[self.next][0] if self.next < len(self.tokens) else ""

    def _fault(self, message: str) -> ProgramFault:
        at = self.tokens[self.next][1] if self.next < len(self.tokens) else len(self.block.text)
        return self.block.fault(message, at)

    def _sum(self, rank: int) -> Expression:
        left, count = self._value(), 0
        while (its := _RANKS.get(self._peek(), -1)) >= max(rank, 1):
            operator = self._peek()
            self.next += 1
            left = of(_NAMES.get(operator, operator), left, self._sum(its + 1))
            count += 1
            if count > OPERATIONS_MAX:
                raise self._fault(
                    f"more than {OPERATIONS_MAX} operations in a row; write them in several blocks"
                )
        return left

    def _value(self) -> Expression:
        token = self._peek()
        self.nested += 1
        if self.nested > NESTED_MAX:
            raise self._fault(f"more than {NESTED_MAX} brackets in each other")
        if not token:
            raise self._fault("the formula ends too early")
        at = self.next
        self.next += 1
        if token in "+-":
            found = self._value()
            found = of(NEGATIVE, found) if token == "-" else found
        elif token == "(":
            found = self._sum(0)
            if self._peek() != ")":
                raise self._fault(") is missing")
            self.next += 1
        elif token[0].isdigit() or token[0] == ".":
            found = Number(float(token))
        elif re.fullmatch(r"Q\d+", token) and int(token[1:]) < PARAMETERS:
            found = parameter(int(token[1:]))
        elif token == "PI":
            found = Number(math.pi)
        elif token == "SQ":
            operand = self._value()
            found = times(operand, operand)
        elif token == "NEG":
            found = of(NEGATIVE, self._value())
        elif token in _FUNCTIONS:
            found = of(token, self._value())
        else:
            self.next = at
            raise self._fault(f"{token} is no value, Q parameter or function of a formula")
        self.nested -= 1
        return found
