"""A line of a program: its codes by modal group, and its other words by letter."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from planner.nc import codes
from planner.nc.settings import Setting

# The largest number of a word: lengths beyond 1e9 mm have lost the micrometre in double precision and are
# certainly a mistake.
NUMBER_MAX = 1e9
OFFSET_NUMBER = codes.Assumption(
    "number of an offset (D, H) without a code that uses it",
    "numbers of offsets (D, H) without a code that uses them",
    "left out",
)
Report = Callable[[int, str], None]


class WordFault(Exception):
    """The line cannot be executed further; carries the index of the word and the message."""

    def __init__(self, word: int, message: str):
        super().__init__(message)
        self.word, self.message = word, message


@dataclass(slots=True)
class Block:
    """One line of a program.

    line    : 1-based source line
    g, m    : codes in tenths by modal group
    value   : numbers by letter, other than G, M and N
    at      : index of the word by letter or modal group, for messages
    ended   : the line is a "%"
    foreign : a code that is not supported uses the line's words; no move is read from it
    refused_motion : such a code is a motion code and stays in force
    partial : some words were reported and left out; others may have belonged to them
    events  : letter and number of words that move nothing and are kept, in their order
    homing  : axes that go to their home position
    stops   : one of `events` is a full stop
    settings : commands that set a factor or a limit
    own     : letters of the words that codes of the line use
    tool_point : number of the M code that switches the tool centre point, or None
    """

    line: int
    g: dict[str, int] = field(default_factory=dict)
    m: dict[str, int] = field(default_factory=dict)
    value: dict[str, float] = field(default_factory=dict)
    at: dict[str, int] = field(default_factory=dict)
    ended: bool = False
    foreign: bool = False
    refused_motion: bool = False
    partial: bool = False
    events: list[tuple[str, float]] = field(default_factory=list)
    homing: str = ""
    stops: bool = False
    settings: list[Setting] = field(default_factory=list)
    own: frozenset[str] = frozenset()
    tool_point: int | None = None

    def has(self, letters: str) -> bool:
        """True if the block has a word with one of the letters."""
        return any(letter in self.value for letter in letters)

    def first_of(self, letters: str) -> int:
        """Index of the first word with one of the letters."""
        return min(self.at[letter] for letter in letters if letter in self.at)

    def motion_word(self) -> int:
        """Index of the word that makes the block move: its motion code, else its first coordinate, or its first word."""
        if "motion" in self.at:
            return self.at["motion"]
        return self.first_of("XYZIJKR") if self.has("XYZIJKR") else min(self.at.values())

    def fault(self, message: str, at: str = "") -> WordFault:
        """A fault of the word of a letter or modal group; of the one that makes the block move if none is given."""
        return WordFault(self.at[at] if at else self.motion_word(), message)


def unused(letter: str) -> str:
    """The message for a word that no code of its block uses."""
    if letter in codes.LETTERS_REFUSED:
        return str(codes.LETTERS_REFUSED[letter])
    return f"{letter} word without {codes.LETTER_NEEDS[letter]}, which would use it; remove it"
