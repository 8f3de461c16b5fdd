"""Sinumerik cycles: depths and feeds, cleared pockets, and what is refused."""

from __future__ import annotations

import math

import numpy as np
import pytest
from moved import is_rapid, machine_with, read_twice, sampled

from planner.base.errors import InputError
from planner.nc.language.making import coarse_lead
from planner.nc.program import Kind, Program
from planner.nc.reading import Reading

MILL = machine_with(10.0)
SIEMENS = Reading(dialect="siemens")
HEAD = "DEF REAL A\nG17 G90 G71 T1 M6 S1000 M3 F200\nG0 X10 Y20 Z50\n"


def read(text: str, head: str = HEAD) -> Program:
    return read_twice(f"{head}{text}\nM30\n", MILL, SIEMENS)


# z of a cycle's blocks, and the feeds per minute of its straight ones
CYCLES = {
    "CYCLE84(20,0,2,-10,,0.5,3,,1.5,0,300,600)": ([2, -10, -10, 2, 2, 20], [450, 900]),
    "CYCLE84(20,0,2,-10,,0.5,3,8,,0,300)": ([2, -10, -10, 2, 2, 20], [375, 375]),
    "CYCLE840(20,0,2,,10,0.5,4,3,0,,1.25)": ([2, -10, -10, 2, 2, 20], [1250, 1250]),
    "CYCLE840(20,0,2,,10,0,4,3,1)": ([2, -10, -10, 2, 2, 20], [200, 200]),
    "CYCLE85(20,0,2,-10,,0.5,100,300)": ([2, -10, -10, 2, 20], [100, 300]),
    "CYCLE86(20,0,2,-10,,0.5,3,-1,-2,1,45)": ([2, -10, -10, -9, 2, 20], [200]),
    "CYCLE87(20,0,2,-10,,3)": ([2, -10, -10, 20], [200]),
    "CYCLE88(20,0,2,-10,,1,3)": ([2, -10, -10, -10, 20], [200]),
    "CYCLE89(20,0,2,-10,,1)": ([2, -10, -10, 2, 20], [200, 200]),
}


@pytest.mark.parametrize("mode", ["", "G95 F0.2\n"])
@pytest.mark.parametrize(("share", "infeeds"), [("0.5", "-8"), ("1", "-8"), ("", "-8"), ("0.25", "-10")])
def test_the_first_infeed_has_its_share_of_the_feed(share: str, infeeds: str, mode: str) -> None:
    found = read(f"{mode}CYCLE83(20,0,2,-10,,{infeeds},,3,0,0,{share},1)\nG1 X99")
    feeds = (found.feed[found.kind == Kind.LINE] * 60).tolist()
    assert feeds[0] == pytest.approx(200 * float(share or 1))
    assert feeds[1:] == pytest.approx([200] * (1 + (infeeds == "-8")))


def test_percent_of_f_counts_once() -> None:
    found = read("OVR=50\nCYCLE840(20,0,2,,10,0,4,3,1)\nG63 Z0\nG1 X99\nG95 F0.1 X89\nG93 F2 X79\nG94 F8 X0")
    feeds = [100, 100, 100, 100, 50, 10, 4]
    assert (found.feed[found.kind == Kind.LINE] * 60).tolist() == pytest.approx(feeds)
    head = "G18 G90 G71 DIAMON LIMS=2000 OVR=50\nG0 X50 Z0\nG96 S200 F0.2 M3\nG1 Z-5"
    turned = read(head, "").feed[-1] * 60
    assert turned == pytest.approx(0.5 * 0.2 * 200_000 / (50 * math.pi))


@pytest.mark.parametrize("modal", [False, True])
@pytest.mark.parametrize("cycle", CYCLES)
def test_cycles_go_to_their_depth_and_back(cycle: str, modal: bool) -> None:
    levels, feeds = CYCLES[cycle]
    call = f"MCALL {cycle}\nX10\nMCALL" if modal else cycle
    found = read(f"{call}\nX99")
    at = [k for k, line in enumerate(found.line) if line == 4]
    assert found.end[at, 2].tolist() == levels
    assert (found.feed[at][found.kind[at] == Kind.LINE] * 60).tolist() == pytest.approx(feeds)
    assert found.end[at[-1]].tolist() == [10, 20, 20]
    assert found.kind[-1] == Kind.RAPID  # G0 is in force again


@pytest.mark.parametrize(
    ("cycle", "hand"),
    [
        ("CYCLE84(20,0,2,-10,,0.5,3,8,,0,300)", [3, 4, 3]), ("CYCLE84(20,0,2,-10,,0.5,3,-8,,0,300)", [4, 3, 4]),
        ("CYCLE84(20,0,2,-10,,0.5,3,,-1.25,0,300)", [4, 3, 4]), ("CYCLE840(20,0,2,,10,0.5,4,3,0,-8)", [4, 3, 4]),
        ("CYCLE840(20,0,2,,10,0.5,4,3,0,,1.25)", [3, 4, 3]),
    ],
)  # fmt: skip
def test_a_negative_size_or_lead_is_a_left_hand_thread(cycle: str, hand: list[int]) -> None:
    """M4 into the hole and M3 out of it; the feed is that of the lead, whatever its sign."""
    found = read(cycle)
    turns = [int(event.text[1:]) for event in found.events if event.text in ("M3", "M4")]
    assert turns[1:] == hand  # behind the M3 of the head
    assert (found.feed[found.kind == Kind.LINE] > 0).all()


def test_a_cycle_keeps_the_modes_of_the_program() -> None:
    found = read("G1 X11 F500\nG91\nCYCLE81(5,0,2,-3)\nX4\nG90\nCYCLE89(5,0,2,-3)\nX4")
    assert found.end[-1].tolist() == [4, 20, 5]
    assert [found.end[k].tolist() for k in range(len(found)) if found.line[k] == 7] == [[15, 20, 5]]
    assert set(found.kind[found.line >= 7][:1]) == {Kind.LINE}


def test_boring_leaves_the_wall() -> None:
    found = read("CYCLE86(20,0,2,-10,,0.5,3,-1,-2,1,45)")
    assert found.end[5].tolist() == [9, 18, -9]
    assert found.end[6].tolist() == [9, 18, 2]


POCKET3 = "POCKET3(20,0,2,-10,60,40,8,15,25,30,4,{fal},{fald},500,100,{cdir},{vari},0,0,0,0,{rad},{dp})"
POCKET4 = "POCKET4(20,0,2,-10,25,15,25,4,{fal},{fald},500,100,{cdir},{vari},,,,{rad},{dp})"


def wall_distance(found: Program, circle: bool) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    points, block = sampled(found, 0.05)
    cutting = (points[:, 2] < -1e-9) & (block > 1)
    place = (points[:, 0] - 15 + 1j * (points[:, 1] - 25))[cutting]
    if circle:
        return 25 - np.abs(place), points[cutting], block[cutting]
    place = place * np.exp(-1j * math.radians(30))
    x, y = np.abs(place.real) - 22, np.abs(place.imag) - 12
    outside = np.hypot(np.maximum(x, 0), np.maximum(y, 0)) + np.minimum(np.maximum(x, y), 0)
    return 8 - outside, points[cutting], block[cutting]


@pytest.mark.parametrize("vari", [1, 2, 11, 21])
@pytest.mark.parametrize("circle", [False, True])
def test_pockets_stay_inside_their_walls_and_reach_them(circle: bool, vari: int) -> None:
    text = (POCKET4 if circle else POCKET3).format(fal=0.5, fald=0.4, cdir=0, vari=vari, rad=3, dp=1.5)
    found = read(text)
    allowance, ground = (0.0, -10.0) if vari == 2 else (0.5, -9.6)
    wall, points, block = wall_distance(found, circle)
    assert wall.min() == pytest.approx(5 + allowance, abs=1e-6)
    assert points[:, 2].min() == pytest.approx(ground)
    ends = found.end[found.line == 4]
    assert not is_rapid(found, block[np.abs(wall - wall.max()) > 1]).any()
    assert ends[-1, 2] == 20
    rounds = {round(float(z), 6) for z in ends[np.isclose(ends[:, 2] % 0.4, 0.0)][:, 2]}
    assert ground in rounds
    if vari == 11:
        levels = {round(float(z), 6) for z in found.end[found.kind == Kind.ARC, 2]}
        assert levels == {-3.2, -6.4, -9.6}
    if vari == 21:
        helix = found.end[found.arc_block[:4]]
        assert (np.diff(helix[:, 2]) < 0).all()
        assert np.hypot(*(helix[0, :2] - [15, 25])) == pytest.approx(3)


@pytest.mark.parametrize(
    ("cdir", "spindle", "left"), [(0, "M3", 1), (1, "M3", 0), (0, "M4", 0), (2, "M3", 0), (3, "M4", 1)]
)
def test_the_direction_of_milling(cdir: int, spindle: str, left: int) -> None:
    found = read(spindle + "\n" + POCKET4.format(fal=0, fald=0, cdir=cdir, vari=11, rad=0, dp=0))
    assert ((found.arc_sweep > 0) == bool(left)).all()


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("CYCLE84(20,0,2,-10,,0.5,3,7.5,,0,300)", "M7.5 is no size"),
        ("CYCLE84(20,0,2,-10,,0.5,3,8,1.25,0,300)", "MPIT and PIT"),
        ("CYCLE84(20,0,2,-10,,0.5,3,,1,0)", "needs SST"),
        ("CYCLE84(20,0,2,5,,0.5,3,,1,0,300)", "at or above its surface"),
        ("CYCLE81(12,1,3,1.5)", "at or above its surface"),
        ("CYCLE82(12,1,3,,0,0.4)", "at or above its surface"),
        ("CYCLE83(12,1,3,-9,,-2,,0.00001,0,0,1,0)", "too small an infeed"),
        ("CYCLE85(20,0,2,-10,,0.5)", "<text>:4:1: .*CYCLE85 needs FFR"),
        ("CYCLE81(20,0,2,-10,,0.5,0,2)", "DMODE 2 of CYCLE81 is not read"),
        ("POCKET4(20,0,2,-10,25,15,25,4,0,0,500,100,0,41)", "VARI 41"),
        ("POCKET4(20,0,2,-10,25,15,25,4,0,0,500,100,7,11)", "CDIR 7"),
        ("POCKET4(20,0,2,-10,4,15,25,4,0,0,500,100,0,11)", "the tool is larger"),
        ("POCKET4(20,0,2,-10,25,15,25,4,0,0,500,100,0,11,,3)", "AP1 of POCKET4"),
        ("POCKET4(20,0,2,-10,25,15,25,4,0,0,500,100,0,21)", "needs RAD1 and DP1"),
        ("POCKET4(20,0,2,-10,25,15,25,4,0,0,500,100,0,21,,,,22,1)", "has no room"),
        ("POCKET3(20,0,2,-10,60,40,3,15,25,30,4,0,0,500,100,0,11)", "the corners of POCKET3"),
        ("POCKET3(20,0,2,-10,-60,40,8,15,25,30,4,0,0,500,100,0,11)", "are to be above 0"),
        ("G18 POCKET3(20,0,2,-10,60,40,8,15,25,30,4,0,0,500,100,0,11)", "POCKET3 in G18"),
        ("MCALL POCKET3(1)", "MCALL POCKET3 is not read"),
        ("SLOT1(20,0,2,-10)", "SLOT1 needs NUM"),
        ("LONGHOLE(20,0,2,-10)", "LONGHOLE needs NUM"),
    ],
)  # fmt: skip
def test_cycles_that_make_no_sense_or_are_not_known_are_refused(text: str, said: str) -> None:
    with pytest.raises(InputError, match=said):
        read(text.replace("G18 ", "G18\n"))


@pytest.mark.parametrize(
    ("lead", "sizes"),
    [
        (0.5, [3]), (0.7, [4]), (0.8, [5]), (1.0, [6, 7]), (1.25, [8, 9]), (1.5, [10, 11]), (1.75, [12]), (2.0, [14, 16]),
        (2.5, [18, 20, 22]), (3.0, [24, 27]), (3.5, [30, 33]), (4.0, [36, 39]), (4.5, [42, 45]), (5.0, [48]),
    ],
)  # fmt: skip
def test_leads_of_coarse_threads_are_those_of_iso_261(lead: float, sizes: list[int]) -> None:
    assert [coarse_lead(float(size), 1.0) for size in sizes] == [lead] * len(sizes)
    assert coarse_lead(float(sizes[0]), 25.4) == pytest.approx(lead / 25.4)
