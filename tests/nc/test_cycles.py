"""Canned cycles, threads and feed modes: laws, examples worked out by hand, and everything that is refused."""

from __future__ import annotations

import numpy as np
import pytest

from planner.base.errors import InputError
from planner.nc.drilling import CLEARANCE, Hole, steps
from planner.nc.program import Kind, Program
from planner.nc.reader import parse_program
from planner.nc.threads import Thread, depths, passes

HEAD = "G21 G90 G98 F100 S60 M3\nG0 X0 Y0 Z10\n"


def places(program: Program) -> list[tuple[str, float, float, float]]:
    return [
        (Kind(k).name[0], *(round(float(v), 6) + 0.0 for v in end))
        for k, end in zip(program.kind, program.end, strict=True)
    ]


def test_holes_one_after_the_other() -> None:
    program = parse_program(HEAD + "G81 X5 Z-3 R2\nX8\nG99 X9\nG80")
    assert places(program)[1:] == [
        ("R", 5, 0, 10), ("R", 5, 0, 2), ("L", 5, 0, -3), ("R", 5, 0, 10),
        ("R", 8, 0, 10), ("R", 8, 0, 2), ("L", 8, 0, -3), ("R", 8, 0, 10),
        ("R", 9, 0, 10), ("R", 9, 0, 2), ("L", 9, 0, -3), ("R", 9, 0, 2),
    ]  # fmt: skip
    assert set(program.feed[program.kind == Kind.LINE] * 60) == {100.0}
    assert program.line.tolist()[1:] == [3] * 4 + [4] * 4 + [5] * 4


def test_repeats_in_increments() -> None:
    program = parse_program(HEAD + "G91 G99 G81 X5 Y1 Z-3 R-8 L3")
    assert [end[1:] for end in places(program) if end[0] == "L"] == [(5, 1, -1), (10, 2, -1), (15, 3, -1)]


@pytest.mark.parametrize(("plane", "letters"), [(17, "XYZ"), (18, "ZXY"), (19, "YZX")])
def test_cycles_work_along_the_normal(plane: int, letters: str) -> None:
    """The same holes with the axes renamed, in every plane."""
    text = "G0 {0}0 {1}0 {2}10\nG98 G73 {0}5 {1}2 {2}-3 R2 Q1.5\n{0}7 {1}3\nG87 {0}1 {1}1 {2}-3 R2 I{i} J{j} K{k}\n"
    offset = dict(zip("ijk", (1.0, 2.0, -1.0), strict=True))
    order = ["XYZ".index(letter) for letter in letters]
    words = {"ijk"[axis]: list(offset.values())[position] for position, axis in enumerate(order)}
    flat = parse_program(HEAD + text.format(*"XYZ", **offset))
    turned = parse_program(HEAD + f"G{plane}\n" + text.format(*letters, **words))
    np.testing.assert_allclose(turned.end[1:, order], flat.end[1:], atol=1e-12)


def test_pecks_add_up_to_the_depth() -> None:
    for code in (730, 830):
        found = list(steps(Hole(code, (0.0, 0.0), bottom=-10.0, clear=2.0, retract=5.0, peck=3.5)))
        down = [step.place[2] for step in found if step.kind == Kind.LINE]
        assert down == [-1.5, -5.0, -8.5, -10.0]
        assert found[-1].place[2] == 5.0
        back = [step.place[2] for step in found[:-1] if step.kind == Kind.RAPID]
        again = [depth + CLEARANCE for depth in down[:-1]]
        assert back == (again if code == 730 else [z for depth in again for z in (2.0, depth)])


def test_taps_turn_the_spindle_back_and_stop_at_the_bottom() -> None:
    program = parse_program(HEAD + "G84 X5 Z-3 R2")
    assert [place[0] for place in places(program)] == ["R", "R", "R", "L", "S", "L"]
    assert [event.text for event in program.events] == ["S60", "M3", "M5", "M4", "M5", "M3"]
    assert "G84 is synchronised" in program.notes[0]


def test_depths_of_a_thread_take_equal_sections() -> None:
    thread = Thread((20.0, 0.0), -10.0, peak=-1.0, depth=2.0, first=0.5, pitch=1.5, degression=2.0, springs=2)
    found = np.array(list(depths(thread)))
    assert found[-3:].tolist() == [2.0, 2.0, 2.0]
    np.testing.assert_allclose(np.diff(found[:-3] ** 2), 0.25)


def test_the_last_pass_of_a_thread_reaches_its_depth_and_end() -> None:
    thread = Thread(
        (20.0, 5.0), -10.0, peak=-1.0, depth=2.0, first=0.5, pitch=1.5, angle=29.5, taper=3.0, tapered=3
    )
    cuts = list(passes(thread))
    last = cuts[-6:]
    assert min(cut.end.imag for cut in cuts) == pytest.approx(17.0)
    assert last[4].end.real == pytest.approx(-10.0)
    assert last[0].end.real == pytest.approx(5.0 - 2.0 * np.tan(np.deg2rad(29.5)))
    # along a taper the pitch along z is the thread's
    assert last[2].pitch * 3.0 / np.hypot(3.0, 2.0) == pytest.approx(1.5)


def test_threads_advance_with_the_spindle_and_stop_at_both_ends() -> None:
    program = parse_program(HEAD + "G33 Z-20 K1.5\nG33 Z-30 K2\nG0 X5\nG33.1 Z-40 K1\nG1 X9")
    assert [place[0] for place in places(program)[1:]] == list("SLLSRSLSLSL")
    feeds = program.feed[program.kind == Kind.LINE] * 60
    np.testing.assert_allclose(feeds, [90, 120, 60, 60, 100])
    assert places(program)[-2][3] == -30.0  # a tap goes back to where it began
    inches = parse_program(HEAD + "G20\nG33 Z-1 K.1")
    assert inches.feed[-1] * 60 == pytest.approx(0.1 * 25.4 * 60)


def test_feed_modes() -> None:
    text = "G93 G1 X10 F6\nY5 F2\nG0 X0\nG95 F.5\nG1 X4\nS120\nX0\nG94 F30\nX1"
    program = parse_program(HEAD + text)
    np.testing.assert_allclose(program.feed[program.kind == Kind.LINE] * 60, [60, 10, 30, 60, 30])


def test_diameters_are_twice_radii() -> None:
    text = "G0 X{0}\nG1 X{1} Z-2\nG2 X{2} Z-7 K-5\nG91 X{3} Z-5 K-5\nG90 G92 X{0}\nG1 X{1}\nG28 X{2}"
    radii = parse_program(HEAD + "G18 G8\n" + text.format(10, 12, 17, 5))
    diameters = parse_program(HEAD + "G18 G7\n" + text.format(20, 24, 34, 10))
    np.testing.assert_array_equal(radii.end, diameters.end)
    np.testing.assert_array_equal(radii.arc_center, diameters.arc_center)


REFUSED = [
    ("G81 X5 R2", 3, "needs its depth as Z"),
    ("G81 X5 Z-1", 3, "needs R"),
    ("G81 X5 Z3 R2", 3, "below its depth"),
    ("G81", 3, "needs an axis word"),
    ("G81 X5 Z-3 R2\nG82 X3 P1", 4, "needs its depth"),
    ("G82 X5 Z-3 R2", 3, "needs P"),
    ("G82 X5 Z-3 R2 P-1", 3, "must not be negative"),
    ("G83 X5 Z-3 R2", 3, "needs Q"),
    ("G83 X5 Z-3 R2 Q0", 3, "above 0"),
    ("G83 X5 Z-3 R2 Q0.000001", 3, "more than 1000000 moves; correct Q"),
    ("G81 X5 Z-3 R2 L999999999", 3, "more than 1000000 moves; correct L"),
    ("G81 X5 Z-3 R2 L0", 3, "L must be a whole number, 1 or more"),
    ("G81 X5 Z-3 R2 P1", 3, "P word without"),
    ("G87 X5 Z-3 R2 I1 J1", 3, "needs K"),
    ("M5 G84 X5 Z-3 R2", 3, "needs the spindle turning M3"),
    ("G74 X5 Z-3 R2", 3, "needs the spindle turning M4"),
    ("M5 G86 X5 Z-3 R2 P1", 3, "does not turn"),
    ("G93\nG81 X5 Z-3 R2 F1", 4, "write G94"),
    ("G33 Z-1", 3, "pitch as a K word"),
    ("G33 Z-1 K1\nZ-2", 4, "pitch as a K word"),
    ("M5 G33 Z-1 K1", 3, "needs the spindle turning"),
    ("G96 S30\nG33 Z-1 K1", 4, "write G97 and S"),
    ("G33.1 Z-1 K1 I0", 3, "must be above 0"),
    ("G76 P1 Z-5 I-1 J1", 3, "needs K"),
    ("G76 P1 Z-5 I-1 J1 K0.5", 3, "below K"),
    ("G76 P1 Z-5 I0 J1 K2", 3, "must not be 0"),
    ("G76 P1 Z-5 I-1 J1 K2 Q85", 3, "0 to 80"),
    ("G76 P1 Z-5 I-1 J1 K2 L4 E1", 3, "must be 0"),
    ("G76 P1 Z-5 I-1 J0.00001 K2", 3, "more than 10000 passes"),
    ("G93 G1 X5", 3, "needs an F word on its line"),
    ("G95 G1 X5", 3, "without a feed"),
    ("S0 G95 F1 G1 X5", 3, "needs a spindle speed"),
    ("G96 S30\nG95 F1 G1 X0", 4, "without a largest speed"),
    ("G96", 3, "as an S word"),
    ("G96 S30\nG0 X0\nG97", 5, "needs its speed as an S word"),
    ("G94 F1 G93\nG94 G1 X5", 3, "same group"),
    ("M66 P1 L3 Q5", 3, "waits for an input"),
    ("M62", 3, "needs the words P"),
    ("M67 E1", 3, "needs the words E and Q"),
    ("G38.2 Z-5", 3, "probing"),
]  # fmt: skip


@pytest.mark.parametrize(("text", "line", "part"), REFUSED, ids=lambda v: str(v)[:40])
def test_refused(text: str, line: int, part: str) -> None:
    with pytest.raises(InputError) as caught:
        parse_program(HEAD + text + "\nM2\n")
    assert caught.value.line == line
    assert part in caught.value.message


@pytest.mark.parametrize(
    "text",
    [
        "G21 G90 G18\nG0 X20 Z2\nM3\nG95 F0.2\nG96 S100 D3000\nG1 Z0\nG97\nZ-9\nX40\nS600\nZ-12\nM2\n",
        "O1\nG21 G99\nT0909\nG50 S3000\nG96 S100 M3\nG0 X40. Z2.\nG1 Z0 F.2\nG97\nZ-9.\nX80.\nG97 S600\nZ-12.\nM30\n",
        "G18 G90 G71 DIAMON\nG0 X40 Z2\nLIMS=3000\nG96 S100 M3\nG1 Z0 F0.2\nG97\nZ-9\nX80\nS600\nZ-12\nM30\n",
    ],
    ids=["linuxcnc", "fanuc", "siemens"],
)
def test_the_spindle_keeps_its_speed_where_g97_has_none(text: str) -> None:
    """100 m/min at a diameter of 40 mm, by Fanuc's and Siemens' manuals; S100 of G96 is no 100 1/min."""
    program = parse_program(text)
    speed = 100e3 / (np.pi * 40.0)
    feeds = program.feed[program.kind == Kind.LINE] * 60.0
    np.testing.assert_allclose(feeds, 0.2 * np.array([speed, speed, speed, 600.0]))
    assert any("G97 without S: the spindle keeps its speed of 796" in said for said in program.assumptions)


def test_outputs_are_events() -> None:
    program = parse_program(HEAD + "M62 P1\nM65 P2\nG0 X1\nM67 E0 Q1.5\nM68 E1 Q2\nM66 P0 L0\n")
    assert [event.text for event in program.events][2:] == ["M62", "M65", "M67", "M68", "M66"]
