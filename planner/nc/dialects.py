"""Languages that are not RS274NGC, by what only they contain.

Conversational Heidenhain programs, Siemens programs with their commands and assignments, and plotter files
(HPGL) cannot be read word by word: a message about their first odd letter would not help. The marks below
occur in no RS274NGC program outside comments.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

from planner.nc.faults import Fault


@dataclass(frozen=True)
class _Dialect:
    name: str
    mark: re.Pattern[bytes]
    remedy: str


_LOOKED_AT = 20_000  # bytes at the start of a file that tell its language
_RS274 = "choose a post-processor for RS274NGC (LinuxCNC, grbl, Mach3) in the CAM system"

_DIALECTS = (
    _Dialect(
        "a conversational Heidenhain program",
        re.compile(
            rb"^[ \t]*(?:\d+[ \t]+)?(BEGIN PGM|BLK FORM|TOOL CALL|TOOL DEF|CYCL DEF)\b",
            re.MULTILINE | re.IGNORECASE,
        ),
        _RS274,
    ),
    _Dialect(
        "a Siemens (Sinumerik) program",
        re.compile(
            rb"^[ \t]*(?:N\d+[ \t]*)?(DEF[ \t]+(?:REAL|INT|BOOL|STRING)|PROC[ \t]|EXTERN[ \t]|CYCLE\d+[ \t]*\(|MSG[ \t]*\(|"
            rb"WORKPIECE[ \t]*\(|SUPA\b|TRAFOOF\b|TRANS[ \t]|STOPRE\b|%_N_|[XYZABC]=)",
            re.MULTILINE | re.IGNORECASE,
        ),
        _RS274,
    ),
    _Dialect(
        "a plotter file (HPGL)",
        re.compile(rb"\A\s*(?:\x1b[^;]*)?((?:IN|DF|SP\d*|PA|PU)[-\d, ]*;)", re.IGNORECASE),
        "convert it to G0 and G1 moves with feeds",
    ),
)


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
