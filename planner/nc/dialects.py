"""Languages that are not RS274NGC, by what only they contain, and files that are no programs at all.

Conversational Heidenhain programs and Siemens programs with their commands and assignments are read by `planner.nc.language`, plotter
files (HPGL) by `planner.nc.hpgl`. The marks below occur in no RS274NGC program outside comments.
"""

from __future__ import annotations

import re

from planner.base.errors import InputError
from planner.nc.hpgl.lexer import CONTROL
from planner.nc.reading import HEIDENHAIN, SIEMENS

# What is repeated below is possessive (*+) or atomic ((?>...)): a text can be read in one way only. Else one that fits nowhere is tried
# in 2^n ways, such as n comments in a file of no language.
_LOOKED_AT = 20_000  # bytes at the start of a file that tell its language
_CONVERSATIONAL = re.compile(
    rb"^[ \t]*(?:\d+[ \t]+)?(BEGIN PGM|BLK FORM|TOOL CALL|TOOL DEF|CYCL DEF)\b", re.MULTILINE | re.IGNORECASE
)
_SIEMENS = re.compile(
    rb"^[ \t]*(?:N\d+[ \t]*)?(DEF[ \t]+(?:REAL|INT|BOOL|STRING)|PROC[ \t]|EXTERN[ \t]|M?CALL[ \t]+CYCLE|CYCLE\d+[ \t]*\(|MSG[ \t]*\(|"
    rb"WORKPIECE[ \t]*\(|SUPA\b|TRAORI\b|TRAFOOF\b|TRANS[ \t]|STOPRE\b|%_N_|[XYZABC]=|R\d+=|(?:ENDIF|ENDWHILE|ENDLOOP|ENDFOR)\b|"
    rb"GOTO[FB]\b)",
    re.MULTILINE | re.IGNORECASE,
)


# A plotter file starts with one of these instructions and a number, the end of the instruction or the next one. No word of an NC
# program is a letter followed by a letter. (A semicolon before it may start a comment of an NC program.)
_FIRST = rb"(?:IN|DF|PU|PD|PA|PR|SP|VS|IP|SC|RO|PS|BP|PG|LT|CO|FS|PW|WU|QL|NP|AF)"
_HPGL = re.compile(
    rb"\A(?:\s|\xef\xbb\xbf)*+(?>"
    + CONTROL
    + rb"[\s;]*)*+"
    + _FIRST
    + rb"(?=[-+.\d,;\s]|"
    + _FIRST
    + rb"|\Z)",
    re.IGNORECASE,
)
_NC = re.compile(rb"\A(?>[%\s]|;[^\n]*|\([^)\n]*\)|/)*+[GMNOFST][ \t]*\d", re.IGNORECASE)
PLOTTER_SUFFIXES = (".plt", ".hpgl", ".hpg", ".hgl", ".hp", ".plo")


_CAM = "make a program of it in a CAM system (for LinuxCNC, grbl or Mach3) and give that"
_MODELS = (
    # name, what only such a file starts with, what to do
    (
        "a drawing (DXF)",
        re.compile(rb"\A\s*+(?>999[^\S\n]*\n[^\n]*\n\s*)*+0\s*\n\s*SECTION\b|\AAutoCAD Binary DXF"),
        _CAM,
    ),
    ("a model (STL)", re.compile(rb"\A\s*solid\b[^\n]*\n\s*(?:facet|endsolid)\b", re.IGNORECASE), _CAM),
    ("a model (STEP)", re.compile(rb"\A\s*ISO-10303-21\s*;"), _CAM),
    (
        "a drawing (SVG)",
        re.compile(rb"\A\s*+(?><\?xml[^>]*>\s*|<!--.*?-->\s*|<!DOCTYPE[^>]*>\s*)*+<svg\b", re.DOTALL),
        _CAM,
    ),
    ("a document (PDF)", re.compile(rb"\A%PDF-\d"), _CAM),
    ("an archive (ZIP, 3MF)", re.compile(rb"\APK\x03\x04"), "unpack it and give the program in it"),
    (
        "a machine file",
        re.compile(rb"^\[axes\.[a-z]\]", re.MULTILINE),
        "give the program, and the machine file as -m FILE",
    ),
    (
        "a file of a control's settings",
        # settings of grbl stand in programs too: a line with a G code makes it one
        re.compile(
            rb"^\[(?:EMC\w*|TRAJ|printer)\]|\A(?!(?:.*+\n)*?[ \t]*+(?:N\d++[ \t]*+)?G\d)(?:.*+\n)*?\$1[12]\d=",
            re.MULTILINE,
        ),
        "make a machine file of it (planner machine import) and give that as -m FILE",
    ),
)
# A binary STL: 80 bytes of any text, the number of triangles, 50 bytes for each.
_STL_HEAD, _STL_TRIANGLE = 84, 50


def refuse_models(data: bytes, source: str) -> None:
    """Raise InputError for drawings, models, settings: files that people have beside their programs."""
    head = data[:_LOOKED_AT]
    triangles = int.from_bytes(data[_STL_HEAD - 4 : _STL_HEAD], "little")
    if triangles and len(data) == _STL_HEAD + _STL_TRIANGLE * triangles:
        raise InputError(f"this is a model (STL), not a program; {_CAM}", source=source)
    for name, mark, remedy in _MODELS:
        if mark.search(head):
            raise InputError(f"this is {name}, not a program; {remedy}", source=source)


def is_plotter_file(data: bytes, source: str) -> bool:
    """True if a text is HPGL: by its content where that is clear, else by the suffix of its name."""
    head = data[:_LOOKED_AT]
    if _HPGL.match(head):
        return True
    return source.lower().endswith(PLOTTER_SUFFIXES) and not _NC.match(head)


def language_of(data: bytes) -> str | None:
    """`HEIDENHAIN` for conversational programs, `SIEMENS` for those of a Sinumerik; None for all others."""
    head = data[:_LOOKED_AT]
    if _CONVERSATIONAL.search(head):
        return HEIDENHAIN
    return SIEMENS if _SIEMENS.search(head) else None
