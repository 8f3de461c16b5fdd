"""What is said of files that are no programs, and of text that is no word: characters, names of other controls,
look-alikes of digits and signs."""

import re
import unicodedata

from planner.base.errors import InputError
from planner.nc.codes import CHARACTERS
from planner.nc.lexer import LINE_MAX, Unreadable, Words

_OF_LINES = {
    Unreadable.LONG: f"the line is longer than {LINE_MAX} characters, the longest that is read; is this an NC program?",
    Unreadable.COMMENT_OPEN: "the comment is not closed on its line; write )",
    Unreadable.COMMENT_NESTED: "a comment inside a comment is not allowed; remove the inner parenthesis",
}
_NO_WORD = "this character starts no word; a word is a letter and a number"
_MINUS_SIGN, _DASHES, _INVISIBLE = "\u2212", "Pd", ("Cf", "Zs")  # one character, and categories of Unicode
# Capitals of Cyrillic and Greek that look like those of programs.
_CAPITALS = dict(
    zip(
        "\u0410\u0412\u0415\u0406\u0408\u041a\u041c\u041d\u041e\u0420\u0421\u0422\u0425\u0423\u0391\u0392\u0396\u039f\u03a7\u03a5",
        "ABEIJKMHOPCTXYABZOXY",
        strict=True,
    )
)
# A number with a letter among its digits, and the digits that are meant.
_LETTERS = re.compile(r"[A-Za-z][ \t]*[-+]?[\d.]*([OolI])[\d.]*(?![A-Za-z_=(])")
_DIGITS = {"O": "0", "o": "0", "l": "1", "I": "1"}
# Words of RepRapFirmware's language, most of them EdingCNC's and Centroid's too; a printer has no commands of such names.
META = "IF|ELIF|ELSE|WHILE|BREAK|CONTINUE|ABORT|VAR|GLOBAL|SET|INPUT"
# How lines begin, whose they are, and what to do.
# fmt: off
_NAMES = (
    (r"(?:GOSUB|(?:END)?SUB|END(?:IF|WHILE))\b",
     "a subprogram or branch of EdingCNC's is not supported; write it as LinuxCNC has it, such as o100 sub and o100 call"),
    (rf"(?:{META})\b(?![ \t]*\[[^=]*\][ \t]*GOTO)",
     "a variable, branch or loop of RepRapFirmware's, EdingCNC's or Centroid's, which the control works out as it goes, is not "
     "supported; write out the lines that it executes, or what it says as LinuxCNC has it, such as o100 if [#1 EQ 3]"),
    (r"(?:CALL|RTS|MODIN|MODOUT|NLAP|NOEX)\b|V[A-Z]*\d*\s*=|N[A-Z]+\d*\b",
     "a word of Okuma's (OSP) is not supported; write the moves out, or post the program for a Fanuc control"),
    (r"(?:RECV|SEND|ECHO|ERROR|OK)\b",
     "a line of what a terminal has recorded, or a message of RepRapFirmware's, is no part of a program; leave it out"),
    (r"(?:FORCE_MOVE|MANUAL_STEPPER)\b",
     "a motor that turns by itself is not supported; write G1, or --ignore MANUAL_STEPPER where it is none of the axes"),
    (r"[A-Z_]{2}", "a word is a letter and a number; a name is none of RS274NGC"),
)
_IN_LINES = (
    (r"==|!=|&&|\|\|", "a sign in expressions of EdingCNC's, Centroid's or RepRapFirmware's; write EQ, NE, AND or OR"),
    (r'"', CHARACTERS['"']),
    (r"\{", "an expression in braces, of RepRapFirmware's, is worked out by the control as it goes; write its value"),
)
_CENTROID = ("an M code of Centroid's with / moves until an input changes, waits for it or sets a home, as only the machine knows; "
             "plan the parts before and after it")
# fmt: on
LOOKED_AT = 20_000  # bytes at the start of a file that tell its language, and hold the first %
_CAM = "make a program of it in a CAM system (for LinuxCNC, grbl or Mach3) and give that"
# What only such a file has at its start, its name, what to do. Settings of grbl stand in programs too: a line with a G code
# makes it one.
# fmt: off
_MODELS = (
    (rb"\A\s*+(?>999[^\S\n]*\n[^\n]*\n\s*)*+0\s*\n\s*SECTION\b|\AAutoCAD Binary DXF", "a drawing (DXF)", _CAM),
    (rb"(?i)\A\s*solid\b[^\n]*\n\s*(?:facet|endsolid)\b", "a model (STL)", _CAM),
    (rb"\A\s*ISO-10303-21\s*;", "a model (STEP)", _CAM),
    (rb"(?s)\A\s*+(?><\?xml[^>]*>\s*|<!--.*?-->\s*|<!DOCTYPE[^>]*>\s*)*+<svg\b", "a drawing (SVG)", _CAM),
    (rb"\A%PDF-\d", "a document (PDF)", _CAM),
    (rb"\APK\x03\x04", "an archive (ZIP, 3MF)", "unpack it and give the program in it"),
    (rb"(?m)^\[axes\.[a-z]\]", "a machine file", "give the program, and the machine file as -m FILE"),
    (rb"(?m)^\[(?:EMC\w*|TRAJ|printer)\]|\A(?!(?:.*+\n)*?[ \t]*+(?:N\d++[ \t]*+)?G\d)(?:.*+\n)*?\$1[12]\d=",
     "a file of a control's settings", "make a machine file of it (planner machine import) and give that as -m FILE"),
    (rb"(?m)^(?:N\d+)?[ \t]*G30[ \t]+G1[789]\b|^N\d+[ \t]*[GTLXYZ]\d.*\*[ \t]*\r?$",
     "a program of Heidenhain's in DIN/ISO, whose codes are others", "save it in plain text (.H) at the control or in CAM"),
    (rb"(?m)^[ \t]*(?:N\d+[ \t]*)?\((?:[PM]?CALL[ \t]*\d+|RPT[ \t]*N\d|GOTO[ \t]*N\d|IF\b[^()]*\bGOTO[ \t]*N\d)",
     "a program of Fagor's with calls and jumps in brackets", "post it for Fanuc, or write its moves out"),
)
# fmt: on
# A binary STL: 80 bytes of any text, the number of triangles, 50 bytes for each.
_STL_HEAD, _STL_TRIANGLE = 84, 50


def refuse_models(data: bytes, source: str) -> None:
    """Raise InputError for drawings, models, settings: files that people have beside their programs."""
    head = data[:LOOKED_AT]
    triangles = int.from_bytes(data[_STL_HEAD - 4 : _STL_HEAD], "little")
    if triangles and len(data) == _STL_HEAD + _STL_TRIANGLE * triangles:
        raise InputError(f"this is a model (STL), not a program; {_CAM}", source=source)
    for mark, name, remedy in _MODELS:
        if re.search(mark, head):
            what = name if name.startswith("a program") else f"{name}, not a program"
            raise InputError(f"this is {what}; {remedy}", source=source)


def unreadable(words: Words, word: int) -> str:
    """The message for a word of the letter `FAULT`."""
    kind, text, at = Unreadable(int(words.value[word])), words.text(word), int(words.at[word])
    if kind in _OF_LINES:
        return _OF_LINES[kind]
    start, end = words.line_at(at)
    before, behind = (words.data[a:b].decode("utf-8", "replace") for a, b in ((start, at), (at, end)))
    if kind is Unreadable.NUMBER:
        return _without_number(behind, behind[len(text) :].lstrip(" \t")[:1])
    if text == "/" and re.search(r"[Mm]\s*\d+\s*$", before):
        return _CENTROID
    if (text.isdigit() and text.isascii()) or text in "+-.":
        return "a number without a letter before it; a word is a letter and one number"
    return CHARACTERS.get(text[:1]) or look_alike(text) or _NO_WORD


def of_another(text: str) -> tuple[int, str] | None:
    """Where a line has what RS274NGC's expressions and Fanuc's have not, and what is said of it; None for none."""
    text = re.sub(r"\([^()]*\)|;.*", lambda found: " " * len(found[0]), text)
    begin = re.match(rf"\s*(?:N\d+\s*)?(?=(?:{META})\b(?!\s*\[))", text, re.IGNORECASE)
    if begin is not None:
        return begin.end(), _without_number(text[begin.end() :], "")
    found = ((match.start(), what) for sign, what in _IN_LINES if (match := re.search(sign, text)))
    return next(found, None)


def _without_number(text: str, behind: str) -> str:
    """What is said of a letter without a number, at the start of a text, and the character behind it."""
    if letter := _LETTERS.match(text):
        return f"{letter[0].strip()} has the letter {letter[1]} in its number; write the digit {_DIGITS[letter[1]]}"
    known = next((what for name, what in _NAMES if re.match(name, text, re.IGNORECASE)), "")
    of_behind = CHARACTERS | {"{": _IN_LINES[-1][1], ")": "", "/": ""}
    known = known or of_behind.get(behind, "") or look_alike(behind)
    return known or "a letter without a number; write digits after it, such as X1.5"


def look_alike(character: str) -> str:
    """What is said of a character beyond ASCII, or one that cannot be seen; "" for others."""
    if not character or (character.isascii() and character.isprintable()):
        return ""
    category, code = unicodedata.category(character), ord(character)
    if category in ("Cc", "Co", "Cn"):
        return f"character {code} is not part of a text; is this a binary file?"
    named = f"U+{code:04X} ({unicodedata.name(character, 'without a name').lower()})"
    if category in _INVISIBLE:
        return f"{named} is a character that cannot be seen; delete it"
    dash = "-" if category == _DASHES or character == _MINUS_SIGN else ""
    meant = dash or _CAPITALS.get(character.upper()) or unicodedata.normalize("NFKC", character)
    if meant.isascii():
        return f"{character} is {named}, which looks like {meant}; write {meant}"
    return f"{_NO_WORD}; it is {named}"
