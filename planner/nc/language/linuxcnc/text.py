"""Expressions of LinuxCNC: how they are spelled and what they mean."""

from __future__ import annotations

from planner.nc.language.arithmetic import ARITHMETIC, COMPARISONS, LOGICAL
from planner.nc.language.expression_reader import ranked
from planner.nc.language.spelling import Spelling
from planner.nc.language.system_variables import LinuxcncVariables
from planner.nc.language.tree import Language

ARGUMENTS_MAX = 30  # #1 to #30 are a call's own
EQUAL = 1e-4  # EQ and NE take numbers this close as equal, as LinuxCNC does
_FUNCTIONS = "ABS ACOS ASIN ATAN COS EXISTS EXP FIX FUP LN ROUND SIN SQRT TAN"
_RANKS = ranked("AND OR XOR", "EQ NE GT GE LT LE", "+ -", "* / MOD", "**")
SPELLING = Spelling(functions=frozenset(_FUNCTIONS.split()), ranks=_RANKS)
LANGUAGE = Language(
    operations=ARITHMETIC
    | {("EQ", 2): f"(abs({{0}}-{{1}})<{EQUAL!r})", ("NE", 2): f"(abs({{0}}-{{1}})>={EQUAL!r})"},
    conditions=COMPARISONS | LOGICAL,
    locals=ARGUMENTS_MAX,
    largest=5601,
    vacant=0.0,
    system_numbers=LinuxcncVariables.numbers,
    system_names=LinuxcncVariables.names,
)
