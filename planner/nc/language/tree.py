"""A program that computes, as a tree: expressions, statements, procedures. No language's spelling is known
here.

A statement appends rows of words, changes parameters, or decides what is executed next. Rows that need no
computing stay as the lexer split them and are named by their numbers (`PlainRows`): a program of 100,000
lines with ten expressions is not parsed twice.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple


class SourcePlace(NamedTuple):
    """A statement's file (0: the main program), line from 1, and byte offset of its first letter."""

    file: int
    line: int
    at: int


class Value:
    """An expression; + - * / of two of them are operations, computed here where both are numbers."""

    __slots__ = ()

    def __add__(self, other: Expression | float) -> Expression:
        other = number(other)
        if isinstance(self, Number) and isinstance(other, Number):
            return Number(self.value + other.value)
        return op("+", self, other)

    def __sub__(self, other: Expression | float) -> Expression:
        return op("-", self, other)

    def __mul__(self, other: Expression | float) -> Expression:
        return op("*", self, other)

    def __truediv__(self, other: Expression | float) -> Expression:
        return op("/", self, other)

    def __neg__(self) -> Expression:
        return Number(-self.value) if isinstance(self, Number) else op("-", self)


@dataclass(unsafe_hash=True, slots=True)
class Number(Value):
    """A number as it is written."""

    value: float


@dataclass(unsafe_hash=True, slots=True)
class Numbered(Value):
    """A parameter by its number, which may be computed."""

    index: Expression


@dataclass(unsafe_hash=True, slots=True)
class Named(Value):
    """A parameter by its name; `shared` ones are the same in all calls."""

    name: str
    shared: bool


@dataclass(unsafe_hash=True, slots=True)
class Operation(Value):
    """An operator or function of the language, by its name there, on its operands."""

    name: str
    operands: tuple[Expression, ...]


Expression = Number | Numbered | Named | Operation
Parameter = Numbered | Named
Assignments = tuple[tuple[Parameter, Expression], ...]
ZERO, ONE = Number(0.0), Number(1.0)


def number(value: Expression | float) -> Expression:
    """An expression, which a number may stand for."""
    return Number(float(value)) if isinstance(value, int | float) else value


def op(name: str, *operands: Value | float) -> Operation:
    """An operation by its name, on its operands."""
    return Operation(name, tuple(number(operand) for operand in operands))  # type: ignore[arg-type]


def numbered(index: int) -> Numbered:
    """The parameter of that number."""
    return Numbered(number(index))


class PlainRows(NamedTuple):
    """Rows `first` to `last` - 1 of a file's words, as they are; they may hold the end of the program."""

    place: SourcePlace
    first: int
    last: int
    may_end: bool = False


class Word(NamedTuple):
    """A letter, its place in the source, and its value."""

    letter: str
    at: int
    value: Expression

    @property
    def code(self) -> str:
        """G and M codes by name; empty for other words and computed codes."""
        named = self.letter in "GM" and isinstance(self.value, Number)
        return f"{self.letter}{self.value.value:g}" if named else ""  # type: ignore[union-attr]


Words = tuple[Word, ...]


class Line(NamedTuple):
    """A row of words and assignments; all values are computed before any is assigned."""

    place: SourcePlace
    words: Words
    assignments: Assignments = ()


def word(letter: str, at: int, value: Expression | float) -> Word:
    """A word of a row, whose value may be a number."""
    return Word(letter, at, number(value))


def row(place: SourcePlace, *words: tuple[str, Expression | float], assigned: Assignments = ()) -> Line:
    """A row of letters and values, all of them at one place."""
    return Line(place, tuple(word(letter, place.at, value) for letter, value in words), assigned)


def assign(place: SourcePlace, *assigned: tuple[Parameter, Expression | float]) -> Line:
    """A row that only gives parameters their values, all of which are computed before."""
    return Line(place, (), tuple((parameter, number(value)) for parameter, value in assigned))


class If(NamedTuple):
    """The body of the first condition that holds, else `otherwise`."""

    place: SourcePlace
    branches: tuple[tuple[Expression, list[Statement]], ...]
    otherwise: list[Statement]


class Loop(NamedTuple):
    """`while` asks before a turn, `do` after it, `repeat` counts; Leave says its name."""

    place: SourcePlace
    kind: str
    name: str
    condition: Expression
    body: list[Statement]


class Leave(NamedTuple):
    """Leave the loop of that name, or go `on` with its next turn."""

    place: SourcePlace
    loop: str
    on: bool


class Label(NamedTuple):
    """A place that Goto names."""

    place: SourcePlace
    number: int


class Goto(NamedTuple):
    """Go to the label whose number the expression gives, in the same procedure."""

    place: SourcePlace
    target: Expression


class Call(NamedTuple):
    """Run a procedure `times` times."""

    place: SourcePlace
    procedure: str | Expression  # its name, or an expression that gives its number
    # values of parameters by number, in a new set of local parameters; None shares the caller's
    arguments: tuple[tuple[int, Expression], ...] | None
    word: str  # as the program writes it, for messages
    times: Expression = Number(1.0)


class Return(NamedTuple):
    """Leave the procedure, with a value or None; `label` is where the caller goes on, else after its call."""

    place: SourcePlace
    value: Expression | None = None
    label: Expression | None = None


class Message(NamedTuple):
    """A text for the user, with parameters in it."""

    place: SourcePlace
    pieces: tuple[str | Parameter, ...]


class Modes(NamedTuple):
    """Save or restore the modal state: "save", "forget", "restore" or "save until return"."""

    place: SourcePlace
    action: str


class MadeRows(NamedTuple):
    """Rows that a function makes of values while the program runs (`making.Maker`)."""

    place: SourcePlace
    maker: Callable[..., Any]
    given: tuple[tuple[str, Expression], ...]


def made(place: SourcePlace, maker: Callable[..., Any], **given: Expression | float) -> MadeRows:
    """Rows of a maker of values by name."""
    return MadeRows(place, maker, tuple((name, number(value)) for name, value in given.items()))


def repeated(place: SourcePlace, counter: Named, times: Expression, label: int) -> If:
    """Go back to a label so many times; the counter is 0 before and behind it."""
    again: list[Statement] = [assign(place, (counter, counter + 1)), Goto(place, number(label))]
    return If(place, ((op("LT", counter, times), again),), [assign(place, (counter, 0))])


@dataclass
class OpenStatement:
    """A branch or loop without its end: its body so far, and conditions and bodies before it."""

    kind: str
    place: SourcePlace
    condition: Expression | None
    label: str = ""
    body: list[Statement] = field(default_factory=list)
    branches: list[tuple[Expression, list[Statement]]] = field(default_factory=list)
    count: tuple[Parameter, Expression] | None = None  # of a loop that counts: its variable and last value

    def another_branch(self, condition: Expression | None) -> None:
        """The next branch, with its condition; None for the one behind else."""
        assert self.condition is not None
        self.branches.append((self.condition, self.body))
        self.condition, self.body = condition, []

    def branched(self) -> If:
        """The whole branch, at its end."""
        if self.condition is not None:
            self.another_branch(None)
        return If(self.place, tuple(self.branches), self.body)


Statement = (
    PlainRows | Line | If | Loop | Leave | Label | Goto | Call | Return | Message | Modes | MadeRows
)  # fmt: skip


def statements_in(body: Sequence[Statement]) -> Iterator[Statement]:
    """The statements of a body and of those in it."""
    for statement in body:
        yield statement
        if isinstance(statement, Loop):
            yield from statements_in(statement.body)
        elif isinstance(statement, If):
            for inner in (*(inner for _, inner in statement.branches), statement.otherwise):
                yield from statements_in(inner)


@dataclass(frozen=True)
class Procedure:
    """A subprogram, or the main program under the empty name."""

    name: str
    place: SourcePlace  # of its first line
    body: list[Statement]  # its statements


@dataclass(frozen=True)
class Language:
    """How a language writes expressions, and what its operators and parameters mean."""

    # Python text by operator or function and number of operands, with {0} and {1} for the operands
    operations: Mapping[tuple[str, int], str]
    ranks: Mapping[str, int]  # of operators; those of a higher rank bind first
    functions: frozenset[str]  # of one value
    conditions: frozenset[str]  # those among them that are true or false rather than a number
    # system_numbers and system_names: parameters that hold the state of the control
    system_numbers: frozenset[int]
    system_names: frozenset[str] = frozenset()
    largest: int = 0  # largest number of a parameter
    locals: int = 0  # parameters 1 to `locals` are a call's own
    # the value of a parameter that was never assigned; None where "no value" differs from 0
    vacant: float | None = 0.0
    read: str = "{0}"  # the Python text of a parameter's value in an expression, with {0} for what was stored
    raw: frozenset[str] = frozenset()  # operators that tell a parameter without a value from 0
    # names of operators in the tree, where they are others
    meant: Mapping[str, str] = field(default_factory=dict)
    long_values: bool = False  # an assignment takes an expression without brackets
    keywords: frozenset[str] = frozenset()  # that statements begin with, or have in them
    behind_commas: frozenset[str] = frozenset()  # letters of words that begin with a comma
    constants: Mapping[str, float] = field(default_factory=dict)  # names of numbers


class ProgramFault(Exception):
    """A program that cannot be run, or not further; carries the place and the sentence."""

    def __init__(self, place: SourcePlace, message: str):
        super().__init__(message)
        self.place, self.message = place, message
