"""From bytes to words, as RS274NGC splits a program: a letter and a number, spaces without meaning.

    line    = [/] word* [comments]        word = letter number        number = [+|-] digits [. digits] [e +|- digits]
    comment = ( anything but a parenthesis )   or   ; to the end of the line

@ and ^ are letters, of polar coordinates. Beyond RS274NGC a % at the start of a line may have a name after
it, :1000 is O1000, $ inside a line is a letter (M3 $1), *71 at the end of a line is a checksum, and a number
may have an exponent with its sign: -8.775e-05; E needs two digits or more, since X1E-2 is a coordinate and an
extruder's word.

What cannot be read becomes a word too, with the letter `FAULT` and a code as its value, and the rest of its line is
left out. Numbers are rounded as float(text): the digits form an integer below 2^53 and the point a power of ten up
to 1e22, both exact, and one division rounds once. Longer numbers are marked NaN by the compiled loop and read by
Python.
"""

import re
from bisect import bisect_right
from dataclasses import dataclass, replace
from enum import IntEnum

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.kernels import njit

# bytes of a source line without its comments: RS274NGC stops at 255, a longer one is no program's
LINE_MAX = 4096
FAULT = 0
BOM = b"\xef\xbb\xbf"
NUMBER = rb"[ \t]*[-+]?[\d \t]*\.?[\d \t]*(?:(?<=[\d.])(?:e[-+]\d|E[-+]\d\d)\d*(?![\d.]))?"
_WORD = re.compile(rb"[@-Z^a-z%$:]" + NUMBER)
# Characters by their codes: what a compiled loop compares bytes with.
_NEWLINE, _RETURN, _TAB, _SPACE, _DOS_END, _NUL = 10, 13, 9, 32, 26, 0
_NO_BREAK = 0xC2, 0xA0  # the bytes of a no-break space, which editors and pages put in place of a blank
_OPEN, _CLOSE, _SEMICOLON, _SLASH, _PERCENT, _PLUS, _MINUS, _POINT, _ZERO = 40, 41, 59, 47, 37, 43, 45, 46, 48
_LETTER_O, _LETTER_E, _SMALL_E, _COLON, _DOLLAR, _STAR, _AT, _Z, _CARET = 79, 69, 101, 58, 36, 42, 64, 90, 94
_POWERS_OF_TEN = np.array([10.0**k for k in range(23)])  # exact in double precision
_MANTISSA_MAX = 2**53 // 10 - 1  # room for one more digit below 2^53


class Unreadable(IntEnum):
    """The codes of words with the letter `FAULT`."""

    CHARACTER = 1  # a character that starts no word
    NUMBER = 2  # a letter without a number
    COMMENT_OPEN = 3  # "(" without ")"
    COMMENT_NESTED = 4  # "(" inside a comment
    LONG = 5  # a line longer than LINE_MAX without its comments


@dataclass(frozen=True, eq=False, kw_only=True)
class Words:
    """W words on R rows, source lines with a word; an expanded program has rows of one line many times."""

    # (W,) upper case letter code, b"%"[0], b"$"[0], or `FAULT`; O is -1 unless a number follows it
    letter: Array
    value: FloatArray  # (W,) number, as written (no unit applied)
    at: Array  # (W,) byte offset of the letter in `data`
    line: Array  # (R,) 1-based source line
    first: Array  # (R+1,) index of a row's first word; row r holds words first[r] ... first[r+1]-1
    data: bytes  # the source
    frame: Array  # (R,) index of the call that the row stands in (`Program.frames`); 0 in the main program
    # further files in `data`: where each begins, and its name, ascending
    files: tuple[tuple[int, str], ...] = ()

    def file(self, word: int) -> str:
        """The file that a word stands in; empty for the main program."""
        found = bisect_right(self.files, int(self.at[word]), key=lambda file: file[0])
        return self.files[found - 1][1] if found else ""

    def row(self, word: int) -> int:
        """The row that holds a word."""
        return int(np.searchsorted(self.first, word, side="right")) - 1

    def rows_with(self, words: Array) -> list[int]:
        """The rows, ascending, that hold words (n,)."""
        found: list[int] = np.unique(np.searchsorted(self.first, words, side="right") - 1).tolist()
        return found

    def of_rows(self, first: int, last: int = 0) -> tuple[Array, FloatArray]:
        """Letters (n,) and values (n,) of the rows `first` to `last` - 1, or of the first alone."""
        span = slice(int(self.first[first]), int(self.first[last or first + 1]))
        return self.letter[span], self.value[span]

    def find(self, letter: str, *numbers: float) -> Array:
        """(n,) the words of a letter with one of the numbers, ascending."""
        of_letter = np.flatnonzero(self.letter == ord(letter))
        return of_letter[np.isin(self.value[of_letter], numbers)]

    def line_at(self, at: int) -> tuple[int, int]:
        """Where the source line of a byte begins and ends in `data`, without its end of line."""
        end = self.data.find(b"\n", at)
        return self.data.rfind(b"\n", 0, at) + 1, end if end >= 0 else len(self.data)

    def row_text(self, row: int) -> str:
        """The source line of a row."""
        start, end = self.line_at(int(self.at[self.first[row]]))
        return self.data[start:end].removeprefix(BOM).decode("utf-8", "replace")

    def column_at(self, at: int) -> int:
        """1-based column of a byte, in characters."""
        before = self.data[self.line_at(at)[0] : at].removeprefix(BOM)
        return len(before.decode("utf-8", "replace")) + 1

    def column(self, word: int) -> int:
        """1-based column of a word, in characters."""
        return self.column_at(int(self.at[word]))

    def text(self, word: int) -> str:
        """The word as written, up to what follows it; a command ($X); one character of what is unreadable."""
        at = int(self.at[word])
        if self.letter[word] == FAULT and self.value[word] != Unreadable.NUMBER:
            found = self.data[at : self.line_at(at)[1]].decode("utf-8", "replace")
            return found.split()[0] if found[:1] == "$" else found[:1]
        match = _WORD.match(self.data, at)
        return match.group().decode("ascii").strip() if match else ""

    def rest(self, word: int) -> str:
        """The line behind the letter of a word, comments included."""
        at = int(self.at[word]) + 1
        return self.data[at : self.line_at(at)[1]].decode("utf-8", "replace").strip()


def split_words(data: bytes, *, block_delete: bool) -> Words:
    """Split a program into words; with `block_delete` lines that start with "/" are left out."""
    if b"\n" not in data:
        data = data.replace(b"\r", b"\n")  # lines of an old Macintosh; elsewhere a return is a blank
    source = np.frombuffer(data, dtype=np.uint8)
    capacity, lines = _count(source)
    letter, value = np.empty(capacity, dtype=np.uint8), np.empty(capacity)
    at = np.empty(capacity, dtype=np.int64 if len(data) > np.iinfo(np.int32).max else np.int32)
    line, first = np.empty(lines, dtype=np.int32), np.empty(lines + 1, dtype=np.int64)
    start = len(BOM) if data.startswith(BOM) else 0
    words, rows = _split(source, start, block_delete, letter, value, at, line, first)
    value = value[:words]
    for word in np.flatnonzero(np.isnan(value)):
        match = _WORD.match(data, at[word])
        assert match is not None
        value[word] = float(re.sub(rb"[ \t]", b"", match.group()[1:]))
    frame, first = np.zeros(rows, dtype=np.int32), first[: rows + 1]
    return Words(
        letter=letter[:words],
        value=value,
        at=at[:words],
        line=line[:rows],
        first=first,
        data=data,
        frame=frame,
    )


def text_alone(data: bytes) -> Words:
    """A text without words, for languages that are not split into words."""
    return replace(split_words(b"\n", block_delete=False), data=data)


_CHARACTER, _NUMBER, _COMMENT_OPEN, _COMMENT_NESTED, _LONG = (int(code) for code in Unreadable)


@njit(cache=True)
def _count(source):  # pragma: no cover - compiled
    letters, lines = 0, 1
    for c in source:
        if 97 <= c <= 122 or _AT <= c <= _Z or c in (_PERCENT, _COLON, _DOLLAR, _CARET):
            letters += 1
        elif c == _NEWLINE:
            lines += 1
    return letters + lines, lines  # a line has at most one word that is not a letter's: its fault


@njit(cache=True)
def _digit_follows(source, i):  # pragma: no cover - compiled
    """True if the next character after blanks from i on is a digit."""
    while i < len(source) and source[i] in (_SPACE, _TAB):
        i += 1
    return i < len(source) and 48 <= source[i] <= 57


@njit(cache=True)
def _ends_in_digits(source, i):  # pragma: no cover - compiled
    """True if digits, blanks and comments alone follow up to the end of the line: a checksum."""
    first = i
    while i < len(source) and 48 <= source[i] <= 57:
        i += 1
    digits = i > first
    while i < len(source) and source[i] in (_SPACE, _TAB, _RETURN):
        i += 1
    return digits and (i == len(source) or source[i] in (_NEWLINE, _SEMICOLON))


@njit(cache=True)
def _exponent(source, i):  # pragma: no cover - compiled
    """The number of characters of an exponent at i, behind a digit or a point; 0 if there is none."""
    if not (48 <= source[i - 1] <= 57 or source[i - 1] == _POINT):
        return 0
    if i + 2 >= len(source) or source[i + 1] not in (_PLUS, _MINUS):
        return 0
    k = i + 2
    while k < len(source) and 48 <= source[k] <= 57:
        k += 1
    enough = k - i - 2 >= (1 if source[i] == _SMALL_E else 2)
    return k - i if enough and not (k < len(source) and source[k] == _POINT) else 0


@njit(cache=True)
def _split(source, i, block_delete, letter, value, at, line, first):  # pragma: no cover - compiled
    end = len(source)
    words, rows, line_number = 0, 0, 0
    while i < end:
        line_number += 1
        line_start, row_first, blank, reading, comments = i, words, True, True, 0
        while i < end and source[i] != _NEWLINE:
            c = source[i]
            if not reading or c in (_SPACE, _TAB, _RETURN, _DOS_END, _NUL):
                i += 1
                continue
            if c == _NO_BREAK[0] and i + 1 < end and source[i + 1] == _NO_BREAK[1]:
                i += 2
                continue
            if c == _SLASH and blank:
                reading = not block_delete
                blank = False
                i += 1
                continue
            blank, starts = False, words == row_first
            if c == _SEMICOLON or (c == _STAR and not starts and _ends_in_digits(source, i + 1)):
                comments -= i
                while i < end and source[i] != _NEWLINE:
                    i += 1
                comments += i
                continue
            if c == _OPEN:
                fault, close = _COMMENT_OPEN, i + 1
                while close < end and source[close] != _NEWLINE:
                    if source[close] == _CLOSE:
                        fault = 0
                        break
                    if source[close] == _OPEN:
                        fault = _COMMENT_NESTED
                        break
                    close += 1
                if fault == 0:
                    comments += close + 1 - i
                    i = close + 1
                    continue
                if fault == _COMMENT_NESTED:
                    i = close
                letter[words], value[words], at[words] = FAULT, fault, i
                words += 1
                reading = False
                continue
            if 97 <= c <= 122:
                c -= 32
            if c == _PERCENT:
                letter[words], value[words], at[words] = c, 0.0, i
                words += 1
                i += 1
                reading = not starts
                continue
            if starts and c == _COLON and _digit_follows(source, i + 1):
                c = _LETTER_O
            if not (_AT <= c <= _Z or c == _CARET or (c == _DOLLAR and not starts)):
                letter[words], value[words], at[words] = FAULT, _CHARACTER, i
                words += 1
                reading = False
                continue

            # names and expressions may follow: the line cannot be split into words
            if c == _LETTER_O and not _digit_follows(source, i + 1):
                letter[words], value[words], at[words] = c, -1.0, i
                words += 1
                reading = False
                continue

            # a letter: its number follows, perhaps with spaces inside
            place, mantissa, digits, decimals = i, 0, 0, 0
            negative, signed, point, exact = False, False, False, True
            i += 1
            while i < end:
                d = source[i]
                if 48 <= d <= 57:
                    if mantissa > _MANTISSA_MAX:
                        exact = False
                    else:
                        mantissa = mantissa * 10 + (d - _ZERO)
                    digits += 1
                    if point:
                        decimals += 1
                elif d == _POINT and not point:
                    point = True
                elif d in (_PLUS, _MINUS) and not (signed or point or digits):
                    signed = True
                    negative = d == _MINUS
                elif d in (_LETTER_E, _SMALL_E) and digits and _exponent(source, i):
                    exact = False
                    i += _exponent(source, i)
                    break
                elif d != _SPACE and d != _TAB:
                    break
                i += 1
            at[words] = place
            if digits == 0:
                letter[words], value[words] = FAULT, _NUMBER
                reading = False
            else:
                letter[words] = c
                if exact and decimals <= 22:
                    number = mantissa / _POWERS_OF_TEN[decimals]
                    value[words] = -number if negative else number
                else:
                    value[words] = np.nan
            words += 1
        if i - line_start - comments > LINE_MAX:
            words = row_first
            letter[words], value[words], at[words] = FAULT, _LONG, line_start
            words += 1
        if words > row_first:
            line[rows], first[rows] = line_number, row_first
            rows += 1
        i += 1
    first[rows] = words
    return words, rows
