"""Expressions of Fanuc's and Haas' macros: how they are spelled and what they mean."""

from __future__ import annotations

import math

from planner.nc.language.arithmetic import ARITHMETIC, DEGREES, modulo
from planner.nc.language.asked import FanucAsked
from planner.nc.language.spelling import Spelling
from planner.nc.language.tree import Language

LOCALS = 33  # #1 to #33 are a call's own
_FUNCTIONS = (
    "ABS", "ACOS", "ADP", "ASIN", "ATAN", "BCD", "BIN", "COS", "EXP", "FIX", "FUP", "LN", "ROUND", "SIN", "SQR", "SQRT", "TAN",
)  # fmt: skip
# Operators of a higher rank bind first.
_RANKS = {
    **dict.fromkeys(("*", "/", "MOD", "AND"), 3),
    **dict.fromkeys(("+", "-", "OR", "XOR"), 2),
    **dict.fromkeys(("EQ", "NE", "GT", "GE", "LT", "LE"), 1),
}
SPELLING = Spelling(functions=frozenset(_FUNCTIONS), ranks=_RANKS, long_values=True)


def from_decimal_digits(x: float) -> float:
    """BIN: 0x25 read as the decimal digits 25."""
    return float(int(f"{int(x):x}"))


def to_decimal_digits(x: float) -> float:
    """BCD: 25 as 0x25."""
    return float(int(str(int(x)), 16))


def angle(y: float, x: float) -> float:
    """ATAN[y]/[x] in degrees, from 0 to 360."""
    return math.degrees(math.atan2(y, x)) % 360.0


LANGUAGE = Language(
    name="fanuc",
    operations=ARITHMETIC
    | {
        ("MOD", 2): "modulo({0},{1})",
        ("EQ", 2): "({0}=={1})",
        ("NE", 2): "({0}!={1})",
        ("AND", 2): "float(int({0})&int({1}))",
        ("OR", 2): "float(int({0})|int({1}))",
        ("XOR", 2): "float(int({0})^int({1}))",
        ("ATAN", 2): "angle({0},{1})",
        ("FIX", 1): "float(trunc({0}))",
        ("FUP", 1): "copysign(ceil(abs({0})),{0})",
        ("ROUND", 1): "copysign(floor(abs({0})+0.5),{0})",
        ("SQR", 1): "sqrt({0})",
        ("ADP", 1): "({0})",
        ("BIN", 1): "binary({0})",
        ("BCD", 1): "decimal({0})",
    },
    conditions=frozenset(("EQ", "NE", "GT", "GE", "LT", "LE")),
    functions=DEGREES
    | {
        "exp": math.exp, "log": math.log, "sqrt": math.sqrt, "floor": math.floor, "ceil": math.ceil, "trunc": math.trunc,
        "copysign": math.copysign, "modulo": modulo, "angle": angle, "binary": from_decimal_digits, "decimal": to_decimal_digits,
    },
    locals=LOCALS,
    largest=9999,
    vacant=None,
    asked=FanucAsked.numbers,
    read="({0} or 0.0)",
    raw=frozenset(("EQ", "NE")),
)  # fmt: skip
