"""Words, expressions and assignments as RS274NGC and Fanuc macro spell them.

    word       = letter value                        value = [+|-] ( number | parameter | [ expression ] | function )
    parameter  = # value | # < name >                function = NAME [ expression ] | ATAN [ expression ] / [ expression ]
    assignment = parameter = value                   (Fanuc: parameter = expression)

Blanks mean nothing, also inside numbers and names; case means nothing. Operators of one rank are taken from
left to right; a sign belongs to what follows it, so that -2**2 is 4.
"""

import re
from collections.abc import Iterator
from functools import cache

from planner.nc.integers import LENGTHS
from planner.nc.language import tree
from planner.nc.language.source import SourceLine
from planner.nc.language.tokens import Token, TokenReader
from planner.nc.unreadable import of_another

_NUMBER = r"(?:\d+(?:\.\d*)?|\.\d+)(?:(?:e[-+]\d|E[-+]\d\d)\d*(?![\d.]))?"
_PIECE = re.compile(r"\((?P<inner>[^()]*)\)|;(?P<rest>.*)|(?P<open>\()|(?P<kept>[^ \t\r\x1a(;]+)", re.DOTALL)
_LETTERS = re.compile(r"[A-Za-z]+")
LINE = tree.Named("_line", True)  # LinuxCNC's name for the number of the line, which is known here


@cache
def _pattern(names: tuple[str, ...]) -> re.Pattern[str]:
    known, begin = "|".join(sorted(names, key=len, reverse=True)), "".join({name[0] for name in names})
    text = rf"(?P<number>{_NUMBER})|(?P<text><[^<>#()\n]+>)|(?P<name>(?i:(?=[{begin}])(?:{known})))|(?P<letter>[@A-Z^a-z])"
    return re.compile(rf"{text}|(?P<sign>\*\*|.)", re.DOTALL)


class LineReader(TokenReader):
    """Reads one line; `text` are its characters without blanks and comments."""

    opening, closing = "[", "]"

    def __init__(self, line: SourceLine, language: tree.Language):
        self.line, self.language = line, language
        self.pattern = _pattern(
            (*language.functions, *language.keywords, *filter(str.isalpha, language.ranks))
        )
        self.comments: list[str] = []
        self.places: list[int] = []  # of the characters that are left, in the line
        text = ""
        for piece in _PIECE.finditer(line.text):
            if piece["kept"]:
                self.places += range(*piece.span())
                text += piece["kept"]
            elif piece["open"]:
                raise self._comment_fault(piece.start())
            else:
                self.comments.append(piece["inner"] or piece["rest"] or "")
        super().__init__(text)

    def _comment_fault(self, at: int) -> tree.ProgramFault:
        inner, closed, _ = self.line.text[at + 1 :].partition(")")
        if not closed:
            return self._fault(at, "the comment is not closed on its line; write )")
        message = "a comment inside a comment is not allowed; remove the inner parenthesis"
        return self._fault(at + 1 + inner.index("("), message)

    def _fault(self, column: int, message: str) -> tree.ProgramFault:
        column, message = of_another(self.line.text) or (column, message)
        return tree.ProgramFault(self.line.place._replace(at=self.line.start + column), message)

    def fault(self, message: str, at: int | None = None) -> tree.ProgramFault:
        return self._fault(self.place(self.column() if at is None else at), message)

    def place(self, at: int) -> int:
        """Where a character of `text` stands in the line."""
        return self.places[at] if at < len(self.places) else (self.places[-1] + 1 if self.places else 0)

    def messages(self) -> Iterator[tuple[str, str]]:
        """Comments that are messages: DEBUG, PRINT or MSG, and the text."""
        for comment in self.comments:
            kind, comma, text = comment.partition(",")
            if comma and kind.strip().upper() in ("DEBUG", "PRINT", "MSG"):
                yield kind.strip().upper(), text

    def expect(self, text: str, after: str = "") -> None:
        if not self.take(text):
            after = after or ("the expression" if text == self.closing else "this")
            raise self.fault(f"{text} is missing after {after}; {self._comes()} comes instead")

    def _comes(self) -> str:
        return "the end of the line" if self.ended else repr(self.text[self.column()])

    def no_value(self) -> tree.ProgramFault:
        if letters := _LETTERS.match(self.text, self.column()):
            known = ", ".join(sorted(self.language.functions))
            return self.fault(f"{letters[0].upper()} is no function; there are {known}")
        text = "a number, parameter, function or [expression] was expected"
        return self.fault(f"{text}; {self._comes()} comes")

    def operand(self, token: Token) -> tree.Expression | None:
        name = token.text
        if name == "#":
            self.next -= 1
            parameter = self.parameter()
            return tree.Number(float(self.line.place.line)) if parameter == LINE else parameter
        if name == "EXISTS" and name in self.language.functions:
            self.expect("[", name)
            parameter = self.parameter()
            self.expect("]", "the parameter")
            return tree.op(name, parameter)
        if name not in self.language.functions:
            return None
        operands = [self.bracket()]
        if name == "ATAN" and self.take("/"):
            operands.append(self.bracket())
        return tree.op(name, *operands)

    def numbered(self, *letters: str) -> int | None:
        """The whole number behind one of the letters, which are gone past; None if something else comes."""
        if self.peek() not in letters or not self.peek(1).isdecimal():
            return None
        self.pop()
        return int(self.pop().text)

    def name(self) -> str:
        """A name between < and >."""
        if self.kind() != "text":
            raise self.fault("a name is < characters >, such as <depth>")
        name = self.peek()[1:-1].lower()
        if name.startswith(("_hal[", "_ini[")):
            raise self.fault("a signal or setting that only the control knows; write its value")
        self.pop()
        return name

    def parameter(self) -> tree.Parameter:
        """#number, #[expression], ##number or #<name>."""
        at = self.column()
        self.expect("#")
        if self.peek()[:1] == "<":
            name = self.name()
            return tree.Named(name, name.startswith("_"))
        index = self.value()
        if isinstance(index, tree.Number) and index.value != int(index.value):
            raise self.fault("the number of a parameter is a whole number", at)
        return tree.Numbered(index)

    def words_and_assignments(self, scale: float = 1.0) -> tuple[tree.Words, tree.Assignments]:
        """Words and assignments up to the end of the line; lengths without a point count `scale`."""
        words: list[tree.Word] = []
        assignments: list[tuple[tree.Parameter, tree.Expression]] = []
        while not self.ended:
            kind = self.kind()
            if kind == "name":  # a letter and what its value begins with: ASIN[30] is A and SIN[30]
                at = self.column()
                self.tokens[self.next :] = [Token("letter", self.peek()[0], at), *self.split(at + 1)]
            at, letter = self.column(), self.peek()
            if letter == "," and self.peek(1) in self.language.behind_commas:  # a rounding, chamfer or angle
                self.pop()
                letter, kind = "," + self.peek(), "letter"
            if letter == "#":
                target = self.parameter()
                self.expect("=", "the parameter")
                assignments.append((target, self.expression() if self.language.long_values else self.value()))
            elif kind in ("letter", "name"):
                self.pop()
                value = self.value()
                is_length = (
                    ord(letter[-1]) in LENGTHS and letter != ",A" and "." not in self.text[at : self.column()]
                )
                if scale != 1.0 and is_length and isinstance(value, tree.Number):
                    value = tree.Number(value.value * scale)
                words.append(tree.Word(letter, self.line.start + self.place(at), value))
            else:
                raise self.fault(f"{self._comes()} starts neither a word nor an assignment")
        return tuple(words), tuple(assignments)

    def nothing_left(self, after: str) -> None:
        """Raises ProgramFault if more comes."""
        if not self.ended:
            raise self.fault(f"nothing may follow {after} on its line")
