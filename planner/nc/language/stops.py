"""Messages of a running program that is stopped, and where it stands."""

from __future__ import annotations

from collections.abc import Mapping
from types import TracebackType

from planner.nc.language.compiled import Compiled
from planner.nc.language.tree import SourcePlace


def statement_of(traceback: TracebackType | None, units: Mapping[str, Compiled]) -> SourcePlace:
    """The statement that a traceback ends in; `units` are the compiled procedures by their marker."""
    place = None
    while traceback is not None:
        unit = units.get(traceback.tb_frame.f_code.co_filename)
        if unit is not None:
            place = unit.places[traceback.tb_lineno - 1]
        traceback = traceback.tb_next
    assert place is not None
    return place


def last_statement(units: Mapping[str, Compiled]) -> SourcePlace:
    """The last statement of the main program, the first of the units."""
    main = next(iter(units.values()))
    return max((place for place in main.places if place.file == 0), key=lambda place: place.at)


class Endless(ValueError):
    """A limit of the running program is reached; `what` says which."""

    def __init__(self, what: str):
        super().__init__(
            f"stopped after {what}: does this loop end? if it does, split the program "
            "(limits: TURNS_MAX, ROWS_MAX, BY_WORD_MAX in planner.nc.language.run)"
        )


class TooDeep(ValueError):
    """Too many calls are open."""


def sentence(fault: Exception) -> str:
    """The message for a Python error of the compiled program."""
    text = str(fault)
    if isinstance(fault, ZeroDivisionError):
        return "division by zero"
    if isinstance(fault, OverflowError):
        return "the result is too large"
    if isinstance(fault, KeyError):
        return f"the named parameter #<{fault.args[0]}> has no value here; assign one before it is read"
    if text == "math domain error" or text.startswith("expected a"):
        return "the function or power is not defined for this number"
    return text
