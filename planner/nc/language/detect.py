"""The language of a text, by what only programs in it contain; and files that are no programs at all.

A program that computes nothing is told from the words that the lexer has made. LinuxCNC's are O words with a
keyword and named parameters; Fanuc's GOTO, IF [ without an O word, WHILE [ with DO, G65, G66, M97, M98, M99,
and sums without brackets behind an equals sign; parameters and brackets alone are read as LinuxCNC's. Text
before the first % is skipped where it cannot be a program: some line of it is no words, and no line that is
words has a code or a coordinate.
"""

import re
from typing import NamedTuple

import numpy as np

from planner.machine import Machine
from planner.nc.hpgl.instructions import CONTROL
from planner.nc.lexer import FAULT, Words, split_words
from planner.nc.printer import is_command
from planner.nc.reading import AUTO, FANUC, GRBL, HEIDENHAIN, LINUXCNC, PRINTERS, Reading
from planner.nc.unreadable import LOOKED_AT

# What is repeated below is possessive (*+) or atomic ((?>...)): a text can be read in one way only. Else one
# that fits nowhere is tried in 2^n ways, such as n comments in a file of no language.
_CONVERSATIONAL = re.compile(
    rb"^[ \t]*(?:\d+[ \t]+)?(BEGIN PGM|BLK FORM|TOOL CALL|TOOL DEF|CYCL DEF)\b|"
    rb"^[ \t]*\d+[ \t]+(?:L[ \t]+I?[XYZ][-+]|CC[ \t]+I?[XYZ][-+]|LBL[ \t]+\d)",
    re.MULTILINE | re.IGNORECASE,
)
# Marks of a Sinumerik's program, behind words of its line that all dialects have; texts of messages are none.
_SIEMENS = re.compile(
    r"\s*(?:/\d?\s*)?(?!N?\d*\s*M(?:11[78]|2[38]|3[023])\b)(?:[A-NP-Z][-+]?(?:\d+\.?\d*|\.\d+)(?![\d.]*\s*=)\s*)*+(?:"
    r"[A-Z_]{2}\w*:\s*(?:N\d+|[GXYZ][\d=]|[A-Z]\d+=)|(?:CR|A[PR]|RP|RNDM?|CHF|CHR|ADIS(?:POS)?|TURN|[IJK]1|ANG|SPOSA?|FRCM?|FB|T|[SMH]\d+|R\d+|OFFN|OVR|[XYZABC]1|DISR|DISC|LIMS|[ABC]3|"
    r"[XYZABCUVWIJKF])\s*=(?!=)|R\d+\s*=|(?:ACC|VELOLIM|FA|FL|SPOSA?|POSA?)\[|R\[[^\]#]*\]\s*=|"
    r"(?:MSG|CYCLE\d+|POCKET\d|SLOT\d|HOLES\d|LONGHOLE|WORKPIECE|SETMS|FGROUP|TRAORI|TRACYL|CASE|SETAL)\s*\(|"
    r"DEF\s+(?:CHAN\s+|NCK\s+)?(?:REAL|INT|BOOL|CHAR|STRING|AXIS|FRAME)\b|\$(?:AA|AC|P|TC|MN|MC|MA|SN|SC|A)_|%_N_|"
    r"(?:GOTO[FBC]|EXTCALL|PROC|EXTERN|CASE)\s|IF\b[^[#]*\bGOTO[FBC]\b|(?:FOR\s+\w+\s*=|CALL\s*\")|"
    r"(?:SUPA|CIP|CT|A?(?:TRANS|ROTS?|SCALE|MIRROR)|TRAORI|TRAFOOF|TRANSMIT|STOPRE|DIAM(?:ON|OF|90)|CFC|CFIN|CFTCP|KONT|NORM|"
    r"BRISK|SOFT|DRIVE|FFWO[NF]|COMP(?:ON|OF|CAD|CURV|SURF)|ORI(?:WKS|MKS|AXES|VECT|SON|SOF)|RTLIO[NF]|CDO[NF]2?|WALIMO[NF]|FNORM|"
    r"UPATH|SPATH|ENDIF|ENDWHILE|ENDLOOP|ENDFOR|MCALL|[BAC]SPLINE|UNTIL|LOOP|INVCW|INVCCW|POLY|WHEN(?:EVER)?|DYN(?:NORM|POS|ROUGH|SEMIFIN|FINISH)|M17|RET)\b)",
    re.IGNORECASE,
)
# Marks of programs that are none of a Sinumerik's: a parameter, commands of Okuma's.
_OF_ANOTHER = re.compile(
    r"[^(;]*?#|\s*(?:N\w+\s+)?(?:CALL\s+O\d|(?:MODIN|MODOUT|NOEX|NLAP|RTS)\b)", re.IGNORECASE
)
_SIEMENS_CODES = (331, 332, 500, *range(505, 600), 601, 602, 603, 621, *range(641, 646), 700, 710)
_PROGRAM_HEAD = re.compile(rb"^(%_N_(\w+)_(MPF|SPF)\b)", re.MULTILINE)
_OF_CYCLES = frozenset(b"PQUWRIJKL")  # letters of a line in which G70 and G71 are cycles
_SUBPROGRAMS = (".mpf", ".spf")
# A plotter file starts with one of these instructions and a number, the end of the instruction or the next
# one. No word of an NC program is a letter followed by a letter. (A semicolon before it may start a comment
# of an NC program.)
_FIRST = rb"(?:IN|DF|PU|PD|PA|PR|SP|VS|IP|SC|RO|PS|BP|PG|LT|CO|FS|PW|WU|QL|NP|AF)"
_BEHIND_CONTROL = rb"\A(?:\s|\xef\xbb\xbf)*+(?>" + CONTROL + rb"[\s;]*)*+"
_HPGL = re.compile(_BEHIND_CONTROL + _FIRST + rb"(?=[-+.\d,;\s]|" + _FIRST + rb"|\Z)", re.IGNORECASE)
_MACRO = re.compile(rb"\s*[A-Z]+_[A-Z]", re.IGNORECASE)  # PRINT_START of a printer
_NC = re.compile(rb"\A(?>[%\s]|;[^\n]*|\([^)\n]*\)|/)*+[GMNOFST][ \t]*\d", re.IGNORECASE)
PLOTTER_SUFFIXES = (".plt", ".hpgl", ".hpg", ".hgl", ".hp", ".plo")
_CL_FILE = re.compile(rb"(?mi)^[ \t]*(?:GOTO|FROM|FEDRAT|MULTAX|LOADTL|PARTNO|CUTTER)[ \t]*/")
LATHE_NOTE = (
    "read as the program of a Fanuc or Haas lathe: X and U are diameters, U and W increments, feeds per turn until G98 "
    "([dialect] lathe = false in the machine file if it is none)"
)
# Codes that call and return, save and restore modes.
_CALLS = {"M": (70, 71, 72, 73, 97, 98, 99), "G": (65, 66, 67)}
# Codes of Fanuc's and Haas' mills that begin something: frames, patterns and pockets; and those that end it.
_FRAMES = (12, 13, 16, 51, 51.1, 68, 68.2, 70, 71, 72, 101)
_FRAME_ENDS = (15, 50, 50.1, 53.1, 69, 100)
_COMMENT = re.compile(r"\([^()]*\)|;.*|\s")
_O_WORD = r"O(?:\d+|<[^>]*>|\[.*?\]|#[\d<>\w]+)"
_LINUXCNC = re.compile(
    rf"{_O_WORD}(?:SUB|ENDSUB|CALL|IF|ELSEIF|ELSE|ENDIF|WHILE|ENDWHILE|DO|REPEAT|ENDREPEAT|RETURN|BREAK|CONTINUE)|#<"
)
_FANUC = re.compile(
    r"GOTO|POPEN|PCLOS|[DB]PRNT\[|SETVN\d|#(?:[6-9]|1\d)\d{3}(?!\d)|[=\[]#4[0-3]\d\d(?!\d)|^(?:/\d?)?(?:N\d+)?(?:IF\[|WHILE\[|DO\d|END\d|#[\d\[\]#]+=[^\[\]]*[#\d.][-+*/]|#[\d\[\]#]+=#0(?!\d)|"
    r"[A-Z\d.]*(?:G6[567](?![\d.])|M9[789](?![\d.])))"
)
_FRAME = re.compile(
    r",[ACR](?=[-+.\d#\[])|G0*(?:16|51(?:\.1)?|68(?:\.2)?)(?![\d.])|G1[23](?![\d.]).*I|G101(?![\d.]).*[XYZ]|G7[012](?![\d.])(?=.*I)(?=.*L)"
)
_ENDS_FRAME = re.compile(r"G0*(?:15|50(?:\.1)?|53\.1|69|100)(?![\d.])")
# Signs of lathes, and of others (`_has_signs`).
_TOOL_AND_OFFSET = re.compile(r"T(?:\d{4}|(\d)0\1)", re.IGNORECASE)
_SPEED_MAX, _SURFACE_SPEED, _PER_TURN, _TOOL_CHANGE = 50.0, 96.0, 99.0, 6.0
_RETRACTING = (73.0, 74.0, 76.0, *(float(n) for n in range(81, 90)))
_OF_OTHERS = (7.0, 8.0, 17.0, 19.0, 93.0, 95.0)
_CYCLES_OF_LATHES = (90.0, 91.0, 94.0)
_EITHER = re.compile(r"[#\[]|^(?:N\d+)?M7[0-3]$")
_STATEMENTS = (_EITHER, _LINUXCNC, _FANUC)
_SHOWN = 30  # characters of the text in the note
_JSON = re.compile(rb'^[ \t]*\{[ \t]*"?gc"?[ \t]*:[ \t]*"([^"\n]*)"[^\n]*', re.MULTILINE)
_FIRST_PERCENT = re.compile(rb"^[ \t]*%", re.MULTILINE)
_LANGUAGE = re.compile(rb"[#\[<=]")
_DOES = np.frombuffer(b"GMXYZ", dtype=np.uint8)


class Archived(NamedTuple):
    """A program of an archive."""

    lines: int  # before it in the file
    body: bytes  # behind its name, with blanks for that

    def text(self) -> bytes:
        """The program with blank lines for all that stands before it, so that lines and columns are those of the file."""
        return b"\n" * self.lines + self.body


def programs_of(data: bytes) -> dict[str, Archived]:
    """The programs of a Sinumerik's archive by the names of their files, in small letters; {} for a file of one program."""
    before, *programs = _PROGRAM_HEAD.split(data) if data.count(b"%_N_") > 1 else (b"",)
    found, lines = dict[str, Archived](), before.count(b"\n")
    for head, name, kind, body in zip(*(programs[k::4] for k in range(4)), strict=True):
        found[f"{name.decode()}.{kind.decode()}".lower()] = Archived(lines, b" " * len(head) + body)
        lines += body.count(b"\n")
    return found


def units(words: Words) -> list[int]:
    """The words G70 and G71 that no word of a cycle stands beside: inch and mm, as G20 and G21."""
    found = words.find("G", 70.0, 71.0).tolist()
    return [word for word in found if not _OF_CYCLES & set(words.of_rows(words.row(word))[0].tolist())]


def is_plotter_file(data: bytes, source: str) -> bool:
    """True if a text is HPGL: by its content where that is clear, else by the suffix of its name."""
    head = data[:LOOKED_AT]
    if _HPGL.match(head):
        return not _MACRO.match(head)
    return source.lower().endswith(PLOTTER_SUFFIXES) and not _NC.match(head)


def is_cl_file(data: bytes) -> bool:
    """True if a text is a CL file (APT)."""
    return _CL_FILE.search(data[:LOOKED_AT]) is not None


def language_of(data: bytes) -> str | None:
    """`HEIDENHAIN` for conversational programs; None for all others."""
    return HEIDENHAIN if _CONVERSATIONAL.search(data[:LOOKED_AT]) else None


def siemens_mark(words: Words, source: str) -> str:
    """What says that a program is one of a Sinumerik: the ending of its file, a G code, or a line with a mark;
    empty for other programs."""
    if source.lower().endswith(_SUBPROGRAMS):
        return "its name"
    if len(codes := words.find("G", *_SIEMENS_CODES)):
        return f"{words.text(codes[0])} in line {words.line[words.row(codes[0])]}"
    for row in words.rows_with(words.find("G", 4.0)):
        letters = set(words.of_rows(row)[0].tolist())
        if ord("F") in letters and not letters & set(b"PXUS"):
            return f"G4 F in line {words.line[row]}"
    odd = words.rows_with(
        np.flatnonzero((words.letter == FAULT) | np.isin(words.letter, (ord("%"), ord("O"))))
    )
    marked = (row for row in odd if _SIEMENS.match(words.row_text(row)))
    first = next(marked, None)
    if first is None or any(_OF_ANOTHER.match(words.row_text(row)) for row in odd):
        return ""
    return f"line {words.line[first]}, {words.row_text(first).strip()[:_SHOWN]!r}"


def without_leader(data: bytes, reading: Reading) -> tuple[bytes, str]:
    """The program with blanks for the text before its first %, and the beginning of that text ("" where there
    is none); of TinyG's {"gc":"..."} the G code alone. Offsets and lines stay as they are. Strict reading has
    neither."""
    if reading.strict:
        return data, ""
    if b"{" in data:
        data = _JSON.sub(
            lambda found: found[1].rjust(found.end(1) - found.start()).ljust(len(found[0])), data
        )
    match = _FIRST_PERCENT.search(data[:LOOKED_AT])
    text = data[: match.start()] if match else b""
    if not text.strip() or _LANGUAGE.search(text) or not _is_text(text):
        return data, ""
    shown = " ".join(text.decode("utf-8", "replace").split())[:_SHOWN]
    return re.sub(rb"[^\r\n]", b" ", text) + data[len(text) :], shown


def _is_text(text: bytes) -> bool:
    words = split_words(text, block_delete=False)
    odd = np.add.reduceat(words.letter == FAULT, words.first[:-1]) if len(words.letter) else np.zeros(0)
    does = np.add.reduceat(np.isin(words.letter, _DOES), words.first[:-1]) if len(words.letter) else odd
    return bool((odd > 0).any() and not ((odd == 0) & (does > 0)).any())


def may_compute(words: Words) -> list[int]:
    """Rows, ascending, that may be of a language: not split by the lexer, with an O word or a call."""
    found = [np.flatnonzero((words.letter == FAULT) | (words.letter == ord("O")))]
    found += [words.find(letter, *numbers) for letter, numbers in _CALLS.items()]
    begun = words.find("G", *_FRAMES)
    found += [begun, *([words.find("G", *_FRAME_ENDS)] if len(begun) else [])]
    return words.rows_with(np.concatenate(found))


def bare(text: str) -> str:
    """A line without comments and blanks, in capitals."""
    return _COMMENT.sub("", text).upper()


def computes(text: str) -> bool:
    """True if a bare line is a statement of a language rather than words."""
    return text[:1] != "$" and any(sign.search(text) for sign in (*_STATEMENTS, _FRAME))


def ends_frame(text: str) -> bool:
    """True if a bare line ends a frame of Fanuc's, which is a statement where frames begin."""
    return bool(_ENDS_FRAME.search(text))


def dialect_of(words: Words, reading: Reading, *, prints: bool = False) -> str | None:
    """The language that a program computes in, or None; `Reading.dialect` decides where it is given. Commands of
    a printer (`prints`) are of none."""
    ends = words.find("M", 2, 30)
    found, end = None, words.row(int(ends[0])) if len(ends) else len(words.line)
    for row in may_compute(words):
        if row > end and found is None:
            return None  # what follows the end of a program that computes nothing is not read
        text = bare(words.row_text(row))
        frame = _FRAME.search(text)
        only = frame is not None and not any(sign.search(text) for sign in _STATEMENTS)
        of_language = '"' not in text and (_LINUXCNC.search(text) or _FANUC.search(text))
        of_printer = prints and not of_language and is_command(words.row_text(row))
        # words that RS274NGC has not, or that the user leaves out
        left_out = frame is not None and frame[0].replace("G0", "G") in reading.ignore
        not_read = prints or left_out or reading.strict or reading.dialect not in (AUTO, FANUC)
        if not computes(text) or of_printer or (only and not_read):
            continue
        if reading.dialect not in (AUTO, *PRINTERS):
            return LINUXCNC if reading.dialect == GRBL else reading.dialect
        if _LINUXCNC.search(text):
            return LINUXCNC
        if _FANUC.search(text) or only:
            found = FANUC
        found = found or LINUXCNC
    return found


def is_turned(words: Words, dialect: str | None, reading: Reading, machine: Machine | None) -> bool:
    """True if a program, found to be of that dialect, is one for a Fanuc or Haas lathe. `[dialect] lathe` of
    the machine decides. Otherwise it has no Y and V, and U or W (where these are no axes of the machine)
    beside X and Z, a cycle G70 to G73 with P and Q, a G76 with K and D, or another sign of a lathe
    (`_has_signs`)."""
    if reading.strict or reading.dialect not in (AUTO, FANUC):
        return False
    texts = (bare(words.row_text(row)) for row in may_compute(words))
    if dialect == LINUXCNC and any(map(_LINUXCNC.search, texts)):
        return False
    if machine is not None and machine.dialect is not None and machine.dialect.lathe is not None:
        return machine.dialect.lathe
    polar = (112.0, 113.0)  # of Haas' lathes; of mills they are work systems among others
    if all(len(words.find("G", code)) for code in polar) and not len(words.find("G", 110.0, 111.0, 114.0)):
        return True
    letters = _letters(words)
    if letters & set("YV"):
        return False
    of_machine = set() if machine is None else {letter.upper() for letter in machine.axes}
    if letters >= set("XZ") and letters & (set("UW") - of_machine):
        return not letters & set(reading.ignore)
    for codes, needed in (((70.0, 71.0, 72.0, 73.0), "PQ"), ((76.0,), "KD")):
        if any(letters >= set(needed) for letters in _rows_with(words, "G", *codes)):
            return True
    return letters >= set("XZ") and _has_signs(words)


def has_two_axes(words: Words) -> bool:
    """True if a program has X and Z and no Y: it may be one for a lathe."""
    return _letters(words) & set("XYZ") == set("XZ")


def _has_signs(words: Words) -> bool:
    """True if a program without Y has a sign of a Fanuc or Haas lathe (G code system A), and none of a mill
    or of another lathe.

    Signs are a tool with its offset in one word of four digits (T0101), G50 or G96 with S, and G99 without
    the cycles whose retract it is on mills. J, M6, planes but G18, feed modes and diameters of LinuxCNC (G93,
    G95, G7, G8), D beside G96, and G90, G91 or G94 without coordinates (G90 and G94 are cycles of system A)
    are of others.
    """
    if "J" in _letters(words) or _rows_with(words, "M", _TOOL_CHANGE) or _rows_with(words, "G", *_OF_OTHERS):
        return False
    fast = _rows_with(words, "G", _SURFACE_SPEED)
    cycles = _rows_with(words, "G", *_CYCLES_OF_LATHES)
    if any("D" in letters for letters in fast) or not all(letters & set("XZUW") for letters in cycles):
        return False
    if any("S" in letters for letters in (*fast, *_rows_with(words, "G", _SPEED_MAX))):
        return True
    if _rows_with(words, "G", _PER_TURN) and not _rows_with(words, "G", *_RETRACTING):
        return True
    tools = np.flatnonzero(words.letter == ord("T")).tolist()
    return any(_TOOL_AND_OFFSET.fullmatch(words.text(word)) for word in tools)


def _rows_with(words: Words, letter: str, *codes: float) -> list[set[str]]:
    """The letters of each row with one of the codes."""
    rows = words.rows_with(words.find(letter, *codes))
    return [{chr(c) for c in words.of_rows(row)[0]} for row in rows]


def _letters(words: Words) -> set[str]:
    return {chr(c) for c in np.unique(words.letter) if c}


def is_fanuc(words: Words, dialect: str | None, reading: Reading) -> bool:
    """True if a program that computes nothing has a mark of Fanuc's and Haas' controls: G54.1 beside L words, or
    before its first move the number of a program (O1000), which LinuxCNC, grbl and printers do not have."""
    if "L" in _letters(words) and len(words.find("G", 54.1)) > 0:
        return True
    if dialect is not None or reading.dialect != AUTO or reading.strict:
        return False
    numbers = np.flatnonzero((words.letter == ord("O")) & (words.value >= 0.0))
    moves = np.flatnonzero(np.isin(words.letter, list(b"XYZ")))
    return len(numbers) > 0 and (not len(moves) or bool(numbers[0] < moves[0]))
