"""One reader for the lines of all languages: a text in tokens, and expressions by the ranks of their operators
(Pratt's method). A dialect gives the pattern of its tokens, its brackets and the values that it knows; ranks,
functions and constants stand in its table (`tree.Language`)."""

import re
from typing import NamedTuple

from planner.nc.language.tree import Expression, Language, Number, Operation, ProgramFault

NESTED_MAX = 40  # brackets in brackets; 255 characters, RS274NGC's lines, hold no more that means anything
OPERATIONS_MAX = 80  # one inside the other: Python compiles no more brackets than 200


def ranked(*names: str) -> dict[str, int]:
    """Ranks of operators from 1, of texts of names with blanks between; higher ones bind first."""
    return {name: rank for rank, of_rank in enumerate(names, start=1) for name in of_rank.split()}


def names(text: str) -> frozenset[str]:
    """Names with blanks between."""
    return frozenset(text.split())


class Token(NamedTuple):
    """A piece of a line."""

    kind: str  # "word" (a letter and its number), "letter", "number", "name", "text" or "sign"
    text: str  # as it is written, in capitals; a text as it stands
    at: int  # where it begins in the line


class TokenReader:
    """Reads a text that is split into tokens, from left to right.

    language         : the table of the dialect
    pattern          : of a token behind blanks; the names of its groups are kinds
    opening, closing : the brackets of expressions
    pieces           : what long expressions are divided into, for messages
    tokens, next     : the pieces, with two of no kind behind the last; and which of them comes
    """

    language: Language
    pattern: re.Pattern[str]
    opening, closing = "(", ")"
    pieces = "lines"
    nested = 0  # brackets, signs and functions that are open

    def __init__(self, text: str, at: int = 0):
        self.text, self.next = text, 0
        self.tokens = self.split(at)

    def split(self, at: int) -> list[Token]:
        """The tokens from a character on. Raises the fault of one that begins none."""
        tokens, end = [], len(self.text.rstrip())
        for match in self.pattern.finditer(self.text, at):
            if match.start() != at:
                break
            group, kind, at = match.lastindex or 0, str(match.lastgroup), match.end()
            word = match[group]
            tokens.append(Token(kind, word if kind == "text" else word.upper(), match.start(group)))
        if at < end:
            at += len(self.text[at:]) - len(self.text[at:].lstrip())
            raise self.fault(f"{self.text[at]!r} is not part of the language", at)
        return [*tokens, *2 * [Token("", "", len(self.text))]]

    def fault(self, message: str, at: int | None = None) -> ProgramFault:
        """A fault of a character of the text; of the next token if none is given."""
        raise NotImplementedError

    def require(self, good: object, message: str, at: int | None = None) -> None:
        """Raise such a fault unless all is good."""
        if not good:
            raise self.fault(message, at)

    def operand(self, token: Token) -> Expression | None:
        """The value that begins with a token, which has been passed; None if it begins none."""
        raise NotImplementedError

    def no_value(self) -> ProgramFault:
        """The fault of the next token, which begins no value, or of the end of the line."""
        if self.ended:
            return self.fault("a value is expected here; the line ends")
        return self.fault(f"{self.peek()} is no value")

    @property
    def ended(self) -> bool:
        """True if nothing is left."""
        return not self.tokens[self.next].kind

    def peek(self, ahead: int = 0) -> str:
        """The text of a token that comes; empty after the last."""
        return self.tokens[self.next + ahead].text

    def kind(self) -> str:
        """The kind of the next token; empty after the last."""
        return self.tokens[self.next].kind

    def pop(self) -> Token:
        """Go past the next token, if there is one."""
        token = self.tokens[self.next]
        self.next += bool(token.kind)
        return token

    def column(self) -> int:
        """Where the next token begins in the text."""
        return self.tokens[self.next].at

    def take(self, text: str) -> bool:
        """Go past the token if it comes next."""
        found = self.tokens[self.next].text == text
        self.next += found
        return found

    def expect(self, text: str) -> None:
        """Go past the token. Raises the fault that another one comes."""
        if not self.take(text):
            raise self.fault(f"{text} is expected here; {self.peek() or 'the end of the line'} comes")

    def expression(self, rank: int = 1) -> Expression:
        """Values with operators of at least that rank, those of one rank taken from left to right."""
        left, count, language = self.value(), 0, self.language
        while (its := language.ranks.get(operator := self.tokens[self.next].text, 0)) >= rank:
            self.next += 1
            left = Operation(language.meant.get(operator, operator), (left, self.expression(its + 1)))
            count += 1
            if count > OPERATIONS_MAX:
                text = f"more than {OPERATIONS_MAX} operations in a row; write them in several {self.pieces}"
                raise self.fault(text)
        return left

    def bracket(self) -> Expression:
        """An expression in brackets."""
        self.expect(self.opening)
        found = self.expression()
        self.expect(self.closing)
        return found

    def value(self) -> Expression:
        """A number, parameter, function or bracket, with signs before it."""
        token = self.tokens[self.next]
        if token.kind == "number":
            self.next += 1
            return Number(self.number(token.text))
        self.nested += 1
        if self.nested > NESTED_MAX:
            text = f"more than {NESTED_MAX} brackets in each other; write the expression in several {self.pieces}"
            raise self.fault(text)
        found: Expression | None = None
        if token.text == self.opening:
            found = self.bracket()
        elif token.kind:
            self.next += 1
            if token.text in ("+", "-"):
                found = -self.value() if token.text == "-" else self.value()
            elif token.text in self.language.constants:
                found = Number(self.language.constants[token.text])
            else:
                found = self.operand(token)
            self.next -= found is None
        if found is None:
            raise self.no_value()
        self.nested -= 1
        return found

    def number(self, text: str) -> float:
        """A number as it is written."""
        return float(text)
