"""The page of constructs is that of the reader's tables, and each of its constructs comes out as it says."""

from __future__ import annotations

import pytest

from benchmarks.reading import constructs
from planner.base.errors import InputError
from planner.machine import load_machine
from planner.nc.reader import parse_program
from planner.nc.reading import Reading

MILL = load_machine("mill")
HEADS = {
    "Sinumerik": ("siemens", "G17 G90 G71 G94 F600\nS1000 M3\nG0 X1 Y2 Z3\n{0}\nG1 X20 Y8\nM30\n"),
    "Heidenhain": (
        "heidenhain",
        "0 BEGIN PGM T MM\nL X+0 Y+0 Z+5 FMAX M3\n{0}\nL X+20 Y+3 F100\nEND PGM T MM\n",
    ),
    "Fanuc and Haas": ("fanuc", "O1000\nG21 G90 G17 F600\nS1000 M3\nG0 X1 Y2 Z3\n{0} X1\nG1 X20 Y8\nM30\n"),
    "Lathes of Fanuc and Haas": (
        "fanuc",
        "O1000\nG21 G99 F0.2\nG97 S1000 M3\nG0 X1 Z3\n{0}\nG1 X20 W-8\nM30\n",
    ),
}

# Refused only with compensation or rotary axes, which these programs have not.
WITHOUT = ("G451", "M94", "M97", "M98", "M109", "M110", "M114", "M115", "M116", "M138", "M144")


def test_the_page_is_that_of_the_tables() -> None:
    made, _, page = constructs.PAGE.read_text(encoding="utf-8").partition("\n\n")
    assert page == constructs.page(), f"out of date: {made}"


@pytest.mark.parametrize("dialect", HEADS)
def test_each_refused_word_is_refused_with_its_line_and_reason(dialect: str) -> None:
    name, head = HEADS[dialect]
    wrong = []
    for word, outcome, why in constructs.rows()[dialect]:
        if outcome != constructs.REFUSED:
            continue
        direction = word[0] in "ABC" and word[1:].isdecimal()
        behind = "=1" if direction else {"FN": ": X", "CY": " X"}.get(word[:2] if " " in word else "", "")
        text = word + (behind if word != "FGROUP" else "(A)")
        try:
            parse_program(head.format(text), MILL, Reading(dialect=name))
            outcome = "read"
        except InputError as fault:
            outcome = str(fault) if fault.line else "no line"
        away = word in WITHOUT
        if (why.split(";")[0] not in outcome) != away:
            wrong.append((word, outcome))
    assert not wrong
