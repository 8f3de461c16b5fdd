"""What the operators and functions of every dialect have in common, as Python text (`tree.Language`). Angles are in degrees."""

from __future__ import annotations

import math
from collections.abc import Callable

from planner.nc.language.spelling import NEGATIVE


def modulo(a: float, b: float) -> float:
    """a MOD b, never negative. Raises ZeroDivisionError."""
    if b == 0.0:
        raise ZeroDivisionError
    rest = math.fmod(a, b)
    return rest + abs(b) if rest < 0.0 else rest


def rounded(x: float) -> float:
    """ROUND: halves go away from zero."""
    return float(math.trunc(x + (0.5 if x >= 0 else -0.5)))


DEGREES: dict[str, Callable[..., object]] = {
    "sin": lambda x: math.sin(math.radians(x)),
    "cos": lambda x: math.cos(math.radians(x)),
    "tan": lambda x: math.tan(math.radians(x)),
    "asin": lambda x: math.degrees(math.asin(x)),
    "acos": lambda x: math.degrees(math.acos(x)),
    "atan": lambda x: math.degrees(math.atan(x)),
    "atan2": lambda y, x: math.degrees(math.atan2(y, x)),
}
ARITHMETIC: dict[tuple[str, int], str] = {
    (NEGATIVE, 1): "(-{0})",
    ("+", 2): "({0}+{1})",
    ("-", 2): "({0}-{1})",
    ("*", 2): "({0}*{1})",
    ("/", 2): "({0}/{1})",
    ("GT", 2): "({0}>{1})",
    ("GE", 2): "({0}>={1})",
    ("LT", 2): "({0}<{1})",
    ("LE", 2): "({0}<={1})",
    ("ABS", 1): "abs({0})",
    ("EXP", 1): "exp({0})",
    ("LN", 1): "log({0})",
    ("SQRT", 1): "sqrt({0})",
    **{(name.upper(), 1): f"{name}({{0}})" for name in ("sin", "cos", "tan", "asin", "acos", "atan")},
}
