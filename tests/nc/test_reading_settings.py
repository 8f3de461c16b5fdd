"""`Reading`: what is left out because the user says so, extruders, feeds and arc centres that the program does not say."""

from __future__ import annotations

import numpy as np
import pytest
from same_program import NO_EXTRUDER, STRICT, machine, same_motion

from planner.base.errors import InputError
from planner.nc.program import Kind
from planner.nc.reader import parse_program
from planner.nc.reading import Reading, ignore_list

# --- settings of the reader -----------------------------------------------------------------------------------------------


def test_ignored_codes_are_left_out_with_what_belongs_to_them() -> None:
    reading = Reading(ignore=ignore_list("M6, g29,G51,M777,$J"))
    program = parse_program("G21 G0 X1\nT1 M6\nG29\nG51 X2 Y3\nM777 X5\n$J=X1\nG0 X3", reading=reading)
    assert program.end[:, 0].tolist() == [1, 3]
    assert program.kind.tolist() == [Kind.RAPID, Kind.RAPID]
    assert any(
        note.startswith("4 words: left out, as --ignore says; first M6 line 2") for note in program.notes
    )
    assert program.reading == reading


def test_the_list_of_ignored_codes_has_one_form() -> None:
    assert ignore_list(" m007,M 428,G12.1,,a,$h,M7,print_start, 3-5,7") == (
        *("M7", "M428", "G12.1", "A", "$H", "PRINT_START", "3-5", "7"),
    )
    for wrong in (
        "X",
        "M",
        "G1",
        "G81",
        "G5.2",
        "M30",
        "M98",
        "M2",
        "G20",
        "F100",
        "TRANS",
        "FN 18",
        "LP",
        "if",
        "3-",
        "M1.23",
    ):
        with pytest.raises(InputError, match="ignore"):
            ignore_list(wrong)


def test_values_of_settings_are_checked() -> None:
    for given in ({"arc_centres": "maybe"}, {"extruder": "keep"}, {"ignore": "M6"}):
        with pytest.raises(InputError, match=next(iter(given))):
            Reading(**given)  # type: ignore[arg-type]


def test_extruder_words_are_left_out_if_the_user_says_so() -> None:
    text = "M82\nG21 G92 E0\nG1 X1 Y1 E0.5 F600\nG1 E-2 F2400\nG1 X2 E1e-05\nG0 X3"
    plain = parse_program("\nG21\nG1 X1 Y1 F600\nG1 F2400\nG1 X2\nX3")
    program = parse_program(text, reading=NO_EXTRUDER)
    assert same_motion(program, plain)
    assert any(note.startswith("4 E words: left out (--extruder ignore)") for note in program.notes)
    with pytest.raises(InputError, match="--extruder ignore"):
        parse_program(text, reading=Reading(extruder="refuse"))
    left_out = parse_program(text)  # a printer's program for a machine without an extruder
    assert same_motion(left_out, plain)
    assert any(
        "4 E words: left out (the machine file has no table [axes.e])" in a for a in left_out.assumptions
    )


def test_dwells_of_printers_are_in_milliseconds() -> None:
    assert parse_program("M83\nG4 P1500\nG4 S2\nG4").dwell.tolist() == [1.5, 2.0, 0.0]
    assert parse_program("G4 P1.5\nG4 S2").dwell.tolist() == [1.5, 2.0]
    assert parse_program("M83\nG4").kind.tolist() == [Kind.STOP]
    both = parse_program("M83\nG4 P500 S2")
    assert both.dwell.tolist() == [2.0]
    assert [event.text for event in both.events] == ["M83"]


def test_the_machine_may_have_a_feed_for_moves_before_the_first() -> None:
    text = "G20 G1 X1\nX2\nX3 F60"
    program = parse_program(text, machine(feed_default=12.7))
    assert program.feed.tolist() == [12.7, 12.7, 25.4]
    assert "line 1: no feed before the first feed move: the machine's feed_default, F30" in program.notes
    for given, reading in ((machine(), Reading()), (machine(feed_default=1.0), STRICT)):
        with pytest.raises(InputError, match=r"without a feed.*feed_default"):
            parse_program(text, given, reading)


def test_a_feed_of_zero_takes_the_feed_away_and_on_printers_keeps_it() -> None:
    """LinuxCNC and grbl refuse the next feed move; Marlin passes over F0."""
    with_default = machine(feed_default=12.7)
    for text in ("G21 G1 X1 F60\nX2 F0", "G21 G1 X1 F60\nG0 X2 F0\nG1 X3", "G21 G1 X1 F60\nG93\nG94\nX2"):
        with pytest.raises(InputError, match=r"without a feed.*write an F word on this line or before it$"):
            parse_program(text, with_default)
    kept = parse_program("M83\nG21 G1 X1 F60\nX2 F0\nX3", with_default)
    assert kept.feed.tolist() == [1.0, 1.0, 1.0]
    assert any("F0 keeps the feed" in text for text in kept.assumptions)


# --- arc centres ----------------------------------------------------------------------------------------------------------


def arcs(centre: str, rng: np.random.Generator, count: int = 8) -> str:
    """Quarter turns one after the other, from points far from zero."""
    lines, at = ["G21 F600 G0 X50 Y20"], np.array([50.0, 20.0])
    for _ in range(count):
        spoke = rng.uniform(2, 9, 2).round(3)
        middle = at + spoke
        end = middle + np.array([spoke[1], -spoke[0]])  # -spoke turned left by 90 degrees
        i, j = spoke if centre == "incremental" else middle
        lines.append(f"G3 X{end[0]:.3f} Y{end[1]:.3f} I{i:.3f} J{j:.3f}")
        at = end
    return "\n".join(lines)


@pytest.mark.parametrize("seed", range(5))
def test_centres_are_read_by_the_look_of_the_whole_program(seed: int) -> None:
    incremental = parse_program(arcs("incremental", np.random.default_rng(seed)))
    text = arcs("absolute", np.random.default_rng(seed))
    absolute = parse_program(text)
    assert same_motion(absolute, incremental) or np.allclose(absolute.arc_center, incremental.arc_center)
    assert absolute.notes[0].startswith(
        "line 2: arc centres read as absolute, as after G90.1: 8 arcs close only so"
    )
    assert absolute.reading.arc_centres == "absolute"
    assert not incremental.notes
    assert same_motion(absolute, parse_program(text, reading=Reading(arc_centres="absolute")))
    for reading in (Reading(arc_centres="incremental"), STRICT):
        with pytest.raises(InputError, match=r"if its centre were absolute: write G90\.1"):
            parse_program(text, reading=reading)


def test_programs_that_say_it_and_mixed_ones_are_not_guessed() -> None:
    text = arcs("absolute", np.random.default_rng(1))
    with pytest.raises(InputError, match=r"G90\.1"):
        parse_program("G91.1\n" + text)
    with pytest.raises(InputError, match="apart"):
        parse_program(text + "\nG3 X100 Y100 I1 J0")
    both = arcs("incremental", np.random.default_rng(1)) + "\n" + arcs("absolute", np.random.default_rng(2))
    with pytest.raises(InputError, match=r"G90\.1"):
        parse_program(both)


def test_a_centre_of_zero_along_the_axis_is_none() -> None:
    assert same_motion(parse_program("F60 G2 X2 I1 J0 K0"), parse_program("F60 G2 X2 I1 J0"))
    with pytest.raises(InputError, match="K in the x y plane"):
        parse_program("F60 G2 X2 I1 J0 K1")


def test_a_loop_that_only_switches_something_ends_with_a_sentence() -> None:
    with pytest.raises(InputError, match="lines executed without a move"):
        parse_program("o1 while [1]\nM9\no1 endwhile")


# A line of a Sinumerik's or a conversational program that is refused, what is left out of it, and what stays.
LEFT_OUT = [
    ("WMAT", "wmat", ""), ("N5 WMAT(1, 2) ; WMAT", "WMAT", ""), ("MY_SUB(3)", "MY_SUB", ""), ("X12 WMAT", "WMAT", "X12"),
    ("G1 ACC[X]=50 X12 ACC[Y]=20", "ACC", "G1 X12"), ("XYZZY=3 X15", "XYZZY", "X15"), ('MSG("FOO")\nFOO\r', "FOO", ""),
    ("12 SQL Q1", "SQL", ""), ("FN17: SYSWRITE ID 5 = 3", "FN 17", ""),
]  # fmt: skip
SINUMERIK = "DEF REAL A\nG90 G54 G17 G71\nG0 X0 Y0\nG1 X10 F500\n{}\nX20\nM30\n"
CONVERSATIONAL = "BEGIN PGM A MM\nL X+0 Y+0 Z+10 FMAX\nL X+10 F500\n{}\nL X+20\nEND PGM A MM\n"


@pytest.mark.parametrize(("line", "name", "stays"), LEFT_OUT)
def test_words_that_move_nothing_are_left_out_before_words_are_split(
    line: str, name: str, stays: str
) -> None:
    frame = CONVERSATIONAL if line[:2] in ("12", "FN") else SINUMERIK
    reading = Reading(ignore=(name,))
    with pytest.raises(InputError):
        parse_program(frame.format(line))
    program = parse_program(frame.format(line), reading=reading)
    assert program.end.tolist() == parse_program(frame.format(stays)).end.tolist()
    assert any("--ignore says" in note for note in program.notes)


def test_what_moves_is_not_left_out_with_a_word() -> None:
    for name in ("TRAORI", "CYCL DEF 200", "CYCLE81", "FUNCTION TCPM", "TRANSMIT", "GOTOF"):
        with pytest.raises(InputError, match="cannot be left out: it moves"):
            Reading(ignore=(name,))
    with pytest.raises(InputError, match=r"FOO stands beside X10, .* line of its own") as caught:
        parse_program(SINUMERIK.format("N5 FOO X10"), reading=Reading(ignore=("FOO",)))
    assert (caught.value.line, caught.value.column) == (5, 4)
    program = parse_program(SINUMERIK.format(""), reading=Reading(ignore=("WMTA",)))
    assert any("WMTA, which is nowhere in it, is left out" in note for note in program.assumptions)


def test_a_feed_of_zero_is_named_where_no_feed_is() -> None:
    with pytest.raises(InputError, match=r"without a feed \(F0 in line 2, column 4, is none\)"):
        parse_program("G21\nG0 F0\nG1 X10\n")
    with pytest.raises(InputError, match="without a feed;"):
        parse_program("G21\nG0 F0\nG93\nG94\nF20\nG95\nG94\nG1 X10\n")


def test_a_conversational_program_is_known_under_another_dialect() -> None:
    with pytest.raises(InputError, match=r"looks like Heidenhain's: leave --dialect out"):
        parse_program(CONVERSATIONAL.format(""), reading=Reading(dialect="fanuc"))


@pytest.mark.parametrize("name", ["RPL", "AC", "CIC", "PO", "FMAX"])
def test_words_that_say_where_or_how_fast_a_move_goes_are_not_left_out(name: str) -> None:
    with pytest.raises(InputError, match="cannot be left out"):
        Reading(ignore=(name,))


def test_a_variable_of_the_program_is_not_left_out() -> None:
    text = "N1 DEF REAL WIDE, DEPTH\nN2 DEPTH=5\nN3 G1 G90 F100 Z=-DEPTH\nN4 M30\n"
    with pytest.raises(InputError, match="1:1: ignore: DEPTH is a variable of the program"):
        parse_program(text, reading=Reading(ignore=("DEPTH",), dialect="siemens"))
