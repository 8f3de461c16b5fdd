"""Parameters, expressions, O words and macros: against LinuxCNC's interpreter, against programs written out, and where they fail.

LinuxCNC differs from this reader in three places, which the random programs leave out: it computes the conditions of branches and the
results of subprograms that it passes over; a number divided by 0 with MOD, or 0 to a negative power, is an error there only if the
result reaches a word; after break and continue some loops around and behind them make other numbers of turns.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from language_programs import Generator, same
from oracle import Canon, ask_oracle, needs_oracle, recorded
from test_agreement import assert_same_motion

from planner.nc.reader import interpret, parse_program, read_program
from planner.nc.reading import Reading
from planner.nc.writer import flat_program

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
    # the motion code in force, in tenths
    "G0 X1\n#1=#<_motion_mode>\nG1 X2\n#2=#<_motion_mode>\nG3 X4 I1\n#3=#<_motion_mode>\nG81 X5 Z-1 R1\n#4=#<_motion_mode>\n"
    "G80\n#5=#<_motion_mode>\nG1 X#1 Y#2 Z#3\nX#4 Y#5",
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

HEAD = "G21 G90 F100\nG1 X0\n"

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


def written(texts: list[str], folder: Path, head: str = HEAD) -> list[dict]:
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


@pytest.mark.parametrize(("text", "read"), VERDICTS.items())
def test_lines_are_read_or_refused(text: str, read: bool) -> None:
    _, faults = interpret(
        f"{HEAD}{text}\nM2\n".encode(), None, Reading(dialect="linuxcnc"), source="line.ngc"
    )
    assert (not faults) == read


@needs_oracle
def test_linuxcnc_reads_or_refuses_the_same_lines(tmp_path: Path) -> None:
    answers = ask_oracle(written(list(VERDICTS), tmp_path), tmp_path)
    given = zip(VERDICTS.items(), answers, strict=True)
    assert not [(text, canon.error) for (text, read), canon in given if (not canon.error) != read]


def agreeing_blocks(texts: list[str], answers: list[Canon]) -> int:
    """Compare random programs with what LinuxCNC made of them; returns the number of blocks."""
    blocks = 0
    for text, canon in zip(texts, answers, strict=True):
        assert not canon.error, f"{canon.error}\n{text}"
        program = parse_program(text)
        try:
            assert_same_motion(program, canon, centre=1e-6)
        except AssertionError as fault:
            raise AssertionError(f"{text}\n{fault}") from fault
        blocks += len(program)
    return blocks


@pytest.mark.shows("read-linuxcnc", "compared: LinuxCNC 2.9's rs274, recorded answers to random programs")
def test_programs_that_compute_agree_with_the_recorded_answers() -> None:
    assert agreeing_blocks(*map(list, zip(*recorded()["language"], strict=True))) > 150


@pytest.mark.slow
@needs_oracle
def test_random_programs_agree(tmp_path: Path) -> None:
    rng = np.random.default_rng(2)
    texts = [Generator(rng).text() for _ in range(100)]
    assert agreeing_blocks(texts, ask_oracle(written(texts, tmp_path, head=""), tmp_path)) > 600


# --- against programs written out -----------------------------------------------------------------------------------------------


@pytest.mark.shows("expand", "exact: the flat program moves as the one with loops")
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
