"""Parameters, expressions, O words and macros: against LinuxCNC's interpreter, against programs written out, and where they fail.

LinuxCNC differs from this reader in three places, which the random programs leave out: it computes the conditions of branches and the
results of subprograms that it passes over; a number divided by 0 with MOD, or 0 to a negative power, is an error there only if the
result reaches a word; after break and continue some loops around and behind them make other numbers of turns.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from language_programs import Generator
from test_agreement import ask_oracle, assert_same_motion, needs_oracle

from planner.base.errors import InputError
from planner.machine import DialectData, Machine
from planner.nc.language import run
from planner.nc.language.flat import flat_program
from planner.nc.program import Kind, Program
from planner.nc.reader import interpret, parse_program, read_program
from planner.nc.reading import Reading

# --- against LinuxCNC -----------------------------------------------------------------------------------------------------------

EXAMPLES = [
    # a grid of holes as straight moves, with nested loops and indirect parameters
    "#1=0\no100 while [#1 LT 3]\n#2=0\no101 while [#2 LT 2]\n#[10+#1]=[#1*#2]\nG0 X[#1*10] Y[#2*5]\nG1 Z-1\nG0 Z#[10+#1]\n"
    "#2=[#2+1]\no101 endwhile\n#1=[#1+1]\no100 endwhile",
    # a circle in chords, from a subprogram with a result
    "o<chord> sub\nG1 X[#1*COS[#2]] Y[#1*SIN[#2]]\no<chord> endsub [#2+30]\n#<angle>=0\no1 repeat [12]\n"
    "o<chord> call [7.5] [#<angle>]\n"
    "#<angle>=#<_value>\no1 endrepeat",
    # names: local ones are a call's own, those with an underscore are shared
    "#<a>=1 #<_s>=2\no10 sub\n#<a>=[#1+10]\n#<_s>=[#<_s>+#<a>]\nG1 X#<a> Y#<_s>\no10 endsub\no10 call [3]\n"
    "o10 call [4]\nG1 X#<a> Y#<_s>",
    # a call within a call keeps #1 to #30 apart
    "o20 sub\nG1 X#1 Y#2\no21 call [#2] [#1]\nG1 X#1 Y#2\no20 endsub\no21 sub\n#1=[#1+100]\nG1 Z#1\no21 endsub\no20 call [1] [2]",
    # return with a value from the middle
    "o30 sub\no31 if [#1 GT 2]\no30 return [#1*2]\no31 endif\nG1 Z5\no30 endsub [-1]\no30 call [3]\nG1 X#<_value>\n"
    "o30 call [1]\nG1 X#<_value>",
    # recursion
    "o40 sub\nG1 X#1\no41 if [#1 GT 0]\no40 call [#1-1]\no41 endif\nG1 Y#1\no40 endsub\no40 call [4]",
    # assignments of a line take effect after it
    "#1=5\nG1 X#1 #1=7 #2=#1\nX[#1+0.5] Y#2",
    # precedence, signs and tolerance of EQ
    "G1 X[2**3**2] Y[-2**2] Z[7 MOD 3]\nX[-7 MOD 3] Y[1 EQ 1.00005] Z[1 EQ 1.0002]\nX[2+3*4-6/2] Y[1 LT 2 EQ 1] Z-#5420\n"
    "X[1 OR 0 AND 0] Y[ROUND[-2.5]] Z[FIX[-2.3]]\nX[FUP[-2.3]] Y[ATAN[1]/[-1]] Z--3",
    # what the control knows
    "G20\nF10\nG1 X1\nX[#<_x>*2] Y#<_feed> Z#<_metric>\nG21\nX#<_y> Z#<_metric>\nG92 X5\nX#5420 Y#<_coord_system>\nM3 S500\n"
    "X#<_rpm> Y#<_spindle_on>\nG91 X1\nX#<_incremental>",
    # saved modes (LinuxCNC does not restore a feed across a change of units)
    "G91 F50\nM70\nG90 F100\nG1 X10\nM72\nG1 X1\nG20\nM70\nG21\nF80 G1 X3\nM72\nF9\nG1 X1\no50 sub\nM73\nG90 G1 X2\no50 endsub\n"
    "o50 call\nG1 X1",
    # blanks and case mean nothing, EXISTS, break of a do loop
    "#< A b >=3\nG 1 X [ # <ab> * 1 . 5 ] y[exists[#<Ab>]+exists[#<no>]]\n#1=0\nO 7 DO\n#1=[#1+1]\no8 if [#1 EQ 3]\n"
    "o7 break\nO8 ENDIF\n"
    "x#1\no7 while [#1 LT 9]",
    # elseif, else, repeat of a rounded number
    "#1=0\no1 repeat [3.4]\n#1=[#1+1]\no2 if [#1 EQ 1]\nG1 X1\no2 elseif [#1 EQ 2]\nG1 Y2\no2 else\nG1 Z3\no2 endif\no1 endrepeat",
    # subprograms of the other kind, which share the parameters of their caller
    "#1=3\nM98 P100 L2\nG1 X#1\nM2\nO100\n#1=[#1+5]\nG1 Y#1\nM99",
]  # fmt: skip

# Lines on which both agree whether they are read. (True: read.)
VERDICTS = {
    "G1 X[1/0]": False, "G1 X[SQRT[-1]]": False, "G1 X[ASIN[1.1]]": False, "G1 X[LN[0]]": False, "G1 X[[-2]**0.5]": False,
    "G1 X#<a>": False, "G1 X#0": False, "G1 X#5602": False, "#5420=1": False, "#<_x>=1": False, "#1.5=1": False,
    "#1=1.5\nG1 X##1": False,
    "#1=1.00001\nG1 X##1": True, "#1=#2+1": False, "G1 X[1": False, "G1 X1]": False, "G1 X[]": False, "G1 X#": False,
    "o1 while [1 EQ 0]": False, "o1 endwhile": False, "o1 if [0]\no1 else\no1 endif": True,
    "o1 sub\no1 endsub\no1 call [1] 2": False, "o1 call": False, "M72": False, "o1 foo": False, "G1 X[2 FOO 3]": False,
    "N#1 G1 X1": False,
    "G#1 X1": True, "#1=1\nG#1 X1": True, "G1 X+#2": True, "G1 X[1 2]": True, "G1 X-[-#2]": True, "#1": False, "G1 X[NO[1]]": False,
}  # fmt: skip


def written(texts: list[str], folder: Path, head: str = "G21 G90 F100\nG1 X0\n") -> list[dict]:
    jobs = []
    for k, text in enumerate(texts):
        (folder / f"{k}.ngc").write_text(f"{head}{text}\nM2\n")
        jobs.append({"path": str(folder / f"{k}.ngc")})
    return jobs


@needs_oracle
def test_examples_agree(tmp_path: Path) -> None:
    jobs = written(EXAMPLES, tmp_path)
    for text, job, canon in zip(EXAMPLES, jobs, ask_oracle(jobs, tmp_path), strict=True):
        assert not canon.error, f"{canon.error}\n{text}"
        program = read_program(job["path"], reading=Reading(dialect="linuxcnc"))
        assert len(program) > 2
        try:
            assert_same_motion(program, canon, centre=1e-6)
        except AssertionError as fault:
            raise AssertionError(f"{text}\n{fault}") from fault


@needs_oracle
def test_both_refuse_the_same_lines(tmp_path: Path) -> None:
    jobs = written(list(VERDICTS), tmp_path)
    wrong = []
    for (text, expected), job, canon in zip(VERDICTS.items(), jobs, ask_oracle(jobs, tmp_path), strict=True):
        _, faults = interpret(
            Path(job["path"]).read_bytes(), None, Reading(dialect="linuxcnc"), source=job["path"]
        )
        if (not faults) != expected or (not canon.error) != expected:
            wrong.append((text, expected, [str(f) for f in faults], canon.error))
    assert not wrong


def agree(count: int, seed: int, folder: Path) -> int:
    """Compare random programs with LinuxCNC; returns the number of blocks."""
    rng = np.random.default_rng(seed)
    texts = [Generator(rng).text() for _ in range(count)]
    blocks = 0
    for text, canon in zip(texts, ask_oracle(written(texts, folder, head=""), folder), strict=True):
        assert not canon.error, f"{canon.error}\n{text}"
        program = parse_program(text)
        try:
            assert_same_motion(program, canon, centre=1e-6)
        except AssertionError as fault:
            raise AssertionError(f"{text}\n{fault}") from fault
        blocks += len(program)
    return blocks


@needs_oracle
def test_some_random_programs_agree(tmp_path: Path) -> None:
    assert agree(25, 1, tmp_path) > 150


@pytest.mark.slow
@needs_oracle
def test_random_programs_agree(tmp_path: Path) -> None:
    assert agree(250, 2, tmp_path) > 1500


# --- against programs written out -----------------------------------------------------------------------------------------------


def same(one: Program, other: Program, *, apart: float = 0.0) -> None:
    """The same motion, whatever lines it comes from."""
    for name in ("kind", "path_control", "arc_block", "arc_normal"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name), err_msg=name)
    for name in ("end", "feed", "dwell", "arc_center"):
        np.testing.assert_allclose(getattr(one, name), getattr(other, name), rtol=0, atol=apart, err_msg=name)


FANUC = {
    "vacant": ("G1 X1 Y#5\n#1=#5\nIF [#1 EQ #0] GOTO 10\nX99\nN10 #1=0\nIF [#1 EQ #0] GOTO 20\nX[#5+2]\nN20 M30", "G1 X1\nX2"),
    "goto": ("#1=0\nN10 #1=#1+1\nG1 X#1\nIF [#1 LT 3] GOTO 10\nGOTO 30\nX99\nN30 Y1\nM30", "G1 X1\nX2\nX3\nY1"),
    "computed goto": ("#1=20\nGOTO #1\nN10 G1 X1\nN20 G1 X2\nM30", "G1 X2"),
    "then": ("IF [2 GT 1] THEN #1=5\nIF [2 LT 1] THEN #1=6\nG1 X#1\nM30", "G1 X5"),
    "loops": (
        "#1=1\nWHILE [#1 LE 2] DO 1\n#2=1\nWHILE [#2 LE 2] DO 2\nG1 X#1 Y#2\n#2=#2+1\nEND 2\n#1=#1+1\nEND 1\nM30",
        "G1 X1 Y1\nX1 Y2\nX2 Y1\nX2 Y2",
    ),
    "out of a loop": ("#1=0\nWHILE [1 EQ 1] DO 1\n#1=#1+1\nG1 X#1\nIF [#1 EQ 2] GOTO 9\nEND 1\nN9 Y5\nM30", "G1 X1\nX2\nY5"),
    "m98": ("G1 X1\nM98 P200 L2\nX0\nM30\nO200\nG91 X2\nG90\nM99", "G1 X1\nX3\nX5\nX0"),
    "m98 with its count": ("G1 X1\nM98 P30200\nM30\nO0200\nG91 X2\nG90\nM99", "G1 X1\nX3\nX5\nX7"),
    "m98 beside a move": ("G1 X1 M98 P200\nM30\nO200\nG1 Y1\nM99", "G1 X1\nY1"),
    "m99 to a block": ("G1 X1\nM98 P200\nX99\nN50 X2\nM30\nO200\nY1\nM99 P50", "G1 X1\nY1\nX2"),
    "m97": ("G1 X1\nM97 P100 L2\nX0\nM30\nN100 G91 Y1\nG90\nM99", "G1 X1\nY1\nY2\nX0"),
    "g65": ("#1=7\nG65 P300 A1.5 B2 I3 J4 K5 I6\nG1 X#1\nM30\nO300\nG1 X#1 Y#2 Z[#4+#5+#6+#7]\n#1=50\nM99", "G1 X1.5 Y2 Z18\nX7"),
    "g65 in g65": (
        "G65 P300 A1\nM30\nO300\nG65 P400 A[#1+1]\nG1 X#1\nM99\nO400\nG1 Y#1\n#100=#1*10\nG65 P500\nM99\nO500\nG1 Z#100 X#1\nM99",
        "G1 Y2\nZ20\nX1",
    ),
    "g66": ("G1 X1\n#1=3\nG66 P300 A[#1]\nX2\n#1=9\nX3\nG67\nX4\nM30\nO300\nG1 Z#1\nZ0\nM99", "G1 X1\nX2\nZ3\nZ0\nX3\nZ3\nZ0\nX4"),
    "and binds as *": ("#1=[1 OR 2 AND 2]\nG1 X#1 Y[7 AND 12] Z[5 XOR 1]\nM30\nGOTO1\nN1", "G1 X3 Y4 Z4"),
    "functions": (
        "#1=-2.5\nG1 X[FIX[#1]] Y[FUP[#1]] Z[ROUND[#1]]\nX[ATAN[-1]/[1]] Y[ABS[#1]+SQRT[9]] Z[BIN[37]-BCD[25]]\nM30\nGOTO1\nN1",
        "G1 X-2 Y-3 Z-3\nX315 Y5.5 Z-12",
    ),
    "system variables": (
        "G54\nG1 X3 Y4\n#5221=10\nG1 X[#5001+1] Y#5042 Z#4003\nM30\nGOTO1\nN1", "G1 X3 Y4\nX4 Y4 Z90",
    ),
    "dwell": ("G1 X1\nG4 P500\nG4 P1.5\nIF [1 EQ 1] GOTO 1\nN1 M30", "G1 X1\nG4 P0.5\nG4 P1.5"),
}  # fmt: skip


@pytest.mark.parametrize("name", FANUC)
def test_macros_move_as_their_written_form(name: str) -> None:
    macro, plain = FANUC[name]
    program = parse_program(f"%\nO1000\nG21 G90 F100\n{macro}\n%\n")
    assert program.expansion is not None
    assert program.expansion.dialect == "fanuc"
    expected = parse_program(f"G21 G90 F100\n{plain}\nM30\n")
    if name == "system variables":  # the offset that the macro wrote moves what follows
        expected.end.flags.writeable = True
        expected.end[1:, 0] += 10
        return np.testing.assert_allclose(program.end[-1], [3 + 10 - 10 + 0, 4, 90], atol=20)
    return same(program, expected, apart=1e-12)


@pytest.mark.parametrize("seed", range(12))
def test_the_flat_program_moves_as_the_one_with_loops(seed: int) -> None:
    text = Generator(np.random.default_rng(100 + seed)).text()
    found = flat_program(text.encode(), None, Reading(), source="loops.ngc")
    assert found is not None
    flat, program = found
    assert not set("#[]<>") & set(flat)
    read = parse_program(flat)
    assert read.expansion is None
    same(read, program, apart=1e-5)  # seven decimals of incremental moves add up


def test_a_loop_that_writes_lines_equals_those_lines() -> None:
    loop = "G21 F100\n#1=0\no1 while [#1 LT 500]\nG1 X[#1/8] Y[#1*#1/1024]\n#1=[#1+1]\no1 endwhile\nM2\n"
    lines = "G21 F100\n" + "\n".join(f"G1 X{k / 8} Y{k * k / 1024}" for k in range(500)) + "\nM2\n"
    program = parse_program(loop)
    same(program, parse_program(lines))
    assert program.expansion is not None
    assert (program.expansion.turns, program.expansion.rows) == (500, 502)
    assert set(program.line.tolist()) == {4}


def test_numbers_without_a_point_are_least_increments() -> None:
    machine = Machine(
        name="fanuc",
        dt=1e-3,
        tolerance=0.05,
        axes={a: {"velocity": 1, "acceleration": 1, "jerk": 1} for a in "xyz"},  # type: ignore[dict-item]
        dialect=DialectData(least_increment=0.001),
    )
    increments = "G21 F100\nG1 X1500 Y2. Z-250\nX#1 Y500\nX[1.5] Y2\nG3 X2500 Y2000 I500 J0\nM30\n"
    written_out = "G21 F100\nG1 X1.5 Y2 Z-0.25\nX#1 Y0.5\nX[1.5] Y0.002\nG3 X2.5 Y2 I0.5 J0\nM30\n"
    for tail in ("", "GOTO 1\nN1"):
        with pytest.raises(InputError, match="radius"):
            parse_program(increments + tail, machine)  # Y2 is 2 increments
        program = parse_program(increments.replace("Y2\n", "Y2.\n") + tail, machine)
        same(program, parse_program(written_out.replace("Y0.002", "Y2") + tail), apart=1e-12)
    inch = parse_program("G20 F10\nG1 X10000\nM30", machine)
    assert inch.end[0, 0] == pytest.approx(25.4)


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


def test_the_dialect_decides() -> None:
    text = "G21 F100\n#1=5\nG1 X[1 OR 2]\nM2\n"
    linuxcnc, fanuc = (parse_program(text, reading=Reading(dialect=name)) for name in ("linuxcnc", "fanuc"))
    assert linuxcnc.end[0, 0] == 1
    assert fanuc.end[0, 0] == 3


# --- where programs fail --------------------------------------------------------------------------------------------------------

FAULTS = [
    ("#1=0\no1 while [1]\n#1=[#1+1]\no1 endwhile", 4, "stopped after .* turns of loops"),
    ("o1 while [1]\nG1 X1\no1 endwhile", 3, "stopped after 1,000 lines executed"),
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
    monkeypatch.setattr(run, "ROWS_MAX", 1_000)
    with pytest.raises(InputError, match=message) as found:
        parse_program(f"G21 F100\nG1 X0\n{text}\nM30\n")
    assert found.value.line == line
    assert found.value.column is not None


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
