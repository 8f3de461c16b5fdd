"""Control statements of a Sinumerik program: branches, loops, labels and jumps."""

from __future__ import annotations

from collections.abc import Container

from planner.nc.language.siemens.text import LineTokens, variable
from planner.nc.language.tree import (
    ONE,
    ZERO,
    Expression,
    Goto,
    If,
    Label,
    Loop,
    Named,
    Number,
    OpenStatement,
    SourcePlace,
    Statement,
    assign,
    op,
)

_NESTED_MAX = 100  # loops and branches in each other


class SiemensControl:
    """The statements so far, and those that are open.

    main, body : statements of the program, and where the next one goes
    open       : control statements whose end has not come, the outermost first
    labels     : their numbers in the tree, by name
    lines      : the statements of lines with labels
    counters   : how many sections are repeated by their labels
    """

    def __init__(self) -> None:
        self.main: list[Statement] = []
        self.body = self.main
        self.open: list[OpenStatement] = []
        self.labels: dict[str, int] = {}
        self.counters = 0
        self.lines: dict[str, list[Statement]] = {}

    def _label(self, name: str, place: SourcePlace) -> None:
        self.body.append(Label(place, self._number_of(name)))

    def _number_of(self, label: str) -> int:
        return self.labels.setdefault(label, len(self.labels) + 1)

    def _begin(self, kind: str, reader: LineTokens, condition: Expression | None) -> OpenStatement:
        if len(self.open) >= _NESTED_MAX:
            raise reader.fault(f"more than {_NESTED_MAX} loops and branches in each other", 0)
        opened = OpenStatement(kind, reader.place, condition)
        self.open.append(opened)
        self.body = opened.body
        return opened

    def _close(self, kind: str, reader: LineTokens) -> OpenStatement:
        if not self.open or self.open[-1].kind != kind:
            raise reader.fault(f"there is no {kind} open that this ends", 0)
        closed = self.open.pop()
        self.body = self.open[-1].body if self.open else self.main
        return closed

    def _if(self, reader: LineTokens) -> None:
        condition = reader.expression()
        if reader.peek().startswith("GOTO"):
            reader.next += 1
            body: list[Statement] = []
            self._jump(reader, body)
            self.body.append(If(reader.place, ((condition, body),), []))
        else:
            self._begin("IF", reader, condition)

    def _else(self, reader: LineTokens) -> None:
        if not self.open or self.open[-1].kind != "IF" or self.open[-1].condition is None:
            raise reader.fault("there is no IF open that this belongs to", 0)
        self.open[-1].another_branch(None)
        self.body = self.open[-1].body

    def _end_if(self, reader: LineTokens) -> None:
        closed = self._close("IF", reader)
        self.body.append(closed.branched())

    def _while(self, reader: LineTokens) -> None:
        self._begin("WHILE", reader, reader.expression())

    def _loop(self, reader: LineTokens) -> None:
        self._begin("LOOP", reader, ONE)

    def _end_loop(self, reader: LineTokens) -> None:
        kind = {"ENDWHILE": "WHILE", "ENDLOOP": "LOOP"}[reader.peek(-1)]
        closed = self._close(kind, reader)
        assert closed.condition is not None
        self.body.append(
            Loop(closed.place, "while", f"{kind} {closed.place.at}", closed.condition, closed.body)
        )

    def _for(self, reader: LineTokens) -> None:
        target = reader.parameter(reader.tokens[reader.next]) if not reader.ended else None
        if target is None:
            raise reader.fault("FOR needs a variable that is declared")
        reader.next += 1
        reader.expect("=")
        first = reader.expression()
        reader.expect("TO")
        last = reader.expression()
        self.body.append(assign(reader.place, (target, first)))
        self._begin("FOR", reader, None).count = (target, last)

    def _end_for(self, reader: LineTokens) -> None:
        closed = self._close("FOR", reader)
        assert closed.count is not None
        target, last = closed.count
        closed.body.append(assign(closed.place, (target, target + ONE)))
        self.body.append(
            Loop(closed.place, "while", f"FOR {closed.place.at}", op("LE", target, last), closed.body)
        )

    def _repeat(self, reader: LineTokens) -> None:
        """REPEAT ... UNTIL, or REPEAT label P=n: the lines from the label to here, n times more."""
        if reader.ended:
            self._begin("REPEAT", reader, None)
            return
        label, counter, times = self._repeated(reader, self.labels)
        place = reader.place
        again: list[Statement] = [
            assign(place, (counter, counter + ONE)),
            Goto(place, Number(float(self.labels[label]))),
        ]
        self.body.append(If(place, ((op("LT", counter, times), again),), [assign(place, (counter, ZERO))]))

    def _repeat_block(self, reader: LineTokens) -> None:
        """REPEATB label P=n: the line of the label, n times more."""
        label, counter, times = self._repeated(reader, self.lines)
        place = reader.place
        self.body.append(assign(place, (counter, ZERO)))
        body = [*self.lines[label], assign(place, (counter, counter + ONE))]
        self.body.append(Loop(place, "while", f"REPEATB {place.at}", op("LT", counter, times), body))

    def _repeated(self, reader: LineTokens, known: Container[str]) -> tuple[str, Named, Expression]:
        """The label of a repeat, a counter of its own, and how often. Raises ProgramFault for a label that is not known."""
        label = reader.peek()
        reader.next += 1
        if label not in known:
            raise reader.fault(f"there is no label {label} above this line", 0)
        times: Expression = ONE
        if reader.take("P"):
            reader.expect("=")
            times = reader.expression()
        self.counters += 1
        return label, variable(f"_count{self.counters - 1}"), times

    def _until(self, reader: LineTokens) -> None:
        closed = self._close("REPEAT", reader)
        self.body.append(
            Loop(closed.place, "do", f"REPEAT {closed.place.at}", op("NOT", reader.expression()), closed.body)
        )

    def _goto(self, reader: LineTokens) -> None:
        self._jump(reader, self.body)

    def _jump(self, reader: LineTokens, body: list[Statement]) -> None:
        label = reader.peek()
        if not label:
            raise reader.fault("a label is expected here")
        reader.next += 1
        body.append(Goto(reader.place, Number(float(self._number_of(label)))))
