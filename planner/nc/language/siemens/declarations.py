"""Variables of a Sinumerik program and of its subprograms: DEF, PROC, what a call hands over and what it gets back."""

import math
import re
from collections.abc import Sequence

from planner.nc.language import tree
from planner.nc.language.siemens import text
from planner.nc.language.siemens.text import TEXT, LineTokens, handed_over, variable
from planner.nc.language.source import Source

TYPES = frozenset(("REAL", "INT", "BOOL"))
TEXTS = frozenset(("STRING", "CHAR", "AXIS", "FRAME"))
_COMPENSATES = re.compile(rb"G4[12]\b")


class Declarations(text.SiemensControl):
    """Declared variables, and the state of the text above a line."""

    def __init__(self, source: Source):
        super().__init__(source)
        self.names: text.Names = {}  # of the variables
        self.array_values = 0  # of arrays so far
        self.fastest: tree.Expression | None = None  # speed of the spindle under G96 (LIMS)
        self.handed_back: list[tuple[tree.Parameter, tree.Expression]] = []  # values of PROC at its end
        self.absolute = True  # G90 is in force
        self.unit = 1.0  # mm per unit of the program
        self.cycle: list[tree.Statement] | None = None  # of MCALL, which follows every row that moves
        self.compensates = bool(_COMPENSATES.search(source.words.data))  # the file has G41 or G42

    def _define(self, reader: LineTokens) -> None:
        while reader.peek() in ("CHAN", "NCK", "SYNR", "SYNW", "SYNRW"):
            reader.pop()
        kind = reader.pop().text
        if kind not in TYPES | TEXTS:
            raise reader.fault(f"DEF {kind} is not read; read are {', '.join(sorted(TYPES | TEXTS))}", 0)
        if kind == "STRING":
            self._sizes(reader)
        while True:
            if reader.kind() not in ("name", "word"):
                raise reader.fault("the name of a variable is expected here")
            name = reader.pop().text
            self._declare(reader, name, kind)
            if not reader.take(","):
                return

    def _declare(self, reader: LineTokens, name: str, kind: str) -> None:
        """A variable, its sizes and its first values."""
        sizes = self._sizes(reader)
        if kind in TEXTS:
            self.names[name] = TEXT
            if reader.take("="):
                self._text_value(reader)
            return
        if not sizes:
            self.names[name] = (0, ())
            value = reader.expression() if reader.take("=") else tree.ZERO
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
            return [(target, reader.expression())]
        assert isinstance(target, tree.Numbered)
        if (at := _constant(target.index)) is None:
            raise reader.fault(f"{kind} begins at a place that is a number here: {name}[0]={kind}(...)", 0)
        left = first + math.prod(sizes) - round(at)
        reader.next += kind != "("
        given = [tree.ZERO if one is None else one for one in self._arguments(reader)]
        if not 0 < len(given) <= left:
            raise reader.fault(f"{kind} gives {len(given)} values; {name} has {left} from there on", 0)
        values = given[:1] * left if kind == "REP" else given
        return [(tree.Numbered(tree.Number(at + k)), value) for k, value in enumerate(values)]

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
            if not reader.take(",") and reader.peek() != ")":
                raise reader.fault(") is missing")
        return given

    def _procedure(self, reader: LineTokens) -> None:
        """PROC NAME([VAR] type name, ...) and its attributes. What VAR names is the caller's behind it."""
        if reader.kind() not in ("name", "word"):
            raise reader.fault("PROC is followed by the subprogram's name")
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
                k, back = len(taken), tree.ONE if by_name else tree.ZERO
                taken.append((variable(name), handed_over(k)))
                self.handed_back += [(handed_over(k), variable(name)), (changed(k), back)]
                if not reader.take(",") and reader.peek() != ")":
                    raise reader.fault(") is missing")
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
