"""The short model of LinuxCNC's planner: closed forms, laws, and times of LinuxCNC 2.9's own planner; what is exported for it."""

from __future__ import annotations

import itertools
import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import planner
from planner.controls.export.program import write_program
from planner.controls.timing.linuxcnc import BLOCKS, LAST, NORMAL, joined_moves, linuxcnc_times
from planner.controls.timing.times import control_times
from planner.machine import Machine
from planner.nc.program import Kind

SHARED = Path(os.environ.get("PLANNER_SHARED", Path(__file__).resolve().parents[4] / "shared"))
AXIS = {"velocity": 100.0, "acceleration": 2000.0, "jerk": 200000.0}
MACHINE = Machine(name="m", dt=0.001, tolerance=0.05, axes={"x": AXIS, "y": AXIS, "z": AXIS})
# Times of LinuxCNC 2.9's planner (Debian's tpmod.so, stepped period by period) on the machine `peers` [s], for P and Q [mm].
MEASURED = {
    ("a_pentagon", 0.05, 0.0): 1.039,
    ("a_pentagon", 0.025, 0.025): 1.048,
    ("b_zigzag", 0.05, 0.0): 2.563,
    ("b_zigzag", 0.025, 0.025): 2.702,
    ("c_circle", 0.05, 0.0): 0.735,
    ("c_circle", 0.025, 0.025): 0.718,
    ("d_starspiral", 0.05, 0.0): 3.035,
    ("d_starspiral", 0.025, 0.025): 3.101,
    ("e_chips", 0.05, 0.0): 32.725,
    ("e_chips", 0.025, 0.025): 30.881,
}


def linuxcnc_time(*moves: Any) -> float:
    return float(linuxcnc_times(*moves).sum())


def time_of(points: np.ndarray, tolerance: float = 0.05, feed: float = 1e9) -> float:
    moves = len(points) - 1
    return linuxcnc_time(
        points, np.full(moves, feed), np.zeros(moves + 1, bool), MACHINE, ("x", "y", "z"), tolerance
    )


@pytest.mark.shows("time-linuxcnc", "exact: closed forms of single moves")
def test_a_straight_move_ends_with_half_of_the_acceleration() -> None:
    """L/v + v/2a + v/(2 a LAST): the last move of a program."""
    points = np.array([[0.0, 0, 0], [40, 0, 0]])
    a = 2000.0 * LAST
    assert time_of(points) == pytest.approx(40 / 100 + 100 / (2 * a) + 100 / (2 * a))
    before = np.array([[-40.0, 0, 0], [0, 0, 0], [40, 0, 0]])
    assert time_of(before) == pytest.approx(80 / 100 + 100 / (2 * 0.9 * 2000) + 100 / (2 * 0.9 * a), rel=1e-9)


def test_moves_that_move_nothing_take_no_time() -> None:
    points = np.array([[0.0, 0, 0], [20, 0, 0], [20, 15, 0]])
    twice = points[[0, 0, 1, 1, 1, 2, 2]]
    assert time_of(twice) == pytest.approx(time_of(points), rel=1e-12)


@pytest.mark.parametrize("turn", [0.0, 3.0, 90.0, 180.0])
def test_a_stop_parts_the_program_in_two(turn: float) -> None:
    """A dwell at a corner: no arc leads through it, and each half takes what it takes alone."""
    angle = np.deg2rad(turn)
    points = np.array([[0.0, 0, 0], [40, 0, 0], [40 + 30 * np.cos(angle), 30 * np.sin(angle), 0]])
    found = linuxcnc_time(
        points, np.full(2, 50.0), np.array([False, True, False]), MACHINE, ("x", "y", "z"), 0.05
    )
    assert found == pytest.approx(time_of(points[:2], feed=50.0) + time_of(points[1:], feed=50.0), rel=1e-12)
    assert found > time_of(points, feed=50.0)


def test_a_corner_is_passed_at_the_speed_of_its_arc() -> None:
    """Right angle: R = P s / (1 - s), v^2 = N a R; the way is shorter by 2 d - pi R / 2."""
    points = np.array([[0.0, 0, 0], [40, 0, 0], [40, 40, 0]])
    s, a = np.sqrt(0.5), 2000.0
    radius = 0.05 * s / (1 - s)
    v = np.sqrt(NORMAL * a * radius)
    leg = 40 - radius
    first = leg / 100 + 100 / (2 * a) + (100 - v) ** 2 / (2 * a * 100)
    second = leg / 100 + 100 / (2 * a * LAST) + (100 - v) ** 2 / (2 * a * LAST * 100)
    assert time_of(points) == pytest.approx(first + second + 0.5 * np.pi * radius / v, rel=1e-6)
    assert time_of(points, 0.02) > time_of(points), "less tolerance, a slower corner"


def test_axes_that_do_not_move_slow_nothing_down() -> None:
    """Corners in x and y know nothing of a slow z; a corner that z has a part in does, and so does one tilted by a little."""
    slow = Machine(
        name="m",
        dt=0.001,
        tolerance=0.05,
        axes={"x": AXIS, "y": AXIS, "z": AXIS | {"acceleration": 50.0}},
    )
    flat = np.array([[0.0, 0, 0], [40, 0, 0], [40, 40, 0], [70, 40, 0]])
    tilted = flat + np.outer([0, 0, 1, 1], [0, 0, 8])
    args = (np.full(3, 60.0), np.zeros(4, bool))
    found = [
        linuxcnc_time(points, *args, machine, ("x", "y", "z"), 0.05)
        for points in (flat, tilted)
        for machine in (MACHINE, slow)
    ]
    assert found[1] == pytest.approx(found[0], rel=1e-12)
    assert found[3] > 1.05 * found[2]
    plane = linuxcnc_time(flat[:, :2], *args, slow, ("x", "y"), 0.05)
    assert plane == pytest.approx(found[0], rel=1e-12), "two axes or three"


def test_short_moves_bound_the_speed_by_what_is_seen_ahead() -> None:
    """On kinks of no angle, v^2 <= 2 a (BLOCKS l): the motion can stand within the moves that are seen."""
    points = np.zeros((4001, 3))
    points[:, 0] = np.linspace(0, 4.0, 4001)
    v = np.sqrt(2 * 0.9 * 2000.0 * BLOCKS * 0.001)
    assert v < 1.0 / 0.001, "and not by the period"
    whole = time_of(points)
    assert 4.0 / min(v, 1.0) <= whole <= 1.02 * 4.0 / min(v, 1.0), "a move takes a period at least: 1 mm/s"


def test_joined_points_are_near_the_moves_that_are_kept() -> None:
    angle = np.linspace(0, np.pi, 200)
    points = np.stack([10 * np.cos(angle), 10 * np.sin(angle), np.zeros(200)], axis=1)
    feed, rapid, stop = np.full(199, 50.0), np.zeros(199, bool), np.zeros(200, bool)
    assert len(joined_moves(points, feed, rapid, stop, 0.0)) == 200
    kept = joined_moves(points, feed, rapid, stop, 0.01)
    assert 2 < len(kept) < 100
    for a, b in itertools.pairwise(kept):
        chord = points[b] - points[a]
        u = np.clip((points[a:b] - points[a]) @ chord / (chord @ chord), 0, 1)
        assert np.linalg.norm(points[a:b] - points[a] - u[:, None] * chord, axis=1).max() <= 0.01
    stop[77] = True
    feed[120:] = 60.0
    assert {77, 120} <= set(joined_moves(points, feed, rapid, stop, 0.01).tolist())


@pytest.mark.shows("time-linuxcnc", "compared: recorded times of LinuxCNC 2.9's own planner")
@pytest.mark.parametrize("case", MEASURED, ids=lambda case: f"{case[0]} P{case[1]} Q{case[2]}")
def test_predictions_are_near_linuxcnc(case: tuple[str, float, float]) -> None:
    job, p, q = case
    file = SHARED / "peers" / "programs" / f"{job}.ngc"
    if not file.exists():
        pytest.skip(f"{file} is not here")
    program = planner.read_program(file, MACHINE)
    points = np.vstack([program.start, program.end])
    moves = np.append(True, (np.diff(points, axis=0) != 0).any(axis=1))
    points, feed = points[moves], program.feed[moves[1:]]
    rapid = (program.kind == Kind.RAPID)[moves[1:]]
    stop = np.zeros(len(points), bool)
    kept = joined_moves(points, feed, rapid, stop, q)
    feed = np.where(rapid, np.inf, feed)[kept[:-1]]
    predicted = linuxcnc_time(points[kept], feed, stop[kept], MACHINE, ("x", "y", "z"), p)
    assert predicted == pytest.approx(MEASURED[case], rel=0.021)


LONG_LEGS = "%\n(legs)\nG21 F6000\nG1 X40\nY40\nX0\nY0\nM2\n%\n"
DENSE = "G21 F6000\n" + "".join(
    f"G1 X{10 * np.cos(a) - 10:.3f} Y{5 * np.sin(2 * a):.3f}\n" for a in np.linspace(0, 6, 600)
)
DENSE += "M2\n"


def test_corners_with_long_legs_keep_their_own_words(tmp_path: Path) -> None:
    """A smooth path would be slower there: the program comes out byte for byte, with a path mode after the percent sign."""
    plan = planner.plan(
        planner.read_program(text=LONG_LEGS), MACHINE, tolerance=0.045, effort="quick", method="second-order"
    )
    made = write_program(tmp_path, plan, "linuxcnc", 0.05)
    assert made.sentence == "program as it is, byte for byte behind a line G21 G64 P0.0500 Q0.0000"
    text = (tmp_path / "linuxcnc.ngc").read_text()
    assert text.replace("G21 G64 P0.0500 Q0.0000\n", "", 1) == LONG_LEGS
    assert text.splitlines()[:2] == ["%", "G21 G64 P0.0500 Q0.0000"]
    own = min(time for name, time in made.predicted.items() if name.startswith("program"))
    planned = min(time for name, time in made.predicted.items() if name.startswith("planned"))
    assert planned > own


def test_another_program_only_where_it_is_faster_by_more_than_the_models_error(tmp_path: Path) -> None:
    plan = planner.plan(
        planner.read_program(text=DENSE), MACHINE, tolerance=0.045, effort="quick", method="second-order"
    )
    made = write_program(tmp_path, plan, "linuxcnc", 0.05)
    times = made.predicted
    name = next(name for name in sorted(times, key=len, reverse=True) if made.sentence.startswith(name))
    assert name == "program as it is" or times[name] < 0.98 * times["program as it is"]
    assert name != "program as it is", "600 chords on smooth curves"
    read = planner.read_program(text=(tmp_path / "linuxcnc.ngc").read_text())
    assert np.nanmax(read.tolerance) <= 0.05


@pytest.mark.parametrize("mode", ["G61", "G64 P0.01", "g 64 p0.02"])
def test_a_path_mode_of_the_program_stays(mode: str, tmp_path: Path) -> None:
    text = f"{mode}\n{LONG_LEGS[2:]}"
    plan = planner.plan(planner.read_program(text=text), MACHINE, method="stop")
    made = write_program(tmp_path, plan, "linuxcnc", 0.05)
    assert made.sentence == "program as it is, with its own path mode, byte for byte"
    assert (tmp_path / "linuxcnc.ngc").read_bytes() == text.encode()
    assert made.predicted == {}
    assert not made.notes


def test_programs_of_another_dialect_are_written_as_moves(tmp_path: Path) -> None:
    text = "BEGIN PGM A MM\nL X+0 Y+0 FMAX\nL X+40 F3000\nL Y+40\nEND PGM A MM\n"
    plan = planner.plan(planner.read_program(text=text), MACHINE, method="stop")
    made = write_program(tmp_path, plan, "linuxcnc", 0.05)
    again = planner.read_program(text=(tmp_path / made.file).read_text())
    assert again.end[-1] == pytest.approx([40, 40, 0])
    assert "is no linuxcnc program" in made.notes[0]


# Times of LinuxCNC 2.9 in real time (linuxcnc_run.py) of programs with splines, and of its planner stepped (lcnc_fast.py) [s].
RUN = {"systems": 32.321, "circle_small_segments_ncd": 15.221}
ZIGZAG_OF_SPLINES = 4.854


@pytest.mark.parametrize("name", RUN)
def test_short_splines_and_the_rests_of_short_lines_take_a_period_at_least(name: str) -> None:
    """Each spline of `systems` becomes 24 arcs; of `circle...` every fourth corner is none, beside which half a line is left."""
    file = SHARED / "nc" / f"LinuxCNC__linuxcnc__{name}.ngc"
    if not file.exists():
        pytest.skip("real programs of ../shared are not here")
    found = planner_time(planner.read_program(file, MACHINE))
    assert found == pytest.approx(RUN[name], rel=0.02)


def test_cubic_splines_are_cut_into_more_arcs_than_quadratic_ones() -> None:
    cubic = "\n".join(
        f"G5 X{k + 1} Y{0.3 * ((k + 1) % 2):.3f} I0.4 J{0.1 if k % 2 == 0 else -0.1} P-0.3 Q0.05"
        for k in range(100)
    )
    program = planner.read_program(text=f"G21 F6000\nG1 X0 Y0\n{cubic}\nG1 X110\n", machine=MACHINE)
    assert planner_time(program) == pytest.approx(ZIGZAG_OF_SPLINES, rel=0.02)
    short = "\n".join(f"G5.1 X{k / 1000:.3f} I0.0005 J0" for k in range(1, 101))
    quadratic = planner.read_program(text=f"G21 F6000\nG1 X0 Y1\nG1 X0 Y0\n{short}\n", machine=MACHINE)
    assert planner_time(quadratic) >= 100 * 24 * MACHINE.dt


def planner_time(program: planner.Program) -> float:
    found = control_times(program, MACHINE, "linuxcnc", 0.05)
    return found.seconds - found.dwells
