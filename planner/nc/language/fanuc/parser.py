"""Macros of Fanuc and Haas as statements: O1000 ... M99, M98 P1000 L3 (P31000), G65, G66 ... G67, M97 P100
(Haas), M99 P200, and IF, THEN, WHILE, GOTO.

#1 to #33 are a call's own. A parameter without a value (#0, or one never assigned) counts as 0 in sums,
differs from 0 for EQ and NE, and a word with such a value is left out. The right side of an assignment needs
no brackets. AND binds as * does, OR and XOR as + does.
"""

import re

from planner.nc.language import tree
from planner.nc.language.fanuc import calls, frames
from planner.nc.language.fanuc.calls import LANGUAGE
from planner.nc.language.makers import corner
from planner.nc.language.run import Dialect
from planner.nc.language.source import LineParser, Source, SourceLine
from planner.nc.language.spelling import LineReader
from planner.nc.language.system_variables import FanucVariables

_PROGRAM = re.compile(r"[O:](\d+)")
_GOTO = re.compile(r"GOTO(\d+)?")
_BEFORE = ("G17", "G18", "G19", "G90", "G91")
_STOP = 3006  # parameter: stop with a message
_NESTED_MAX = 3  # DO 1 to DO 3 in each other, as the control allows
_CALLS = ("M98", "M97", "M99", "G65", "G66")


class FanucParser(LineParser):
    """Makes statements of one file: a procedure for each of its programs (O numbers)."""

    def __init__(self, source: Source):
        super().__init__(source)
        self.procedures: list[tree.Procedure] = []
        self.modal: tree.Call | None = None  # G66
        self.local: list[tuple[int, tree.SourcePlace, tree.Procedure]] = []  # M97
        self.numbers: frozenset[str] = frozenset()
        self.targets: frozenset[int] | None = frozenset()  # labels that are used; None for all
        self.calls_blocks = False  # M97 is used: an M99 may return from it
        self.hidden = 0

    def parse(self) -> list[tree.Procedure]:
        """All procedures of the file; the main program first, under the empty name."""
        items = list(self.source.in_order())
        texts = [item.text.upper().replace(" ", "") for item in items if not isinstance(item, tree.PlainRows)]
        found = filter(None, map(_PROGRAM.match, texts))
        self.numbers = frozenset(str(int(match.group(1))) for match in found)
        self.targets = _targets(texts)
        self.calls_blocks = any("M97" in text for text in texts)
        self._begin("" if self.source.file == 0 else "file", tree.SourcePlace(self.source.file, 1, 0))
        self.read(items)
        self._end_of_program()
        for number, place, procedure in self.local:
            self._local_call(number, place, procedure)
        return self.procedures

    def _begin(self, name: str, place: tree.SourcePlace) -> None:
        self.base = self.body = []
        self.procedures.append(tree.Procedure(name, place, self.body))

    def _end_of_program(self) -> None:
        if self.open:
            number = self.open[0].label
            self.faults.append(tree.ProgramFault(self.open[0].place, f"DO {number} has no END {number}"))
            self.open.clear()
        self.modal = None

    def _local_call(self, number: int, place: tree.SourcePlace, procedure: tree.Procedure) -> None:
        name, body = calls.block_name(number, procedure), procedure.body
        at = [k for k, s in enumerate(body) if isinstance(s, tree.Label) and s.number == number]
        if not at:
            text = f"M97 P{number}: there is no block N{number} in this program"
            self.faults.append(tree.ProgramFault(place, text))
        elif all(known.name != name for known in self.procedures):
            self.procedures.append(tree.Procedure(name, body[at[0]].place, body[at[0] :]))

    def take_plain(self, rows: tree.PlainRows) -> None:
        """Rows without a statement, used labels between them, and G66 calls after those that move."""
        if self.source.file and (self.source.words_of(rows)[0] == ord("%")).all():
            return  # of a file that is called it is no end of the program
        if self.targets == frozenset() and self.modal is None:
            self.body.append(rows)
            return
        begin = rows.first
        for row in range(rows.first, rows.last):
            letters, values = self.source.words.of_rows(row - self.source.first_row)
            number = int(values[0]) if len(letters) and letters[0] == ord("N") else None
            if number is not None and (self.targets is None or number in self.targets):
                if row > begin:
                    self.body.append(self.source.part(rows, begin, row))
                    begin = row
                self.body.append(tree.Label(rows.place, number))
            if self.modal is not None and any(chr(c) in "XYZ" for c in letters):
                self.body += [self.source.part(rows, begin, row + 1), self.modal]
                begin = row + 1
        if begin < rows.last:
            self.body.append(self.source.part(rows, begin, rows.last))

    def take_line(self, line: SourceLine) -> None:
        reader = LineReader(line, LANGUAGE)
        if reader.take("/") and reader.kind() == "number":
            reader.pop()
        program = reader.numbered("O", ":")
        if program is not None:
            self._program(str(program), line)
        label = reader.numbered("N")
        if label is not None and (self.targets is None or label in self.targets):
            self.body.append(tree.Label(line.place, label))
        if not reader.ended and reader.peek() in LANGUAGE.keywords - {"THEN"}:
            self._flow(reader.pop().text, reader, line)
            return
        words, assignments = reader.words_and_assignments(line.scale)
        self.body += [tree.Message(line.place, (text,)) for _, text in reader.messages()]
        if words or assignments:
            self._words(words, assignments, line)

    def _program(self, number: str, line: SourceLine) -> None:
        self._end_of_program()
        only = self.procedures[-1]
        runs = [self.source.words_of(s)[0] for s in only.body if isinstance(s, tree.PlainRows)]
        empty = len(runs) == len(only.body) and all((letters == ord("%")).all() for letters in runs)
        if len(self.procedures) == 1 and empty:
            if self.source.file:
                self.procedures[0] = tree.Procedure(number, line.place, only.body)
            return  # the first program of the file
        if any(known.name == number for known in self.procedures):
            raise line.fault(f"a second program O{number}")
        self._begin(number, line.place)

    def _flow(self, keyword: str, reader: LineReader, line: SourceLine) -> None:
        flow = {"IF": self._if, "WHILE": self._while, "DO": self._do, "END": self._end}
        if keyword in flow:
            flow[keyword](reader, line)
        elif keyword == "GOTO":
            self.body.append(tree.Goto(line.place, reader.value()))
        else:  # output to a file
            self.body.append(tree.Message(line.place, (reader.text,)))
            return
        reader.nothing_left(keyword)

    def _while(self, reader: LineReader, line: SourceLine) -> None:
        condition = _condition_of(reader)
        reader.require(reader.take("DO"), "WHILE [condition] is followed by DO and a number")
        self._do(reader, line, condition)

    def _do(self, reader: LineReader, line: SourceLine, condition: tree.Expression = tree.ONE) -> None:
        number = _loop_number(reader)
        good = all(number != loop.label for loop in self.open) and len(self.open) < _NESTED_MAX
        line.require(
            good, f"DO {number} inside another DO {number}, or more than {_NESTED_MAX} in each other"
        )
        self.begin(tree.OpenStatement("DO", line.place, condition, number))

    def _end(self, reader: LineReader, line: SourceLine) -> None:
        number = _loop_number(reader)
        if not self.open or self.open[-1].label != number:
            raise line.fault(f"END {number} has no DO {number} before it")
        loop = self.close()
        assert loop.condition is not None
        self.add_loop(loop, loop.condition)

    def _if(self, reader: LineReader, line: SourceLine) -> None:
        condition = _condition_of(reader)
        if reader.take("GOTO"):
            body: list[tree.Statement] = [tree.Goto(line.place, reader.value())]
        elif reader.take("THEN"):
            outside, self.body = self.body, []
            self._words(*reader.words_and_assignments(line.scale), line)
            body, self.body = self.body, outside
        else:
            raise reader.fault("IF [condition] is followed by GOTO or THEN")
        self.body.append(tree.If(line.place, ((condition, body),), []))

    def _words(self, words: tree.Words, assignments: tree.Assignments, line: SourceLine) -> None:
        codes = [word.code for word in words]
        called = next((code for code in _CALLS if code in codes), None)
        if called is not None:
            self._call(called, words, line)
            return
        if "G67" in codes:
            self.modal = None
            words = tuple(word for word in words if word.code != "G67")
        stop, none = tree.numbered(_STOP), tree.numbered(0)
        for target, _ in assignments:
            if target == stop:
                words = (*words, tree.word("M", line.place.at, 0.0))
            line.require(target != none, "#0 has no value and cannot be given one")
        assignments = tuple(pair for pair in assignments if pair[0] != stop)
        words = self._frames(words, line)
        before, words = self._corner(words, line)
        self.body += before
        if words or assignments:
            self.body.append(tree.Line(line.place, words, assignments))
        if self.modal is not None and any(word.letter in "XYZ" for word in words):
            self.body.append(self.modal)

    def _frames(self, words: tree.Words, line: SourceLine) -> tree.Words:
        """Codes that set a frame or make a pattern, behind or before the rest of their line, which is left."""
        behind: list[tree.Statement] = []
        for code in [word.code for word in words if word.code in frames.WORDS]:
            if code in frames.PATTERNS and not {"I", "L"} <= {word.letter for word in words}:
                continue
            made, words = frames.statements(code, words, line)
            if frames.WORDS[code] or code == "G16":
                behind += made
            else:
                self.body += made
        if behind:  # planes and G90, G91 hold for the frame; polar coordinates of the line for what it moves
            first = tuple(word for word in words if word.code in _BEFORE or code != "G16")
            words = tuple(word for word in words if word not in first)
            self.body += [tree.Line(line.place, first)] if first else []
        self.body += behind
        return words

    def _corner(self, words: tree.Words, line: SourceLine) -> tuple[list[tree.Statement], tree.Words]:
        """,R and ,C, a rounding or chamfer at the end of the move, and ,A, its angle to the first axis."""
        given = {word.letter: word.value for word in words}
        kinds = ((",R", "RND"), (",C", "CHR"))
        before: list[tree.Statement] = [corner(line.place, k, given[c]) for c, k in kinds if c in given]
        if ",A" in given:
            words = (*words, self._at_angle(given, line))
        return before, tuple(word for word in words if word.letter[0] != ",")

    across = ("X", "Y")  # the axes of the plane that ,A is an angle in
    of_diameter = 1.0  # words of the axis beside the angle per its length

    def _at_angle(self, given: dict[str, tree.Expression], line: SourceLine) -> tree.Word:
        """The coordinate that a move at an angle has not. Raises ProgramFault for two or none."""
        first, second = self.across
        if (first in given) == (second in given):
            text = f",A needs one of {first} and {second}; a move whose end follows from the next line is not read"
            raise line.fault(text)
        here = {c: tree.Numbered(tree.Number(5001.0 + k)) for k, c in enumerate(self.axes)}
        slope = tree.op("TAN", given[",A"]) * tree.Number(self.of_diameter)
        if first in given:
            return tree.Word(second, line.place.at, here[second] + (given[first] - here[first]) * slope)
        return tree.Word(first, line.place.at, here[first] + (given[second] - here[second]) / slope)

    axes = "XYZ"  # of #5001, #5002 ...

    def _call(self, code: str, words: tree.Words, line: SourceLine) -> None:
        program = self.procedures[-1]
        if code == "M98":
            self.body += calls.subprogram(words, line, self.numbers)
        elif code == "M97":
            number, statements = calls.of_block(words, line, program)
            self.local.append((number, line.place, program))
            self.body += statements
        elif code == "M99":
            restarts = program.name == "" and not self.calls_blocks
            self.body += calls.returned(words, line, self.base, restarts=restarts)
        elif code == "G65":
            self.body.append(calls.macro(words, "G65", line))
        else:
            self._modal_call(calls.macro(words, "G66", line), line)

    def _modal_call(self, call: tree.Call, line: SourceLine) -> None:
        """The call that follows every move: its arguments are computed now and kept in names of their own."""
        given = call.arguments or ()
        names = [tree.Named(f"g66 {self.hidden + k}", False) for k in range(1, len(given) + 1)]
        self.hidden += len(given)
        self.body += [tree.assign(line.place, (one, v)) for one, (_, v) in zip(names, given, strict=True)]
        numbers = (number for number, _ in given)
        self.modal = call._replace(arguments=tuple(zip(numbers, names, strict=True)))


def _targets(texts: list[str]) -> frozenset[int] | None:
    """The labels that are used, or None if some are computed: M99 P, M97 P, GOTO."""
    used: set[int] = set()
    for text in texts:
        for found in _GOTO.finditer(text):
            if found.group(1) is None:
                return None
            used.add(int(found.group(1)))
        if ("M99" in text or "M97" in text) and "P" in text:
            return None
    return frozenset(used)


def _condition_of(reader: LineReader) -> tree.Expression:
    """[a] of IF and WHILE, or [a] AND [b] OR [c], from left to right. Raises ProgramFault."""
    condition = reader.bracket()
    while found := next((name for name in ("AND", "OR", "XOR") if reader.take(name)), ""):
        condition = tree.op(found, condition, reader.bracket())
    return condition


def _loop_number(reader: LineReader) -> str:
    value = reader.value() if reader.kind() == "number" else None
    if not isinstance(value, tree.Number) or value.value != int(value.value):
        raise reader.fault("DO and END are followed by a whole number")
    return f"{value.value:.0f}"


DIALECT = Dialect(LANGUAGE, FanucVariables, FanucParser, calls.fanuc_files)
