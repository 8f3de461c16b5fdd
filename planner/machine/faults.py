"""What is wrong in a record of a machine, in words: the key, what is needed and what was found."""

from __future__ import annotations

import difflib
from collections.abc import Mapping, Sequence

from pydantic import ValidationError

FAULTS_SAID = 20  # the others are counted
SHOWN = 60  # characters of a name or a value
# What is needed where pydantic finds a fault of a type; {gt} and so on are its context.
_NEEDED = {
    "greater_than": "must be above {gt:g}",
    "greater_than_equal": "must be {ge:g} or more",
    "less_than": "must be below {lt:g}",
    "finite_number": "must be a finite number",
    "float_type": "must be a number",
    "float_parsing": "must be a number",
    "int_type": "must be a whole number",
    "int_parsing": "must be a whole number",
    "bool_type": "must be true or false",
    "bool_parsing": "must be true or false",
    "string_type": "must be a text",
    "literal_error": "must be {expected}",
    "dict_type": "must be a table",
    "model_type": "must be a table",
    "model_attributes_type": "must be a table",
    "tuple_type": "must be a list",
    "too_short": "must have at least {min_length} entry",
}


def faults_in_words(fault: ValidationError, keys: Mapping[str, Sequence[str]]) -> str:
    """The faults of a record, each with the key, what is needed and what was found.

    keys : of the record, under "", and of each of its tables, under its name
    """
    said: list[str] = []
    found = fault.errors()
    for error in found:
        if len(said) == FAULTS_SAID:
            said.append(f"and {len(found) - FAULTS_SAID:,} more")
            break
        place = [part if len(part) <= SHOWN else f"{part[:SHOWN]}..." for part in map(str, error["loc"])]
        key = ".".join(place)
        if error["type"] == "missing":
            said.append(f"{key}: missing")
        elif error["type"] == "extra_forbidden":
            known = keys.get("" if len(place) == 1 else place[0], ())
            near = difflib.get_close_matches(place[-1], known, n=1)
            said.append(f"{key}: unknown key" + (f" (did you mean '{near[0]}'?)" if near else ""))
        elif error["type"] == "value_error":
            text = error["msg"].removeprefix("Value error, ")
            said.append(f"{key}: {text}" if key else text)
        else:
            needed = _NEEDED.get(error["type"], error["msg"]).format(**error.get("ctx", {}))
            said.append(f"{key}: {needed}, found {shown(error['input'])}")
    return "; ".join(said)


def shown(value: object) -> str:
    """A value as it is named, at most `SHOWN` characters of it."""
    text = repr(value)
    return text if len(text) <= SHOWN else f"{text[:SHOWN]}..."
