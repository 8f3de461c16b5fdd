"""Languages that are not RS274NGC, by what only they contain.

Conversational Heidenhain programs and Siemens programs with their commands and assignments cannot be read word by word: a message
about their first odd letter would not help. The former are read by `planner.nc.language.heidenhain`, plotter files (HPGL) by
`planner.nc.hpgl`. The marks below occur in no RS274NGC program outside comments.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

from planner.nc.faults import Fault
from planner.nc.hpgl.lexer import CONTROL


@dataclass(frozen=True)
class _Dialect:
    name: str
    mark: re.Pattern[bytes]
    remedy: str


_LOOKED_AT = 20_000  # bytes at the start of a file that tell its language
_RS274 = "choose a post-processor for RS274NGC (LinuxCNC, grbl, Mach3) in the CAM system"

_CONVERSATIONAL = re.compile(
    rb"^[ \t]*(?:\d+[ \t]+)?(BEGIN PGM|BLK FORM|TOOL CALL|TOOL DEF|CYCL DEF)\b", re.MULTILINE | re.IGNORECASE
)
_DIALECTS = (
    _Dialect(
        "a Siemens (Sinumerik) program",
        re.compile(
            rb"^[ \t]*(?:N\d+[ \t]*)?(DEF[ \t]+(?:REAL|INT|BOOL|STRING)|PROC[ \t]|EXTERN[ \t]|CYCLE\d+[ \t]*\(|MSG[ \t]*\(|"
            rb"WORKPIECE[ \t]*\(|SUPA\b|TRAFOOF\b|TRANS[ \t]|STOPRE\b|%_N_|[XYZABC]=)",
            re.MULTILINE | re.IGNORECASE,
        ),
        _RS274,
    ),
)


# A plotter file starts with one of these instructions and a number, the end of the instruction or the next one. No word of an NC
# program is a letter followed by a letter. (A semicolon before it may start a comment of an NC program.)
_FIRST = rb"(?:IN|DF|PU|PD|PA|PR|SP|VS|IP|SC|RO|PS|BP|PG|LT|CO|FS|PW|WU|QL|NP|AF)"
_HPGL = re.compile(
    rb"\A(?:\s|\xef\xbb\xbf)*(?:" + CONTROL + rb"[\s;]*)*" + _FIRST + rb"(?=[-+.\d,;\s]|" + _FIRST + rb"|\Z)",
    re.IGNORECASE,
)
_NC = re.compile(rb"\A(?:[%\s]|;[^\n]*|\([^)\n]*\)|/)*[GMNOFST][ \t]*\d", re.IGNORECASE)
PLOTTER_SUFFIXES = (".plt", ".hpgl", ".hpg", ".hgl", ".hp", ".plo")


def is_plotter_file(data: bytes, source: str) -> bool:
    """Whether a text is HPGL: by its content where that is clear, else by the suffix of its name."""
    head = data[:_LOOKED_AT]
    if _HPGL.match(head):
        return True
    return source.lower().endswith(PLOTTER_SUFFIXES) and not _NC.match(head)


def is_conversational(data: bytes) -> bool:
    """Whether a text is a conversational Heidenhain program."""
    return _CONVERSATIONAL.search(data[:_LOOKED_AT]) is not None


def recognise(data: bytes) -> Fault | None:
    """The fault that names the language of a program, if it is not RS274NGC."""
    head = data[:_LOOKED_AT]
    for dialect in _DIALECTS:
        found = dialect.mark.search(head)
        if found:
            at = found.start(1)
            line = head.count(b"\n", 0, at) + 1
            column = at - head.rfind(b"\n", 0, at)
            word = found.group(1).decode("latin-1").strip()
            return Fault(
                line, column, word, f"this looks like {dialect.name}, which is not read; {dialect.remedy}"
            )
    return None
