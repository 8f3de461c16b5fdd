"""Called files, the places of blocks, messages; and where programs that compute fail."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from planner.base.errors import InputError
from planner.nc.language import run
from planner.nc.program import Kind
from planner.nc.reader import interpret, parse_program, read_program
from planner.nc.reading import Reading

# --- files, places, notes -------------------------------------------------------------------------------------------------------


def test_a_call_finds_a_file_in_the_folder_and_below_and_nowhere_else(tmp_path: Path) -> None:
    job, below = tmp_path / "job", tmp_path / "job" / "lib"
    below.mkdir(parents=True)
    (job / "near.ngc").write_text("o<near> sub\nG1 X#1\no<near> endsub\nM2\n")
    (below / "far.ngc").write_text("(comment)\no<far> sub\n\nG1 Y#1\no<near> call [9]\no<far> endsub\n")
    (tmp_path / "outside.ngc").write_text("o<outside> sub\nG1 Z1\no<outside> endsub\n")
    main = job / "main.ngc"
    main.write_text("G21 F100\no<near> call [1]\no<far> call [2]\nM2\n")
    program = read_program(main)
    np.testing.assert_allclose(program.end, [[1, 0, 0], [1, 2, 0], [9, 2, 0]])
    assert program.line.tolist() == [2, 4, 2]
    assert program.place(2) == (
        f"line 2 in {job / 'near.ngc'} (near), called from line 5 in {below / 'far.ngc'} (far), called from line 3"
    )
    for name in ("outside", "../outside"):
        main.write_text(f"G21 F100\no<{name}> call\nM2\n")
        with pytest.raises(InputError, match=r"main.ngc:2:.*no such subprogram"):
            read_program(main)
    (job / "near.ngc").write_text("o<near> sub\nG1 X[1/0]\no<near> endsub\n")
    main.write_text("G21 F100\no<near> call [1]\nM2\n")
    with pytest.raises(InputError, match=r"near.ngc:2:1: G1: division by zero; called from line 2"):
        read_program(main)


def test_messages_and_what_was_expanded_are_said() -> None:
    text = "G21 F100\no1 sub\n(DEBUG, depth #1 of #<no>)\nG1 X#1\no1 endsub\no1 call [2]\no1 call [2]\n(MSG, hello)\nM2\n"
    program = parse_program(text)
    assert program.notes == ("line 3: message: depth 2.000000 of ###### (2 times)", "line 8: message: hello")
    assert program.expansion is not None
    assert program.expansion.calls == (("1", 2),)
    assert program.place(1) == "line 4 (1), called from line 7"


def test_a_program_that_computes_nothing_is_read_as_before() -> None:
    for text in ("G21 G0 X1 (#1 [2] o1 call)", "O1000\nG21 G0 X1\nM30", "G21 G0 X1\nM30\n#1=[2\no9 endsub"):
        program = parse_program(text)
        assert program.expansion is None
        assert len(program) == 1


@pytest.mark.parametrize("dialect", ["linuxcnc", "fanuc"])
@pytest.mark.parametrize("end", ["M2", "M30", "N9 M30 (end)"])
def test_nothing_behind_the_end_is_computed(dialect: str, end: str) -> None:
    """Also a value that there is not."""
    for behind in ("X[SQRT[0-1]]", "#2=1\nX[1/0]"):
        text = f"G21 F100\n#1=5\nG1 X#1\nX2\n{end}\nX7\n{behind}\nX8\n"
        assert parse_program(text, reading=Reading(dialect=dialect)).end[:, 0].tolist() == [5.0, 2.0]


# --- where programs fail --------------------------------------------------------------------------------------------------------

FAULTS = [
    ("#1=0\no1 while [#1 GE 0]\n#1=[#1+1]\no1 endwhile", 4, "stopped after .* turns of loops"),
    ("o1 while [#1 GE 0]\nG1 X1\n#1=[#1+1]\no1 endwhile", 3, "stopped after 1,000 lines executed"),
    ("#1=0\no1 while [#1 GE 0]\nM8\n#1=[#1+1]\no1 endwhile", 4, "lines executed without a move"),
    (
        "#1=0\no1 while [#1 GE 0]\nG4 P1\n#1=[#1+1]\no1 endwhile",
        4,
        "50 lines that are no plain straight moves",
    ),
    ("WHILE [#1 LT 5] DO 1\nM83\nM201 X500\nEND 1", 3, "lines executed without a move"),
    ("o1 sub\no1 call\no1 endsub\no1 call", 4, "100 calls are open; .*called from line 4"),
    ("o1 while [1]\nG1 X1", 3, "this while has no end; write o1 endwhile"),
    ("o1 if [1]\no2 while [1]\no1 endif", 5, "o1 endif has no o1 if before it: o2 while on line 4 is open"),
    ("G1 X#<depth>", 3, "named parameter #<depth> has no value"),
    ("G1 X[1/[#1-#1]]", 3, "division by zero"),
    ("G1 X[1e9*1e-1]", 3, "expected|missing"),
    ("#1=9\nG1 X[#1**9**9**9]", 4, "too large|infinite"),
    ("o1 sub\no1 endsub\no1 sub\no1 endsub", 5, "a second subprogram o1; the first is on line 3"),
    ("o1 call", 3, "no such subprogram"),
    ("o1 break", 3, "no loop o1 around this break"),
    ("G1 X" + "[" * 60 + "1" + "]" * 60, 3, "brackets in each other"),
    ("G1 X[1" + "+1" * 100 + "]", 3, "operations in a row"),
    ("#<_hal[pin]>=1", 3, "only the control knows"),
    ("#5221=1", 3, "belongs to the control"),
    ("WHILE [1 EQ 1] DO 1\nG1 X1", 3, "DO 1 has no END 1"),
    ("GOTO 77", 3, "no block N77"),
    ("#1=77\nGOTO #1", 4, "no block N77"),
    ("END 1\nGOTO 1\nN1", 3, "END 1 has no DO 1"),
    ("#3000=1 (TOOL BROKEN)\nGOTO 1\nN1", 3, "raises its alarm 1"),
    ("G65 A1", 3, "needs P"),
    ("M97 P5", 3, "no block N5"),
    ("#1=#3011\nGOTO1\nN1", 3, "known by the control only"),
    ("#0=1\nGOTO1\nN1", 3, "#0 has no value"),
]


@pytest.mark.parametrize(("text", "line", "message"), FAULTS, ids=lambda value: str(value)[:25])
def test_faults_name_the_line(text: str, line: int, message: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(run, "TURNS_MAX", 100_000)
    monkeypatch.setattr(run, "ROWS_MAX", 1_000 if "M8" not in text else 10_000)
    monkeypatch.setattr(run, "BY_WORD_MAX", 50 if "G4" in text else 1_000_000)
    monkeypatch.setattr(run, "IDLE_AT_ONCE", 100)
    monkeypatch.setattr(run, "IDLE_MAX", 300)
    with pytest.raises(InputError, match=message) as found:
        parse_program(f"G21 F100\nG1 X0\n{text}\nM30\n")
    assert found.value.line == line
    assert found.value.column is not None


@pytest.mark.parametrize(
    "inside",
    [
        "#1=[#1+1]", "##3=9", "o2 if [#2 EQ 3]\no1 break\no2 endif", "o2 repeat [2]\no3 if [1]\n#1=9\no3 endif\no2 endrepeat",
        "o2 if [#2 EQ 3]\nM2\no2 endif", "o9 call",
    ],
)  # fmt: skip
def test_a_loop_that_may_end_is_run(inside: str) -> None:
    program = (
        parse_program(
            f"o9 sub\n#31=1\no9 endsub\n#3=1\no1 while [#1 LT 5]\n#2=[#2+1]\nG0 X#2\n{inside}\no1 endwhile\nM2"
        )
        if "call" not in inside
        else parse_program("o9 sub\n#40=9\no9 endsub\no1 while [#40 LT 5]\nG0 X1\no9 call\no1 endwhile\nM2")
    )
    assert len(program)


def test_what_was_done_before_a_fault_is_kept() -> None:
    program, faults = interpret(
        "G21 F100\n#1=3\no1 repeat [5]\nG1 X[6/#1]\n#1=[#1-1]\no1 endrepeat\nM2\n", None, source="x"
    )
    assert program.end[:, 0].tolist() == [2, 3, 6]
    assert [(f.line, f.column) for f in faults] == [(4, 1)]


def test_a_bad_line_in_a_loop_is_named_once() -> None:
    _, faults = interpret(
        "G21 F100\no1 repeat [50]\nG1 X1\nG38.2 Z[0-1]\no1 endrepeat\nM2\n", None, source="x"
    )
    assert [(f.line, f.column, f.word) for f in faults] == [(4, 1, "G38.2")]


def test_end_of_the_program_inside_a_branch() -> None:
    program = parse_program(
        "G21 F100\no1 repeat [9]\n#1=[#1+1]\nG1 X#1\no2 if [#1 EQ 3]\nM2\no2 endif\no1 endrepeat\nG1 X99\n"
    )
    assert program.end[:, 0].tolist() == [1, 2, 3]
    assert set(program.kind.tolist()) == {Kind.LINE}
