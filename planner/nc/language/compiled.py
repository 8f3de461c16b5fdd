"""Statements to Python source, compiled once: a loop of a million turns runs as Python's own code.

Structured statements and jumps become basic blocks, functions inside that of their procedure, which return
the number of the block that is next; so loops may be nested as deep as one likes (Python allows 20). A loop
asks its condition in the block of its body, at its end. A line of the Python source belongs to a statement,
so that an error of Python's arithmetic is told as the statement's.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from types import TracebackType

from planner.base.sizes import SIZES
from planner.nc.language import tree
from planner.nc.language.expressions import FUNCTIONS, BasicBlocks, Expressions
from planner.nc.language.rows import AppendedRows

# Turns of loops between two looks at the limits and at the length of what is pending.
TURNS_AT_ONCE = SIZES.turns_at_once
# M codes that end the program: what is pending is executed, to see whether the program goes on.
ENDS = (2.0, 30.0)
_HEAD = "P=run.numbered;G=run.shared;S=run.rows.pending.append;V=run.rows.values.extend;R=run.get;A=run.ask;T=run.tick"


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


Functions = dict[str, Callable[..., float | None]]  # of procedures, by name
Places = list[tree.SourcePlace]  # of the lines of their Python source


def compile_procedures(
    procedures: Sequence[tree.Procedure], language: tree.Language, rows: AppendedRows, marker: str
) -> tuple[Functions, Places]:
    """Compile procedures; the rows that they append are added to `rows`. Raises ProgramFault for a jump that
    leads nowhere.

    marker : stands for a file name in tracebacks
    """
    makers: list[Callable[..., object]] = []
    lines: list[tuple[str, tree.SourcePlace]] = []
    for k, procedure in enumerate(procedures):
        lines += _Function(language, rows, makers).source(procedure, f"p{k}")
    namespace: dict[str, object] = {"whole": whole, "turns_of": turns_of, "M": makers, **FUNCTIONS}
    exec(compile("\n".join(line for line, _ in lines), marker, "exec"), namespace)
    functions = {procedure.name: namespace[f"p{k}"] for k, procedure in enumerate(procedures)}
    return functions, [place for _, place in lines]  # type: ignore[return-value]


class _Function:
    def __init__(self, language: tree.Language, rows: AppendedRows, makers: list[Callable[..., object]]):
        self.language, self.rows, self.makers = language, rows, makers
        self.say = Expressions(language)
        self.blocks = BasicBlocks()
        self.loops: list[tuple[str, int, int]] = []  # name, label of the next turn, label after the loop
        self.counters = 0  # of repeated loops, which count in L; L[0] is the value of the procedure
        self._seen = 0  # of `numbers`

    def source(self, procedure: tree.Procedure, name: str) -> list[tuple[str, tree.SourcePlace]]:
        """Lines of Python with their places."""
        place = procedure.place
        labels = (s for s in tree.statements_in(procedure.body) if isinstance(s, tree.Label))
        self.blocks.numbers += [(label.number, self.blocks.label()) for label in labels]
        self._body(procedure.body)
        lines = self.blocks.source(place)
        return [(f"def {name}(run,L):", place), (f" {_HEAD}", place), *lines, (" return L.get(0)", place)]

    def _body(self, body: Sequence[tree.Statement]) -> None:
        for statement in body:
            try:  # the method of its type, as `ast.NodeVisitor` finds them
                getattr(self, f"_{type(statement).__name__}")(statement)
            except OverflowError:
                raise tree.ProgramFault(statement.place, "a number is too large") from None

    def _PlainRows(self, plain: tree.PlainRows) -> None:
        self.blocks.put(f"S({self.rows.add_entry(plain.first, plain.last)})", plain.place)
        if plain.may_end:
            self.blocks.put("run.flush()", plain.place)

    def _Line(self, line: tree.Line) -> None:
        words, given = [], []
        for word in line.words:
            constant = word.value.value if isinstance(word.value, tree.Number) else None
            words.append((ord(word.letter), word.at, constant))
            if constant is None:
                given.append(self.say.assigned(word.value))
        values = [self.say.assigned(value) for _, value in line.assignments]
        if len(values) > 1 or (words and values):
            for k, value in enumerate(values):
                self.blocks.put(f"t{k}={value}", line.place)
            values = [f"t{k}" for k in range(len(values))]
        if given:
            self.blocks.put(f"V(({','.join(given)},))", line.place)
        if words:
            self.blocks.put(f"S({self.rows.add_row(line.place.line, words)})", line.place)
        for (target, _), value in zip(line.assignments, values, strict=True):
            self.blocks.put(self._assign(target, value, line.place), line.place)
        if any(letter == ord("M") and number in (None, *ENDS) for letter, _, number in words):
            self.blocks.put("run.flush()", line.place)

    def _assign(self, target: tree.Parameter, value: str, place: tree.SourcePlace) -> str:
        if isinstance(target, tree.Named):
            if target.shared and target.name in self.language.system_names:
                raise tree.ProgramFault(
                    place, f"the control sets #<{target.name}> itself; it can only be read"
                )
            return f"{'G' if target.shared else 'L'}[{target.name!r}]={value}"
        if isinstance(target.index, tree.Number) and self.say.stored(target.index.value):
            return f"P[{int(target.index.value)}]={value}"
        return f"run.put({self.say.value(target.index)},{value})"

    def _If(self, statement: tree.If) -> None:
        after = self.blocks.label()
        for condition, body in statement.branches:
            then, otherwise = self.blocks.label(), self.blocks.label()
            self.blocks.go(statement.place, then, self.say.condition(condition), otherwise)
            self.blocks.here(then)
            self._body(body)
            self.blocks.go(statement.place, after)
            self.blocks.here(otherwise)
        self._body(statement.otherwise)
        self.blocks.here(after)

    def _Loop(self, loop: tree.Loop) -> None:
        turn, again, after = self.blocks.label(), self.blocks.label(), self.blocks.label()
        if loop.kind == "repeat":
            self.counters += 1
            left = f"L[{self.counters}]"
            self.blocks.put(f"{left}=turns_of({self.say.value(loop.condition)})", loop.place)
            condition = f"{left}>0"
        else:
            condition = self.say.condition(loop.condition)
        if loop.kind != "do":
            self.blocks.go(loop.place, turn, condition, after)
        self.blocks.here(turn)
        self.loops.append((loop.name, again, after))
        self._body(loop.body)
        self.loops.pop()
        inner = tree.statements_in(loop.body)
        if any(isinstance(s, tree.Leave) and s.on and s.loop == loop.name for s in inner):
            self.blocks.here(again)
        self._tick(loop.place)
        if loop.kind == "repeat":
            self.blocks.put(f"{left}-=1", loop.place)
        self.blocks.go(loop.place, turn, condition, after)
        self.blocks.here(after)

    def _Leave(self, leave: tree.Leave) -> None:
        for name, again, after in reversed(self.loops):
            if name == leave.loop:
                self.blocks.go(leave.place, again if leave.on else after)
                return
        raise tree.ProgramFault(leave.place, f"there is no loop {leave.loop} around this")

    def _Label(self, _: tree.Label) -> None:
        self.blocks.here(self.blocks.numbers[self._seen][1])
        self._seen += 1

    def _Goto(self, goto: tree.Goto) -> None:
        self._tick(goto.place)
        if isinstance(goto.target, tree.Number):
            self.blocks.go(goto.place, self._target(goto.place, int(goto.target.value)))
        else:
            self._jump(self.say.value(goto.target), goto.place)

    def _jump(self, number: str, place: tree.SourcePlace) -> None:
        """To the label of the program whose number that text gives."""
        table = "".join(f"{known}:@{label}@," for known, label in reversed(self.blocks.numbers))
        self.blocks.end(f"run.label({{{table}}},{number})", place)

    def _tick(self, place: tree.SourcePlace) -> None:
        self.blocks.put("run.turns+=1", place)
        self.blocks.put(f"if not run.turns%{TURNS_AT_ONCE}:T()", place)

    def _target(self, place: tree.SourcePlace, number: int) -> int:
        """The label of that number: the next one, or else the first of the procedure."""
        found = [(k, label) for k, (known, label) in enumerate(self.blocks.numbers) if known == number]
        if not found:
            text = f"there is no block N{number} to go to; write its number at its start"
            raise tree.ProgramFault(place, text)
        return next((label for k, label in found if k >= self._seen), found[0][1])

    def _Call(self, call: tree.Call) -> None:
        procedure = call.procedure
        name = repr(procedure) if isinstance(procedure, str) else f"whole({self.say.value(procedure)})"
        given = "None"
        if call.arguments is not None:
            given = "(" + "".join(f"({k},{self.say.assigned(value)})," for k, value in call.arguments) + ")"
        times = self.say.value(call.times)
        self.blocks.put(f"run.call({tuple(call.place)!r},{call.word!r},{name},{given},{times})", call.place)
        if self.blocks.numbers:
            to, on = self.blocks.label(), self.blocks.label()
            self.blocks.go(call.place, to, "run.resume is not None", on)
            self.blocks.here(to)
            self._jump("run.resumed()", call.place)
            self.blocks.here(on)

    def _Return(self, statement: tree.Return) -> None:
        if statement.label is not None:
            self.blocks.put(f"run.resume={self.say.value(statement.label)}", statement.place)
        if statement.value is not None:
            self.blocks.put(f"L[0]={self.say.value(statement.value)}", statement.place)
        self.blocks.end("-1", statement.place)

    def _Message(self, message: tree.Message) -> None:
        pieces = []
        for piece in message.pieces:
            known = self.language.system_names
            if isinstance(piece, str):
                pieces.append(repr(piece))
            elif isinstance(piece, tree.Named) and not (piece.shared and piece.name in known):
                pieces.append(f"{'G' if piece.shared else 'L'}.get({piece.name!r})")
            else:
                pieces.append(self.say.value(piece))
        self.blocks.put(f"run.message({message.place.line},({','.join(pieces)},))", message.place)

    def _Modes(self, modes: tree.Modes) -> None:
        self.blocks.put(f"run.modes({modes.action!r},{tuple(modes.place)!r})", modes.place)

    def _MadeRows(self, made: tree.MadeRows) -> None:
        given = "".join(f"({name!r},{self.say.value(value)})," for name, value in made.given)
        self.blocks.put(f"run.made(M[{len(self.makers)}],({given}),{tuple(made.place)!r})", made.place)
        self.makers.append(made.maker)


def statement_of(traceback: TracebackType | None, units: Mapping[str, Places]) -> tree.SourcePlace:
    """The statement that a traceback ends in; `units` are compiled files by their marker."""
    place = None
    while traceback is not None:
        unit = units.get(traceback.tb_frame.f_code.co_filename)
        if unit is not None:
            place = unit[traceback.tb_lineno - 1]
        traceback = traceback.tb_next
    assert place is not None
    return place


def last_statement(units: Mapping[str, Places]) -> tree.SourcePlace:
    """The last statement of the main program, the first of the units."""
    main = next(iter(units.values()))
    return max((place for place in main if place.file == 0), key=lambda place: place.at)


def endless(what: str) -> ValueError:
    """The error of a limit of the running program that is reached; `what` says which."""
    return ValueError(
        f"stopped after {what}: does this loop end? if it does, split the program "
        "(limits: TURNS_MAX, ROWS_MAX, BY_WORD_MAX in planner.nc.language.run)"
    )


def sentence(fault: Exception) -> str:
    """The message for a Python error of the compiled program."""
    text = str(fault)
    if isinstance(fault, ZeroDivisionError):
        return "division by zero"
    if isinstance(fault, OverflowError):
        return "the result is too large"
    if isinstance(fault, KeyError):
        return f"the named parameter #<{fault.args[0]}> has no value here; assign one before it is read"
    if text == "math domain error" or text.startswith("expected a"):
        return "the function or power is not defined for this number"
    return text
