"""The text of an error is for a terminal: words that it quotes cannot make it do something."""

from __future__ import annotations

import pytest

from planner.base.errors import InputError, printable
from planner.nc.reader import parse_program


@pytest.mark.parametrize("word", ["\x1b[2JK@!", "\x1b]0;title\x07", "\x9b31m", "\x00\x7f"])
def test_control_characters_of_a_program_are_escapes_in_its_errors(word: str) -> None:
    for text in (f"G1 {word}\n", f"G1 X{word}\n", f"(comment)\n{word}\n"):
        with pytest.raises(InputError) as fault:
            parse_program(text, source=f"job{word}.ngc")
        said = str(fault.value)
        assert not [c for c in said if ord(c) < 32 or 127 <= ord(c) < 160], said
        assert f"job{printable(word)}.ngc:" in said


def test_lines_tabs_and_letters_stay() -> None:
    assert printable("a\tb\nü µ") == "a\tb\nü µ"
    assert str(InputError("two\nlines", source="ü.ngc", line=3)) == "ü.ngc:3: two\nlines"
