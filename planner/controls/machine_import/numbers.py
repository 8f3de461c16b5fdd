"""Numbers of settings, checked where they are read."""

from __future__ import annotations

import math
import re

from planner.base.errors import InputError

_BEGINS = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")


def leading_number(text: str) -> float | None:
    """The number with which a text begins, as C's scanf reads "3 mm"; None where it begins with none."""
    found = _BEGINS.match(text.strip())
    return float(found.group()) if found else None


def finite_number(text: str, place: str, source: str, line: int | None = None) -> float:
    """The number that a setting holds. Raises InputError for anything else, with the setting's name and place."""
    try:
        value = float(text.strip())
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise InputError(
            f"{place}: a number is needed, found {text.strip()[:40]!r}", source=source, line=line
        )
    return value


def positive(text: str, place: str, source: str, line: int | None = None) -> float:
    """A number above zero. Raises InputError for anything else."""
    value = finite_number(text, place, source, line)
    if value <= 0:
        raise InputError(f"{place}: must be above 0, found {text.strip()}", source=source, line=line)
    return value
