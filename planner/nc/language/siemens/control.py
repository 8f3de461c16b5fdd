"""Statements of a Sinumerik program that decide what comes next, and the variables of it and of its subprograms:
DEF, PROC, what a call hands over and what it gets back."""

import math
import re
from collections.abc import Sequence

from planner.nc.language import tree
from planner.nc.language.siemens import text
from planner.nc.language.siemens.text import TEXT, LineTokens, handed_over, variable
from planner.nc.language.source import LineParser, Source

TYPES = frozenset(("REAL", "INT", "BOOL"))
TEXTS = frozenset(("STRING", "CHAR", "AXIS", "FRAME"))
_COMPENSATES = re.compile(rb"G4[12]\b")


class Control(LineParser):
    """Branches, loops, jumps, repeated sections; declared variables; and the state of the text above a line."""

    def __init__(self, source: Source):
        super().__init__(source)
        self.labels: dict[str, int] = {}  # their numbers in the tree, by name
        self.counters = 0  # how many sections are repeated by their labels
        # where the statements of lines with labels stand: a body, and the first and behind the last of them
        self.lines: dict[str, tuple[list[tree.Statement], int, int]] = {}
        self.names: text.Names = {}  # of the variables
        self.whole: set[str] = set()  # variables of the kind INT
        self.array_values = 0  # of arrays so far
        self.fastest: tree.Expression | None = None  # speed of the spindle under G96 (LIMS)
        self.handed_back: list[tuple[tree.Parameter, tree.Expression]] = []  # values of PROC at its end
        self.absolute = True  # G90 is in force
        # what F is multiplied with: under G70 and G71 it stays in the unit that the control starts with
        self.feed_factor = 1.0
        self.inverse_time = False  # G93 is in force
        self.cycle: list[tree.Statement] | None = None  # of MCALL, which follows every row that moves
        self.compensates = bool(_COMPENSATES.search(source.words.data))  # the file has G41 or G42

    def _number_of(self, label: str) -> int:
        return self.labels.setdefault(label, len(self.labels) + 1)

    def _begin(self, kind: str, reader: LineTokens, condition: tree.Expression | None) -> tree.OpenStatement:
        return self.begin(tree.OpenStatement(kind, reader.place, condition))

    def _close(self, kind: str, reader: LineTokens) -> tree.OpenStatement:
        reader.require(self.open and self.open[-1].kind == kind, f"there is no {kind} open that this ends", 0)
        return self.close()

    def _if(self, reader: LineTokens) -> None:
        condition = reader.expression()
        if reader.peek().startswith("GOTO"):
            reader.pop()
            self.body.append(tree.If(reader.place, ((condition, [self._jump(reader)]),), []))
        else:
            self._begin("IF", reader, condition)

    def _else(self, reader: LineTokens) -> None:
        if not self.open or self.open[-1].kind != "IF" or self.open[-1].condition is None:
            raise reader.fault("there is no IF open that this belongs to", 0)
        self.open[-1].another_branch(None)
        self.body = self.open[-1].body

    def _end_if(self, reader: LineTokens) -> None:
        branch = self._close("IF", reader).branched()
        self.body.append(branch)

    def _end_loop(self, reader: LineTokens) -> None:
        closed = self._close(reader.peek(-1).removeprefix("END"), reader)
        assert closed.condition is not None
        self.add_loop(closed, closed.condition)

    def _for(self, reader: LineTokens) -> None:
        target = reader.parameter(reader.tokens[reader.next])
        if target is None:
            raise reader.fault("FOR needs a variable that is declared")
        name = reader.pop().text
        reader.expect("=")
        first = self._kept(name, reader.expression())
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
        """REPEAT ... UNTIL, or REPEAT label P=n: the lines from the label to here (or to ENDLABEL, or to
        the line of a second label), n times more."""
        if reader.ended:
            self._begin("REPEAT", reader, None)
            return
        label, last, counter, times = self._repeated(reader)
        if last or "ENDLABEL" in self.lines:
            self._repeat_lines(reader, self._lines_between(reader, label, last or "ENDLABEL"), counter, times)
        else:
            self.body.append(tree.repeated(reader.place, counter, times, self.labels[label]))

    def _repeat_block(self, reader: LineTokens) -> None:
        label, _, counter, times = self._repeated(reader)
        self._repeat_lines(reader, self._lines_between(reader, label, label), counter, times)

    def _call_block(self, reader: LineTokens) -> None:
        """CALL BLOCK label TO label: the lines between, once."""
        label = reader.pop().text
        reader.expect("TO")
        self.body += self._lines_between(reader, label, reader.pop().text)

    def _lines_between(self, reader: LineTokens, first: str, last: str) -> list[tree.Statement]:
        """The statements from a label to the line of another one."""
        for name in (first, last):
            reader.require(name in self.lines, f"there is no label {name} above this line", 0)
        body, begin, end = *self.lines[first][:2], self.lines[last][2]
        found: list[tree.Statement] = [one for one in body[begin:end] if not isinstance(one, tree.Label)]
        jumps = any(isinstance(one, tree.Goto) for one in tree.statements_in(found))
        if jumps or body is not self.lines[last][0]:
            raise reader.fault(f"lines {first} to {last} jump, or lie in different loops; write them out", 0)
        return found

    def _repeat_lines(
        self, reader: LineTokens, lines: list[tree.Statement], counter: tree.Named, times: tree.Expression
    ) -> None:
        self.body.append(tree.assign(reader.place, (counter, tree.ZERO)))
        body = [*lines, tree.assign(reader.place, (counter, counter + tree.ONE))]
        opened = tree.OpenStatement("REPEATB", reader.place, None, body=body)
        self.add_loop(opened, tree.op("LT", counter, times))

    def _repeated(self, reader: LineTokens) -> tuple[str, str, tree.Named, tree.Expression]:
        """The label of a repeat, a second one, its counter, and how often. Raises ProgramFault for unknown
        labels."""
        label, last = reader.pop().text, ""
        reader.require(label in self.labels, f"there is no label {label} above this line", 0)
        if reader.peek() in self.labels:
            last = reader.pop().text
        times = reader.times()
        self.counters += 1
        return label, last, variable(f"_count{self.counters - 1}"), times

    def _until(self, reader: LineTokens) -> None:
        closed = self._close("REPEAT", reader)
        self.add_loop(closed, tree.op("NOT", reader.expression()), "do")

    def _jump(self, reader: LineTokens) -> tree.Goto:
        reader.require(not reader.ended, "a label is expected here")
        label = reader.pop().text.strip('"').upper()
        return tree.Goto(reader.place, tree.number(self._number_of(label)))

    def _case(self, reader: LineTokens) -> None:
        """CASE value OF 1 GOTOF label ... DEFAULT GOTOF label."""
        value = reader.expression()
        reader.expect("OF")
        branches: list[tuple[tree.Expression, list[tree.Statement]]] = []
        otherwise: list[tree.Statement] = []
        while not reader.ended:
            condition = None if reader.take("DEFAULT") else tree.op("EQ", value, reader.value())
            reader.require(reader.peek().startswith("GOTO"), "GOTOF or GOTOB and a label are expected here")
            reader.pop()
            body: list[tree.Statement] = [self._jump(reader)]
            if condition is None:
                otherwise = body
            else:
                branches.append((condition, body))
        self.body.append(tree.If(reader.place, tuple(branches), otherwise))

    def _define(self, reader: LineTokens) -> None:
        while reader.peek() in ("CHAN", "NCK", "SYNR", "SYNW", "SYNRW"):
            reader.pop()
        kind = reader.pop().text
        if kind not in TYPES | TEXTS:
            raise reader.fault(f"DEF {kind} is not read; read are {', '.join(sorted(TYPES | TEXTS))}", 0)
        if kind == "STRING":
            self._sizes(reader)
        while True:
            reader.require(reader.kind() in ("name", "word"), "the name of a variable is expected here")
            name = reader.pop().text
            self._declare(reader, name, kind)
            if not reader.take(","):
                return

    def _declare(self, reader: LineTokens, name: str, kind: str) -> None:
        """A variable, its sizes and its first values."""
        sizes = self._sizes(reader)
        self.whole = self.whole | {name} if kind == "INT" else self.whole - {name}
        if kind in TEXTS:
            self.names[name] = TEXT
            if reader.take("="):
                self._text_value(reader)
            return
        if not sizes:
            self.names[name] = (0, ())
            value = self._kept(name, reader.expression()) if reader.take("=") else tree.ZERO
            self.body.append(tree.assign(reader.place, (variable(name), value)))
            return
        count = math.prod(map(round, sizes))
        if (
            count < 1
            or self.array_values + count > text.ARRAY_VALUES
            or self.source.file >= text.FILES_WITH_ARRAYS
        ):
            raise reader.fault(f"arrays of a file hold at most {text.ARRAY_VALUES} values here", 0)
        first = text.FIRST_ARRAY + self.source.file * text.ARRAY_VALUES + self.array_values
        self.array_values += count
        self.names[name] = first, tuple(round(size) for size in sizes)
        places = [tree.numbered(first + k) for k in range(count)]
        pairs: tree.Assignments = tuple((one, tree.ZERO) for one in places)
        if reader.take("="):
            pairs += tuple(self._assigned(reader, name, places[0], ("SET", "REP", "(")))
        self.body.append(tree.assign(reader.place, *pairs))

    def _sizes(self, reader: LineTokens) -> list[float]:
        """Whole numbers in square brackets, if any come."""
        found: list[float] = []
        while reader.take("[" if not found else ","):
            size = reader.expression()
            if not isinstance(size, tree.Number):
                raise reader.fault("the size of an array is a number here", 0)
            found.append(size.value)
        if found:
            reader.expect("]")
        return found

    def _assigned(
        self, reader: LineTokens, name: str, target: tree.Parameter, kinds: Sequence[str] = ("SET", "REP")
    ) -> list[tuple[tree.Parameter, tree.Expression]]:
        """What is given to a variable; SET(a, b, ...) and REP(a) give values to an array from a place on, and
        brackets alone where it is defined (`kinds`)."""
        kind, (first, sizes) = reader.peek(), self.names.get(name, (0, ()))
        if kind not in kinds or kind in self.names or not first:
            return [(target, self._kept(name, reader.expression()))]
        assert isinstance(target, tree.Numbered)
        if (at := _constant(target.index)) is None:
            raise reader.fault(f"{kind} begins at a place that is a number here: {name}[0]={kind}(...)", 0)
        left = first + math.prod(sizes) - round(at)
        reader.next += kind != "("
        given = [tree.ZERO if one is None else one for one in self._arguments(reader)]
        if not 0 < len(given) <= left:
            raise reader.fault(f"{kind} gives {len(given)} values; {name} has {left} from there on", 0)
        values = given[:1] * left if kind == "REP" else given
        return [
            (tree.Numbered(tree.Number(at + k)), self._kept(name, value)) for k, value in enumerate(values)
        ]

    def _kept(self, name: str, value: tree.Expression) -> tree.Expression:
        """What a variable of that name keeps of a value: of the kind INT the nearest whole number."""
        whole = isinstance(value, tree.Number) and value.value.is_integer()
        return tree.op("ROUND", value) if name in self.whole and not whole else value

    def _text_value(self, reader: LineTokens) -> None:
        """Go past a text; what the control computes of texts moves nothing."""
        while not reader.ended and not (reader.kind() == "name" and reader.peek(1) == "="):
            reader.pop()

    def _arguments(self, reader: LineTokens) -> list[tree.Expression | None]:
        """The arguments in the brackets behind a cycle; None for what is left out or a text."""
        given: list[tree.Expression | None] = []
        if not reader.take("("):
            return given
        while not reader.take(")"):
            is_text = reader.kind() == "text" or self.names.get(reader.peek()) == TEXT
            reader.next += is_text
            given.append(None if is_text or reader.peek() == "," else reader.expression())
            reader.require(reader.take(",") or reader.peek() == ")", ") is missing")
        return given

    def _procedure(self, reader: LineTokens) -> None:
        """PROC NAME([VAR] type name, ...) and its attributes. What VAR names is the caller's behind it."""
        reader.require(reader.kind() in ("name", "word"), "PROC is followed by the subprogram's name")
        reader.pop()
        taken: list[tuple[tree.Parameter, tree.Expression]] = []
        if reader.take("("):
            while not reader.take(")"):
                by_name, kind = reader.take("VAR"), reader.pop().text
                if kind == "STRING":
                    self._sizes(reader)
                name = reader.pop().text
                if kind not in TYPES | TEXTS or not name or reader.peek() in ("[", "="):
                    kinds = f"a value of PROC is one of {', '.join(sorted(TYPES | TEXTS))} and a name"
                    raise reader.fault(f"{kinds}; arrays and values that a call may leave out are not read")
                self.names[name] = TEXT if kind in TEXTS else (0, ())
                self.whole |= {name} if kind == "INT" else set()
                k, back = len(taken), tree.ONE if by_name else tree.ZERO
                taken.append((variable(name), self._kept(name, handed_over(k))))
                self.handed_back += [(handed_over(k), variable(name)), (changed(k), back)]
                reader.require(reader.take(",") or reader.peek() == ")", ") is missing")
        reader.leave()  # SAVE, DISPLOF and others
        if taken:
            self.body.append(tree.assign(reader.place, *taken))

    def _return(self, reader: LineTokens) -> None:
        if self.handed_back:
            self.body.append(tree.assign(reader.place, *self.handed_back))
        self.body.append(tree.Return(reader.place))


def _constant(index: tree.Expression) -> float | None:
    """The place of a value in an array that is written in numbers; None for one that is computed."""
    if isinstance(index, tree.Number):
        return index.value
    if not isinstance(index, tree.Operation) or index.name not in ("+", "*", "INDEX"):
        return None
    left, right = map(_constant, index.operands)
    if left is None or right is None:
        return None
    return {"+": left + right, "*": left * right, "INDEX": left}[index.name]


def changed(number: int) -> tree.Named:
    """1 where a subprogram has changed the value of that number for its caller (VAR)."""
    return tree.Named(f"_changed {number}", True)
