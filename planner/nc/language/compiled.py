"""Statements to Python source, compiled once: a loop of a million turns runs as Python's own code.

Structured statements and jumps become the same thing: basic blocks, which end by saying which block is next,

    while True:
        if pc < 2:
            if pc < 1: ... block 0 ...
            else:      ... block 1 ...
        else: ...

found by halving, so that a jump among a thousand blocks takes ten comparisons, and loops may be nested as deep as one likes (Python
allows 20). A loop asks its condition at the end of its turn, in the block of its body: a turn of a simple loop is one block.

A line of the Python source belongs to a statement, so that an error of Python's arithmetic is told as the statement's.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from planner.nc.language.rows import Rows
from planner.nc.language.tree import (
    Break,
    Call,
    Continue,
    Exists,
    Expression,
    Goto,
    If,
    Label,
    Language,
    Line,
    Loop,
    Message,
    Modes,
    Named,
    Number,
    Numbered,
    Parameter,
    Place,
    PlainRows,
    Procedure,
    ProgramFault,
    Return,
    Statement,
    Turning,
)

# Turns of loops between two looks at the limits and at the length of what is pending.
TURNS_AT_ONCE = 500
ENDS = (
    2.0,
    30.0,
)  # M codes that end the program: what is pending is executed, to see whether the program goes on
_HEAD = "P=run.numbered;G=run.shared;S=run.rows.pending.append;V=run.rows.values.extend;R=run.get;A=run.ask;T=run.tick;n=0;pc=0"


def whole(value: float | None) -> int:
    """A whole number, within 0.0001 as RS274NGC rounds. Raises ValueError."""
    if value is None:
        raise ValueError("a parameter without a value where a whole number is needed")
    number = round(value)
    if abs(value - number) > 1e-4:
        raise ValueError(f"{value:g} where a whole number is needed")
    return number


def turns_of(value: float | None) -> int:
    """The number of turns of a repeated loop: rounded, as LinuxCNC does it."""
    return math.floor((value or 0.0) + 0.5)


@dataclass
class Compiled:
    """Python functions of procedures, by name, and the place of each line of their source."""

    functions: dict[str, Callable[..., float | None]] = field(default_factory=dict)
    places: list[Place] = field(default_factory=list)


def compile_procedures(
    procedures: Sequence[Procedure], language: Language, rows: Rows, marker: str
) -> Compiled:
    """Compile procedures; the rows that they append are added to `rows`.

    marker : stands for a file name in tracebacks

    Raises ProgramFault for a jump that leads nowhere.
    """
    found = Compiled()
    text: list[str] = []
    for k, procedure in enumerate(procedures):
        for line, place in _Function(procedure, language, rows).source(f"p{k}"):
            text.append(line)
            found.places.append(place)
    namespace: dict[str, object] = {"whole": whole, "turns_of": turns_of, **language.functions}
    exec(compile("\n".join(text), marker, "exec"), namespace)
    for k, procedure in enumerate(procedures):
        found.functions[procedure.name] = namespace[f"p{k}"]  # type: ignore[assignment]
    return found


@dataclass
class _End:
    """How a basic block goes on: to `label`, or to `otherwise` if the condition does not hold; None leaves the function.
    With `computed` it goes to the label of the program whose number that text gives.
    """

    place: Place
    label: int | None
    condition: str = ""
    otherwise: int = 0
    computed: str = ""


@dataclass
class _Block:
    lines: list[tuple[str, Place]] = field(default_factory=list)
    end: _End | None = None


class _Function:
    """The Python source of one procedure."""

    def __init__(self, procedure: Procedure, language: Language, rows: Rows):
        self.procedure, self.language, self.rows = procedure, language, rows
        self.blocks = [_Block()]
        self.block_of: dict[int, int] = {}  # label to block
        self.labels = 0
        self.loops: list[tuple[str, int, int]] = []  # name, label of the next turn, label after the loop
        self.numbers: list[tuple[int, int]] = []  # labels of the program in their order: number, label
        self.counters = 0
        self._seen = 0  # of `numbers`

    def source(self, name: str) -> list[tuple[str, Place]]:
        """Lines of Python with their places."""
        place = self.procedure.place
        self._number_labels(self.procedure.body)
        self._body(self.procedure.body)
        self._put("run.turns+=n;return None", place)
        self.blocks[-1].end = _End(place, None)
        lines = [(f"def {name}(run,L):", place), (f" {_HEAD}", place)]
        if len(self.blocks) == 1:
            return [*lines, *((" " + text, at) for text, at in self.blocks[0].lines)]
        lines.append((" while True:", place))
        self._choose(0, len(self.blocks), "  ", lines)
        return lines

    def _choose(self, low: int, high: int, indent: str, lines: list[tuple[str, Place]]) -> None:
        if high - low > 1:
            middle = (low + high) // 2
            lines.append((f"{indent}if pc<{middle}:", self.procedure.place))
            self._choose(low, middle, indent + " ", lines)
            lines.append((f"{indent}else:", self.procedure.place))
            self._choose(middle, high, indent + " ", lines)
            return
        block = self.blocks[low]
        lines.extend((indent + text, place) for text, place in block.lines)
        end = block.end
        if end is None:
            lines.append((f"{indent}pc={low + 1}", self.procedure.place))
        elif end.computed:
            table = {number: self.block_of[label] for number, label in reversed(self.numbers)}
            lines.append((f"{indent}pc=run.label({table!r},{end.computed})", end.place))
        elif end.label is not None:
            to = self.block_of[end.label]
            if end.condition:
                lines.append(
                    (f"{indent}pc={to} if {end.condition} else {self.block_of[end.otherwise]}", end.place)
                )
            else:
                lines.append((f"{indent}pc={to}", end.place))
        elif not block.lines:
            lines.append((f"{indent}pass", self.procedure.place))

    # --- blocks -----------------------------------------------------------------------------------------------------------

    def _put(self, text: str, place: Place) -> None:
        self.blocks[-1].lines.append((text, place))

    def _label(self) -> int:
        self.labels += 1
        return self.labels

    def _here(self, label: int) -> None:
        """The label is the place that is reached now."""
        if self.blocks[-1].lines or self.blocks[-1].end:
            self.blocks.append(_Block())
        self.block_of[label] = len(self.blocks) - 1

    def _go(self, place: Place, label: int, condition: str = "", otherwise: int = 0) -> None:
        self.blocks[-1].end = _End(place, label, condition, otherwise)
        self.blocks.append(_Block())

    # --- statements -------------------------------------------------------------------------------------------------------

    def _body(self, body: Sequence[Statement]) -> None:
        for statement in body:
            _WRITE[type(statement)](self, statement)

    def _plain_rows(self, plain: PlainRows) -> None:
        self._put(f"S({self.rows.add_entry(plain.first, plain.last)})", plain.place)
        if plain.may_end:
            self._put("run.turns+=n;n=0;run.flush()", plain.place)

    def _line(self, line: Line) -> None:
        words, given = [], []
        for word in line.words:
            constant = word.value.value if isinstance(word.value, Number) else None
            words.append((word.letter, word.at, constant))
            if constant is None:
                given.append(self._assigned(word.value))
        values = [self._assigned(value) for _, value in line.assignments]
        if len(values) > 1 or (words and values):
            for k, value in enumerate(values):
                self._put(f"t{k}={value}", line.place)
            values = [f"t{k}" for k in range(len(values))]
        if given:
            self._put(f"V(({','.join(given)},))", line.place)
        if words:
            self._put(f"S({self.rows.add_row(line.place.line, words)})", line.place)
        for (target, _), value in zip(line.assignments, values, strict=True):
            self._put(self._assign(target, value, line.place), line.place)
        if any(letter == ord("M") and number in (None, *ENDS) for letter, _, number in words):
            self._put("run.turns+=n;n=0;run.flush()", line.place)

    def _assign(self, target: Parameter, value: str, place: Place) -> str:
        if isinstance(target, Named):
            if target.shared and target.name in self.language.asked_names:
                raise ProgramFault(place, f"the control sets #<{target.name}> itself; it can only be read")
            return f"{'G' if target.shared else 'L'}[{target.name!r}]={value}"
        if isinstance(target.index, Number) and self._stored(target.index.value):
            return f"P[{int(target.index.value)}]={value}"
        return f"run.put({self.value(target.index)},{value})"

    def _if(self, statement: If) -> None:
        after = self._label()
        for condition, body in statement.branches:
            then, otherwise = self._label(), self._label()
            self._go(statement.place, then, self.condition(condition), otherwise)
            self._here(then)
            self._body(body)
            self._go(statement.place, after)
            self._here(otherwise)
        self._body(statement.otherwise)
        self._here(after)

    def _loop(self, loop: Loop) -> None:
        turn, again, after = self._label(), self._label(), self._label()
        if loop.kind == "repeat":
            self.counters += 1
            left = f"r{self.counters}"
            self._put(f"{left}=turns_of({self.value(loop.condition)})", loop.place)
            condition = f"{left}>0"
        else:
            condition = self.condition(loop.condition)
        if loop.kind != "do":
            self._go(loop.place, turn, condition, after)
        self._here(turn)
        self.loops.append((loop.name, again, after))
        self._body(loop.body)
        self.loops.pop()
        if self._is_continued(loop.body, loop.name):
            self._here(again)
        self._put("n+=1", loop.place)
        self._put(f"if n>{TURNS_AT_ONCE}:n=T(n)", loop.place)
        if loop.kind == "repeat":
            self._put(f"{left}-=1", loop.place)
        self._go(loop.place, turn, condition, after)
        self._here(after)

    def _is_continued(self, body: Sequence[Statement], name: str) -> bool:
        return any(
            (isinstance(s, Continue) and s.loop == name)
            or (isinstance(s, Loop) and self._is_continued(s.body, name))
            or (
                isinstance(s, If)
                and any(self._is_continued(b, name) for b in (*(b for _, b in s.branches), s.otherwise))
            )
            for s in body
        )

    def _break(self, statement: Break | Continue) -> None:
        for name, again, after in reversed(self.loops):
            if name == statement.loop:
                self._go(statement.place, after if isinstance(statement, Break) else again)
                return
        what = "break" if isinstance(statement, Break) else "continue"
        raise ProgramFault(statement.place, f"{what} outside of the loop {statement.loop}")

    def _number_labels(self, body: Sequence[Statement]) -> None:
        for s in body:
            if isinstance(s, Label):
                self.numbers.append((s.number, self._label()))
            elif isinstance(s, Loop):
                self._number_labels(s.body)
            elif isinstance(s, If):
                for inner in (*(b for _, b in s.branches), s.otherwise):
                    self._number_labels(inner)

    def _label_here(self, _: Label) -> None:
        self._here(self.numbers[self._seen][1])
        self._seen += 1

    def _goto(self, goto: Goto) -> None:
        if isinstance(goto.target, Number):
            self._tick(goto.place)
            self._go(goto.place, self._target(goto.place, int(goto.target.value)))
            return
        self._tick(goto.place)
        self._jump_to(self.value(goto.target), goto.place)

    def _tick(self, place: Place) -> None:
        self._put("n+=1", place)
        self._put(f"if n>{TURNS_AT_ONCE}:n=T(n)", place)

    def _jump_to(self, number: str, place: Place) -> None:
        """Go to the label whose number is computed."""
        self.blocks[-1].end = _End(place, None, computed=number)
        self.blocks.append(_Block())

    def _target(self, place: Place, number: int) -> int:
        """The label of that number: the next one, or else the first of the procedure."""
        found = [(k, label) for k, (known, label) in enumerate(self.numbers) if known == number]
        if not found:
            raise ProgramFault(place, f"there is no block N{number} to go to; write its number at its start")
        return next((label for k, label in found if k >= self._seen), found[0][1])

    def _call(self, call: Call) -> None:
        name = (
            repr(call.procedure)
            if isinstance(call.procedure, str)
            else f"whole({self.value(call.procedure)})"
        )
        given = "None"
        if call.arguments is not None:
            given = "(" + "".join(f"({k},{self._assigned(value)})," for k, value in call.arguments) + ")"
        times = self.value(call.times)
        self._put(f"run.call({tuple(call.place)!r},{call.word!r},{name},{given},{times})", call.place)
        if self.numbers:
            to, on = self._label(), self._label()
            self._go(call.place, to, "run.resume is not None", on)
            self._here(to)
            self._jump_to("run.resumed()", call.place)
            self._here(on)

    def _return(self, statement: Return) -> None:
        if statement.label is not None:
            self._put(f"run.resume={self.value(statement.label)}", statement.place)
        value = "None" if statement.value is None else self.value(statement.value)
        self._put(f"run.turns+=n;return {value}", statement.place)
        self.blocks[-1].end = _End(statement.place, None)
        self.blocks.append(_Block())

    def _message(self, message: Message) -> None:
        pieces = []
        for piece in message.pieces:
            if isinstance(piece, str):
                pieces.append(repr(piece))
            elif isinstance(piece, Named) and not (piece.shared and piece.name in self.language.asked_names):
                pieces.append(f"{'G' if piece.shared else 'L'}.get({piece.name!r})")
            else:
                pieces.append(self.value(piece))
        self._put(f"run.message({message.place.line},({','.join(pieces)},))", message.place)

    def _modes(self, modes: Modes) -> None:
        self._put(f"run.modes({modes.action!r},{tuple(modes.place)!r})", modes.place)

    def _turning(self, turning: Turning) -> None:
        self._put(
            f"run.turning({turning.action!r},{turning.letters!r},{tuple(turning.place)!r})", turning.place
        )

    # --- expressions ------------------------------------------------------------------------------------------------------

    def value(self, expression: Expression) -> str:
        """Python text of a number."""
        text, logical = self._expression(expression, raw=False)
        return f"(1.0 if {text} else 0.0)" if logical else text

    def condition(self, expression: Expression) -> str:
        """Python text of what is true or false."""
        text, logical = self._expression(expression, raw=False)
        return text if logical else f"{text}!=0"

    def _assigned(self, expression: Expression) -> str:
        """Python text of a value to be stored: a vacant parameter alone stays vacant."""
        if isinstance(expression, Numbered | Named):
            return self._expression(expression, raw=True)[0]
        return self.value(expression)

    def _stored(self, index: float) -> bool:
        low = 0 if self.language.vacant is None else 1
        return (
            index == int(index) and low <= index <= self.language.largest and index not in self.language.asked
        )

    def _expression(self, expression: Expression, *, raw: bool) -> tuple[str, bool]:
        """Python text, and whether it is true or false rather than a number."""
        language = self.language
        if isinstance(expression, Number):
            return (repr(expression.value) if expression.value >= 0 else f"({expression.value!r})"), False
        if isinstance(expression, Named):
            name = expression.name
            if expression.shared and name in language.asked_names:
                return f"A({name!r})", False
            return f"{'G' if expression.shared else 'L'}[{name!r}]", False
        if isinstance(expression, Numbered):
            index = expression.index
            if isinstance(index, Number) and self._stored(index.value):
                text = f"P[{int(index.value)}]"
            elif isinstance(index, Number) and index.value in language.asked:
                return f"A({int(index.value)})", False
            else:
                text = f"R({self.value(index)})"
            return (text if raw else language.read.format(text)), False
        if isinstance(expression, Exists):
            return self._exists(expression.parameter), True
        raw = expression.name in language.raw
        operands = []
        for operand in expression.operands:
            text, logical = self._expression(operand, raw=raw and isinstance(operand, Numbered))
            operands.append(f"(1.0 if {text} else 0.0)" if logical else text)
        template = language.operations[expression.name, len(operands)]
        return template.format(*operands), expression.name in language.conditions

    def _exists(self, parameter: Parameter) -> str:
        if isinstance(parameter, Numbered):
            return f"run.exists({self.value(parameter.index)})"
        if not parameter.shared:
            return f"({parameter.name!r} in L)"
        return "True" if parameter.name in self.language.asked_names else f"({parameter.name!r} in G)"


_WRITE: dict[type, Callable[..., None]] = {
    PlainRows: _Function._plain_rows,
    Line: _Function._line,
    If: _Function._if,
    Loop: _Function._loop,
    Break: _Function._break,
    Continue: _Function._break,
    Label: _Function._label_here,
    Goto: _Function._goto,
    Call: _Function._call,
    Return: _Function._return,
    Message: _Function._message,
    Modes: _Function._modes,
    Turning: _Function._turning,
}
