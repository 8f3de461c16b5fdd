"""One row of words as a block: its codes by modal group and its other words by letter, checked against each
other.

Checked here is what a line may hold at all: codes that are known, one code per modal group, a letter once,
words that some code of the line uses, N at its start. What the words mean in the state of the program is the
interpreter's business.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from planner.nc import codes
from planner.nc.lexer import FAULT, LINE_MAX, Unreadable, Words

# The largest number of a word: lengths beyond 1e9 mm have lost the micrometre in double precision and are
# certainly a mistake.
NUMBER_MAX = 1e9
CODE_MAX = 1e4  # larger G and M numbers are all unknown
_CODE_ROUNDING = 1e-4  # G1.00001 is G1, as RS274NGC rounds
_MOTION_LETTERS = "XYZ"
_ARC_LETTERS = "IJKR"

Report = Callable[[int, str], None]


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

    def has(self, letters: str) -> bool:
        """Whether the block has a word with one of the letters."""
        return any(letter in self.value for letter in letters)

    def first_of(self, letters: str) -> int:
        """Index of the first word with one of the letters."""
        return min(self.at[letter] for letter in letters if letter in self.at)

    def motion_word(self) -> int:
        """Index of the word that makes the block move: its motion code, else its first coordinate."""
        return self.at["motion"] if "motion" in self.at else self.first_of("XYZIJKR")


def read_block(words: Words, row: int, report: Report) -> Block | None:
    """Read a row of words. Faults go to `report(word, message)`; None if the row cannot be read as a
    whole."""
    block = Block(line=int(words.line[row]))
    first, last = int(words.first[row]), int(words.first[row + 1])
    for word in range(first, last):
        code, value = int(words.letter[word]), float(words.value[word])
        if code == FAULT:
            report(word, _unreadable(words, word))
            return None
        letter = chr(code)
        if letter == "%":
            if last - first > 1:
                report(word, "a % stands alone on its line: it starts and ends a program")
                return None
            block.ended = True
        elif letter == "N":
            if word > first:
                report(word, "a line number comes first on its line, once")
                return None
        elif letter in "GM":
            block.partial |= _add_code(block, letter, value, word, report)
        elif letter in codes.LETTERS_REFUSED and letter != "L":
            report(word, str(codes.LETTERS_REFUSED[letter]))
            block.partial = True
        elif letter in block.value:
            report(word, f"a second {letter} word on this line; write one")
            return None
        elif abs(value) > NUMBER_MAX:
            report(word, f"the number is too large; at most {NUMBER_MAX:g} is allowed")
            return None
        else:
            block.value[letter], block.at[letter] = value, word
    if not block.partial:
        _check_used(block, report)
    return block


def _add_code(block: Block, letter: str, value: float, word: int, report: Report) -> bool:
    """Put a G or M code into its group; True if it was reported instead."""
    code = round(min(max(value, -1.0), CODE_MAX) * 10.0)
    known, refused = (codes.G_GROUP, codes.G_REFUSED) if letter == "G" else (codes.M_GROUP, codes.M_REFUSED)
    exact = abs(value * 10.0 - code) <= 10.0 * _CODE_ROUNDING
    if not exact or code not in known:
        refusal = refused.get(code) if exact else None
        refusal = refusal or codes.unknown(letter, code)
        report(word, str(refusal))
        block.foreign |= refusal.takes_axes
        block.refused_motion |= refusal.takes_axes and 330 <= code <= 890
        return True
    group, groups = known[code], block.g if letter == "G" else block.m
    if group in groups:
        report(
            word,
            f"{letter}{codes.number(groups[group])} and {letter}{codes.number(code)} on one line are of the same "
            f"group ({group}); write one of them, or two lines",
        )
        return True
    groups[group] = code
    block.at[group] = word
    return False


def _check_used(block: Block, report: Report) -> None:
    """Report words that no code of the line uses. I J K and R may belong to an arc code in force: the
    interpreter looks."""
    one_shot, motion = block.g.get("one-shot"), block.g.get("motion", block.g.get("cycle end"))
    path, arc = block.g.get("path control"), motion in (20, 30)
    if "L" in block.value and motion not in (None, 52):
        report(block.at["L"], str(codes.LETTERS_REFUSED["L"]))
        del block.value["L"]
    used = {
        "P": arc or motion in (None, 50, 52, 62) or one_shot == 40 or path == 640,
        "Q": path == 640 or motion in (None, 50),
        "H": block.g.get("tool length") == 430,
        **dict.fromkeys(_ARC_LETTERS, arc or motion in (None, 50, 51, 62)),
    }
    for letter, allowed in used.items():
        if letter in block.value and not allowed:
            report(
                block.at[letter],
                f"{letter} word without {codes.LETTER_NEEDS[letter]}, which would use it; remove it",
            )
            del block.value[letter]


def _unreadable(words: Words, word: int) -> str:
    kind = Unreadable(int(words.value[word]))
    if kind is Unreadable.LONG:
        return (
            f"the line is longer than {LINE_MAX} characters, the longest that is read; is this an NC program?"
        )
    if kind is Unreadable.COMMENT_OPEN:
        return "the comment is not closed on its line; write )"
    if kind is Unreadable.COMMENT_NESTED:
        return "a comment inside a comment is not allowed; remove the inner parenthesis"
    if kind is Unreadable.NUMBER:
        return _no_number(words, word)
    return _character(words.text(word))


def _no_number(words: Words, word: int) -> str:
    after = words.data[int(words.at[word]) + len(words.text(word)) :].lstrip(b" \t")[:1].decode("latin-1")
    if after in codes.CHARACTERS and after not in ")/":
        return codes.CHARACTERS[after]
    return "a letter without a number; write digits after it, such as X1.5"


def _character(character: str) -> str:
    if character.isdigit() or character in "+-.":
        return "a number without a letter before it; a word is a letter and one number"
    if character.isprintable():
        return codes.CHARACTERS.get(
            character, "this character starts no word; a word is a letter and a number"
        )
    return f"character {ord(character)} is not part of a text; is this a binary file?"
