"""Where in a program a fault of its compiled run stands."""

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
