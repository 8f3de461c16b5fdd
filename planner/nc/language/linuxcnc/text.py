"""Expressions of LinuxCNC: how they are spelled and what they mean."""

from __future__ import annotations

import math

from planner.nc.language.arithmetic import ARITHMETIC, DEGREES, modulo, rounded
from planner.nc.language.asked import LinuxcncAsked
from planner.nc.language.spelling import Spelling
from planner.nc.language.tree import Language

ARGUMENTS_MAX = 30  # #1 to #30 are a call's own
EQUAL = 1e-4  # EQ and NE take numbers this close as equal, as LinuxCNC does
_FUNCTIONS = (
    "ABS",
    "ACOS",
    "ASIN",
    "ATAN",
    "COS",
    "EXISTS",
    "EXP",
    "FIX",
    "FUP",
    "LN",
    "ROUND",
    "SIN",
    "SQRT",
    "TAN",
)
# Operators of a higher rank bind first.
_RANKS = {
    "**": 5,
    **dict.fromkeys(("*", "/", "MOD"), 4),
    **dict.fromkeys(("+", "-"), 3),
    **dict.fromkeys(("EQ", "NE", "GT", "GE", "LT", "LE"), 2),
    **dict.fromkeys(("AND", "OR", "XOR"), 1),
}
SPELLING = Spelling(functions=frozenset(_FUNCTIONS), ranks=_RANKS)


LANGUAGE = Language(
    name="linuxcnc",
    operations=ARITHMETIC
    | {
        ("**", 2): "power({0},{1})",
        ("MOD", 2): "modulo({0},{1})",
        ("EQ", 2): f"(abs({{0}}-{{1}})<{EQUAL!r})",
        ("NE", 2): f"(abs({{0}}-{{1}})>={EQUAL!r})",
        ("AND", 2): "({0}!=0 and {1}!=0)",
        ("OR", 2): "({0}!=0 or {1}!=0)",
        ("XOR", 2): "(({0}!=0)!=({1}!=0))",
        ("ATAN", 2): "atan2({0},{1})",
        ("FIX", 1): "float(floor({0}))",
        ("FUP", 1): "float(ceil({0}))",
        ("ROUND", 1): "rounded({0})",
    },
    conditions=frozenset(("EQ", "NE", "GT", "GE", "LT", "LE", "AND", "OR", "XOR")),
    functions=DEGREES
    | {
        "exp": math.exp, "log": math.log, "sqrt": math.sqrt, "power": math.pow, "floor": math.floor, "ceil": math.ceil,
        "modulo": modulo, "rounded": rounded,
    },
    locals=ARGUMENTS_MAX,
    largest=5601,
    vacant=0.0,
    asked=LinuxcncAsked.numbers,
    asked_names=LinuxcncAsked.names,
)  # fmt: skip
