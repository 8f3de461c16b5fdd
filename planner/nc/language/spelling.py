"""Words, expressions and assignments as RS274NGC and Fanuc macro spell them.

    word       = letter value                        value = [+|-] ( number | parameter | [ expression ] | function )
    parameter  = # value | # < name >                function = NAME [ expression ] | ATAN [ expression ] / [ expression ]
    assignment = parameter = value                   (Fanuc: parameter = expression)

Blanks mean nothing, also inside numbers and names; case means nothing. Operators of one rank are taken from
left to right; a sign belongs to what follows it, so that -2**2 is 4.
"""

import re
from collections.abc import Iterator

from planner.nc.integers import LENGTHS
from planner.nc.language import tree
from planner.nc.language.expression_reader import ExpressionReader
from planner.nc.language.source import SourceLine

_NUMBER = re.compile(r"(?:\d+(?:\.\d*)?|\.\d+)(?:(?:e[-+]\d|E[-+]\d\d)\d*(?![\d.]))?")
_NAME = re.compile(r"<([^<>#()\n]+)>")
_LETTERS = re.compile(r"[A-Za-z]+")
_OPERATOR = re.compile(r"\*\*|[-+*/]|MOD|AND|XOR|OR|EQ|NE|GT|GE|LT|LE", re.IGNORECASE)
_BLANK = re.compile(r"[ \t\r\x1a]")
LINE = tree.Named("_line", True)  # LinuxCNC's name for the number of the line, which is known here
_IN_LINES = "; write the expression in several lines"


class LineReader(ExpressionReader):
    """Reads one line from left to right; `at` counts its characters without blanks and comments."""

    def __init__(self, line: SourceLine, language: tree.Language):
        self.line, self.language = line, language
        self.at = 0
        self.comments: list[str] = []
        self.places: list[int] | None = None  # of the characters that are left, in `text`
        text = line.text
        plain = _BLANK.search(text) is None and "(" not in text and ";" not in text
        self.text = text if plain else self._cleaned(text)

    def _cleaned(self, text: str) -> str:
        """The text without blanks and comments; comments are kept."""
        places: list[int] = []
        at, end = 0, len(text)
        while at < end:
            c = text[at]
            if c == ";":
                self.comments.append(text[at + 1 :])
                break
            if c == "(":
                close = text.find(")", at)
                if close < 0:
                    raise self._fault(at, "the comment is not closed on its line; write )")
                inner = text[at + 1 : close]
                if "(" in inner:
                    message = "a comment inside a comment is not allowed; remove the inner parenthesis"
                    raise self._fault(at + 1 + inner.index("("), message)
                self.comments.append(inner)
                at = close
            elif c not in " \t\r\x1a":
                places.append(at)
            at += 1
        self.places = places
        return "".join([text[k] for k in places])

    def messages(self) -> Iterator[tuple[str, str]]:
        """Comments that are messages: DEBUG, PRINT or MSG, and the text."""
        for comment in self.comments:
            kind, comma, text = comment.partition(",")
            if comma and kind.strip().upper() in ("DEBUG", "PRINT", "MSG"):
                yield kind.strip().upper(), text

    def column(self, at: int) -> int:
        """Where a character stands in the text as it was given."""
        if self.places is None:
            return at
        return self.places[at] if at < len(self.places) else (self.places[-1] + 1 if self.places else 0)

    def refused(self, message: str, at: int | None = None) -> tree.ProgramFault:
        return self._fault(self.column(self.at if at is None else at), message)

    def _fault(self, column: int, message: str) -> tree.ProgramFault:
        return tree.ProgramFault(self.line.place._replace(at=self.line.start + column), message)

    @property
    def ended(self) -> bool:
        """True if nothing is left on the line."""
        return self.at >= len(self.text)

    def peek(self) -> str:
        """The next character, or an empty text."""
        return self.text[self.at : self.at + 1]

    def take(self, character: str) -> bool:
        """Go past the character if it comes next."""
        if self.text[self.at : self.at + 1] != character:
            return False
        self.at += 1
        return True

    def expect(self, character: str, after: str) -> None:
        """Go past the character. Raises ProgramFault if another one comes."""
        if not self.take(character):
            found = f"{self.peek()!r}" if not self.ended else "the end of the line"
            raise self.refused(f"{character} is missing after {after}; {found} comes instead")

    def keyword(self) -> str:
        """The letters that come next, in lower case; empty if none."""
        match = _LETTERS.match(self.text, self.at)
        if match is None:
            return ""
        self.at = match.end()
        return match.group().lower()

    def name(self) -> str:
        """A name between < and >."""
        match = _NAME.match(self.text, self.at)
        if match is None:
            raise self.refused("a name is < characters >, such as <depth>")
        name = match.group(1).lower()
        if name.startswith(("_hal[", "_ini[")):
            raise self.refused("a signal or setting that only the control knows; write its value")
        self.at = match.end()
        return name

    def number(self) -> float | None:
        """The number that comes next, without a sign, or None."""
        match = _NUMBER.match(self.text, self.at)
        if match is None:
            return None
        self.at = match.end()
        return float(match.group())

    def value(self) -> tree.Expression:
        c = self.peek()
        if c == "-" or c == "+":
            self.at += 1
            self.deeper(_IN_LINES)
            operand = self.value()
            self.nested -= 1
            return operand if c == "+" else -operand
        if c == "#":
            parameter = self.parameter()
            return tree.Number(float(self.line.place.line)) if parameter == LINE else parameter
        if c == "[":
            return self.bracket()
        number = self.number()
        if number is not None:
            return tree.Number(number)
        if c.isalpha():
            return self._function()
        found = f"{c!r}" if c else "the end of the line"
        raise self.refused(f"a number, parameter, function or [expression] was expected; {found} comes")

    def bracket(self) -> tree.Expression:
        """[expression]"""
        self.expect("[", "this")
        self.deeper(_IN_LINES)
        found = self.expression()
        self.nested -= 1
        self.expect("]", "the expression")
        return found

    def parameter(self) -> tree.Parameter:
        """#number, #[expression], ##number or #<name>."""
        at = self.at
        self.expect("#", "this")
        if self.peek() == "<":
            name = self.name()
            return tree.Named(name, name.startswith("_"))
        self.deeper(_IN_LINES)
        index = self.value()
        self.nested -= 1
        if isinstance(index, tree.Number) and index.value != int(index.value):
            raise self.refused("the number of a parameter is a whole number", at)
        return tree.Numbered(index)

    def _function(self) -> tree.Expression:
        at = self.at
        name = self.keyword().upper()
        if name not in self.language.functions:
            known = ", ".join(sorted(self.language.functions))
            raise self.refused(f"{name} is no function; there are {known}", at)
        if name == "EXISTS":
            self.expect("[", name)
            parameter = self.parameter()
            self.expect("]", "the parameter")
            return tree.Exists(parameter)
        operands = [self.bracket()]
        if name == "ATAN" and self.take("/"):
            operands.append(self.bracket())
        return tree.op(name, *operands)

    def operator(self) -> str:
        match = None if self.peek() == "]" else _OPERATOR.match(self.text, self.at)
        return match.group().upper() if match else ""

    def skip(self, operator: str) -> None:
        self.at += len(operator)

    def words_and_assignments(self, scale: float = 1.0) -> tuple[tree.Words, tree.Assignments]:
        """Words and assignments up to the end of the line; lengths without a point count `scale`."""
        words: list[tree.Word] = []
        assignments: list[tuple[tree.Parameter, tree.Expression]] = []
        while not self.ended:
            at, c = self.at, self.peek()
            if c == "#":
                target = self.parameter()
                self.expect("=", "the parameter")
                assignments.append((target, self.expression() if self.language.long_values else self.value()))
            elif c.isalpha() and c.isascii():
                self.at += 1
                letter, value = c.upper(), self.value()
                is_length = ord(letter) in LENGTHS and "." not in self.text[at : self.at]
                if scale != 1.0 and is_length and isinstance(value, tree.Number):
                    value = tree.Number(value.value * scale)
                words.append(tree.Word(letter, self.line.start + self.column(at), value))
            else:
                raise self.refused(f"{c!r} starts neither a word nor an assignment", at)
        return tuple(words), tuple(assignments)
