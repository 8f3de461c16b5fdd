"""Operators and functions of all dialects, as Python text (`tree.Language`), and what the texts call. Angles are in degrees."""

from __future__ import annotations

import math
from collections.abc import Callable

COMPARISONS = frozenset(("EQ", "NE", "GT", "GE", "LT", "LE"))
LOGICAL = frozenset(("AND", "OR", "XOR", "NOT"))


def modulo(a: float, b: float) -> float:
    """a MOD b, never negative. Raises ZeroDivisionError."""
    if b == 0.0:
        raise ZeroDivisionError
    rest = math.fmod(a, b)
    return rest + abs(b) if rest < 0.0 else rest


def rounded(x: float) -> float:
    """ROUND: halves go away from zero."""
    return float(math.trunc(x + (0.5 if x >= 0 else -0.5)))


def from_decimal_digits(x: float) -> float:
    """BIN: 0x25 read as the decimal digits 25."""
    return float(int(f"{int(x):x}"))


def to_decimal_digits(x: float) -> float:
    """BCD: 25 as 0x25."""
    return float(int(str(int(x)), 16))


FUNCTIONS: dict[str, Callable[..., object]] = {
    **{f.__name__: f for f in (math.exp, math.log, math.log10, math.sqrt, math.hypot, math.trunc, math.fmod)},
    **{f.__name__: f for f in (math.ceil, math.floor, math.copysign, modulo, rounded)},
    "power": math.pow,
    "sin": lambda x: math.sin(math.radians(x)),
    "cos": lambda x: math.cos(math.radians(x)),
    "tan": lambda x: math.tan(math.radians(x)),
    "asin": lambda x: math.degrees(math.asin(x)),
    "acos": lambda x: math.degrees(math.acos(x)),
    "atan": lambda x: math.degrees(math.atan(x)),
    "atan2": lambda y, x: math.degrees(math.atan2(y, x)),
    "binary": from_decimal_digits,
    "decimal": to_decimal_digits,
}
# By name and number of operands. A dialect that means another thing by a name puts its own text in the place of this one.
ARITHMETIC: dict[tuple[str, int], str] = {
    ("-", 1): "(-{0})",
    ("+", 2): "({0}+{1})",
    ("-", 2): "({0}-{1})",
    ("*", 2): "({0}*{1})",
    ("/", 2): "({0}/{1})",
    ("**", 2): "power({0},{1})",
    ("MOD", 2): "modulo({0},{1})",
    ("DIV", 2): "float(trunc({0}/{1}))",
    ("EQ", 2): "({0}=={1})",
    ("NE", 2): "({0}!={1})",
    ("GT", 2): "({0}>{1})",
    ("GE", 2): "({0}>={1})",
    ("LT", 2): "({0}<{1})",
    ("LE", 2): "({0}<={1})",
    ("AND", 2): "({0}!=0 and {1}!=0)",
    ("OR", 2): "({0}!=0 or {1}!=0)",
    ("XOR", 2): "(({0}!=0)!=({1}!=0))",
    ("NOT", 1): "({0}==0)",
    ("ATAN", 2): "atan2({0},{1})",
    ("LEN", 2): "hypot({0},{1})",
    ("MIN", 2): "min({0},{1})",
    ("MAX", 2): "max({0},{1})",
    ("ABS", 1): "abs({0})",
    ("EXP", 1): "exp({0})",
    ("LN", 1): "log({0})",
    ("LOG", 1): "log10({0})",
    ("SQRT", 1): "sqrt({0})",
    ("SQR", 1): "sqrt({0})",
    ("POT", 1): "({0})**2",
    ("INT", 1): "float(trunc({0}))",
    ("TRUNC", 1): "float(trunc({0}))",
    ("FRAC", 1): "({0}-trunc({0}))",
    ("FIX", 1): "float(floor({0}))",
    ("FUP", 1): "float(ceil({0}))",
    ("ROUND", 1): "rounded({0})",
    ("ADP", 1): "({0})",
    ("BIN", 1): "binary({0})",
    ("BCD", 1): "decimal({0})",
    **{(name.upper(), 1): f"{name}({{0}})" for name in ("sin", "cos", "tan", "asin", "acos", "atan")},
}
