"""Lines of a conversational program: blocks, values, formulas, and the words behind a path function.

A block begins with its number and a function word; `~` at its end, or the parameters of a cycle, continue it
on the next line. What follows `;` is a comment, and a line that begins with `*` is a heading.

    value   = [+|-] number | [+|-] Q number (QL and QR, too)
    formula = values with + - * / ^ and brackets; SIN COS TAN ASIN ACOS ATAN SQRT SQ ABS INT FRAC NEG LN LOG
    EXP SGN; PI; % is the rest of a division
"""

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cache

from planner.nc.language import tree
from planner.nc.language.expressions import ARITHMETIC, COMPARISONS
from planner.nc.language.source import Source
from planner.nc.language.system_variables import FIRST_POSITION, PositionVariables, position
from planner.nc.language.tokens import Token, TokenReader, names, ranked
from planner.nc.language.tree import Expression

PARAMETERS = 2000  # Q0 to Q1999; parameter n of the tree is Q(n-1)
# First parameters of the tree of QL and QR, of which there are so many.
_KINDS, _OF_KIND = {"": 1, "L": FIRST_POSITION + 10, "R": FIRST_POSITION + 1010}, 1000
LANGUAGE = tree.Language(
    operations=ARITHMETIC
    | {
        ("%", 2): "fmod({0},{1})",
        ("SGN", 1): "(({0}>0)-({0}<0)+0.0)",
        ("WRAPPED", 1): "remainder({0},360.0)",
    },
    ranks=ranked("+ -", "* / %", "^"),
    meant={"^": "**"},
    functions=names("SIN COS TAN ASIN ACOS ATAN SQRT ABS INT FRAC LN LOG EXP SGN"),
    constants={"PI": math.pi},
    conditions=COMPARISONS,
    largest=FIRST_POSITION + 2010,
    system_numbers=PositionVariables.numbers,
)
Rows = list[tree.Statement]
_CONTINUED = re.compile(r"\s*Q\d+\s*=", re.IGNORECASE)
_NUMBERED = re.compile(r"\s*(\d+)\s+(?=\S)")
_ITEM = (
    r"\s*(?:MB\s*(?P<limit>MAX)|(?P<back>MB)(?=\s*[-+.\dQ])|(?P<axis>I?[XYZABCUVW])(?=\s*[-+.\dQ])|(?P<polar>I?P[AR])|DR(?P<turn>[-+])|(?P<comp>R[0LR])(?![\d.])|"
    r"(?P<radius>R)(?=\s*[-+.\dQ])|F\s*(?P<fast>MAX|AUTO)|(?P<unit>F[ZUT])|(?P<feed>F)|M\s*(?P<code>\d+)|"
    r"(?P<ahead>LA)(?=\s*\d))"
)
_WITH_AXES = (94, 138)  # M codes that may name rotary axes


def variable(name: str) -> tree.Named:
    """A variable of the reader's own: the position, the pole, what a cycle needs."""
    return tree.Named(f"_{name}", True)


def parameter(number: int, kind: str = "") -> tree.Numbered:
    """Q of that number; QL and QR with their letter."""
    return tree.numbered(number + _KINDS[kind])


@dataclass
class Block:
    """A block read from left to right: its place, and its text without number and comment, in one line."""

    place: tree.SourcePlace
    text: str
    # byte offset of the first character of each part, and where the part begins in `text`
    at: tuple[tuple[int, int], ...]
    function: str = ""  # the word that it begins with
    column: int = 0  # of the text that comes next

    def byte(self, column: int) -> int:
        """Byte offset of a character of the text."""
        start, begin = [pair for pair in self.at if pair[1] <= column][-1]
        return start + column - begin

    def fault(self, message: str, column: int = 0) -> tree.ProgramFault:
        """A fault of the character at `column` of the text."""
        return tree.ProgramFault(self.place._replace(at=self.byte(column)), message)

    def require(self, good: object, message: str, column: int = 0) -> None:
        """Raise such a fault unless all is good."""
        if not good:
            raise self.fault(message, column)

    def wrong(self, message: str) -> tree.ProgramFault:
        """A fault of what comes next."""
        return self.fault(message, self.column)

    @property
    def rest(self) -> str:
        """The text that comes."""
        return self.text[self.column :]

    def take(self, pattern: str) -> re.Match[str] | None:
        """Go past what fits a pattern, in small letters too, if it comes next."""
        match = _compiled(pattern).match(self.text, self.column)
        if match is not None:
            self.column = match.end()
        return match

    def named(self, pattern: str) -> dict[str, tree.Expression]:
        """The values behind names, the group of a pattern, as long as one comes. Raises ProgramFault."""
        found: dict[str, tree.Expression] = {}
        while name := self.take(pattern):
            found[name[1].upper()] = self.value()
        return found

    def end(self, message: str = "nothing may follow here") -> None:
        """Raises ProgramFault if more comes."""
        if self.rest.strip():
            raise self.wrong(message)

    def value(self) -> tree.Expression:
        """The number or parameter that comes next. Raises ProgramFault."""
        match = self.take(r" *(?:([+-]?)\s*Q([LR]?)(\d+)(?!\d)|([+-]?(?:\d+(?:\.\d*)?|\.\d+)))")
        if match is None:
            self.take(" *")
            raise self.wrong("a number or a Q parameter is expected here, such as +12.5 or Q3")
        if match[4]:
            return tree.Number(float(match[4]))
        found = self.known(int(match[3]), match[2].upper(), match.start(1))
        return -found if match[1] == "-" else found

    def known(self, number: int, kind: str, column: int = 0) -> tree.Numbered:
        """A parameter by its number. Raises ProgramFault for none."""
        count = PARAMETERS if not kind else _OF_KIND
        if number >= count:
            raise self.fault(f"Q{kind}{number}: there are Q{kind}0 to Q{kind}{count - 1}", column)
        return parameter(number, kind)


@cache
def _compiled(pattern: str) -> re.Pattern[str]:
    return re.compile(pattern, re.IGNORECASE)


def blocks(source: Source) -> Iterator[Block]:
    """The blocks of a program, but for those that begin with / where such are left out."""
    waiting: Block | None = None
    open_end = hidden = False
    at = source.begin
    for number, raw in enumerate(source.words.data.split(b"\n"), start=1):
        start, at = at, at + len(raw) + 1
        body = raw.decode("latin-1").split(";", 1)[0].rstrip()
        numbered = _NUMBERED.match(body)
        first = numbered.end() if numbered else len(body) - len(body.lstrip())
        hidden = hidden or body[first : first + 1] == "/"
        if hidden and source.skips:
            hidden = body.endswith("~")
            continue
        if hidden:
            first, hidden = len(body) - len(body[first + 1 :].lstrip()), False
        content = "" if body.strip().isdigit() else body[first:]  # a number alone stands before a comment
        ends_open = content.endswith("~")
        content = content.rstrip("~ \t\r\x1a")
        cycle = waiting is not None and waiting.text.upper().startswith("CYCL DEF") and not numbered
        if waiting is not None and content and (open_end or (cycle and _CONTINUED.match(body))):
            waiting.at = (*waiting.at, (start + first, len(waiting.text) + 1))
            waiting.text += f" {content}"
        elif content:
            if waiting is not None:
                yield waiting
            place = tree.SourcePlace(source.file, number, start + first)
            waiting = Block(place, content, ((start + first, 0),))
        open_end = ends_open or (open_end and not content)
    if waiting is not None:
        yield waiting


class Formula(TokenReader):
    """Reads a formula, the rest of a block."""

    pattern = re.compile(
        r"\s*(?:(?P<number>\d+(?:\.\d*)?|\.\d+)|(?P<name>Q[LRS]?\d*|[A-Z]+)|(?P<sign>.))", re.IGNORECASE
    )
    language = LANGUAGE
    pieces = "blocks"

    def __init__(self, block: Block):
        self.block = block
        super().__init__(block.text, block.column)

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

    def no_value(self) -> tree.ProgramFault:
        if self.ended:
            return self.fault("the formula ends too early")
        return self.fault(f"{self.peek()} is no value, Q parameter or function of a formula")

    def operand(self, token: Token) -> tree.Expression | None:
        name = token.text
        if given := re.fullmatch(r"Q([LR]?)(\d+)", name):
            return self.block.known(int(given[2]), given[1], token.at)
        if name == "SQ":
            operand = self.value()
            return operand * operand
        if name == "NEG":
            return -self.value()
        return tree.op(name, self.value()) if name in LANGUAGE.functions else None


POSITION = {axis: variable(axis.lower()) for axis in "XYZ"}
POLE = variable("cx"), variable("cy"), variable("cz")
PLANE = variable("plane")  # the normal of the pole's plane, 0 to 2
POLAR = variable("pr"), variable("pa")


@dataclass
class Items:
    """The words behind a path function."""

    # absolute or incremental ("I") coordinates by letter
    axes: dict[str, tuple[Expression, bool]] = field(default_factory=dict)
    polar: dict[str, Expression] = field(default_factory=dict)  # PA, PR, IPA, IPR
    turn: int = 0  # -1 for DR-, 1 for DR+, 0 where it is not given
    radius: Expression | None = None  # R of CR
    feed: Expression | None = None  # F with a number;  fast : FMAX;  automatic : F AUTO
    fast: bool = False
    automatic: bool = False
    codes: list[tuple[int, int]] = field(default_factory=list)  # M codes, each with its column
    back: Expression | None = None  # MB of M140, or None for MB MAX
    side: int | None = None  # 1 for RL, -1 for RR, 0 for R0, None where none is given


def items(block: Block, rotary: str = "") -> Items:
    """Read what stands behind the function; `rotary`: letters of rotary axes, whose coordinates are read, too. Raises
    ProgramFault for what a path function does not take here."""
    found, end = Items(), len(block.text.rstrip())
    while block.column < end:
        item = block.take(_ITEM)
        if item is None:
            block.take(r"\s*")
            raise block.wrong(f"{block.rest.split()[0]} is not read here")
        at = item.end() - len(item[0].lstrip())
        if item["axis"]:
            name = item["axis"].upper()
            if name[-1] not in "XYZ" + rotary:
                raise block.fault(f"axis {name[-1]} is not planned here; {', '.join('XYZ' + rotary)} are", at)
            given = block.value()
            if name[-1] in found.axes:
                raise block.fault(f"a second {name[-1]} in this block", at)
            found.axes[name[-1]] = (given, name[0] == "I")
        elif item["limit"] or item["back"]:
            found.back = None if item["limit"] else block.value()
        elif item["polar"]:
            found.polar[item["polar"].upper()] = block.value()
        elif item["turn"]:
            found.turn = 1 if item["turn"] == "+" else -1
        elif item["comp"]:
            found.side = {"R0": 0, "RL": 1, "RR": -1}[item["comp"].upper()]
        elif item["radius"]:
            found.radius = block.value()
        elif item["fast"]:
            found.fast, found.automatic = item["fast"].upper() == "MAX", item["fast"].upper() == "AUTO"
        elif item["ahead"]:  # of M120, blocks that the control looks ahead
            block.value()
        elif item["unit"]:
            what = item["unit"].upper()
            raise block.fault(f"{what}, a feed per tooth, turn or time, is not read; write F in mm/min", at)
        elif item["feed"]:
            found.feed = block.value()
        else:
            found.codes.append((int(item["code"]), at))
            if int(item["code"]) in _WITH_AXES:
                block.take(r"(?:\s+[ABC](?![-+.\dQ]))*")
    return found


def absolute(axis: str, given: tuple[Expression, bool]) -> Expression:
    """An absolute coordinate for a value and whether that is incremental (IX)."""
    return (POSITION.get(axis) or position(axis)) + given[0] if given[1] else given[0]


def looked_up(block: Block) -> tree.Line:
    """Ask the interpreter for the position: behind offsets and moves in machine coordinates."""
    return tree.assign(block.place, *((here, position(axis)) for axis, here in POSITION.items()))
