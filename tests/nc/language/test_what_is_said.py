"""What Sinumerik, Heidenhain and plotter words do that were left out once: right values, first lines, and strict reading."""

from __future__ import annotations

import numpy as np
import pytest
from language_programs import same
from moved import AXES, read_twice

from planner.base.errors import InputError
from planner.machine import Machine
from planner.nc.program import Program
from planner.nc.reader import parse_program
from planner.nc.reading import Reading

MACHINE = Machine(  # type: ignore[call-arg]
    name="test",
    dt=1e-3,
    tolerance=0.05,
    axes=AXES,  # type: ignore[arg-type]
    work_offsets={"g54": {"x": 10.0, "z": 3.0}, "g55": {"x": 20.0}},
    tools={"1": {"length": 0.0, "diameter": 6.0}},  # type: ignore[dict-item]
)
SIEMENS, HEIDENHAIN = Reading(dialect="siemens"), Reading(dialect="heidenhain")
HEAD = "DEF REAL A\nG17 G71 G90 G94 F600\nG0 X0 Y0 Z0\n"


def sinumerik(body: str) -> Program:
    return read_twice(f"{HEAD}{body}\nM30\n", MACHINE, SIEMENS)


def conversational(body: str) -> Program:
    return read_twice(f"0 BEGIN PGM T MM\n{body}\nEND PGM T MM\n", MACHINE, HEIDENHAIN)


def test_g500_is_no_work_offset() -> None:
    """It switches G54 to G57 off; a programmed shift stays (840D sl, fundamentals, settable offsets)."""
    program = sinumerik("G55 X1\nG500 X1 Z2\nTRANS X5\nX1\nTRANS\nG54 X1\nG500\nX1")
    assert program.end[1:, 0].tolist() == [21, 1, 6, 11, 1]
    assert program.end[2, 2] == 2


@pytest.mark.parametrize("word", ["G53", "G153", "SUPA"])
def test_machine_coordinates(word: str) -> None:
    assert sinumerik(f"{word} G0 X1\nX1").end[1:, 0].tolist() == [1, 11]


def test_stopre_ends_the_block_before_in_an_exact_stop() -> None:
    with_stop = sinumerik("G1 X10\nSTOPRE\nX20")
    same(with_stop, sinumerik("G1 X10 G9\n\nX20"), apart=0.0)
    assert len(with_stop) == len(sinumerik("G1 X10\n\nX20")) + 1


@pytest.mark.parametrize(
    ("body", "line", "said"),
    [
        ("T1 D1 M6\nG1 X5", 4, "offsets of tools"),
        ("G1 X5\nD0 X6", 5, "offsets of tools"),
        ("BRISK\nG1 X5", 4, "BRISK and DRIVE"),
        ("G1 X5 DRIVE", 4, "BRISK and DRIVE"),
        ("RTLIOF\nG0 X5", 4, "straight lines"),
        ("ORIVECT", 4, "ORIAXES"),
        ("SPOS=90", 4, "SPOS"),
        ("G621 G1 X5", 4, "G621"),
        ("T1 M6\nG41 G1 X5\nX9\nG40 Y9", 5, "CFTCP"),
    ],
)
def test_what_sinumerik_words_are_not_followed_is_said_with_its_line(body: str, line: int, said: str) -> None:
    text = f"{HEAD}{body}\nG1 Z1\nM30\n"
    assert [
        n
        for n in parse_program(text, MACHINE, SIEMENS).assumptions
        if said in n and n.startswith(f"line {line}:")
    ]
    with pytest.raises(InputError, match=rf":{line}:\d+: .*{said}"):
        parse_program(text, MACHINE, Reading(dialect="siemens", strict=True))


def test_a_feed_at_the_tool_s_centre_is_planned_as_it_says() -> None:
    program = parse_program(f"{HEAD}T1 M6\nCFTCP\nG41 G1 X5\nX9\nG40 Y9\nM30", MACHINE, SIEMENS)
    assert not [note for note in program.assumptions if "CFTCP" in note]


def test_a_feed_alone_counts_for_the_moves_behind_it() -> None:
    program = conversational("L X+1 F500\nL F200\nL X+5\nL X+6 M3 F300\nL X+7")
    np.testing.assert_allclose(program.feed * 60, [500, 200, 300, 300])


def test_cycle_32_without_a_tolerance_is_that_of_the_machine() -> None:
    program = conversational(
        "CYCL DEF 32.0 T\nCYCL DEF 32.1 T0.2\nL X+1 F500\nCYCL DEF 32.0 T\nCYCL DEF 32.1\nL X+5"
    )
    assert program.tolerance[0] == 0.2
    assert np.isnan(program.tolerance[1])


@pytest.mark.parametrize("code", [10, 17, 48, 60, 61, 66, 159, 190, 221, 400, 600])
def test_m_codes_of_the_machine_s_builder_are_none_of_another_control(code: int) -> None:
    """M60 is no stop, M66 no wait, M190 waits for no temperature and M600 moves no head: nobody knows what they do here."""
    program = conversational(f"L X+1 F500\nM{code}\nL X+5")
    assert len(program) == 2
    assert any("M code" in note and "line 3" in note for note in program.assumptions)


@pytest.mark.parametrize("body", ["M3 X+5", "M3 F300", "STOP F300", "STOP X+1"])
def test_what_stands_beside_an_m_code_is_not_passed_over(body: str) -> None:
    with pytest.raises(InputError, match=r"<text>:2:.*only M codes are read here"):
        conversational(body)


@pytest.mark.parametrize("word", ["LT2", "IW0,0,9,9", "AS2", "RP3", "EC", "NR"])
def test_what_a_plotter_would_do_otherwise_is_said_first(word: str) -> None:
    text = f"IN;SP1;VS10;PU0,0;{word};PD400,0;"
    (found,) = parse_program(text, MACHINE).assumptions
    assert found.startswith(f"{word[:2]} ignored, on line 1: ")
    with pytest.raises(InputError, match=r"assumed without --strict"):
        parse_program(text, MACHINE, Reading(strict=True))
    assert parse_program(text.replace(word, "LT"), MACHINE).assumptions == ()


@pytest.mark.parametrize(
    ("text", "place"),
    [
        ("G21 G90 F600\n#1=[{}]\nG1 X#1\nM2\n", "2:1: #1"),
        ("G21 G90 F600\nG1 X[{} * 0]\nM2\n", "2:1: G1"),
        ("G21 G90 F600\no1 if [1 lt {}]\nG1 X1\no1 endif\nM2\n", "2:1: o1"),
        ("O1\nG21 G90 F600\n#100={}.\nIF[#100GT1.]GOTO5\nN5G1 X1.\nM30\n", "3:1: #100"),
        ("DEF REAL A={}\nG1 G90 F600 X=A\nM30\n", "1:1: DEF"),
        ("0 BEGIN PGM A MM\n1 L X+{} F100\n2 END PGM A MM\n", "2:3: L"),
    ],
)
def test_more_digits_than_there_are_numbers_for_are_refused_with_their_line(text: str, place: str) -> None:
    """They are infinite, which Python has no literal for; an infinite number times nothing would be a word left out."""
    with pytest.raises(InputError, match=rf":{place}.*: a number is too large"):
        parse_program(text.format("1" * 400), MACHINE)


@pytest.mark.parametrize(
    "text",
    [
        "G21 G90 F600\n#1=[10**200]\n#2=[#1*#1]\nG1 X1\nM2\n",
        "G21 G90 F600\n#1=[10**200]\nG1 X[#1*#1-#1*#1] Y1\nM2\n",
        "G21 G90 F600\n#1=[10**200]\nG1 X[1/[#1*#1]]\nM2\n",
        "G21 G90 F600\n#1=[10**200]\no1 if [[#1*#1] gt 0]\nG1 X1\no1 endif\nM2\n",
        "O1\nG21 G90 F600\n#1=1.\nWHILE[#3LT40]DO1\n#1=#1*10000000000.\n#3=#3+1\nEND1\nG1 X[#1-#1] Y1.\nM30\n",
        "O1\nG21 G90 F600\n#1=100000000.\n#2=#1*#1*#1*#1*#1*#1*#1*#1*#1*#1*#1*#1*#1*#1*#1*#1*#1*#1*#1*#1*#1*#1*#1*#1\n"
        "#3=#2*#2\nM30\n",
        "R1=1EX300\nG1 G90 F600\nG1 X=R1*R1*0 Y1\nM30\n",
        "0 BEGIN PGM A MM\nQ1 = +10\nQ2 = Q1 * Q1\nLBL 1\nQ2 = Q2 * Q2\nCALL LBL 1 REP 9\n9 END PGM A MM\n",
    ],
)
def test_results_that_are_no_finite_numbers_are_refused_where_they_are_made(text: str) -> None:
    """LinuxCNC refuses them; an infinite number less itself would be a word left out, and one over it nothing."""
    with pytest.raises(InputError, match=r":\d+:\d+: .*: the result is too large"):
        parse_program(text, MACHINE)


@pytest.mark.parametrize("number", [0, -1, 5602, 6000])
def test_a_computed_parameter_that_there_is_not_is_refused(number: int) -> None:
    text = f"G21 G90 F600\n#1={number}\n#[#1]=2\nG1 X1\nM2\n"
    with pytest.raises(InputError, match=rf":3:.*#{number} (is not one of #1 to #5601|cannot be given)"):
        parse_program(text, MACHINE)
