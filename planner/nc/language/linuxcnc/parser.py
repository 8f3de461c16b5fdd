"""LinuxCNC's language (RS274NGC with O words) as statements; O100 ... M99 and M98 P100 L3, too, as other
controls write subprograms.

A label is a number, a <name>, or an expression where it calls. A call runs the subprogram of that name in the
program, else that of the file name.ngc in its folder. Parameters 1 to 30 are a call's own: its arguments,
then zeros; so are named parameters without an underscore. M98 shares its caller's.
"""

import re

from planner.nc.language import tree
from planner.nc.language.expressions import ARITHMETIC, COMPARISONS, LOGICAL
from planner.nc.language.run import Dialect
from planner.nc.language.source import LineParser, Source, SourceLine
from planner.nc.language.spelling import LineReader
from planner.nc.language.system_variables import LinuxcncVariables
from planner.nc.language.tokens import names, ranked
from planner.nc.language.tree import Language

ARGUMENTS_MAX = 30  # #1 to #30 are a call's own
_ENDS = {"endsub": "sub", "endif": "if", "endwhile": "while", "endrepeat": "repeat"}
KEYWORDS = names("sub call return if elseif else while do repeat break continue") | _ENDS.keys()
EQUAL = 1e-4  # EQ and NE take numbers this close as equal, as LinuxCNC does
LANGUAGE = Language(
    operations=ARITHMETIC
    | {("EQ", 2): f"(abs({{0}}-{{1}})<{EQUAL!r})", ("NE", 2): f"(abs({{0}}-{{1}})>={EQUAL!r})"},
    ranks=ranked("AND OR XOR", "EQ NE GT GE LT LE", "+ -", "* / MOD", "**"),
    functions=names("ABS ACOS ASIN ATAN COS EXISTS EXP FIX FUP LN ROUND SIN SQRT TAN"),
    conditions=COMPARISONS | LOGICAL,
    locals=ARGUMENTS_MAX,
    largest=5601,
    system_numbers=LinuxcncVariables.numbers,
    system_names=LinuxcncVariables.names,
    keywords=frozenset(map(str.upper, KEYWORDS)),
)
# What M70 to M73 do with the modes.
_MODES = {70: "save", 71: "forget", 72: "restore", 73: "save until return"}
_FLOW = frozenset(("98", "99", *map(str, _MODES)))  # numbers of M codes that are statements
_NEXT_PROGRAM = re.compile(
    rb"^[ \t]*(?:(?:N[\d \t]+)?M[ \t]*(99)(?!\d)|O[ \t]*\d+[ \t\r]*(?:\(|;|$))", re.MULTILINE | re.IGNORECASE
)
_PARAMETER = re.compile(r"#(?:<([^<>]*)>|(\d+))")


def _needed(condition: tree.Expression | None, keyword: str, line: SourceLine) -> tree.Expression:
    if condition is None:
        raise line.fault(f"{keyword} needs an [expression] after it")
    return condition


class LinuxcncParser(LineParser):
    """Makes statements of one file: the main program, and its subprograms by their labels."""

    def __init__(self, source: Source):
        super().__init__(source)
        self.procedures: dict[str, tree.Procedure] = {}  # subprograms by their labels
        self.plain_sub = ""  # the subprogram of the O100 ... M99 kind that is being read
        self.ended = False  # the main program has ended; subprograms may follow

    def _add(self, label: str, place: tree.SourcePlace, body: list[tree.Statement]) -> None:
        if label in self.procedures:
            first = self.procedures[label].place.line
            raise tree.ProgramFault(place, f"a second subprogram o{label}; the first is on line {first}")
        self.procedures[label] = tree.Procedure(label, place, body)

    def _control(self, keyword: str, label: str, condition: tree.Expression | None, line: SourceLine) -> None:
        top = self.open[-1] if self.open else None
        if keyword == "while" and top is not None and top.kind == "do" and top.label == label:
            self.close()
            self.body.append(tree.Loop(top.place, "do", label, _needed(condition, keyword, line), top.body))
        elif keyword in ("sub", "if", "while", "do", "repeat"):
            self._begin(keyword, label, condition, line)
        elif keyword in ("elseif", "else"):
            branch = self._innermost("if", keyword, label, line)
            if branch.condition is None:
                raise line.fault(f"{keyword} after else; else comes last")
            branch.another_branch(_needed(condition, keyword, line) if keyword == "elseif" else None)
            self.body = branch.body
        elif keyword in _ENDS:
            self._end(keyword, label, condition, line)
        elif keyword == "return":
            line.require(any(o.kind == "sub" for o in self.open), "return stands in a subprogram only")
            self.body.append(tree.Return(line.place, condition))
        else:
            if not any(o.kind in ("while", "do", "repeat") and o.label == label for o in self.open):
                raise line.fault(f"there is no loop o{label} around this {keyword}")
            self.body.append(tree.Leave(line.place, label, keyword == "continue"))

    def _begin(self, keyword: str, label: str, condition: tree.Expression | None, line: SourceLine) -> None:
        if keyword == "sub" and self.open:
            raise line.fault(f"a subprogram begins inside {self.open[-1].kind}; write its end before it")
        if keyword not in ("sub", "do"):
            _needed(condition, keyword, line)
        opened = self.begin(tree.OpenStatement(keyword, line.place, condition, label))
        if keyword == "sub":
            self._add(label, line.place, opened.body)

    def _end(self, keyword: str, label: str, condition: tree.Expression | None, line: SourceLine) -> None:
        kind = _ENDS[keyword]
        top = self._innermost(kind, keyword, label, line)
        self.close()
        if kind == "if":
            self.body.append(top.branched())
        elif kind != "sub":
            assert top.condition is not None
            self.body.append(tree.Loop(top.place, kind, label, top.condition, top.body))
        elif condition is not None:
            top.body.append(tree.Return(line.place, condition))

    def _innermost(self, kind: str, keyword: str, label: str, line: SourceLine) -> tree.OpenStatement:
        top = self.open[-1] if self.open else None
        if top is None or top.kind != kind or top.label != label:
            last = f"o{top.label} {top.kind} on line {top.place.line} is open" if top else "nothing is open"
            raise line.fault(f"o{label} {keyword} has no o{label} {kind} before it: {last}")
        return top

    def parse(self) -> list[tree.Procedure]:
        """All procedures of the file; the main program first, under the empty name."""
        self.read(self.source.in_order())
        for left in self.open[:1] if not self.faults else ():
            end = "while [condition]" if left.kind == "do" else f"end{left.kind}"
            text = f"this {left.kind} has no end; write o{left.label} {end}"
            self.faults.append(tree.ProgramFault(left.place, text))
        main = tree.Procedure("", tree.SourcePlace(self.source.file, 1, 0), self.main)
        return [main, *self.procedures.values()]

    def take_plain(self, rows: tree.PlainRows) -> None:
        in_main = self.body is self.main
        if not (in_main and self.ended):
            self.body.append(rows)
        letter, value = self.source.words_of(rows)
        ends = ((letter == ord("M")) & ((value == 2.0) | (value == 30.0))).any()
        self.ended |= in_main and rows.may_end and bool(ends)

    def take_line(self, line: SourceLine) -> None:
        reader = LineReader(line, LANGUAGE)
        reader.take("/")
        if reader.take("O"):
            self._o_word(reader, line)
        elif self.ended and self.body is self.main:
            return
        elif line.row >= 0 and not self._code(reader, line):
            words, assignments = reader.words_and_assignments(line.scale)
            for word in words:
                if word.letter == "N" and not isinstance(word.value, tree.Number):
                    raise line.fault("a line number is written in digits", word.at)
            if words or assignments:
                self.body.append(tree.Line(line.place, words, assignments))
        self._messages(reader, line)

    def _messages(self, reader: LineReader, line: SourceLine) -> None:
        for kind, text in reader.messages():
            self.body.append(tree.Message(line.place, (text,) if kind == "MSG" else _pieces(text)))

    def _code(self, reader: LineReader, line: SourceLine) -> bool:
        code = int(reader.peek(1)) if reader.peek() == "M" and reader.peek(1) in _FLOW else 0
        if not code:
            return False
        reader.next += 2
        if code in _MODES:
            reader.nothing_left(f"M{code}")
            self.body.append(tree.Modes(line.place, _MODES[code]))
        elif code == 98:
            words, _ = reader.words_and_assignments()
            given = {word.letter: word.value for word in words}
            if "P" not in given or set(given) - {"P", "L"}:
                raise line.fault("M98 takes P with the number of a subprogram, and L with its repetitions")
            name = _constant_name(given["P"])
            self.body.append(tree.Call(line.place, name, None, "M98", given.get("L", tree.Number(1.0))))
        else:
            reader.nothing_left("M99")
            line.require(self.plain_sub, "M99 ends a subprogram; the main program ends with M2 or M30")
            self.body.append(tree.Return(line.place))
            if not self.open:
                self.base = self.body = self.main
                self.plain_sub = ""
        return True

    def _o_word(self, reader: LineReader, line: SourceLine) -> None:
        label = self._label(reader)
        if reader.ended and isinstance(label, str):
            self._plain_program(label, line)
            return
        keyword = reader.peek().lower()
        if keyword not in KEYWORDS:
            raise reader.fault(f"after an O word one of {', '.join(sorted(KEYWORDS))} is expected")
        reader.pop()
        if keyword == "call":
            self._call(reader, line, label)
        elif not isinstance(label, str):
            raise line.fault("only a call may compute its O word; write a number or a <name>")
        else:
            condition = reader.bracket() if reader.peek() == "[" else None
            self._control(keyword, label, condition, line)
        reader.nothing_left(f"o... {keyword}")

    def _label(self, reader: LineReader) -> str | tree.Expression:
        if reader.peek()[:1] == "<":
            return reader.name()
        value = reader.value()
        return _constant_name(value) if isinstance(value, tree.Number) else value

    def _plain_program(self, label: str, line: SourceLine) -> None:
        """O100 alone: a program number, or a subprogram if an M99 follows before the next one."""
        if self.open:
            raise line.fault(f"O{label} stands inside {self.open[-1].kind}; write its end before it")
        behind = line.start - self.source.begin + len(line.text)
        following = _NEXT_PROGRAM.search(self.source.words.data, behind)
        if following is not None and following.group(1) is not None:
            self.plain_sub, self.base = label, []
            self._add(label, line.place, self.base)
        else:
            self.plain_sub, self.base = "", self.main
        self.body = self.base

    def _call(self, reader: LineReader, line: SourceLine, label: str | tree.Expression) -> None:
        arguments: list[tree.Expression] = []
        while reader.peek() == "[":
            arguments.append(reader.bracket())
        line.require(len(arguments) <= ARGUMENTS_MAX, f"{len(arguments)} arguments; at most {ARGUMENTS_MAX}")
        name = "" if not isinstance(label, str) else label if label.isdigit() else f"<{label}>"
        self.body.append(tree.Call(line.place, label, tuple(enumerate(arguments, 1)), f"o{name} call"))


def _constant_name(value: tree.Expression) -> str | tree.Expression:
    if isinstance(value, tree.Number):
        return f"{value.value:.0f}" if value.value == round(value.value) else f"{value.value:g}"
    return value


def _pieces(text: str) -> tuple[str | tree.Named | tree.Numbered, ...]:
    pieces: list[str | tree.Named | tree.Numbered] = []
    done = 0
    for found in _PARAMETER.finditer(text):
        pieces.append(text[done : found.start()])
        done = found.end()
        if found[2]:
            known = 1 <= int(found[2]) <= LANGUAGE.largest
            pieces.append(tree.numbered(int(found[2])) if known else found[0])
        else:
            name = re.sub(r"\s", "", found[1]).lower()
            pieces.append(tree.Named(name, name.startswith("_")))
    return (*pieces, text[done:])


DIALECT = Dialect(LANGUAGE, LinuxcncVariables, LinuxcncParser, lambda name: frozenset({f"{name}.ngc"}))
