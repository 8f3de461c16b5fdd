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

from planner.nc.language import tree
from planner.nc.language.arithmetic import ARITHMETIC, COMPARISONS, LOGICAL
from planner.nc.language.expression_reader import Token, TokenReader, ranked
from planner.nc.language.system_variables import FIRST_POSITION, PositionVariables

PARAMETERS = 1000  # R0 to R999; parameter n of the tree is R(n-1)
LANGUAGE = tree.Language(
    operations=ARITHMETIC | {("MOD", 2): "fmod({0},{1})"},
    conditions=COMPARISONS | LOGICAL,
    locals=0,
    largest=FIRST_POSITION + 2,
    vacant=0.0,
    system_numbers=PositionVariables.numbers,
)
_FUNCTIONS = frozenset(
    ["SIN", "COS", "TAN", "ASIN", "ACOS", "SQRT", "ABS", "POT", "TRUNC", "ROUND", "LN", "EXP"]
)
_TWO = {"ATAN2": "ATAN", "MIN": "MIN", "MAX": "MAX"}  # functions of two values, by their names in the tree
# Names of numbers.
_CONSTANTS = {"TRUE": 1.0, "FALSE": 0.0, "PI": math.pi}
_SYSTEM = re.compile(r"\$(?:AA_IW|AA_IM|P_EP)\Z")


def position(axis: str) -> tree.Numbered:
    """Where the axis is, in the program's coordinates."""
    return tree.Numbered(tree.Number(float(FIRST_POSITION + "XYZ".index(axis))))


def variable(name: str) -> tree.Named:
    """A variable of the program, or of the reader's own: each call has its own ones."""
    return tree.Named(name.lower(), False)


def handed_over(number: int) -> tree.Named:
    """The value of that number, from 0, that a call hands to a subprogram."""
    return tree.Named(f"_value {number}", True)


class LineTokens(TokenReader):
    """Reads one line of a program from left to right.

    names : variables that the program has declared
    """

    pattern = re.compile(
        r"\s*(?:(?P<word>[XYZIJKFSTMDGHABC][-+]?(?:\d+\.?\d*|\.\d+)(?![\d_.])(?!\w*\s*[=(\[]))|"
        r"(?P<number>(?:\d+(?:\.\d*)?|\.\d+)(?:EX[-+]?\d+)?)|(?P<name>\$?[A-Z_][A-Z0-9_]*)|(?P<text>\"[^\"]*\")|"
        r"(?P<sign>==|<>|>=|<=|[-+*/()<>=,\[\]:]))",
        re.IGNORECASE,
    )
    ranks = ranked("OR XOR", "AND", "== <> > >= < <=", "+ -", "* / DIV MOD")
    meant = {"==": "EQ", "<>": "NE", ">": "GT", ">=": "GE", "<": "LT", "<=": "LE"}  # noqa: RUF012

    def __init__(self, text: str, place: tree.SourcePlace, start: int, names: set[str]):
        self.place, self.start, self.names = place, start, names
        super().__init__(text)

    def fault(self, message: str, at: int | None = None) -> tree.ProgramFault:
        return tree.ProgramFault(
            self.place._replace(at=self.start + (self.column() if at is None else at)), message
        )

    def at(self) -> int:
        """Byte offset of the next token."""
        return self.start + self.column()

    def value(self) -> tree.Expression:
        if not self.ended and self.tokens[self.next].kind == "word":
            self._take_apart()
        return super().value()

    def _take_apart(self) -> None:
        """Split a word that is a variable and a sum: A+1 in an expression."""
        word = self.tokens[self.next]
        split = 1 if word.text[1:2] in ("+", "-") else len(word.text)
        parts = [Token("name", word.text[:split], word.at)]
        if split == 1:
            parts += [Token("sign", word.text[1], word.at + 1), Token("number", word.text[2:], word.at + 2)]
        self.tokens[self.next : self.next + 1] = parts

    def operand(self, token: Token) -> tree.Expression | None:
        name = token.text
        if name == "NOT":
            return tree.op(name, self.value())
        if token.kind == "number":
            mantissa, _, exponent = name.partition("EX")
            return tree.Number(float(f"{mantissa}e{exponent}" if exponent else mantissa))
        if token.kind != "name":
            return None
        if name in _FUNCTIONS or name in _TWO:
            self.expect("(")
            operands = [self.expression()]
            if name in _TWO:
                self.expect(",")
                operands.append(self.expression())
            self.expect(")")
            return tree.op(_TWO.get(name, name), *operands)
        if name in _CONSTANTS:
            return tree.Number(_CONSTANTS[name])
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

    def parameter(self, token: Token) -> tree.Numbered | tree.Named | None:
        """R parameter or variable of that name, whose index may follow; None if there is none."""
        if token.text == "R" and self.take("["):
            index = self.expression()
            self.expect("]")
            return tree.Numbered(index + tree.ONE)
        if re.fullmatch(r"R\d+", token.text):
            number = int(token.text[1:])
            if number >= PARAMETERS:
                raise self.fault(f"{token.text}: there are R0 to R{PARAMETERS - 1}", token.at)
            return tree.Numbered(tree.Number(float(number + 1)))
        return variable(token.text) if token.text in self.names else None
