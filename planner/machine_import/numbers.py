"""Numbers of settings, checked where they are read."""

from __future__ import annotations

import math

from planner.base.errors import InputError


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
