"""Expressions and words of a Sinumerik program.

    word        = letter value | NAME = expression | NAME = AC(expression) | NAME = IC(expression)
    expression  = values with OR XOR, AND, == <> > >= < <=, + -, * / DIV MOD, NOT and signs, and brackets
    value       = number | R n | R[expression] | variable | function ( expression )
    function    = SIN COS TAN ASIN ACOS ATAN2 SQRT ABS POT TRUNC ROUND ROUNDUP LN EXP MINVAL MAXVAL BOUND

Variables are declared by DEF and are 0 at first; arrays are parameters behind the R parameters, which are R0 to
R999, and texts are not followed. $AA_IW[X], $AA_IM[X] and $P_EP[X] are positions of an axis.
"""

import math
import re

from planner.nc.language import tree
from planner.nc.language.expressions import ARITHMETIC, COMPARISONS, LOGICAL
from planner.nc.language.system_variables import FIRST_POSITION, POSITIONS, PositionVariables, position
from planner.nc.language.tokens import Token, TokenReader, names, ranked

PARAMETERS = 1000  # R0 to R999; parameter n of the tree is R(n-1)
# Values of arrays that a file may have, how many files may have some, and the first parameter.
ARRAY_VALUES, FILES_WITH_ARRAYS, FIRST_ARRAY = 1000, 50, FIRST_POSITION + 10
# States of a control that runs a program from its start to its end, without a simulation, and names of
# what is set by cycles.
_KNOWN = dict.fromkeys(
    names(
        "$P_ISTEST $P_SEARCH $P_SEARCHL $P_SIM $P_DRYRUN $P_PROGPATH _OFF $AN_NCK_VERSION $P_PROG_EVENT $P_TOOLD _ROUGH "
        "_SEMIFIN _FINISH _ORI_ROUGH _ORI_SEMIFIN _ORI_FINISH _TOP_SURFACE_SMOOTH_OFF _TOP_SURFACE_SMOOTH_ON"
    ),
    0.0,
)
LANGUAGE = tree.Language(
    operations=ARITHMETIC
    | {
        ("MOD", 2): "fmod({0},{1})",
        # > and < are exact (job planning, "Precision correction on comparison errors")
        ("EQ", 2): "equal({0},{1})",
        ("NE", 2): "(not equal({0},{1}))",
        ("GE", 2): "({0}>={1} or equal({0},{1}))",
        ("LE", 2): "({0}<={1} or equal({0},{1}))",
        ("B_AND", 2): "float(int({0})&int({1}))",
        ("B_OR", 2): "float(int({0})|int({1}))",
        ("B_XOR", 2): "float(int({0})^int({1}))",
        ("BOUND", 3): "min(max({0},{1}),{2})",
        ("INDEX", 2): "array_index({0},{1})",
        ("WRAPPED", 1): "remainder({0},360.0)",
        ("TURNED", 1): "({0}%360.0)",
    },
    ranks=ranked("OR XOR", "AND", "B_OR B_XOR", "B_AND", "== <> > >= < <=", "+ -", "* / DIV MOD"),
    meant={"==": "EQ", "<>": "NE", ">": "GT", ">=": "GE", "<": "LT", "<=": "LE"},
    functions=names("SIN COS TAN ASIN ACOS SQRT ABS POT TRUNC ROUND ROUNDUP LN EXP"),
    conditions=COMPARISONS | LOGICAL,
    largest=FIRST_ARRAY + ARRAY_VALUES * FILES_WITH_ARRAYS,
    system_numbers=PositionVariables.numbers,
    constants={"TRUE": 1.0, "FALSE": 0.0, "PI": math.pi, **_KNOWN},
)
# Functions of several values, by their names in the tree.
_MORE = {"ATAN2": "ATAN", "MIN": "MIN", "MAX": "MAX", "MINVAL": "MIN", "MAXVAL": "MAX", "BOUND": "BOUND"}
TIMES = re.compile(r"P(\d+)")
_SYSTEM = re.compile(r"\$(?:AA_IW|AA_IM|P_EP|AA_IB)\Z")


def variable(name: str) -> tree.Named:
    """A variable of the program, or of the reader's own: each call has its own ones."""
    return tree.Named(name.lower(), False)


def handed_over(number: int) -> tree.Named:
    """The value of that number, from 0, that a call hands to a subprogram."""
    return tree.Named(f"_value {number}", True)


# Variables by name: the first parameter of an array (0 for others) and its sizes; a text has one size, of 0.
Names = dict[str, tuple[int, tuple[int, ...]]]
TEXT = (0, (0,))


class LineTokens(TokenReader):
    """Reads one line of a program from left to right.

    names : variables that the program has declared, arrays with their first parameter and their sizes
    """

    pattern = re.compile(
        r"\s*(?:(?P<word>[XYZIJKFSTMDGHABCUVW][-+]?(?:\d+\.?\d*|\.\d+)(?![\d_.])(?!\w*\s*[=(\[]))|"
        r"(?P<number>(?:\d+(?:\.\d*)?|\.\d+)(?:EX[-+]?\d+)?|'(?:H[\dA-F]+|B[01]+|\d+)')|(?P<name>\$?[A-Z_][A-Z0-9_]*)|"
        r"(?P<text>\"[^\"]*\"|'[^']*')|(?P<sign>==|<>|>=|<=|<<|[-+*/()<>=,\[\]:]))",
        re.IGNORECASE,
    )
    language = LANGUAGE

    def __init__(self, text: str, place: tree.SourcePlace, start: int, names: Names):
        self.place, self.start, self.names = place, start, names
        super().__init__(text)

    def fault(self, message: str, at: int | None = None) -> tree.ProgramFault:
        column = self.column() if at is None else at
        return tree.ProgramFault(self.place._replace(at=self.start + column), message)

    def leave(self) -> None:
        """Go past all that is left."""
        self.next = len(self.tokens) - 2

    def at(self) -> int:
        """Byte offset of the next token."""
        return self.start + self.column()

    def times(self) -> tree.Expression:
        """How often: P3 or P=expression, 1 if none of them comes."""
        if match := TIMES.fullmatch(self.peek()):
            self.pop()
            return tree.Number(float(match[1]))
        if not self.take("P"):
            return tree.ONE
        self.expect("=")
        return self.expression()

    def value(self) -> tree.Expression:
        if self.kind() == "word":  # is a variable, or one and a sum: A+1
            _, text, at = self.tokens[self.next]
            parts = [Token("name", text, at)]
            if text[1] in "+-":
                parts = [Token("name", text[0], at), Token("sign", text[1], at + 1)]
                parts.append(Token("number", text[2:], at + 2))
            self.tokens[self.next : self.next + 1] = parts
        return super().value()

    def number(self, text: str) -> float:
        if text[0] == "'":
            base = {"H": 16, "B": 2}.get(text[1], 10)
            return float(int(text.strip("'HB") if base != 16 else text[2:-1], base))
        return float(text.replace("EX", "e"))

    def operand(self, token: Token) -> tree.Expression | None:
        name = token.text
        if name == "NOT":
            return tree.op(name, self.value())
        if token.kind != "name":
            return None
        if name in LANGUAGE.functions or name in _MORE:
            self.expect("(")
            operands = [self.expression()]
            while self.take(","):
                operands.append(self.expression())
            self.expect(")")
            name = {"ROUNDUP": "FUP"}.get(name, _MORE.get(name, name))
            if (name, len(operands)) not in LANGUAGE.operations:
                raise self.fault(f"{token.text} takes another number of values", token.at)
            return tree.op(name, *operands)
        if _SYSTEM.match(name) and self.take("["):
            axis = self.pop().text
            self.expect("]")
            if axis not in POSITIONS or not axis:
                raise self.fault(f"{name}[{axis}]: the position of {', '.join(POSITIONS)} is known", token.at)
            return position(axis)
        if (parameter := self.parameter(token)) is None:
            of_control = "is known by the control only; write its value"
            why = of_control if name[0] == "$" else f"is not declared; write DEF REAL {name} before"
            raise self.fault(f"{name} {why}", token.at)
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
        if token.text not in self.names:
            return None
        first, sizes = self.names[token.text]
        if not first:
            return None if sizes else variable(token.text)
        if not self.take("["):
            text = f"{token.text} is an array; write which of its values: {token.text}[0]"
            raise self.fault(text, token.at)
        value: tree.Expression = tree.ZERO
        for k, size in enumerate(sizes):
            if k:
                self.expect(",")
            index = tree.op("INDEX", self.expression(), tree.Number(float(size)))
            value = index if not k else value * tree.Number(float(size)) + index
        self.expect("]")
        return tree.Numbered(tree.op("+", tree.Number(float(first)), value))
