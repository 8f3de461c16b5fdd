"""A re-timed program is the same program but for its feeds: same bytes, same path, the feeds that were asked for."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from oracle import SHARED, ask_oracle, needs_oracle
from test_agreement import (
    MACHINE,
    PROGRAMS,
    assert_same_motion,
    needs_programs,
    offsets_in_inches,
    random_program,
)

from planner.base.arrays import Array, FloatArray
from planner.base.errors import InputError
from planner.nc.program import Kind, Program
from planner.nc.reader import parse_program
from planner.nc.reading import Reading
from planner.nc.writer import FEED_MIN, SAME_FEED, SIGNIFICANT, retimed, round_down

# What one F word may take away at most by rounding down [-], and the rounding of units (25.4, 60) beside it.
ROUNDED = 10.0 ** (1 - SIGNIFICANT)
ROUNDING = 1e-11
EXACT = ("kind", "dwell", "line", "path_control", "tolerance", "arc_block", "arc_normal")
LENGTHS = ("end", "arc_center", "arc_sweep")
# Comments stay; of the rest, an F word and one blank before it. Not the lexer of the package.
COMMENT_OR_F = re.compile(rb"(\([^)\r\n]*\)|;[^\r\n]*)|[ ]?[Ff](?:[ \t]*[-+.\d])+")


def moving(program: Program) -> Array:
    return (program.kind == Kind.LINE) | (program.kind == Kind.ARC)


def without_f(data: bytes) -> bytes:
    return COMMENT_OR_F.sub(lambda found: found.group(1) or b"", data)


def assert_same_but_feeds(one: Program, other: Program) -> None:
    for name in EXACT:
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name), err_msg=name)
    for name in LENGTHS:
        np.testing.assert_allclose(getattr(one, name), getattr(other, name), rtol=0, atol=1e-6, err_msg=name)
    assert list(map(vars, one.events)) == list(map(vars, other.events))


def assert_feeds_as_asked(program: Program, asked: FloatArray, result: Program) -> None:
    move = moving(program)
    planned = np.maximum(np.where(np.isfinite(asked), asked, np.inf), FEED_MIN)
    # The moves of a line, those of a cycle, share its F word: the fastest of them decides.
    of_line = np.zeros(int(program.line.max(initial=0)) + 1)
    np.maximum.at(of_line, program.line[move], np.minimum(planned, program.feed)[move])
    expected = np.minimum(of_line[program.line], program.feed)[move]
    short = 1.0 - result.feed[move] / expected
    assert short.min(initial=0.0) >= -SAME_FEED
    assert short.max(initial=0.0) <= ROUNDED
    assert (result.feed[move] <= program.feed[move] * (1 + ROUNDING)).all()
    kept = expected >= program.feed[move]
    np.testing.assert_allclose(result.feed[move][kept], program.feed[move][kept], rtol=ROUNDING)


def check(data: bytes, asked: FloatArray, machine: object = None) -> bytes:
    """Re-time, and hold the result against the laws that every program keeps."""
    program = parse_program(data, machine)  # type: ignore[arg-type]
    text = retimed(data, program, asked)
    result = parse_program(text, machine)  # type: ignore[arg-type]
    assert without_f(text) == without_f(data)
    assert_same_but_feeds(program, result)
    assert_feeds_as_asked(program, asked, result)
    assert retimed(text, result, asked) == text, "a second time changes nothing"
    assert retimed(data, program, np.full(len(program), np.nan)) == data
    return text


def random_feeds(program: Program, rng: np.random.Generator) -> FloatArray:
    """Mostly below the programmed feed, over four decades; some above, some to stay."""
    asked = np.where(moving(program), program.feed, 1.0) * 10.0 ** rng.uniform(-4, 0.3, len(program))
    return np.where(rng.random(len(program)) < 0.2, rng.choice([np.nan, np.inf], len(program)), asked)


# --- where the word goes, and in which units -----------------------------------------------------------------------------

IN_MM = [10.0, 20.0, 30.0, 40.0]  # [mm/s]: F600, F1200, F1800, F2400


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ("F6000\nG1 X1\nX2 Y3\n", "F6000\nG1 X1 F600\nX2 Y3 F1200\n"),
        ("G1 X1 F6000\nX2\nM2\n", "G1 X1 F600\nX2 F1200\nM2\n"),
        ("G1 F6000 X1 (F9)\nX2 ; F9\n", "G1 F600 X1 (F9)\nX2 F1200 ; F9\n"),
        ("F6000 G1 X1(a)\nX2;b\n(c) X3 (d) Y3 (e)", "F600 G1 X1(a)\nX2 F1200;b\n(c) X3 (d) Y3 F1800 (e)"),
        ("G1X1F6000\nX2Y2\nX3.\n", "G1X1F600\nX2Y2F1200\nX3. F1800\n"),
        ("N10G1X1F6000\nN20X2.\nN30 X3\n", "N10G1X1F600\nN20X2.F1200\nN30 X3 F1800\n"),
        ("g1x1f6000\nx2 y2\n", "g1x1f600\nx2 y2 f1200\n"),
        ("G1 X1 F6000\r\nX 2 . 5 \r\n%\r\n", "G1 X1 F600\r\nX 2 . 5 F1200 \r\n%\r\n"),
        ("G1 X1 F6000\rX2\r", "G1 X1 F600\rX2 F1200\r"),
        ("\ufeff%\nG1 X1 F6000\n%\nX2 F7\n", "\ufeff%\nG1 X1 F600\n%\nX2 F7\n"),
        ("G1 X1 F 60 00 Y2\nX-.5\n", "G1 X1 F600 Y2\nX-.5 F1200\n"),
        ("F6000 G1 X1\n/X9 F1\nX2\n", "F600 G1 X1\n/X9 F1\nX2 F1200\n"),
        ("F6000\nG2 X1 Y1 R1\nG3 X2 Y2 I1 J0\n", "F6000\nG2 X1 Y1 R1 F600\nG3 X2 Y2 I1 J0 F1200\n"),
        ("F6000 G91 G1 X1\nX1\nX1\n", "F600 G91 G1 X1\nX1 F1200\nX1 F1800\n"),
        # words on the way that are no feed moves: rapids, dwells, stops, a motion code alone, F alone
        (
            "G0 X1 F6000\nG4 P1\nG1 X2\nM3 S5\nF5000\nG1\nM6 X4\nG28\nM0\n",
            "G0 X1 F6000\nG4 P1\nG1 X2 F1800\nM3 S5\nF5000\nG1\nM6 X4 F3000\nG28\nM0\n",
        ),
    ],
)
def test_where_it_goes(before: str, after: str) -> None:
    program = parse_program(before)
    asked = 10.0 * np.arange(1, len(program) + 1)
    assert check(before.encode(), asked).decode() == after


def test_units_are_those_before_the_line() -> None:
    """F acts before G20 and G21 beside it: millimetres in the first line, inches in the second and third."""
    text = check(b"G20 G1 X1 F6000\nX2\nG21 X3\nX4\n", np.array([10.0, 25.4, 2.54, 40.0]))
    assert text == b"G20 G1 X1 F600\nX2 F60\nG21 X3 F6\nX4 F2400\n"


def test_the_programmed_feed_is_brought_back() -> None:
    """A block that keeps its feed says so once ours is in force; in its own units; then source words rule again."""
    source = b"G1 X1 F6000\nX2\nG20\nX3\nX4 F60\nX5\n"
    text = check(source, np.array([10.0, np.nan, np.inf, np.nan, 1e6]))
    assert text == b"G1 X1 F600\nX2 F6000\nG20\nX3\nX4 F60\nX5\n"
    text = check(source, np.array([10.0, 20.0, np.inf, np.nan, 1e6]))
    first = 6000 / 25.4
    assert text == f"G1 X1 F600\nX2 F1200\nG20\nX3 F{first!r}\nX4 F60\nX5\n".encode()


def test_a_feed_in_force_is_not_written_again() -> None:
    source = b"G1 X1 F6000\nX2\nG0 X3\nG1 X4\nG20\nX5\nX6 F100\n"
    text = check(source, np.array([10.0, 10.0, np.nan, 10.0, 10.0, 10.0]))
    assert (
        text == b"G1 X1 F600\nX2\nG0 X3\nG1 X4\nG20\nX5 F23.62\nX6 F23.62\n"
    )  # 600 mm/min, in inches and rounded down


def test_a_feed_on_a_rapid_rules_what_follows() -> None:
    source = b"G1 X1 F6000\nG0 X2 F50\nG1 X3\n"
    text = check(source, np.array([10.0, 10.0, np.nan]))
    assert text == b"G1 X1 F600\nG0 X2 F50\nG1 X3\n"


def test_never_zero_and_never_above_the_programmed_feed() -> None:
    text = check(b"G1 X1 F6000.25\nX2\nX3 F0.01\n", np.array([100.1, 0.0, 0.0]))
    assert text == b"G1 X1 F6000.25\nX2 F0.6\nX3 F0.01\n"


@given(st.floats(1e-6, 1e9))
@example(0.3)
@example(999.9999999999999)
@example(1000.0)
@example(1e9)
def test_rounding_down(value: float) -> None:
    text = round_down(value)
    assert re.fullmatch(r"\d+(\.\d*[1-9])?", text), "no exponent, no needless zero"
    assert -2e-12 <= 1 - float(text) / value <= ROUNDED
    assert len(text.replace(".", "").strip("0")) <= SIGNIFICANT


def test_the_blocks_of_a_line_share_its_feed() -> None:
    """The fastest of them decides: a cycle, and a corner that compensation adds."""
    source = b"G21 G99 F600\nG0 X0 Y0 Z9\nG83 X1 Z-4 R2 Q2\nG41.1 D2\nG1 X20\nY-9\nG40\n"
    program = parse_program(source)
    feeds = np.where(program.line == 3, np.linspace(2.0, 5.0, len(program)), np.nan)
    feeds[program.line == 6] = 4.0, 7.0
    largest = feeds[(program.line == 3) & (program.kind == Kind.LINE)].max() * 60
    after = retimed(source, program, feeds)
    assert after.split(b"\n")[2] == b"G83 X1 Z-4 R2 Q2 F" + round_down(largest).encode()
    assert b"G1 X20 F600\nY-9 F420\n" in after


def test_other_feed_modes_and_threads_stay() -> None:
    source = b"G21 F600 S60 M3\nG33 Z-5 K1\nG1 X5\nG93 X7 F2\nX9 F3\nG95 F.5 X1\nG94 F300 X0\n"
    program = parse_program(source)
    after = retimed(source, program, np.full(len(program), 0.1))
    assert after == source.replace(b"G1 X5", b"G1 X5 F6").replace(b"F300", b"F6")


def test_what_does_not_belong_together_is_refused() -> None:
    program = parse_program("G1 X1 F60\nX2\n")
    with pytest.raises(ValueError, match="on lines where the source has no word"):
        retimed(b"G1 X1 F60\n", program, np.ones(2))
    with pytest.raises(ValueError, match="3 feeds for 2 blocks"):
        retimed(b"G1 X1 F60\nX2\n", program, np.ones(3))
    with pytest.raises(ValueError, match="-1 mm/s"):
        retimed(b"G1 X1 F60\nX2\n", program, np.array([1.0, -1.0]))


def test_deleted_blocks_that_are_read_are_written() -> None:
    source = b"F6000 G1 X1\n/X9\n"
    program = parse_program(source, reading=Reading(block_delete=False))
    assert retimed(source, program, np.full(2, 10.0)) == b"F600 G1 X1\n/X9\n"


# --- any program, in any spelling ----------------------------------------------------------------------------------------


def spelled(text: str, rng: np.random.Generator) -> bytes:
    """Another spelling of the same lines: case, blanks, comments, line numbers, line ends."""
    lines = []
    for line in text.split("\n"):
        words = [w.lower() if rng.random() < 0.3 else w for w in line.split()]
        new = str(rng.choice(["", " ", "  ", "\t"])).join(words)
        if rng.random() < 0.2:
            new = re.sub(r"([A-Za-z])", r"\1 ", new)
        if rng.random() < 0.3:
            new = f"N{rng.integers(10**5)}{rng.choice(['', ' '])}{new}"
        lines.append(new + str(rng.choice(["", "", " ", "(F7 note)", " ; F8 note", " (ä) ", "\t;"])))
    return str(rng.choice(["\n", "\r\n", "\r"])).join(lines).encode()


@pytest.mark.slow
@given(st.integers(0, 2**32 - 1))
@settings(max_examples=40, deadline=None)
def test_any_program(seed: int) -> None:
    rng = np.random.default_rng(seed)
    source = spelled(random_program(rng), rng)
    check(source, random_feeds(parse_program(source, MACHINE), rng), MACHINE)


@pytest.mark.shows("planned-ngc", "compared: LinuxCNC's rs274 reads the same path, where it is installed")
@pytest.mark.slow
@needs_oracle
def test_the_control_reads_random_programs_as_we_do(tmp_path: Path) -> None:
    rng = np.random.default_rng(77)
    jobs, results = [], []
    for k in range(150):
        source = random_program(rng).encode()
        program = parse_program(source, MACHINE)
        text = retimed(source, program, random_feeds(program, rng))
        (tmp_path / f"{k}.ngc").write_bytes(text)
        jobs.append({"path": str(tmp_path / f"{k}.ngc"), **offsets_in_inches()})
        results.append(parse_program(text, MACHINE))
    for job, result, canon in zip(jobs, results, ask_oracle(jobs, tmp_path), strict=True):
        assert not canon.error, f"{canon.error}\n{Path(job['path']).read_text()}"
        assert_same_motion(result, canon, centre=1e-6)


REAL_MAX = 15_000  # bytes of a program: of long ones the beginning


@pytest.mark.slow
@needs_oracle
@needs_programs
def test_the_control_reads_real_programs_as_we_do(tmp_path: Path) -> None:
    """Programs of many post-processors, and those of the comparison with other planners."""
    rng = np.random.default_rng(78)
    jobs, results = [], []
    for path in [*PROGRAMS, *sorted((SHARED / "peers" / "programs").glob("*.ngc"))]:
        source = path.read_bytes()
        if len(source) > REAL_MAX:
            source = source[:REAL_MAX].rpartition(b"\n")[0]
        try:
            program = parse_program(source)
        except InputError:
            continue
        if program.expansion is not None:  # of those the flat program is re-timed
            continue
        text = check(source, random_feeds(program, rng))
        target = tmp_path / f"{len(jobs)}.ngc"
        target.write_bytes(b"\n".join(b"" if s.startswith(b"/") else s for s in text.split(b"\n")))
        jobs.append({"path": str(target)})
        results.append(parse_program(text))
    compared = 0
    for result, canon in zip(results, ask_oracle(jobs, tmp_path), strict=True):
        if not canon.error or "no percent sign" in canon.error:
            assert_same_motion(result, canon, centre=1e-6)
            compared += 1
    assert compared >= 20
