"""Cycles, patterns and called programs of conversational programs: depths, places and cleared pockets."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from moved import is_rapid, machine_with, read_twice, sampled

from planner.base.errors import InputError
from planner.nc.program import Kind, Program
from planner.nc.reader import read_program
from planner.nc.reading import Reading

MILL = machine_with(10.0)
HEIDENHAIN = Reading(dialect="heidenhain")
START = "L Z+50 FMAX M3\nL X+10 Y+20 FMAX F700"


def read(cycle: str, after: str = "CYCL CALL\nL X+99") -> Program:
    text = f"0 BEGIN PGM T MM\nTOOL CALL 1 Z S1000\nCYCL DEF {cycle}\n{START}\n{after}\nEND PGM T MM\n"
    return read_twice(text, MILL, HEIDENHAIN)


def depths(program: Program) -> list[float]:
    """z of the cycle's blocks."""
    return [float(z) for z in program.end[3:-1, 2]]


HOLE = "Q200=2 Q201=-20 Q203=1 Q204=10"


def test_pecks_become_smaller_and_break_chips() -> None:
    found = read(f"203 P {HOLE} Q206=150 Q202=8 Q212=2 Q205=3 Q213=1 Q211=0.2 Q208=900 Q256=0.4")
    assert depths(found) == pytest.approx([3, -7, -6.6, -13, 3, -12.8, -17, -16.6, -19, -19, 3, 11])
    assert found.feed[-1] == pytest.approx(700 / 60)  # the program's feed is again in force
    assert found.dwell.sum() == pytest.approx(0.2)
    found = read(f"205 P {HOLE} Q206=100 Q202=10 Q257=4 Q256=.2 Q258=.5 Q259=1")
    assert depths(found) == pytest.approx(
        [3, -3, -2.8, -7, -6.8, -9, 3, -8.5, -13, -12.8, -17, -16.8, -19, 3, 11]
    )


def test_tapping_moves_by_the_lead_of_each_turn() -> None:
    for cycle in (f"207 T {HOLE} Q239=1.5", f"206 T {HOLE} Q206=1500", f"207 T {HOLE} Q239=-1.5"):
        found = read(cycle)
        assert depths(found) == pytest.approx([3, -19, -19, 3, 3, 11])
        assert set(found.feed[found.kind == Kind.LINE][:-1].tolist()) == {25.0}
        assert (found.kind == Kind.STOP).sum() == 3  # with the tool change
        turns = [
            int(v)
            for v, letter in zip(found.events.value, found.events.letter, strict=True)
            if letter == ord("M")
        ]
        left = "=-1.5" in cycle
        assert [v for v in turns if v in (3, 4)] == ([3, 4, 3, 4] if left else [3, 3, 4, 3])
    found = read(f"209 T {HOLE} Q239=1.5 Q257=8 Q256=1")
    assert depths(found)[1:9:2] == pytest.approx([-7, -5.5, -15, -13.5])
    with pytest.raises(InputError, match="needs the lead"):
        read(f"207 T {HOLE}")


def test_the_last_way_out_of_a_thread_is_faster_by_q403() -> None:
    """Q403, "RPM factor for retraction" (TNC 640, cycle 209)."""
    for factor, times in (("", 1.0), (" Q403=0", 1.0), (" Q403=2.5", 2.5)):
        found = read(f"209 T {HOLE} Q239=1.5 Q257=8 Q256=1{factor}")
        feeds = (found.feed[found.kind == Kind.LINE] * 60)[:-1]  # the last is a move of the head
        assert feeds[-1] == pytest.approx(times * feeds[0])
        assert feeds[:-1] == pytest.approx(feeds[0])


def test_a_bored_hole_is_left_off_its_wall() -> None:
    found = read(f"202 B {HOLE} Q206=100 Q208=250 Q214=2")
    assert found.end[5:8].tolist() == [[10, 19.8, -19], [10, 19.8, 3], [10, 19.8, 11]]
    assert found.end[8].tolist() == [10, 20, 11]
    with pytest.raises(InputError, match="Q214 7, the direction"):
        read(f"202 B {HOLE} Q206=100 Q214=7")


@pytest.mark.parametrize(("direction", "away"), [(1, (-1, 0)), (2, (0, -1)), (3, (1, 0)), (4, (0, 1))])
def test_the_direction_of_disengaging(direction: int, away: tuple[int, int]) -> None:
    """Q214: 1 negative x, 2 negative y, 3 positive x, 4 positive y (TNC 640, cycle 202): the other way is into the wall."""
    found = read(f"202 B {HOLE} Q206=100 Q208=250 Q214={direction}")
    off = found.end[5] - [10, 20, -19]
    np.testing.assert_allclose(off, [0.2 * away[0], 0.2 * away[1], 0.0], atol=1e-12)


def test_a_bore_is_milled_to_its_diameter_on_a_helix() -> None:
    found = read(f"208 M {HOLE} Q206=200 Q334=6 Q335=17 Q351=1")
    assert len(found.arc_sweep) == 5  # four turns of 5 mm, and once round
    np.testing.assert_allclose(found.arc_sweep, 2 * math.pi)
    np.testing.assert_allclose(found.arc_center[:, :2], [[10, 20]] * 5)
    np.testing.assert_allclose(np.diff(found.end[found.arc_block, 2]), [-5, -5, -5, 0])
    assert found.end[found.arc_block[0], 0] == pytest.approx(10 + 8.5 - 5)
    with pytest.raises(InputError, match="leaves a core"):
        read(f"208 M {HOLE} Q206=200 Q334=6 Q335=30")


POCKET = "Q200=2 Q201=-10 Q202=4 Q203=1 Q204=20 Q206=150 Q207=500 Q338=0 Q351={turn} Q366=0 Q370=1 Q385=400"
RECTANGLE = f"251 P {POCKET.format(turn=1)} Q218=60 Q219=40 Q220=8 Q224=30"


@pytest.mark.parametrize("kind", [0, 1, 2])
def test_a_rectangular_pocket_is_cleared_inside_its_walls(kind: int) -> None:
    found = read(f"{RECTANGLE} Q367=1 Q215={kind} Q368=0.3 Q369=0.2")
    turn = np.exp(-1j * math.radians(30))
    points, block = sampled(found, 0.05)
    local = (points[:, 0] - 10 + 1j * (points[:, 1] - 20)) * turn - (30 + 20j)  # the tool stands in a corner
    low = (points[:, 2] < 1 - 1e-9) & (block > 2)
    x, y = np.abs(local.real) - 22, np.abs(local.imag) - 12
    wall = 8 - (np.hypot(np.maximum(x, 0), np.maximum(y, 0)) + np.minimum(np.maximum(x, y), 0))
    allowance = 0.3 if kind == 1 else 0.0
    assert wall[low].min() == pytest.approx(5 + allowance, abs=1e-6)
    assert not is_rapid(found, block[low & (np.abs(np.gradient(points[:, 0])) > 1e-9)]).any()
    levels = sorted({round(float(z), 9) for z in found.end[(found.kind == Kind.ARC), 2]})
    assert (
        levels
        == {0: [-9, -8.8, -5.533333333, -2.266666667], 1: [-8.8, -5.533333333, -2.266666667], 2: [-9]}[kind]
    )
    assert set(found.feed[found.kind == Kind.ARC].round(9)) <= {round(500 / 60, 9), round(400 / 60, 9)}


def test_the_tool_goes_round_as_it_climbs() -> None:
    for turn, left in ((1, True), (-1, False)):
        found = read(f"252 P {POCKET.format(turn=turn)} Q223=40 Q215=1")
        assert (found.arc_sweep > 0).all() == left
    mirrored = read_twice(
        f"0 BEGIN PGM T MM\nTOOL CALL 1 Z S1000\nCYCL DEF 8.1 X\nCYCL DEF 252 P {POCKET.format(turn=1)} Q223=40 Q215=1\n"
        f"{START}\nCYCL CALL\nEND PGM T MM\n",
        MILL,
        HEIDENHAIN,
    )
    assert (mirrored.arc_sweep > 0).all()
    np.testing.assert_allclose(mirrored.arc_center[:, :2], [[-10, 20]] * len(mirrored.arc_center), atol=1e-9)


def test_slots_lie_where_they_are_asked_for() -> None:
    found = read(f"253 S {POCKET.format(turn=1)} Q218=50 Q219=14 Q374=90 Q367=2 Q215=1")
    low = found.end[found.end[:, 2] < 0]  # ends of moves: the arcs reach their tips
    assert [low[:, 0].min(), low[:, 0].max()] == pytest.approx([10 - 2, 10 + 2])
    assert low[:, 1].min() == pytest.approx(20 - 2)
    assert low[:, 1].max() == pytest.approx(20 + 38)
    ring = read(
        f"254 S {POCKET.format(turn=1)} Q219=14 Q375=80 Q376=10 Q248=90 Q377=2 Q378=180 Q216=50 Q217=60 Q215=1"
    )
    points, _ = sampled(ring, 0.1)
    place = points[points[:, 2] < 0] - [50, 60, 0]
    far = np.hypot(place[:, 0], place[:, 1])
    assert [far.min(), far.max()] == pytest.approx([38, 42], abs=1e-6)
    angle = np.degrees(np.arctan2(place[:, 1], place[:, 0]))[np.abs(far - 40) < 1e-6]
    assert angle[(angle > 0)].max() == pytest.approx(100, abs=0.1)


@pytest.mark.parametrize(("where", "middle"), [(0, 0.0), (1, 25.0), (2, 18.0), (3, -18.0), (4, -25.0)])
def test_where_the_tool_stands_in_a_slot(where: int, middle: float) -> None:
    """Q367: 0 the middle, 1 the left end, 2 and 3 the centres of the left and the right arc, 4 the right end (TNC 640, cycle 253)."""
    found = read(f"253 S {POCKET.format(turn=1)} Q218=50 Q219=14 Q374=30 Q367={where} Q215=1")
    points, _ = sampled(found, 0.05)
    low = points[points[:, 2] < 0]
    along = (low[:, 0] - 10) * math.cos(math.radians(30)) + (low[:, 1] - 20) * math.sin(math.radians(30))
    assert [along.min(), along.max()] == pytest.approx([middle - 20, middle + 20], abs=1e-3)


@pytest.mark.parametrize(
    ("cycle", "said"),
    [
        (f"{RECTANGLE} Q367=7", "Q367 7"),
        (f"{RECTANGLE} Q215=4", "Q215 4"),
        (f"{RECTANGLE} Q351=3", "Q351 3"),
        (f"{RECTANGLE} Q369=10", "the whole depth"),
        (f"{RECTANGLE} Q368=-1", "is negative"),
        (f"252 P {POCKET.format(turn=1)} Q223=9", "the tool is larger"),
        (f"253 P {POCKET.format(turn=1)} Q218=9 Q219=14", "a length Q218"),
        (f"254 P {POCKET.format(turn=1)} Q219=14 Q375=10 Q248=5", "below the diameter"),
        (f"251 P {POCKET.format(turn=1)} Q218=60 Q219=40 Q207=0", "the feed in the plane"),
        (f"251 P {POCKET.format(turn=1)} Q218=60 Q219=40 Q202=0.000000001", "too small an infeed"),
        ("205 P Q200=2 Q201=-20 Q379=3", "Q379"),
        ("200 D Q200=3 Q201=0 Q202=2 Q206=90", "at or above its surface"),
        ("240 C Q200=3 Q201=-0 Q206=90", "at or above its surface"),
        ("200 D Q200=3 Q201=-12 Q202=0.00001 Q206=90", "too small an infeed"),
        ("204 B Q200=2", "cycle 204 is not read: it bores"),
    ],
)
def test_cycles_that_make_no_sense_are_refused(cycle: str, said: str) -> None:
    with pytest.raises(InputError, match=said):
        read(cycle)


def test_a_pocket_needs_the_diameter_of_its_tool() -> None:
    text = f"0 BEGIN PGM T MM\nTOOL CALL 7 Z S1000\nCYCL DEF {RECTANGLE}\n{START}\nCYCL CALL\nEND PGM T MM\n"
    with pytest.raises(InputError, match=r"<text>:6:1: .*the diameter of tool 7"):
        read_twice(text, MILL, HEIDENHAIN)


def test_patterns_of_places() -> None:
    drill = "240 C Q200=2 Q201=-3 Q206=100 Q203=0 Q204=20"
    circle = read(
        drill, "CYCL DEF 220 C Q216=50 Q217=60 Q244=80 Q245=30 Q246=390 Q241=5 Q200=2 Q203=0 Q204=30 Q301=1"
    )
    holes = circle.end[circle.kind == Kind.LINE][:, :2]
    angle = np.radians(30 + 72 * np.arange(5))
    np.testing.assert_allclose(holes, np.stack([50 + 40 * np.cos(angle), 60 + 40 * np.sin(angle)], axis=1))
    part = read(drill, "CYCL DEF 220 C Q216=0 Q217=0 Q244=80 Q245=0 Q246=90 Q241=4 Q200=2 Q203=0 Q204=30")
    np.testing.assert_allclose(
        np.degrees(np.arctan2(*part.end[part.kind == Kind.LINE][:, 1::-1].T)), [0, 30, 60, 90], atol=1e-9
    )
    lines = read(
        drill,
        "CYCL DEF 221 L Q225=5 Q226=6 Q237=10 Q238=7 Q242=3 Q243=2 Q224=90 Q200=2 Q203=0 Q204=30 Q301=0\nL IX+1 FMAX",
    )
    holes = lines.end[lines.kind == Kind.LINE][:, :2]
    np.testing.assert_allclose(holes, [[5, 6], [5, 16], [5, 26], [-2, 26], [-2, 16], [-2, 6]], atol=1e-9)
    between = lines.end[np.flatnonzero(lines.kind == Kind.LINE)[:-1] + 1, 2]
    assert set(between) == {2.0}  # Q301 0: at the first clearance
    assert lines.end[-1, [0, 2]].tolist() == pytest.approx([-1, 30])
    with pytest.raises(InputError, match="Q365 1"):
        read(drill, "CYCL DEF 220 C Q216=0 Q365=1")
    with pytest.raises(InputError, match="the result is too large"):
        read(drill, f"CYCL DEF 221 C Q225=0 Q242={'9' * 300} Q243={'9' * 300}")


def test_called_programs(tmp_path: Path) -> None:
    (tmp_path / "PART.H").write_text(
        "0 BEGIN PGM PART INCH\n1 L X+1 F+100\n2 CALL LBL 1\n3 Q5 = Q5 + 1\n4 M2\n5 LBL 1\n6 L IY+1\n7 LBL 0\n8 END PGM PART INCH\n"
    )
    main = "0 BEGIN PGM M MM\nL X+0 Y+0 FMAX\nCALL PGM TNC:\\\\nc\\\\Part.h\nCALL LBL 1\n"
    main += "CALL PGM part\nL X+Q5\nM30\nLBL 1\nL IX+3\nLBL 0\nEND PGM M MM\n"
    (tmp_path / "main.h").write_text(main)
    found = read_program(tmp_path / "main.h")
    np.testing.assert_allclose(
        found.end[:, :2],
        [[0, 0], [25.4, 0], [25.4, 25.4], [28.4, 25.4], [25.4, 25.4], [25.4, 50.8], [2, 50.8]],
    )
    assert found.expansion is not None
    assert dict(found.expansion.calls) == {"part": 2, "LBL 1 of 1": 2, "LBL 1": 1}
    (tmp_path / "main.h").write_text("0 BEGIN PGM M MM\nCALL PGM nowhere.h\nEND PGM M MM\n")
    with pytest.raises(InputError, match="no such subprogram"):
        read_program(tmp_path / "main.h")
