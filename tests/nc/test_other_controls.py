"""Lines of other controls and of their operators: each is read, moves nothing, is said first, or refused by name; and what is said of
text that is no word."""

from __future__ import annotations

import functools

import numpy as np
import pytest
from same_program import same_motion

from planner.base.errors import InputError
from planner.machine import load_machine
from planner.nc.program import Kind, Program
from planner.nc.reader import parse_program
from planner.nc.reading import Reading
from planner.nc.writer import retimed

HEAD, TAIL = "G21 G90 F600\nG0 X1 Y2 Z3\n", "\nG1 X10 Y5\nM30\n"
WITHOUT = parse_program(HEAD + TAIL)


def between(line: str, reading: Reading | None = None) -> Program:
    return parse_program(HEAD + line + TAIL, reading=reading or Reading())


same = functools.partial(same_motion, lines=False)


def stops(program: Program) -> int:
    return int((program.kind == Kind.STOP).sum())


# Lines that move nothing: grbl, grblHAL and FluidNC; TinyG and g2core; EdingCNC; UCCNC, Mach3 and Mach4; Centroid; Masso.
NOTHING = (
    "?", "~", "$", "$$", "$#", "$G", "$I", "$N", "$X", "$C", "$N0=G20", "$TLR", "$help", "$SD/List", "$LocalFS/List", "$MD", "$10=1",
    "$Alarm/Disable", "$RST=*",
    '{"sr":null}', "{sr:{line:t,posx:t}}", '{"xjm":500}', "{xfr:16000}", "$1sa=1.8", "$ej=1", "$xjm=500",
    'MSG "drill next"', 'LogMsg "part 1"', "TCAGuard off", "LogFile \"a\" 1",
    "M10", "M11", "M20", "M21", "M31", "M47", "M800", "G8 P1", "M3 P100", "M3 P0 S50", "M5 P1",
    "M94/5", "M95/5", "M39", "M25", "M106", "M107", "M666", "N10 ?", "M3 $1",
)  # fmt: skip
STOPPING = ("!", 'DlgMsg "tool?" "length" 100', 'WarnMsg "look"', "M0", "M1")


@pytest.mark.parametrize("line", NOTHING)
def test_lines_that_move_nothing(line: str) -> None:
    program = between(line)
    assert same(program, WITHOUT)
    assert len(program.notes) > 0 or line == "M3 $1"


@pytest.mark.parametrize("line", STOPPING)
def test_lines_that_wait_are_full_stops(line: str) -> None:
    program = between(line)
    assert stops(program) == 1
    np.testing.assert_array_equal(program.end[program.kind != Kind.STOP], WITHOUT.end)


@pytest.mark.parametrize(
    "line", ["$xvm=300", "{xvm:300}", '{"xvm":300}', "$110=300", "$/axes/x/max_rate_mm_per_min=300"]
)
def test_a_speed_that_a_control_is_given_limits_its_axis(line: str) -> None:
    (limit,) = between(line).limits
    assert (limit.quantity, limit.axis, limit.value) == ("velocity", "x", 5.0)


@pytest.mark.parametrize(
    "text", ['{"gc":"G1 X7 Y1"}', '{gc:"g1x7y1"}', ' {"gc" : "N5 G1 X7 Y1"} \r', '{"gc":"G1 X7 Y1","n":4}']
)
def test_tinyg_has_g_code_in_json(text: str) -> None:
    program = between(text)
    assert same(program, between("G1 X7 Y1"))
    assert same(parse_program(retimed((HEAD + text + TAIL).encode(), program, program.feed)), program)


def test_a_program_that_begins_with_json_is_no_file_of_points() -> None:
    text = '{"sr":{"line":true}}\n{"gc":"g21 g90"}\nG1 X10 F600\n{"gc":"g1 y5"}\n'
    assert parse_program(text).end.tolist() == [[10.0, 0.0, 0.0], [10.0, 5.0, 0.0]]


def test_g70_and_g71_without_a_cycle_are_units() -> None:
    program = parse_program("N10 G90 F600\nN20 G71 G17\nG0 X1\nG70\nX2\nG1 Y1 F10\n")
    assert program.end.tolist() == [[1.0, 0.0, 0.0], [50.8, 0.0, 0.0], [50.8, 25.4, 0.0]]
    assert program.feed[-1] * 60.0 == pytest.approx(254.0)
    assert any("line 2: G70 and G71" in said for said in program.assumptions)
    with pytest.raises(InputError, match="no profile from N10"):
        parse_program("G71 P10 Q20\n")


# Programs of other controls with words that a Sinumerik has, and what is said of them.
NO_SINUMERIK = {
    "O1000\nG15 H1\nCALL O200 Q2 LX=5\nX=LX\nM2\n": "Okuma",
    "#1 = 3\nif [#1 > 2]\nG1 X1 F100\nendif\nM30\n": "'>' comes",
}


@pytest.mark.parametrize("text", NO_SINUMERIK)
def test_no_sinumerik(text: str) -> None:
    with pytest.raises(InputError) as caught:
        parse_program(text)
    assert NO_SINUMERIK[text] in str(caught.value)
    assert "Sinumerik" not in str(caught.value)


def test_unused_words_are_not_to_be_left_out() -> None:
    with pytest.raises(InputError, match=r"P word without .*; write its moves out"):
        between("G41 P2 X20 Y20")


# Lines that are refused by name: their column, and a part of what is said.
REFUSED = [
    ("$J=G91 X5 F100", 1, "may move"), ("$TPW", 1, "$TPW: this command"), ("$F=part.nc", 1, "may move"),
    ("$SD/Run=a.nc", 1, "may move"),
    ('{"gc":"G1 X#"}', 13, ""), ("{jogx:5}", 1, "starts no word"), ("{G1 X5}", 1, "starts no word"),
    ("GoSub drill", 1, "EdingCNC"), ("Sub drill", 1, "EdingCNC"), ("While", 1, "EdingCNC"),
    ("CALL O100", 1, "Okuma"), ("RTS", 1, "Okuma"), ("VC1=5", 1, "Okuma"), ("NAT01", 1, "Okuma"), ("G15 H2", 1, "Okuma"),
    ("G31 Z-5 F50", 1, "probing"), ("G38.2 Z-5", 1, "probing"), ("G38.5 Z-5", 1, "probing"), ("G00.1 X5", 1, "G00.1"),
    ("M100/1", 5, "Centroid"), ("M115/Z-2 P1 F10", 5, "Centroid"), ("M105/X P1", 5, "Centroid"), ("M7.1", 1, "M7.1"),
    ("M100.1 ({x:n})", 1, "M100.1"), ("M225 #100 \"depth\"", 11, ""), ("M120 \"a.txt\"", 6, "texts"), ("G12 I5", 1, "G12"),
    ("G70 Q100", 1, "lathe cycle"), ("G71 Q100 D1", 1, "lathe cycle"), ("[ESP400]", 1, "starts neither"),
    ("IF [#1 == 3]", 8, "write EQ"), ("#1=[1 != 2]", 7, "write EQ"), ("IF #1 == 3 THEN #2=1", 1, "Centroid's"),
    ("INPUT \"a\" #1", 1, "EdingCNC's"),
    ("var x = 3", 1, "RepRapFirmware's"), ("if a == 3", 1, "RepRapFirmware's"), ("set global.x=3", 1, "RepRapFirmware's"),
    ("G1 X{var.x}", 4, "braces"), ("{move.axes[0]}", 1, "braces"), ("G92.9 X3", 1, "Marlin"), ("M225 #1 \"a\"", 9, "Centroid's"),
    ("G72 Q100 D1", 1, "LinuxCNC: Q"), ("o100 if [#1 == 3]", 13, "EdingCNC's"),
    ("Recv: ok", 1, "terminal"), ("echo: busy", 1, "terminal"), ("@ pause", 1, "without a number"),
    # look-alikes: the character, what it is and what to write
    ("G1 XO Y1", 4, "digit 0"),
    ("G1 X1O Y1", 6, "digit 0"), ("G1 X1O5", 6, "digit 0"), ("GO X5", 1, "digit 0"), ("G1 Xl5", 4, "digit 1"),
    ("G1 X\u22125", 4, "U+2212 (minus sign), which looks like -"), ("G1 X\u20135", 4, "U+2013 (en dash)"),
    ("G1 X\uff15", 4, "fullwidth digit five), which looks like 5"), ("\uff271 X5", 1, "write G"), ("G1 \u04255", 4, "write X"),
    ("G1\u200b X5", 3, "cannot be seen"), ("\ufeffG1 X5", 1, "cannot be seen"), ("G1 X5\u00b0", 6, "degree sign"),
    ("G1 X1,5", 6, "decimal comma"), ("G1 X1.5.2", 8, "without a letter"), ("G1 X\x07", 4, "character 7"),
    ("G1 X5 \x18", 7, "character 24"),
    ("F-5", 1, "positive"), ("hello world", 1, "a letter and a number"), ("G1 X5\0 Y1", 6, "NUL"),
]  # fmt: skip


@pytest.mark.parametrize(("line", "column", "said"), REFUSED)
def test_lines_that_are_refused_by_name(line: str, column: int, said: str) -> None:
    with pytest.raises(InputError) as caught:
        between(line)
    assert (caught.value.line, caught.value.column) == (3, column)
    assert said in str(caught.value)
    assert "--ignore" not in str(caught.value)


def test_blanks_of_pages_and_padding_are_blanks() -> None:
    for text in ("G1\u00a0X7 Y1", "\u00a0G1 X7\u00a0Y1\u00a0"):
        assert same(between(text), between("G1 X7 Y1"))
    padded = b"\0" * 300 + (HEAD + TAIL).encode() + b"\0" * 300
    assert same(parse_program(padded), WITHOUT)


def test_f0_is_no_feed() -> None:
    assert same(parse_program(HEAD + "G0 F0 X5\nG1 F600" + TAIL), between("G0 X5"))
    for line in ("G0 F0 X5", "F0", "G1 F0 X5"):
        with pytest.raises(InputError, match="without a feed"):
            between(line)


def test_a_mistaken_sinumerik_is_told_why() -> None:
    with pytest.raises(InputError, match=r"because of line 3, 'X=5'; --dialect says otherwise"):
        between("X=5")
    with pytest.raises(InputError, match=r":3:1: X: assignments"):
        between("X=5", Reading(dialect="linuxcnc"))


# --- what the user says is left out ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("code", ["G38.2", "G38.3", "G38.5", "G31"])
def test_probing_is_a_stop_if_the_user_says_so(code: str) -> None:
    program = between(f"{code} Z-5 F50\nG0 Z3", Reading(ignore=(code,)))
    assert stops(program) == 1
    assert program.end[-1].tolist() == [10.0, 5.0, 3.0]
    assert any("1 probing move: left out, as --ignore says" in said for said in program.assumptions)
    with pytest.raises(InputError, match="motion code that is not supported"):
        between(f"{code} Z-5 F50\nZ3", Reading(ignore=(code,)))


@pytest.mark.parametrize(
    "odd", ["G1 X900", "hello (", '"', "o100 while", "G71 Q100", "CYCLE81(1)", "#1=[", "M98 P7"]
)
def test_lines_are_left_out_before_they_are_looked_at(odd: str) -> None:
    text = f"{HEAD}{odd}\n{odd}\nG1 X7\n{odd}{TAIL}"
    program = parse_program(text, reading=Reading(ignore=("3-4", "6")))
    assert same(program, between("G1 X7"))
    assert program.assumptions[:2] == tuple(
        f"line {k}: lines {k} to {n} are left out, as --ignore says" for k, n in ((3, 4), (6, 6))
    )
    assert program.line.tolist() == [2, 5, 7]
    assert odd.encode() not in retimed(text.encode(), program, program.feed)


def test_lines_beyond_the_program_are_none() -> None:
    for lines in ("9-12", "0", "4-3"):
        with pytest.raises(InputError, match="the program has lines 1 to 5"):
            between("M0", Reading(ignore=(lines,)))


def test_commands_are_left_out_by_name() -> None:
    text = "M83\nG1 X5 F600\nCLEAN_NOZZLE\nG1 X9"
    (said,) = parse_program("G21\n" + text).assumptions
    assert "macro" in said
    assert not parse_program("G21\n" + text, reading=Reading(ignore=("clean_nozzle",))).assumptions


@pytest.mark.parametrize(
    ("name", "means"),
    [("haas", "fanuc"), ("sinumerik", "siemens"), ("klipper", "printer")],
)
def test_controls_have_the_dialect_of_another(name: str, means: str) -> None:
    assert Reading(dialect=name) == Reading(dialect=means)


def test_the_dialect_of_printers_holds_where_no_word_tells_it() -> None:
    """G4 P is in ms there; a program that computes is read as before."""
    text = "G21 G90\nG1 X10 F600\nG4 P500\nG1 X20\n"
    (said,) = parse_program(text).assumptions
    assert "a dwell of 500 s" in said
    assert "--dialect fanuc, or marlin" in said
    assert float(parse_program(text, load_machine("ender3")).dwell.sum()) == pytest.approx(0.5)
    program = parse_program(text, reading=Reading(dialect="marlin"))
    assert float(program.dwell.sum()) == pytest.approx(0.5)
    computed = parse_program("#1 = 7\nG1 X#1 F600\n", reading=Reading(dialect="marlin"))
    assert computed.end[-1, 0] == 7.0


@pytest.mark.parametrize(
    ("text", "dialect", "dwell"),
    [
        ("G1 X1 F600\nG4 P500\n", "auto", 0.5),
        ("G64 P0.01\nG1 X1 F600\nG4 P5\n", "auto", 5.0),
        ("G61\nG1 X1 F600\nG4 P5\n", "auto", 5.0),
        ("G1 X1 F600\nG4 P5\n", "linuxcnc", 5.0),
    ],
)
def test_on_a_machine_with_an_extruder_a_mills_program_is_a_mills(
    text: str, dialect: str, dwell: float
) -> None:
    program = parse_program(text, load_machine("ender3"), Reading(dialect=dialect))
    assert float(program.dwell.sum()) == pytest.approx(dwell)
