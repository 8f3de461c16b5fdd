"""Expressions and words of a Sinumerik program.

    word        = letter value | NAME = expression | NAME = AC(expression) | NAME = IC(expression)
    expression  = values with OR XOR, AND, == <> > >= < <=, + -, * / DIV MOD, NOT and signs, and brackets
    value       = number | R n | R[expression] | variable | function ( expression )
    function    = SIN COS TAN ASIN ACOS ATAN2 SQRT ABS POT TRUNC ROUND LN EXP MIN MAX

Variables are declared by DEF and are 0 at first; R parameters are R0 to R999. $AA_IW[X], $AA_IM[X] and $P_EP[X] are positions of an
axis.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

from planner.nc.language.arithmetic import ARITHMETIC, DEGREES, rounded
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

PARAMETERS = 1000  # R0 to R999; parameter n of the tree is R(n-1)

# What operators and functions mean.
LANGUAGE = Language(
    name="siemens",
    operations=ARITHMETIC
    | {
        ("==", 2): "({0}=={1})",
        ("<>", 2): "({0}!={1})",
        (">", 2): "({0}>{1})",
        (">=", 2): "({0}>={1})",
        ("<", 2): "({0}<{1})",
        ("<=", 2): "({0}<={1})",
        ("AND", 2): "({0}!=0 and {1}!=0)",
        ("OR", 2): "({0}!=0 or {1}!=0)",
        ("XOR", 2): "(({0}!=0)!=({1}!=0))",
        ("NOT", 1): "({0}==0)",
        ("DIV", 2): "float(trunc({0}/{1}))",
        ("MOD", 2): "fmod({0},{1})",
        ("ATAN2", 2): "atan2({0},{1})",
        ("POT", 1): "({0})**2",
        ("TRUNC", 1): "float(trunc({0}))",
        ("ROUND", 1): "rounded({0})",
        ("MIN", 2): "min({0},{1})",
        ("MAX", 2): "max({0},{1})",
    },
    conditions=frozenset(("==", "<>", ">", ">=", "<", "<=", "AND", "OR", "XOR", "NOT")),
    functions={
        **DEGREES,
        "exp": math.exp,
        "log": math.log,
        "sqrt": math.sqrt,
        "trunc": math.trunc,
        "fmod": math.fmod,
        "rounded": rounded,
    },
    locals=0,
    largest=FIRST_POSITION + 2,
    vacant=0.0,
    asked=PositionAsked.numbers,
)

# Operators of a higher rank bind first.
_RANKS = {
    **dict.fromkeys(("OR", "XOR"), 1),
    "AND": 2,
    **dict.fromkeys(("==", "<>", ">", ">=", "<", "<="), 3),
    **dict.fromkeys(("+", "-"), 4),
    **dict.fromkeys(("*", "/", "DIV", "MOD"), 5),
}
_FUNCTIONS = ("SIN", "COS", "TAN", "ASIN", "ACOS", "SQRT", "ABS", "POT", "TRUNC", "ROUND", "LN", "EXP")
_TWO = ("ATAN2", "MIN", "MAX")
# Names of numbers.
_CONSTANTS = {"TRUE": 1.0, "FALSE": 0.0, "PI": math.pi}
_TOKEN = re.compile(
    r"\s*(?:(?P<word>[XYZIJKFSTMDGHABC][-+]?(?:\d+\.?\d*|\.\d+)(?![\d_.])(?!\w*\s*[=(\[]))|"
    r"(?P<number>(?:\d+(?:\.\d*)?|\.\d+)(?:EX[-+]?\d+)?)|(?P<name>\$?[A-Z_][A-Z0-9_]*)|(?P<text>\"[^\"]*\")|"
    r"(?P<sign>==|<>|>=|<=|[-+*/()<>=,\[\]:]))",
    re.IGNORECASE,
)
_SYSTEM = re.compile(r"\$(?:AA_IW|AA_IM|P_EP)\Z")


def operation(name: str, *operands: Expression) -> Operation:
    """An operation of the language."""
    return Operation(name, operands)


def position(axis: str) -> Numbered:
    """Where the axis is, in the program's coordinates."""
    return Numbered(Number(float(FIRST_POSITION + "XYZ".index(axis))))


def variable(name: str) -> Named:
    """A variable of the program, or of the reader's own: each call has its own ones."""
    return Named(name.lower(), False)


def handed_over(number: int) -> Named:
    """The value of that number, from 0, that a call hands to a subprogram."""
    return Named(f"_value {number}", True)


@dataclass(frozen=True)
class Token:
    """A piece of a line.

    kind : "word" (a letter and its number), "number", "name", "text" or "sign"
    text : as it is written, in capitals
    at   : where it begins in the line
    """

    kind: str
    text: str
    at: int


class TokenReader:
    """Reads one line of a program from left to right.

    names : variables that the program has declared
    """

    def __init__(self, text: str, place: SourcePlace, start: int, names: set[str]):
        self.text, self.place, self.start, self.names = text, place, start, names
        self.tokens: list[Token] = []
        self.next = self.nested = 0
        at = 0
        while at < len(text) and text[at:].strip():
            found = _TOKEN.match(text, at)
            if found is None:
                at += len(text[at:]) - len(text[at:].lstrip())
                raise self.fault(f"{text[at]!r} is not part of the language", at)
            kind = str(found.lastgroup)
            word = found.group(kind)
            self.tokens.append(Token(kind, word if kind == "text" else word.upper(), found.start(kind)))
            at = found.end()

    def fault(self, message: str, at: int | None = None) -> ProgramFault:
        """A fault at a character of the line; that of the next token if none is given."""
        if at is None:
            at = self.tokens[self.next].at if self.next < len(self.tokens) else len(self.text)
        return ProgramFault(self.place._replace(at=self.start + at), message)

    @property
    def ended(self) -> bool:
        """Whether nothing is left."""
        return self.next >= len(self.tokens)

    def peek(self, ahead: int = 0) -> str:
        """The text of a token that comes; empty after the last."""
        return self.tokens[self.next + ahead].text if self.next + ahead < len(self.tokens) else ""

    def take(self, text: str) -> bool:
        """Go past the token if it comes next."""
        if self.peek() != text:
            return False
        self.next += 1
        return True

    def expect(self, text: str) -> None:
        """Go past the token. Raises ProgramFault if another one comes."""
        if not self.take(text):
            raise self.fault(f"{text} is expected here; {self.peek() or 'the end of the line'} comes")

    def at(self) -> int:
        """Byte offset of the next token."""
        return self.start + (self.tokens[self.next].at if not self.ended else len(self.text))

    def expression(self, rank: int = 1) -> Expression:
        """Values with operators of at least that rank between them. Raises ProgramFault."""
        left, count = self.value(), 0
        while (its := _RANKS.get(self.peek(), -1)) >= rank:
            operator = self.peek()
            self.next += 1
            left = operation(operator, left, self.expression(its + 1))
            count += 1
            if count > OPERATIONS_MAX:
                raise self.fault(
                    f"more than {OPERATIONS_MAX} operations in a row; write them in several lines"
                )
        return left

    def value(self) -> Expression:
        """A number, variable, function or bracket, with signs before it. Raises ProgramFault."""
        self.nested += 1
        if self.nested > NESTED_MAX:
            raise self.fault(f"more than {NESTED_MAX} brackets in each other")
        found = self._value()
        self.nested -= 1
        return found

    def _value(self) -> Expression:
        if self.ended:
            raise self.fault("a value is expected here; the line ends")
        if self.tokens[self.next].kind == "word":
            self._take_apart()
        token = self.tokens[self.next]
        self.next += 1
        if token.text in ("+", "-"):
            operand = self.value()
            if token.text == "+":
                return operand
            return Number(-operand.value) if isinstance(operand, Number) else operation(NEGATIVE, operand)
        if token.text == "NOT":
            return operation("NOT", self.value())
        if token.text == "(":
            inner = self.expression()
            self.expect(")")
            return inner
        if token.kind == "number":
            mantissa, _, exponent = token.text.partition("EX")
            return Number(float(f"{mantissa}e{exponent}" if exponent else mantissa))
        if token.kind == "name":
            return self._named(token)
        self.next -= 1
        raise self.fault(f"{token.text} is no value")

    def _take_apart(self) -> None:
        """What looks like a word is a variable and what follows it: A+1 in an expression."""
        word = self.tokens[self.next]
        split = 1 if word.text[1:2] in ("+", "-") else len(word.text)
        parts = [Token("name", word.text[:split], word.at)]
        if split == 1:
            parts += [Token("sign", word.text[1], word.at + 1), Token("number", word.text[2:], word.at + 2)]
        self.tokens[self.next : self.next + 1] = parts

    def _named(self, token: Token) -> Expression:
        name = token.text
        if name in _FUNCTIONS or name in _TWO:
            self.expect("(")
            first = self.expression()
            operands = (first,)
            if name in _TWO:
                self.expect(",")
                operands = (first, self.expression())  # type: ignore[assignment]
            self.expect(")")
            return operation(name, *operands)
        if name in _CONSTANTS:
            return Number(_CONSTANTS[name])
        if _SYSTEM.match(name) and self.take("["):
            axis = self.peek()
            self.next += 1
            self.expect("]")
            if axis not in ("X", "Y", "Z"):
                raise self.fault(f"{name}[{axis}]: the position of X, Y or Z is known", token.at)
            return position(axis)
        parameter = self.parameter(token)
        if parameter is None:
            raise self.fault(f"{name} is not declared; write DEF REAL {name} before", token.at)
        return parameter

    def parameter(self, token: Token) -> Numbered | Named | None:
        """R parameter or variable of that name, whose index may follow; None if there is none."""
        if token.text == "R" and self.take("["):
            index = self.expression()
            self.expect("]")
            return Numbered(operation("+", index, Number(1.0)))
        if re.fullmatch(r"R\d+", token.text):
            number = int(token.text[1:])
            if number >= PARAMETERS:
                raise self.fault(f"{token.text}: there are R0 to R{PARAMETERS - 1}", token.at)
            return Numbered(Number(float(number + 1)))
        return variable(token.text) if token.text in self.names else None
