"""One row of words as a block: its codes by modal group and its other words by letter, checked against what a
line may hold at all. What the words mean in the state of the program is the interpreter's business.

Lines that are no words: commands to grbl ($X, $H, $100=250), and G28 with bare axis letters, as 3-D printers
have it. Homing is a rapid to the position of G28, else to machine zero, and said so. What else starts with $
may move ($J jogs) and is refused.
"""

import re

from planner.nc import codes, printer, settings
from planner.nc.codes import Assumption
from planner.nc.faults import LEFT_OUT, REFUSED, IgnoredWords
from planner.nc.lexer import FAULT, Words
from planner.nc.moves import NUMBER_MAX, OFFSET_NUMBER, Block, Report, unused
from planner.nc.unreadable import unreadable

MESSAGE = "message"  # the rest of the line is text
COMMAND = Assumption("line{|s} to the control or its operator", "assumed not to move anything")
_IGNORED = Assumption("command{|s} to the control", "left out, as --ignore says")
# Settings, unlock, parser state, build info, start-up lines, check mode, sleep, reset, spindle tuning, files on
# a card, reference of the tool, motors; real-time characters of grbl; objects of TinyG; texts of EdingCNC.
_HARMLESS = re.compile(
    r"\$(\$|#|X|G|I\+?|C|SLP|RST=[$#*]?|N\d?(=.*)?|\d+(=.*)?|S[A-Z]*(=.*)?|L[A-Z]*|TLR|HELP|(SD|LOCALFS)/(LIST|STATUS|SHOW)\b.*"
    r"|(ALARM|MOTOR)/\w+|M[DE])?|[?~!]|\{(?!.*\b(gc|jog\w?|hom\w?|prb\w*)\b)\s*\"?\w+\"?\s*:.*\}|((LOG|WARN|DLG)?MSG|LOGFILE|TCAGUARD)\s.*",
    re.IGNORECASE,
)
_JSON = re.compile(r'\{\s*"?((?!gc\b|jog|hom|prb)\w+)"?\s*:\s*"?([^"{}]*?)"?\s*\}', re.IGNORECASE)
_WAITS = ("DLG", "WAR")  # how texts begin that the operator has to answer
_OTHER_SETTING = Assumption("setting{|s} of the control", "assumed not to change the motion", changes=True)
_SETTING = re.compile(r"(\$[\w/]+)\s*=\s*(\d+\.?\d*)")
_HOMING = re.compile(r"\$H\s*([XYZ]*)", re.IGNORECASE)
_LONGEST = 80  # characters of bare axis letters that are looked at
# Possessive: blanks go to one of two places each, and n letters that do not end the line would be tried in
# 3^n ways.
_BARE = re.compile(rb"[ \t]*+((?>[XYZWO][ \t]*+0?+[ \t]*+)++)[\r\n;(]", re.IGNORECASE)
CODE_MAX = 1e4  # larger G and M numbers are all unknown
_CODE_ROUNDING = 1e-4  # G1.00001 is G1, as RS274NGC rounds
_ALWAYS = frozenset("XYZFST$@^" + codes.PARKABLE)  # words that need no code beside them
_TOOL_POINT_CODES = tuple(10 * number for number in (*settings.TOOL_POINT_ON, *settings.TOOL_POINT_OFF))
_BARE_WORD = re.compile(r"([a-z])\s*([-+]?\d+\.?\d*|)")
NAME_SHOWN = 20  # characters of a name in a note
PROGRAM_NAME = Assumption("program name{|s}", "without effect")
PROGRAM_NUMBER = Assumption("program number{|s}", "kept, without effect")


def command(words: Words, word: int, block: Block, ignored: IgnoredWords) -> bool:
    """Execute a line to the control or its operator into `block`; False for none, or one that may move."""
    if block.g or block.m or block.value or ignored.strict:
        return False
    at = int(words.at[word])
    text = words.data[at : words.line_at(at)[1]].decode("utf-8", "replace").split(";")[0].strip()
    if text.upper()[:2] in ignored.reading.ignore or (text[:1] == "$" and "$" in ignored.reading.ignore):
        ignored.count(_IGNORED, text, block.line)
        return True
    if pair := _JSON.fullmatch(text):
        text = f"${pair[1]}={pair[2]}"
    text = text.split("(")[0].strip() if text[:1] == "$" else text
    if homing := _HOMING.fullmatch(text):
        block.homing = homing.group(1).upper() or "XYZ"
        return True
    setting = _SETTING.fullmatch(text)
    if setting and setting[1] in settings.GRBL:
        block.settings.append(settings.Setting(setting[1], {"": float(setting[2])}, word))
    elif setting or _HARMLESS.fullmatch(text):
        ignored.count(_OTHER_SETTING if setting or text[:1] == "{" else COMMAND, text, block.line)
        block.stops = text[:1] == "!" or text[:3].upper() in _WAITS
    else:
        return False
    return True


def homed(words: Words, word: int, block: Block, ignored: IgnoredWords) -> bool:
    """Execute a G28 with bare letters (`G28 X Y`, `G28 W` for all) into `block`; False for anything else."""
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


def read_block(words: Words, row: int, report: Report, ignored: IgnoredWords) -> Block | None:
    """A row as a block, faults to `report(word, message)`; None if it cannot be read, or holds nothing."""
    block = Block(line=int(words.line[row]))
    first, last = int(words.first[row]), int(words.first[row + 1])
    if ignored.printer and not ignored.strict and printer.take(words, row, block, ignored):
        return block
    owned = ""  # letters that belong to a setting
    for word in range(first, last):
        code, value = int(words.letter[word]), float(words.value[word])
        if owned == MESSAGE or (owned == settings.EVERYTHING and code == FAULT):
            if block.settings:
                at = int(words.at[word])
                text = words.data[at : words.line_at(at)[1]].partition(b";")[0].decode("latin-1").lower()
                given = {letter: float(number or "nan") for letter, number in _BARE_WORD.findall(text)}
                block.settings[-1].values.update(given)  # NaN where a letter has no number
            break
        if code == FAULT:
            if homed(words, word, block, ignored) or command(words, word, block, ignored):
                break
            if "spindle" in block.m and words.text(word) in ("I", "i") and not ignored.strict:
                ignored.count(settings.SPINDLE_WORD, "I", block.line)  # of Marlin: S of each move
                continue
            report(word, unreadable(words, word))
            return None
        letter = chr(code)
        if letter == "%":
            name = words.rest(word).partition("(")[0].partition(";")[0].strip()
            if word > first or (name and ignored.strict):
                report(word, "a % stands alone on its line: it starts and ends a program")
                return None
            if name:
                ignored.count(PROGRAM_NAME, f"%{name[:NAME_SHOWN]}", block.line)
            block.ended = True
        elif letter == "O" and word > first + (words.letter[first] == ord("N")):
            what = "the letter O inside a line"
            report(word, f"{what}; write the digit 0, or an O word at the start of its line")
            return None
        elif letter == "O":
            statement = value < 0 or (words.letter[word:last] == FAULT).any()
            if statement or ignored.strict or value > NUMBER_MAX:
                report(word, str(codes.LETTERS_REFUSED["O"]))
                return None
            ignored.count(PROGRAM_NUMBER, words.text(word), block.line)
            block.events.append(("O", value))
        elif letter == "N" and "N" not in owned:
            if word > first:
                report(word, "a line number comes first on its line, once")
                return None
        elif letter in "GM":
            taken = None
            if value * 10.0 not in settings.ALWAYS_READ[letter] or ignored.reading.ignore:
                taken = _settle(words, word, (first, last), block, ignored)
            owned = taken or ""
            if taken is None:
                block.partial |= _add_code(block, letter, value, word, report, ignored)
        elif letter in owned or (ignored.treatment[code] == LEFT_OUT and letter != "E"):
            if letter in owned and block.settings:
                block.settings[-1].values[letter.lower()] = value
        elif ignored.treatment[code] == REFUSED and letter != "E":
            report(word, str(codes.LETTERS_REFUSED[letter]))
            block.partial = True
        elif letter in block.value and (ignored.strict or block.value[letter] != value):
            report(word, f"a second {letter} word on this line; write one")
            return None
        elif abs(value) > NUMBER_MAX:
            report(word, f"the number is too large; at most {NUMBER_MAX:g} is allowed")
            return None
        else:
            block.value[letter], block.at[letter] = value, word
    if not block.partial:
        _check_used(words, block, report, ignored)
    return block


def _settle(words: Words, word: int, row: tuple[int, int], block: Block, ignored: IgnoredWords) -> str | None:
    """Keep a code that moves nothing, or that the user knows to be harmless, as an event. Returns the letters
    behind it that are its own, or `MESSAGE` for all that follows; None for a code that is to be read."""
    letter, value = chr(words.letter[word]), float(words.value[word])
    code = round(min(max(value, -1.0), CODE_MAX) * 10.0)
    if abs(value * 10.0 - code) > 10.0 * _CODE_ROUNDING:
        return None
    name = f"{letter}{codes.number(code)}"
    letters = bytes(words.letter[row[0] : row[1]]).decode("latin-1")
    before = letters[: word - row[0]].replace("N", "").replace("M", "")
    behind = re.split("[GM]", letters[word + 1 - row[0] :], maxsplit=1)[0]  # up to the next code
    found = settings.setting(letter, code, before, behind)
    if name in ignored.reading.ignore:
        probes = letter == "G" and code in settings.PROBES
        ignored.count(settings.PROBING if probes else settings.LEFT_OUT_BY_USER, name, block.line)
        block.stops, block.refused_motion = probes, probes
        block.events.append((letter, code / 10))
        block.partial = True
        block.foreign |= letter == "G"
        alone = letter == "M" and code not in codes.M_GROUP and not before
        return found.letters if found else settings.EVERYTHING if alone else ""
    if ignored.at_tip and letter == "M" and code in _TOOL_POINT_CODES:
        block.tool_point, block.at["tool point"] = code // 10, word
        block.events.append((letter, code / 10))
        return ""
    if found is None or ignored.strict:
        return None
    if found.what is None:
        block.settings.append(settings.Setting(name, {}, word))
    else:
        ignored.count(found.what, words.text(word), block.line)
    block.events.append((letter, code / 10))
    block.stops |= found.stops
    return MESSAGE if letter == "M" and code // 10 in settings.TEXTS and not before else found.letters


def _add_code(
    block: Block, letter: str, value: float, word: int, report: Report, ignored: IgnoredWords
) -> bool:
    """Put a G or M code into its group; True if it was reported instead."""
    code = round(min(max(value, -1.0), CODE_MAX) * 10.0)
    known, refused = (codes.G_GROUP, codes.G_REFUSED) if letter == "G" else (codes.M_GROUP, codes.M_REFUSED)
    exact = abs(value * 10.0 - code) <= 10.0 * _CODE_ROUNDING
    if not exact or code not in known:
        refusal = refused.get(code) if exact else None
        refusal = refusal or codes.unknown(letter, code, strict=ignored.strict or not exact)
        report(word, str(refusal))
        block.foreign |= refusal.takes_axes
        block.refused_motion |= refusal.takes_axes and 330 <= code <= 890
        return True
    group, groups = known[code], block.g if letter == "G" else block.m
    if groups.get(group) == code and not ignored.strict:  # said twice
        return False
    if group in groups:
        both = f"{letter}{codes.number(groups[group])} and {letter}{codes.number(code)}"
        report(word, f"{both} on one line are of the same group ({group}); write one of them, or two lines")
        return True
    groups[group] = code
    block.at[group] = word
    return False


def _check_used(words: Words, block: Block, report: Report, ignored: IgnoredWords) -> None:
    """Report words that no code of the line uses; numbers of offsets are counted. Where the line has no
    motion code, the one in force may use them: the interpreter looks."""
    named = [("G", code) for code in block.g.values()] + [("M", code) for code in block.m.values()]
    block.uses = frozenset("".join(codes.WORDS.get(name, "") for name in named))
    idle = "P" in block.value and "P" not in block.uses and "spindle" in block.m
    if idle and not (ignored.strict or block.has("XYZ")):
        ignored.count(settings.SPINDLE_WORD, words.text(block.at["P"]), block.line)
        del block.value["P"]
    in_force = "" if "motion" in block.g or "cycle end" in block.g else codes.MOTION_WORDS
    if "E" in block.uses:
        ignored.used["E"] += 1
    for letter in sorted(block.value.keys() - block.uses - _ALWAYS - set(in_force), key=block.at.__getitem__):
        if letter in "DH" and not ignored.strict:
            ignored.count(OFFSET_NUMBER, words.text(block.at[letter]), block.line)
        elif ignored.treatment[ord(letter)] != LEFT_OUT:
            report(block.at[letter], unused(letter))
        block.idle[letter] = block.value.pop(letter)
