"""Lines that are no words: commands to grbl ($X, $H, $100=250), and G28 with bare axis letters, as 3-D printers have it.

Settings and questions move nothing and are counted. Homing is a rapid to the position of G28 in the machine file, else to machine zero,
and said so. Everything else that starts with $ may move ($J jogs) and is refused.
"""

from __future__ import annotations

import re

from planner.nc.block import Block, Report
from planner.nc.codes import Assumption
from planner.nc.ignored_words import IgnoredWords
from planner.nc.lexer import Words
from planner.nc.settings import GRBL, VELOCITY_LIMIT, Setting

MESSAGE = "message"  # the rest of the line is text

COMMAND = Assumption(
    "command to the control ($)", "commands to the control ($)", "assumed not to move anything"
)
_IGNORED = Assumption("command to the control", "commands to the control", "left out, as --ignore says")
# Settings, unlock, parser state, build info, start-up lines, check mode, sleep, reset, spindle tuning, files on a card.
_HARMLESS = re.compile(
    r"\$(\$|#|X|G|I\+?|C|SLP|RST=[$#*]?|N\d?(=.*)?|\d+(=.*)?|S[A-Z]*(=.*)?|L[A-Z]*)?", re.IGNORECASE
)
_OTHER_SETTING = Assumption(
    "setting of grbl", "settings of grbl", "assumed not to change the motion", changes=True
)
_SETTING = re.compile(r"(\$\d+)\s*=\s*(\d+\.?\d*)")
_VALUE = re.compile(r"(\w+)=([-+]?\d+\.?\d*)")
_HOMING = re.compile(r"\$H\s*([XYZ]*)", re.IGNORECASE)
_LONGEST = 80  # characters of bare axis letters that are looked at
# Possessive: blanks go to one of two places each, and n letters that do not end the line would be tried in 3^n ways.
_BARE = re.compile(rb"[ \t]*+((?>[XYZWO][ \t]*+0?+[ \t]*+)++)[\r\n;(]", re.IGNORECASE)


def command(words: Words, word: int, block: Block, report: Report, ignored: IgnoredWords) -> bool:
    """Execute a `$` command at the start of a line into `block`, or Klipper's limit; False for what is none, or is refused."""
    if block.g or block.m or block.value or ignored.strict:
        return False
    if words.text(word) != "$":
        return _velocity_limit(words, word, block)
    text = "$" + words.rest(word).split(";")[0].split("(")[0].strip()
    if ignored.ignores("$") or ignored.ignores(text.upper()[:2]):
        ignored.count(_IGNORED, text, block.line)
        return True
    if homing := _HOMING.fullmatch(text):
        block.homing = homing.group(1).upper() or "XYZ"
        return True
    if (setting := _SETTING.fullmatch(text)) and setting[1] in GRBL:
        block.settings.append(Setting(setting[1], {"": float(setting[2])}, word))
        return True
    if setting:
        ignored.count(_OTHER_SETTING, text, block.line)
        return True
    if _HARMLESS.fullmatch(text):
        ignored.count(COMMAND, text, block.line)
        return True
    return False


def _velocity_limit(words: Words, word: int, block: Block) -> bool:
    text = (chr(words.data[int(words.at[word])]) + words.rest(word)).partition(";")[0].upper()
    name, _, rest = text.partition(" ")
    values = _VALUE.findall(rest)
    if name.strip() != VELOCITY_LIMIT or " ".join(f"{key}={value}" for key, value in values) != " ".join(
        rest.split()
    ):
        return False
    block.settings.append(Setting(VELOCITY_LIMIT, {key.lower(): float(value) for key, value in values}, word))
    return True


def homed(words: Words, word: int, block: Block, ignored: IgnoredWords) -> bool:
    """Execute a G28 with bare letters from `word` on into `block`: `G28 X Y`, or all axes for `G28 W`; False for anything else."""
    if block.g.get("one-shot") != 280 or block.value or ignored.strict:
        return False
    data, at = words.data, int(words.at[word])
    match = _BARE.match(data[at : at + _LONGEST].partition(b"\n")[0] + b"\n")
    if match is None:
        return False
    named = match.group(1).upper()
    block.homing = "".join(letter for letter in "XYZ" if letter.encode() in named) or "XYZ"
    del block.g["one-shot"]
    return True
