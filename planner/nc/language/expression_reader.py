"""Reading expressions by the ranks of their operators (Pratt's method): one reader, and the table of a
dialect (`tree.Language`)."""

import re
from dataclasses import dataclass
from typing import ClassVar

from planner.nc.language.tree import Expression, Language, Operation

NESTED_MAX = (
    40  # brackets in brackets; the 255 characters of RS274NGC's lines hold no more that means anything
)
OPERATIONS_MAX = 80  # one inside the other: Python compiles no more brackets than 200


def ranked(*names: str) -> dict[str, int]:
    """Ranks of operators from 1, of texts of names with blanks between; higher ones bind first."""
    return {name: rank for rank, of_rank in enumerate(names, start=1) for name in of_rank.split()}


def names(text: str) -> frozenset[str]:
    """Names with blanks between."""
    return frozenset(text.split())


class ExpressionReader:
    """Reads values with operators between them."""

    language: Language
    nested = 0  # brackets and signs that are open
    pieces = "lines"  # what long expressions are divided into, for messages

    def operator(self) -> str:
        """The operator that comes next; empty for none."""
        raise NotImplementedError

    def skip(self, operator: str) -> None:
        """Go past the operator."""
        raise NotImplementedError

    def value(self) -> Expression:
        """The expression that comes next, up to an operator between two values."""
        raise NotImplementedError

    def refused(self, message: str) -> Exception:
        """A fault of the next character or token."""
        raise NotImplementedError

    def expression(self, rank: int = 1) -> Expression:
        """Values with operators of at least that rank, those of one rank taken from left to right."""
        left, count, language = self.value(), 0, self.language
        while (its := language.ranks.get(operator := self.operator(), 0)) >= rank:
            self.skip(operator)
            left = Operation(language.meant.get(operator, operator), (left, self.expression(its + 1)))
            count += 1
            if count > OPERATIONS_MAX:
                text = f"more than {OPERATIONS_MAX} operations in a row; write them in several {self.pieces}"
                raise self.refused(text)
        return left

    def deeper(self, more: str = "") -> None:
        """One more bracket is open."""
        self.nested += 1
        if self.nested > NESTED_MAX:
            raise self.refused(f"more than {NESTED_MAX} brackets in each other{more}")


@dataclass(frozen=True, slots=True)
class Token:
    """A piece of a line."""

    kind: str  # "word" (a letter and its number), "number", "name", "text" or "sign"
    text: str  # as it is written, in capitals
    at: int  # where it begins in the line


class TokenReader(ExpressionReader):
    """Reads a text that is split into tokens, from left to right.

    pattern : of a token behind blanks; the names of its groups are kinds
    next    : the token that comes
    ends, no_value : what is said where the text ends before a value, and of a token that begins none
    """

    pattern: ClassVar[re.Pattern[str]]
    ends = "a value is expected here; the line ends"
    no_value = "is no value"

    def __init__(self, text: str, at: int = 0):
        self.text, self.next = text, 0
        self.tokens: list[Token] = []
        while text[at:].strip():
            match = self.pattern.match(text, at)
            if match is None:
                at += len(text[at:]) - len(text[at:].lstrip())
                raise self.fault(f"{text[at]!r} is not part of the language", at)
            kind = str(match.lastgroup)
            word = match.group(kind)
            self.tokens.append(Token(kind, word if kind == "text" else word.upper(), match.start(kind)))
            at = match.end()

    def fault(self, message: str, at: int | None = None) -> Exception:
        """A fault of a character of the text; of the next token if none is given."""
        raise NotImplementedError

    def operand(self, token: Token) -> Expression | None:
        """The value that begins with a token, which has been passed; None if it begins none."""
        raise NotImplementedError

    def refused(self, message: str) -> Exception:
        """A fault of the next token."""
        return self.fault(message)

    @property
    def ended(self) -> bool:
        """True if nothing is left."""
        return self.next >= len(self.tokens)

    def peek(self, ahead: int = 0) -> str:
        """The text of a token that comes; empty after the last."""
        return self.tokens[self.next + ahead].text if self.next + ahead < len(self.tokens) else ""

    operator = peek

    def column(self) -> int:
        """Where the next token begins in the text."""
        return len(self.text) if self.ended else self.tokens[self.next].at

    def take(self, text: str) -> bool:
        """Go past the token if it comes next."""
        if self.peek() != text:
            return False
        self.next += 1
        return True

    def skip(self, operator: str) -> None:
        """Go past the next token."""
        self.next += 1

    def expect(self, text: str) -> None:
        """Go past the token. Raises the fault that another one comes."""
        if not self.take(text):
            raise self.fault(f"{text} is expected here; {self.peek() or 'the end of the line'} comes")

    def value(self) -> Expression:
        """A number, parameter, function or bracket, with signs before it."""
        self.deeper()
        if self.ended:
            raise self.fault(self.ends)
        token = self.tokens[self.next]
        self.next += 1
        found: Expression | None
        if token.text in ("+", "-"):
            found = self.value()
            found = -found if token.text == "-" else found
        elif token.text == "(":
            found = self.expression()
            self.expect(")")
        else:
            found = self.operand(token)
        if found is None:
            self.next -= 1
            raise self.fault(f"{token.text} {self.no_value}")
        self.nested -= 1
        return found
