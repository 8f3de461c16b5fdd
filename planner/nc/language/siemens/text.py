"""Expressions, words and control statements of a Sinumerik program.

    word        = letter value | NAME = expression | NAME = AC(expression) | NAME = IC(expression)
    expression  = values with OR XOR, AND, == <> > >= < <=, + -, * / DIV MOD, NOT and signs, and brackets
    value       = number | R n | R[expression] | variable | function ( expression )
    function    = SIN COS TAN ASIN ACOS ATAN2 SQRT ABS POT TRUNC ROUND LN EXP MIN MAX

Variables are declared by DEF and are 0 at first; R parameters are R0 to R999. $AA_IW[X], $AA_IM[X] and
$P_EP[X] are positions of an axis.
"""

import math
import re
from collections.abc import Container

from planner.nc.language import tree
from planner.nc.language.expressions import ARITHMETIC, COMPARISONS, LOGICAL
from planner.nc.language.source import LineParser, Source
from planner.nc.language.system_variables import FIRST_POSITION, PositionVariables
from planner.nc.language.tokens import Token, TokenReader, names, ranked

PARAMETERS = 1000  # R0 to R999; parameter n of the tree is R(n-1)
LANGUAGE = tree.Language(
    operations=ARITHMETIC | {("MOD", 2): "fmod({0},{1})"},
    ranks=ranked("OR XOR", "AND", "== <> > >= < <=", "+ -", "* / DIV MOD"),
    meant={"==": "EQ", "<>": "NE", ">": "GT", ">=": "GE", "<": "LT", "<=": "LE"},
    functions=names("SIN COS TAN ASIN ACOS SQRT ABS POT TRUNC ROUND LN EXP"),
    conditions=COMPARISONS | LOGICAL,
    largest=FIRST_POSITION + 2,
    system_numbers=PositionVariables.numbers,
    constants={"TRUE": 1.0, "FALSE": 0.0, "PI": math.pi},
)
_TWO = {"ATAN2": "ATAN", "MIN": "MIN", "MAX": "MAX"}  # functions of two values, by their names in the tree
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
    language = LANGUAGE

    def __init__(self, text: str, place: tree.SourcePlace, start: int, names: set[str]):
        self.place, self.start, self.names = place, start, names
        super().__init__(text)

    def fault(self, message: str, at: int | None = None) -> tree.ProgramFault:
        return tree.ProgramFault(
            self.place._replace(at=self.start + (self.column() if at is None else at)), message
        )

    def leave(self) -> None:
        """Go past all that is left."""
        self.next = len(self.tokens) - 2

    def at(self) -> int:
        """Byte offset of the next token."""
        return self.start + self.column()

    def value(self) -> tree.Expression:
        if self.kind() == "word":  # is a variable, or one and a sum: A+1
            word = self.tokens[self.next]
            split = 1 if word.text[1:2] in ("+", "-") else len(word.text)
            parts = [Token("name", word.text[:split], word.at)]
            if split == 1:
                parts += [
                    Token("sign", word.text[1], word.at + 1),
                    Token("number", word.text[2:], word.at + 2),
                ]
            self.tokens[self.next : self.next + 1] = parts
        return super().value()

    def number(self, text: str) -> float:
        return float(text.replace("EX", "e"))

    def operand(self, token: Token) -> tree.Expression | None:
        name = token.text
        if name == "NOT":
            return tree.op(name, self.value())
        if token.kind != "name":
            return None
        if name in LANGUAGE.functions or name in _TWO:
            self.expect("(")
            operands = [self.expression()]
            if name in _TWO:
                self.expect(",")
                operands.append(self.expression())
            self.expect(")")
            return tree.op(_TWO.get(name, name), *operands)
        if _SYSTEM.match(name) and self.take("["):
            axis = self.pop().text
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


class SiemensControl(LineParser):
    """Statements that decide what comes next: branches, loops, jumps, repeated sections."""

    def __init__(self, source: Source):
        super().__init__(source)
        self.labels: dict[str, int] = {}  # their numbers in the tree, by name
        self.counters = 0  # how many sections are repeated by their labels
        self.lines: dict[str, list[tree.Statement]] = {}  # the statements of lines with labels

    def _label(self, name: str, place: tree.SourcePlace) -> None:
        self.body.append(tree.Label(place, self._number_of(name)))

    def _number_of(self, label: str) -> int:
        return self.labels.setdefault(label, len(self.labels) + 1)

    def _begin(self, kind: str, reader: LineTokens, condition: tree.Expression | None) -> tree.OpenStatement:
        return self.begin(tree.OpenStatement(kind, reader.place, condition))

    def _close(self, kind: str, reader: LineTokens) -> tree.OpenStatement:
        if not self.open or self.open[-1].kind != kind:
            raise reader.fault(f"there is no {kind} open that this ends", 0)
        return self.close()

    def _if(self, reader: LineTokens) -> None:
        condition = reader.expression()
        if reader.peek().startswith("GOTO"):
            reader.pop()
            body: list[tree.Statement] = []
            self._jump(reader, body)
            self.body.append(tree.If(reader.place, ((condition, body),), []))
        else:
            self._begin("IF", reader, condition)

    def _else(self, reader: LineTokens) -> None:
        if not self.open or self.open[-1].kind != "IF" or self.open[-1].condition is None:
            raise reader.fault("there is no IF open that this belongs to", 0)
        self.open[-1].another_branch(None)
        self.body = self.open[-1].body

    def _end_if(self, reader: LineTokens) -> None:
        branch = self._close("IF", reader)
        self.body.append(branch.branched())

    def _end_loop(self, reader: LineTokens) -> None:
        closed = self._close(reader.peek(-1).removeprefix("END"), reader)
        assert closed.condition is not None
        self.add_loop(closed, closed.condition)

    def _for(self, reader: LineTokens) -> None:
        target = reader.parameter(reader.tokens[reader.next])
        if target is None:
            raise reader.fault("FOR needs a variable that is declared")
        reader.pop()
        reader.expect("=")
        first = reader.expression()
        reader.expect("TO")
        last = reader.expression()
        self.body.append(tree.assign(reader.place, (target, first)))
        self._begin("FOR", reader, None).count = (target, last)

    def _end_for(self, reader: LineTokens) -> None:
        closed = self._close("FOR", reader)
        assert closed.count is not None
        target, last = closed.count
        closed.body.append(tree.assign(closed.place, (target, target + tree.ONE)))
        self.add_loop(closed, tree.op("LE", target, last))

    def _repeat(self, reader: LineTokens) -> None:
        """REPEAT ... UNTIL, or REPEAT label P=n: the lines from the label to here, n times more."""
        if reader.ended:
            self._begin("REPEAT", reader, None)
            return
        label, counter, times = self._repeated(reader, self.labels)
        place = reader.place
        self.body.append(tree.repeated(place, counter, times, self.labels[label]))

    def _repeat_block(self, reader: LineTokens) -> None:
        label, counter, times = self._repeated(reader, self.lines)
        place = reader.place
        self.body.append(tree.assign(place, (counter, tree.ZERO)))
        body = [*self.lines[label], tree.assign(place, (counter, counter + tree.ONE))]
        self.add_loop(tree.OpenStatement("REPEATB", place, None, body=body), tree.op("LT", counter, times))

    def _repeated(self, reader: LineTokens, known: Container[str]) -> tuple[str, tree.Named, tree.Expression]:
        """The label of a repeat, its counter, and how often. Raises ProgramFault for an unknown label."""
        label = reader.pop().text
        if label not in known:
            raise reader.fault(f"there is no label {label} above this line", 0)
        times: tree.Expression = tree.ONE
        if reader.take("P"):
            reader.expect("=")
            times = reader.expression()
        self.counters += 1
        return label, variable(f"_count{self.counters - 1}"), times

    def _until(self, reader: LineTokens) -> None:
        closed = self._close("REPEAT", reader)
        self.add_loop(closed, tree.op("NOT", reader.expression()), "do")

    def _jump(self, reader: LineTokens, body: list[tree.Statement]) -> None:
        if reader.ended:
            raise reader.fault("a label is expected here")
        label = reader.pop().text
        body.append(tree.Goto(reader.place, tree.Number(float(self._number_of(label)))))
