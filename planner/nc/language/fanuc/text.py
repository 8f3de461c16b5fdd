"""Expressions of Fanuc's and Haas' macros: how they are spelled and what they mean."""

from __future__ import annotations

from planner.nc.language.arithmetic import ARITHMETIC, COMPARISONS
from planner.nc.language.expression_reader import ranked
from planner.nc.language.spelling import Spelling
from planner.nc.language.system_variables import FanucVariables
from planner.nc.language.tree import Language

LOCALS = 33  # #1 to #33 are a call's own
_FUNCTIONS = "ABS ACOS ADP ASIN ATAN BCD BIN COS EXP FIX FUP LN ROUND SIN SQR SQRT TAN"
_RANKS = ranked("EQ NE GT GE LT LE", "+ - OR XOR", "* / MOD AND")
SPELLING = Spelling(functions=frozenset(_FUNCTIONS.split()), ranks=_RANKS, long_values=True)
LANGUAGE = Language(
    operations=ARITHMETIC
    | {
        ("AND", 2): "float(int({0})&int({1}))",
        ("OR", 2): "float(int({0})|int({1}))",
        ("XOR", 2): "float(int({0})^int({1}))",
        ("ATAN", 2): "(atan2({0},{1})%360.0)",
        ("FIX", 1): "float(trunc({0}))",
        ("FUP", 1): "copysign(ceil(abs({0})),{0})",
        ("ROUND", 1): "copysign(floor(abs({0})+0.5),{0})",
    },
    conditions=COMPARISONS,
    locals=LOCALS,
    largest=9999,
    vacant=None,
    system_numbers=FanucVariables.numbers,
    read="({0} or 0.0)",
    raw=frozenset(("EQ", "NE")),
)
