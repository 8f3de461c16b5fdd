"""What programs mean, and what must not matter: units, relative coordinates, spelling."""

from __future__ import annotations

import random

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.machine import Machine
from planner.nc.lexer import split_words
from planner.nc.program import Kind, PathControl, Program
from planner.nc.reader import parse_program
from planner.nc.reading import Reading

FIELDS = (
    "kind", "end", "feed", "dwell", "line", "path_control", "tolerance",
    "arc_block", "arc_center", "arc_normal", "arc_sweep",
)  # fmt: skip


def machine(**more: object) -> Machine:
    axis = {"velocity": 1.0, "acceleration": 1.0, "jerk": 1.0}
    return Machine(name="t", dt=1e-3, tolerance=0.05, axes=dict.fromkeys("xyz", axis), **more)  # type: ignore[arg-type]


def assert_same(one: Program, other: Program, *, atol: float = 0.0, but: tuple[str, ...] = ()) -> None:
    for name in FIELDS:
        if name not in but:
            np.testing.assert_allclose(
                getattr(one, name), getattr(other, name), rtol=atol, atol=atol, err_msg=name
            )


def ends(text: str, of: Machine | None = None) -> list[list[float]]:
    return parse_program(text, of).end.tolist()


# --- numbers and words ---------------------------------------------------------------------------------------------------


def number(rng: random.Random) -> str:
    """Up to 25 digits before the point, and up to 30 after it."""
    before, after = (
        "".join(rng.choices("0123456789", k=rng.randint(0, most))) if rng.random() < 0.8 else ""
        for most in (25, 30)
    )
    point = "." if after or rng.random() < 0.5 else ""
    return rng.choice(["", "+", "-"]) + (before if before or after else "0") + point + after


@given(st.integers(0, 10**6))
@settings(max_examples=20)
def test_numbers_are_rounded_as_float_does(seed: int) -> None:
    rng = random.Random(seed)
    texts = [number(rng) for _ in range(200)]
    words = split_words("\n".join("X" + t for t in texts).encode(), block_delete=True)
    assert words.value.tolist() == [float(t) for t in texts]


SMALL = """%
(a comment) G21 G90 G17 G40 G49 G80 G94
G64 P0.01
T2 M6
S12000 M3
G0 X1.5 Y-2 Z3
G1 Z-1 F300
X10.25 F1200
G2 X12.25 Y0 I0 J2
G3 X14.25 Y2 R2 Z0
G18 G3 X10 Z0 I-2.125 K0
G4 P0.5
G91 G1 X1 Y1 Z1
G92 X0 Y0
G90 G1 X3 Y3
G53 G0 Z5
G92.1
G28 Z10
M5 M9
M30
%
"""


@given(st.randoms(use_true_random=False))
@settings(max_examples=25, deadline=None)
def test_spelling_does_not_matter(rng: random.Random) -> None:
    def spell(line: str) -> str:
        if line.startswith(("%", "(")):
            return line
        words = line.split()
        if rng.random() < 0.5:
            words = [rng.choice([w, w.lower()]) for w in words]
        text = rng.choice(["", " ", "\t", "  "]).join(words)
        if rng.random() < 0.3:
            text = "".join(c + rng.choice(["", " "]) for c in text)
        text = text.replace("G1 ", "G01 ").replace("G0 ", "G00 ")
        text = rng.choice(["", f"N{rng.randrange(10**6)} "]) + text
        return text + rng.choice(["", " ; end G0 X99", " (note # [)", "(\xe4\xff)"])

    end = rng.choice(["\n", "\r\n", "\r"])
    other = end.join(spell(line) for line in SMALL.split("\n"))
    assert_same(parse_program(SMALL), parse_program(other.encode(rng.choice(["latin-1", "utf-8"]))))


def test_order_of_words_does_not_matter() -> None:
    assert_same(parse_program("F60 G1 X1 Y2 S3"), parse_program("Y2 S3 X1 F60 G1"))


def test_byte_order_mark_and_block_delete() -> None:
    text = "\ufeffG0 X1\n/G0 X2\n / G0 X3\nG0 X4"
    assert ends(text) == [[1, 0, 0], [4, 0, 0]]
    assert len(parse_program(text, reading=Reading(block_delete=False))) == 4


def test_percent_starts_and_ends() -> None:
    assert len(parse_program("\n%\nG0 X1\n%\nG0 X2")) == 1
    assert len(parse_program("G0 X1\n%\nG0 X2")) == 1


# --- units and coordinates -----------------------------------------------------------------------------------------------

COORDINATE = st.integers(-(10**6), 10**6).map(lambda n: n / 1000)
POINTS = st.lists(st.tuples(COORDINATE, COORDINATE, COORDINATE), min_size=1, max_size=12)


@given(POINTS)
@settings(max_examples=30, deadline=None)
def test_inches_are_millimetres(points: list[tuple[float, float, float]]) -> None:
    def text(scale: float, unit: str) -> str:
        moves = "\n".join("X{:.12f} Y{:.12f} Z{:.12f}".format(*(c / scale for c in p)) for p in points)
        arc = "G91 G2 X{0:.12f} Y{0:.12f} I{0:.12f}".format(5 / scale)
        return (
            f"{unit}\nF{600 / scale:.12f}\nG1\n{moves}\n{arc}\nG64 P{0.1 / scale:.12f}\nG0 X{1 / scale:.12f}"
        )

    assert_same(parse_program(text(1.0, "G21")), parse_program(text(25.4, "G20")), atol=1e-9)


@given(POINTS)
@settings(max_examples=30, deadline=None)
def test_relative_coordinates_lead_to_the_same_places(points: list[tuple[float, float, float]]) -> None:
    places = np.array(points)
    steps = np.diff(places, axis=0, prepend=0.0)

    def text(rows: np.ndarray) -> str:
        return "\n".join("X{:.3f} Y{:.3f} Z{:.3f}".format(*row) for row in rows)

    assert_same(
        parse_program("G90\nG0\n" + text(places)), parse_program("G91\nG0\n" + text(steps)), atol=1e-9
    )


@given(POINTS, st.tuples(COORDINATE, COORDINATE, COORDINATE))
@settings(max_examples=30, deadline=None)
def test_a_work_offset_moves_everything(
    points: list[tuple[float, float, float]], shift: tuple[float, ...]
) -> None:
    text = "G55\nG0\n" + "\n".join(f"X{x:.3f} Y{y:.3f} Z{z:.3f}" for x, y, z in points)
    given_offset = machine(work_offsets={"g55": dict(zip("xyz", shift, strict=True))})
    np.testing.assert_allclose(
        parse_program(text, given_offset).end, parse_program(text).end + shift, atol=1e-9
    )


def test_offsets_add_up() -> None:
    of = machine(tools={"3": 25.0}, work_offsets={"g54": {"x": 10.0}, "g55": {"z": 2.0}})
    assert ends("G0 X1\nG43 H3\nZ1\nG55 Z1\nG92 Z0\nZ1\nG53 Z7\nG49 G92.1 Z0", of) == [
        [11, 0, 0], [11, 0, 26], [11, 0, 28], [11, 0, 29], [11, 0, 7], [11, 0, 2],
    ]  # fmt: skip


def test_g43_without_h_takes_the_tool_in_the_spindle() -> None:
    of = machine(tools={"3": 25.0, "4": 1.0})
    assert parse_program("T3 M6\nT4\nG43\nG0 Z0", of).end[-1, 2] == 25.0
    assert parse_program("T4 M6 G43 G0 Z0", of).end[-1, 2] == 1.0


def test_g92_3_brings_back_what_g92_2_took() -> None:
    assert ends("G0 X3\nG92 X1\nX2\nG92.2\nX2\nG92.3\nX2\nG92.1\nX2\nG92.3\nX2") == [
        [3, 0, 0], [4, 0, 0], [2, 0, 0], [4, 0, 0], [2, 0, 0], [2, 0, 0],
    ]  # fmt: skip


def test_home_through_a_point() -> None:
    of = machine(positions={"g28": {"x": 100.0, "z": 50.0}}, work_offsets={"g54": {"x": 0.0}})
    program = parse_program("G21 G0 X1 Y2 Z3\nG91 G28 Z4\nG28\nG90 G30 X5 Y5", of)
    assert program.end.tolist() == [[1, 2, 3], [1, 2, 7], [1, 2, 50], [100, 0, 50], [5, 5, 50], [0, 0, 50]]
    assert program.line.tolist() == [1, 2, 2, 3, 4, 4]
    assert program.notes == ("line 4: G30 has no position in the machine file: machine zero",)


# --- feeds, modes, events ------------------------------------------------------------------------------------------------


def test_feed_is_read_before_units() -> None:
    program = parse_program("G21 G1 X1 F60\nG20 F120 G1 X1\nX2 F60", reading=Reading(dialect="linuxcnc"))
    assert program.feed.tolist() == [1.0, 2.0, 25.4]
    assert program.notes == ("line 2: F120 is mm per minute: F acts before G20 on the same line",)


def test_path_control_holds_from_its_line_on() -> None:
    text = "G21 G0 X1\nG61\nX2\nG61.1 X3\nG64 P0.1 X4\nG20 G64 P0.01\nX5\nG64 Q1 X6\nG64 P0 X7"
    program = parse_program(text, machine(path_control="exact_stop"))
    B, P, S = PathControl
    assert program.path_control.tolist() == [S, P, S, B, B, B, B]
    np.testing.assert_allclose(program.tolerance, [np.nan, np.nan, np.nan, 0.1, 0.254, np.nan, np.nan])
    assert len(program.notes) == 2


def test_stops_and_dwells_in_their_order() -> None:
    program = parse_program("F60\nM0 G0 X1\nM6 T2 G0 X2\nG4 P2 X3\nG4 P0\nM1\nM60\nG1 X4\nM2")
    R, L, D, S = Kind.RAPID, Kind.LINE, Kind.DWELL, Kind.STOP
    assert program.kind.tolist() == [R, S, S, R, D, R, S, S, S, L]
    assert program.dwell.tolist() == [0, 0, 0, 0, 2, 0, 0, 0, 0, 0]
    assert np.isinf(program.feed).tolist() == [True] * 9 + [False]


def test_events_keep_their_place() -> None:
    program = parse_program("G21\nM3 S12000 T2\nG0 X1 S0.5 M8\nX2 S7\nG97 M48\nM5")
    assert [(e.block, e.line, e.text) for e in program.events] == [
        (0, 2, "S12000"), (0, 2, "T2"), (0, 2, "M3"), (0, 3, "S0.5"), (0, 3, "M8"), (1, 4, "S7"),
        (2, 5, "M48"), (2, 5, "G97"), (2, 6, "M5"),
    ]  # fmt: skip
    assert program.events[-1].text == "M5"
    assert [e.text for e in program.events[1:3]] == ["T2", "M3"]


def test_a_motion_code_alone_moves_nothing() -> None:
    assert len(parse_program("G1\nG0\nG1 F100\nF200")) == 0


def test_notes_say_what_is_missing() -> None:
    program = parse_program("T3 M6\nG43 H3\nG56\nG28\nG28\nG64 Q1 P1\nG64 Q1 P1\nG43 H3", machine())
    assert program.notes == (
        "line 3: G56 has no offset in the machine file: 0",
        "line 1: tool change: a full stop, moves nothing; its time is not included, [times] tool_change of the "
        "machine file gives it",
        "line 2: tool 3 has no length in the machine file: 0 (2 times)",
        "line 4: G28 has no position in the machine file: machine zero (2 times)",
        "line 4: no G20 or G21 before the first move: mm",
        "line 6: G64 Q is not used: the tolerance of P bounds every deviation (2 times)",
    )
    assert program.assumptions == program.notes[:-1]


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("F9\nG1 X1", 2),
        ("F9\nG1 X1\nG20 X2", 2),
        ("G20\nF9 G1 X1", 0),
        ("F9\nG21 G1 X1", 0),
        ("F9", 0),
        ("G4 P1\nG20\nG1 F9 X1", 0),
    ],
)
def test_units_that_are_not_said_are_noted(text: str, line: int) -> None:
    notes = parse_program(text).notes
    assert notes == ((f"line {line}: no G20 or G21 before the first move: mm",) if line else ())


# --- arcs ----------------------------------------------------------------------------------------------------------------


def arc(text: str) -> tuple[list[float], list[float], float]:
    program = parse_program("F60\n" + text)
    assert program.kind[-1] == Kind.ARC
    return program.end[-1].tolist(), program.arc_center[-1].tolist(), float(program.arc_sweep[-1] / np.pi)


@pytest.mark.parametrize(
    ("text", "end", "centre", "half_turns"),
    [
        ("G3 X1 Y1 I0 J1", [1, 1, 0], [0, 1, 0], 0.5),
        ("G2 X1 Y1 I1 J0", [1, 1, 0], [1, 0, 0], -0.5),
        ("G2 X1 Y1 I0 J1", [1, 1, 0], [0, 1, 0], -1.5),
        ("G3 I5", [0, 0, 0], [5, 0, 0], 2.0),
        ("G2 I5 P3 Z4", [0, 0, 4], [5, 0, 0], -6.0),
        ("G3 X1 Y1 J1 P2", [1, 1, 0], [0, 1, 0], 2.5),
        ("G2 X2 R1", [2, 0, 0], [1, 0, 0], -1.0),
        ("G3 X1 Y1 R1", [1, 1, 0], [0, 1, 0], 0.5),
        ("G3 X1 Y1 R-1", [1, 1, 0], [1, 0, 0], 1.5),
        ("G2 X1 Y1 R1", [1, 1, 0], [1, 0, 0], -0.5),
        ("G2 X1 Y1 R-1", [1, 1, 0], [0, 1, 0], -1.5),
        ("G18 G2 X1 Z1 I1", [1, 0, 1], [1, 0, 0], -1.5),
        ("G18 G3 X1 Z1 I1 Y3", [1, 3, 1], [1, 0, 0], 0.5),
        ("G19 G3 Y1 Z1 K1", [0, 1, 1], [0, 0, 1], 0.5),
        ("G92 X5 Y5\nG90.1 G3 X7 I6 J5", [2, 0, 0], [1, 0, 0], 1.0),
        ("G91 G90.1 G3 X2 I1 J0", [2, 0, 0], [1, 0, 0], 1.0),
    ],
)
def test_arcs(text: str, end: list[float], centre: list[float], half_turns: float) -> None:
    found_end, found_centre, found_turns = arc(text)
    np.testing.assert_allclose(found_end, end, atol=1e-12)
    np.testing.assert_allclose(found_centre, centre, atol=1e-12)
    assert found_turns == pytest.approx(half_turns, abs=1e-12)


@given(
    st.floats(1e-2, 1e4),
    st.floats(-3.1, 3.1),
    st.floats(0.01, 6.2),
    st.booleans(),
    st.sampled_from([17, 18, 19]),
)
@settings(max_examples=40, deadline=None)
def test_r_and_centre_describe_the_same_arc(
    radius: float, first: float, sweep: float, clockwise: bool, plane: int
) -> None:
    """Within rounding: near half a turn a rounding of the chord moves the centre by its square root."""
    a, b = {17: "XY", 18: "ZX", 19: "YZ"}[plane]
    i, j = {17: "IJ", 18: "KI", 19: "JK"}[plane]
    turn = -sweep if clockwise else sweep
    u, v = -radius * np.cos(first), -radius * np.sin(first)
    x, y = u + radius * np.cos(first + turn), v + radius * np.sin(first + turn)
    head = f"F1 G{plane} G91\nG{2 if clockwise else 3} {a}{x:.15f} {b}{y:.15f} "
    size = radius if sweep <= np.pi else -radius
    by_centre = parse_program(f"{head} {i}{u:.15f} {j}{v:.15f}")
    if abs(sweep - np.pi) > 1e-3 and 2 * radius * np.sin(sweep / 2) > 1e-3:
        by_radius = parse_program(f"{head} R{size:.15f}")
        np.testing.assert_allclose(by_radius.arc_center, by_centre.arc_center, atol=1e-6 * max(1.0, radius))
        np.testing.assert_allclose(by_radius.arc_sweep, by_centre.arc_sweep, atol=1e-6 * max(1.0, 1 / radius))
    assert by_centre.arc_sweep[0] == pytest.approx(turn, abs=1e-6)


# --- fast and slow paths -------------------------------------------------------------------------------------------------


@given(
    st.lists(
        st.sampled_from(["X1", "Y-2.5", "Z3", "G1", "G0", "F60", "S5", "N7"]),
        min_size=1,
        max_size=5,
        unique=True,
    )
)
@settings(max_examples=60, deadline=None)
def test_the_compiled_loop_does_what_the_interpreter_does(words: list[str]) -> None:
    """G40 stops the compiled loop and changes nothing."""
    if {"G0", "G1"} <= set(words):
        words.remove("G0")
    words = sorted(words, key=lambda word: word != "N7")
    line = " ".join(words)
    head = "F30 G1 G91\n"
    plain, slow = parse_program(f"{head}{line}\n{line}"), parse_program(f"{head}{line} G40\n{line} G40")
    assert_same(plain, slow)
    assert [e.text for e in plain.events] == [e.text for e in slow.events]
