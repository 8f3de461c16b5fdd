"""LinuxCNC's language (RS274NGC with O words) as statements.

    o100 sub ... o100 endsub [value]      o100 call [a] [b] ...      o100 return [value]
    o101 if [c] / elseif [c] / else / endif      o102 while [c] ... endwhile      o103 do ... while [c]
    o104 repeat [n] ... endrepeat         o104 break, continue
    O100 ... M99 and M98 P100 L3: subprograms as other controls write them

A label is a number, a <name>, or an expression where it calls. A call runs the subprogram of that name in the program, else that of the
file name.ngc in the program's folder. Parameters 1 to 30 are a call's own: its arguments, then zeros; so are named parameters that do
not begin with an underscore. M98 shares its caller's.

What LinuxCNC refuses and this reader takes: a subprogram that stands after its call, break and continue in repeat loops.
"""

from __future__ import annotations

import re

from planner.nc.language import tree
from planner.nc.language.linuxcnc.control import KEYWORDS, LinuxcncControl, end_of
from planner.nc.language.linuxcnc.text import ARGUMENTS_MAX, LANGUAGE, SPELLING
from planner.nc.language.source import Source, SourceLine
from planner.nc.language.spelling import LineReader

# What M70 to M73 do with the modes.
_MODES = {70: "save", 71: "forget", 72: "restore", 73: "save until return"}
_PROGRAM = ""


class LinuxcncParser(LinuxcncControl):
    """Statements of one file. Faults of all its lines are kept in `faults`."""

    def __init__(self, source: Source):
        super().__init__()
        self.source = source
        self.faults: list[tree.ProgramFault] = []
        self.plain_sub = ""  # the subprogram of the O100 ... M99 kind that is being read
        self.ended = False  # the main program has ended; subprograms may follow

    def parse(self) -> list[tree.Procedure]:
        """All procedures of the file; the main program first, under the empty name."""
        for item in self.source.in_order():
            if isinstance(item, tree.PlainRows):
                self._plain(item)
                continue
            try:
                self._line(item)
            except tree.ProgramFault as fault:
                self.faults.append(fault)
        for left in self.open[:1] if not self.faults else ():
            self.faults.append(
                tree.ProgramFault(
                    left.place, f"this {left.kind} has no end; write o{left.label} {end_of(left.kind)}"
                )
            )
        return [
            tree.Procedure(_PROGRAM, tree.SourcePlace(self.source.file, 1, 0), self.main),
            *self.procedures.values(),
        ]

    def _plain(self, rows: tree.PlainRows) -> None:
        in_main = self.body is self.main
        if not (in_main and self.ended):
            self.body.append(rows)
        self.ended |= in_main and rows.may_end and self.source.has_end(rows)

    def _line(self, line: SourceLine) -> None:
        reader = LineReader(line, SPELLING)
        reader.take("/")
        if reader.peek() in "oO" and not reader.ended:
            self._o_word(reader, line)
        elif self.ended and self.body is self.main:
            return
        elif line.row >= 0 and not self._code(reader, line):
            words, assignments = reader.words_and_assignments(line.scale)
            for word in words:
                if word.letter == ord("N") and not isinstance(word.value, tree.Number):
                    raise line.fault("a line number is written in digits", word.at)
            if words or assignments:
                self.body.append(tree.Line(line.place, words, assignments))
        self._messages(reader, line)

    def _messages(self, reader: LineReader, line: SourceLine) -> None:
        for comment in reader.comments:
            kind, comma, text = comment.partition(",")
            if comma and kind.strip().upper() in ("DEBUG", "PRINT", "MSG"):
                expanded = kind.strip().upper() != "MSG"
                self.body.append(tree.Message(line.place, _pieces(text) if expanded else (text,)))

    # --- codes that are control flow ------------------------------------------------------------------------------------------

    def _code(self, reader: LineReader, line: SourceLine) -> bool:
        """M70 to M73, M98 and M99 as statements; False if the line has none of them."""
        match = _FLOW.match(reader.text, reader.at)
        if match is None:
            return False
        code = int(match.group(1))
        reader.at = match.end()
        if code in _MODES:
            self._nothing_left(reader, f"M{code}")
            self.body.append(tree.Modes(line.place, _MODES[code]))
        elif code == 98:
            words, _ = reader.words_and_assignments()
            given = {chr(word.letter): word.value for word in words}
            if "P" not in given or set(given) - {"P", "L"}:
                raise line.fault("M98 takes P with the number of a subprogram, and L with its repetitions")
            name = _constant_name(given["P"])
            self.body.append(tree.Call(line.place, name, None, "M98", given.get("L", tree.Number(1.0))))
        else:
            self._nothing_left(reader, "M99")
            if not self.plain_sub:
                raise line.fault("M99 ends a subprogram; the main program ends with M2 or M30")
            self.body.append(tree.Return(line.place))
            if not self.open:
                self.base = self.body = self.main
                self.plain_sub = ""
        return True

    # --- O words ----------------------------------------------------------------------------------------------------------------

    def _o_word(self, reader: LineReader, line: SourceLine) -> None:
        reader.at += 1
        label = self._label(reader)
        at = reader.at
        keyword = reader.keyword()
        if not keyword and reader.ended and isinstance(label, str):
            self._plain_program(label, line)
            return
        if keyword not in KEYWORDS:
            raise reader.refused(f"after an O word one of {', '.join(sorted(KEYWORDS))} is expected", at)
        if keyword == "call":
            self._call(reader, line, label)
        elif not isinstance(label, str):
            raise line.fault("only a call may compute its O word; write a number or a <name>")
        else:
            condition = reader.bracket() if reader.peek() == "[" else None
            self._control(keyword, label, condition, line)
        self._nothing_left(reader, f"o... {keyword}")

    def _label(self, reader: LineReader) -> str | tree.Expression:
        if reader.peek() == "<":
            return reader.name()
        value = reader.value()
        return _constant_name(value) if isinstance(value, tree.Number) else value

    def _plain_program(self, label: str, line: SourceLine) -> None:
        """O100 alone: a program number, or a subprogram if an M99 follows before the next one."""
        if self.open:
            raise line.fault(f"O{label} stands inside {self.open[-1].kind}; write its end before it")
        if self._returns(line):
            self.plain_sub, self.base = label, []
            self._add(label, line.place, self.base)
        else:
            self.plain_sub, self.base = "", self.main
        self.body = self.base

    def _returns(self, line: SourceLine) -> bool:
        match = _NEXT_PROGRAM.search(self.source.words.data, line.start - self.source.begin + len(line.text))
        return match is not None and match.group(1) is not None

    def _call(self, reader: LineReader, line: SourceLine, label: str | tree.Expression) -> None:
        arguments: list[tree.Expression] = []
        while reader.peek() == "[":
            arguments.append(reader.bracket())
        if len(arguments) > ARGUMENTS_MAX:
            raise line.fault(f"{len(arguments)} arguments; at most {ARGUMENTS_MAX}")
        word = f"o<{label}> call" if isinstance(label, str) and not label.isdigit() else "o call"
        if isinstance(label, str) and label.isdigit():
            word = f"o{label} call"
        self.body.append(tree.Call(line.place, label, tuple(enumerate(arguments, 1)), word))

    def _nothing_left(self, reader: LineReader, after: str) -> None:
        if not reader.ended:
            raise reader.refused(f"nothing may follow {after} on its line")


_FLOW = re.compile(r"[Mm](7[0-3]|9[89])(?![\d.])")
_NEXT_PROGRAM = re.compile(
    rb"^[ \t]*(?:(?:N[\d \t]+)?M[ \t]*(99)(?!\d)|O[ \t]*\d+[ \t\r]*(?:\(|;|$))", re.MULTILINE | re.IGNORECASE
)


def _constant_name(value: tree.Expression) -> str | tree.Expression:
    if isinstance(value, tree.Number):
        return f"{value.value:.0f}" if value.value == round(value.value) else f"{value.value:g}"
    return value


_PARAMETER = re.compile(r"#(?:<([^<>]*)>|(\d+))")


def _pieces(text: str) -> tuple[str | tree.Named | tree.Numbered, ...]:
    """The text of a message with its parameters."""
    pieces: list[str | tree.Named | tree.Numbered] = []
    done = 0
    for found in _PARAMETER.finditer(text):
        pieces.append(text[done : found.start()])
        done = found.end()
        if found.group(2):
            number = float(found.group(2))
            pieces.append(
                tree.Numbered(tree.Number(number)) if 1 <= number <= LANGUAGE.largest else found.group()
            )
        else:
            name = re.sub(r"\s", "", found.group(1)).lower()
            pieces.append(tree.Named(name, name.startswith("_")))
    return (*pieces, text[done:])
