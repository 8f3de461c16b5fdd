"""`planner smooth`: fewer lines, the same path within a share of the tolerance, and nothing else changed."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.base.errors import InputError
from planner.commands.smooth import compared
from planner.controls.export.fewer import Fewer, fewer_lines
from planner.machine import load_machine
from planner.nc.program import Program
from planner.nc.reader import parse_program
from planner.verifier import SamePath
from tests.machine.kinematics.five_axis import table_machine

MILL = load_machine("mill")
HEAD = "G21 G90 G17 G94 G64\nG0 X0 Y0 Z5\nF1200\nG1 Z0\n"


def read(text: str | bytes) -> Program:
    return parse_program(text, MILL)


def fewer(text: str, within: float = 0.01, *, arcs: bool = True) -> Fewer:
    return fewer_lines(text.encode(), read(text), MILL, within, arcs=arcs)


def judged(before: str | bytes, after: str | bytes, within: float = 0.01) -> SamePath:
    return compared(read(before), read(after), MILL, within)


def lines_through(points: np.ndarray) -> str:
    return "".join(f"X{x:.4f} Y{y:.4f} Z{z:.4f}\n" for x, y, z in points)


def curve(radius: float, turn: float, count: int, plane: str = "XY") -> np.ndarray:
    """Points on a helix about the normal of a plane, from the origin on."""
    angle = np.linspace(0.0, turn, count)
    u, v, w = radius * np.sin(angle), radius * (1.0 - np.cos(angle)), 0.3 * angle
    return np.stack({"XY": (u, v, w), "XZ": (v, w, u), "YZ": (w, u, v)}[plane], axis=1)[1:]


def dense(program: Program, step: float) -> np.ndarray:
    """(n, 3) points of a program of lines and arcs, closer than `step` one to the next, by formulas of their own."""
    places, found = np.vstack([program.start, program.end]), [program.start[None]]
    arcs = {int(block): row for row, block in enumerate(program.arc_block)}
    for k in range(len(program)):
        a, b = places[k], places[k + 1]
        share = np.linspace(0.0, 1.0, 2 + int(np.linalg.norm(b - a) / step) * (3 if k in arcs else 1))[
            1:, None
        ]
        if k not in arcs:
            found.append(a + share * (b - a))
            continue
        row = arcs[k]
        n = int(program.arc_normal[row])
        u, v = (n + 1) % 3, (n + 2) % 3
        centre, turn = program.arc_center[row], program.arc_sweep[row] * share[:, 0]
        out, points = a - centre, a + share * (b - a)
        points[:, u] = centre[u] + np.cos(turn) * out[u] - np.sin(turn) * out[v]
        points[:, v] = centre[v] + np.sin(turn) * out[u] + np.cos(turn) * out[v]
        found.append(points)
    return np.vstack(found)


def frechet(a: np.ndarray, b: np.ndarray) -> float:
    """The discrete Frechet distance of two rows of points, by its recursion."""
    far = np.linalg.norm(a[:, None] - b[None], axis=2)
    best = np.maximum.accumulate(far[0])
    for row in far[1:]:
        new = np.empty_like(best)
        new[0] = max(best[0], row[0])
        for j in range(1, len(row)):
            new[j] = max(min(best[j], best[j - 1], new[j - 1]), row[j])
        best = new
    return float(best[-1])


@pytest.mark.parametrize("plane", ["XY", "XZ", "YZ"])
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_points_on_arcs_become_arcs_in_all_planes(plane: str, side: float) -> None:
    made = fewer(HEAD + lines_through(curve(8.0, side * 4.0, 120, plane)) + "M2\n")
    program = read(made.text)
    assert made.arcs >= 1
    assert made.after <= 4
    row = int(np.argmax(np.abs(program.arc_sweep)))
    assert int(program.arc_normal[row]) == {"XY": 2, "XZ": 1, "YZ": 0}[plane]
    out = program.end[program.arc_block[row] - 1] - program.arc_center[row]
    out[program.arc_normal[row]] = 0.0
    assert np.linalg.norm(out) == pytest.approx(8.0, abs=0.01)


STEPS = st.lists(
    st.tuples(st.floats(-1.0, 1.0), st.floats(-1.0, 1.0), st.floats(-0.3, 0.3), st.integers(1, 8)),
    min_size=2,
    max_size=6,
)


@pytest.mark.shows(
    "smooth", "certified: the distance both ways and in order, by code that shares none with the writer"
)
@settings(max_examples=20, deadline=None)
@given(STEPS, st.floats(30.0, 120.0), st.booleans())
def test_the_path_stays_within_in_order(steps: list[tuple[float, ...]], part: float, arcs: bool) -> None:
    """Against the discrete Frechet distance of dense points, which is above that of the paths by their spacing at most."""
    turns = np.concatenate([np.tile(step[:3], (int(step[3]), 1)) for step in steps])
    points = np.cumsum(np.cumsum(turns, axis=0) * 0.05, axis=0)
    within = max(float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum()) / part, 1e-3)
    text = "G21 G90 G64\nG0 X0 Y0 Z0\nF1200\nG1 " + lines_through(points)
    if (np.diff(np.round(points, 4), axis=0) == 0.0).all(axis=1).any():
        return
    try:
        made = fewer(text, within, arcs=arcs)
    except InputError:  # no line can go
        return
    step = within / 4.0
    a, b = read(text), read(made.text)
    apart = frechet(dense(a, step), dense(b, step))
    assert apart <= within + 2.0 * step
    found = judged(text, made.text, 1.1 * within)
    assert not found.fault
    assert apart - 2.0 * step <= found.within <= apart + 2.0 * step + 0.03 * within


def test_what_stands_between_stays_in_its_place() -> None:
    """Lines with anything else are there byte for byte, and so is where the motion stands at them."""
    arc = curve(20.0, 1.0, 40)
    others = [
        "(a pocket)",
        "M8",
        "S900 M3",
        "G4 P0.5",
        "T2 M6",
        "; said",
        "F700",
        "G61",
        "G64 P0.01",
        "M9 (off)",
    ]
    text = HEAD
    for k, other in enumerate(others):
        text += f"{other}\nG1 " + lines_through(arc + np.array([0.0, 0.0, 10.0 * k]))
    text += (
        "G91\n"
        + "X0.1 Y0.1\n" * 5
        + "G90\nG41 D1\nX30 Y0\n"
        + "X31\nX32\nX33\n"
        + "G40\nX40\nG81 R20 Z10\nX41\nX42\nG80\nM2\n"
    )
    made = fewer(text)
    after = made.text.decode().split("\n")
    assert made.after < 0.4 * made.before
    left = iter(after)
    assert all(other in left for other in others), "in their order"
    tail = text[text.index("G91") :]
    assert made.text.decode().endswith(tail)
    assert not judged(text, made.text).fault
    reasons = " ".join(made.kept)
    for part in ("G41", "G91", "G61", "canned"):
        assert part in reasons
    exact = text.split("G61\n")[1].split("G64 P")[0]
    assert exact in made.text.decode()


def test_feeds_are_those_of_before_at_every_place() -> None:
    arc = curve(20.0, 2.0, 81)
    rows = [f"X{x:.4f} Y{y:.4f} F{900 if k < 40 else 600}" for k, (x, y, _) in enumerate(arc)]
    text = HEAD + "\n".join(rows) + "\nM2\n"
    made = fewer(text)
    assert made.after < 10
    program = read(made.text)
    where = int(np.flatnonzero(np.isclose(program.feed, 10.0))[0])
    np.testing.assert_allclose(program.end[where - 1, :2], arc[39, :2], atol=1e-4)
    assert set(np.round(program.feed[program.kind == 1], 6)) <= {10.0, 15.0, 20.0}


@pytest.mark.parametrize("unit", [("G21", 1.0, 4), ("G20", 25.4, 5)])
@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_numbers_units_line_ends_and_offsets(unit: tuple[str, float, int], end: str) -> None:
    code, scale, digits = unit
    points = curve(20.0, 2.0, 120, "XZ") / scale
    lines = [f"{code} G90 G64 G54", "G0 X0 Y0 Z0", "G92 X0 Y1 Z2", "F100"]
    lines += [f"G1 X{x:.{digits}f} Y{y + 1:.{digits}f} Z{z + 2:.{digits}f}" for x, y, z in points]
    lines += ["G0 X0", "G2 X2 Y0 I1 J0" if code == "G20" else "G0 X1", "M2"]
    text = "".join(f"N{10 * k} {line}{end}" for k, line in enumerate(lines))
    text = text.replace("G2 X2 Y0 I1 J0", "Y0" + end + "G2 X2 Y0 I1 J0 F100")
    made = fewer(text)
    assert made.arcs
    assert not judged(text, made.text).fault
    written = made.text.decode().split(end)
    numbers = [int(found[1]) for line in written if (found := re.match(r"N(\d+) ", line))]
    assert numbers == sorted(numbers)
    assert "\r" not in made.text.decode().replace("\r\n", "")


def test_a_line_has_the_number_of_the_last_that_it_replaces() -> None:
    """And stands where that one stood, with blanks if that one has some, and with its line end."""
    arc = curve(20.0, 2.0, 60)
    lines = [f"N{10 * k}{' ' * (k % 2)}X{x:.4f}{' ' * (k % 2)}Y{y:.4f}" for k, (x, y, _) in enumerate(arc)]
    text = HEAD.replace("\n", "\r\n") + "\r\n".join([*lines, "M8"]) + "\nM2\n"
    made = fewer(text)
    assert made.after < 10
    before, after = read(text), read(made.text)
    places = dict(zip(after.line.tolist(), after.end.tolist(), strict=True))
    moved = dict(zip(before.line.tolist(), before.end.tolist(), strict=True))
    old = text.split("\n")
    for number, line in enumerate(made.text.decode().split("\n"), start=1):
        if found := re.match(r"N(\d+) ?", line):
            (own,) = (k for k, one in enumerate(old) if one.startswith(f"{found[0]}X"))
            assert places[number] == moved[own + 1]
            assert line.endswith("\r") == old[own].endswith("\r")


SHIFTS = (
    "G43 H1",
    "G43.1 Z2",
    "G43.2 H1",
    "G43.4 H1",
    "G49",
    "G52 X1",
    "G10 L2 P1 X1",
    "G55",
    "G92.1",
    "G92.2",
    "G92.3",
)


@pytest.mark.parametrize("shift", SHIFTS)
def test_the_first_line_behind_a_shift_of_the_coordinates_stays(shift: str) -> None:
    """It says where the tool stands in the new ones; without a shift it goes as the others do."""
    machine = table_machine(tool_length=60.0)
    lines = "".join(f"X{x:.4f} Y{y:.4f}\n" for x, y, _ in curve(20.0, 2.0, 60))
    for between, stays in (("M8", False), (shift, True)):
        text = f"{HEAD}{between}\nG1 {lines}M2\n"
        made = fewer_lines(text.encode(), parse_program(text, machine), machine, 0.01)
        assert made.after < 10
        assert (text.split("\n")[5].encode() in made.text) == stays


@pytest.mark.shows("smooth", "compared: LinuxCNC's rs274 reads the arcs, where it is installed")
@pytest.mark.skipif(
    shutil.which("rs274") is None, reason="LinuxCNC's rs274 is missing (package linuxcnc-uspace)"
)
def test_linuxcnc_reads_the_arcs(tmp_path: Path) -> None:
    """By its own interpreter, in all planes: as many arcs, no error, and the end in the same place."""
    text = HEAD + "".join(
        "G0 X0 Y0 Z0\nG1 " + lines_through(curve(8.0, 3.0, 90, plane)) for plane in ("XY", "XZ", "YZ")
    )
    made = fewer(text + "M2\n")
    file = tmp_path / "job.ngc"
    file.write_bytes(made.text)
    done = subprocess.run(["rs274", "-g", str(file)], capture_output=True, text=True, check=False)
    assert made.arcs >= 3
    assert done.stdout.count("ARC_FEED") == made.arcs
    assert "PROGRAM_END" in done.stdout


def test_plane_and_g1_are_in_force_again_behind() -> None:
    """The line behind has no G word, and an arc of the program counts on its plane."""
    text = HEAD + lines_through(curve(8.0, 3.0, 90, "XZ")) + "S500\nX50 Y0 Z0\nG2 X60 I5\nM2\n"
    made = fewer(text)
    assert made.arcs
    assert "G18" in made.text.decode()
    assert not judged(text, made.text).fault


FAULTS = {
    "a vertex elsewhere": ("X4 Y0", "X4 Y0.02"),
    "an end elsewhere": ("X10 Y0\nM8", "X10 Y0.001\nM8"),
    "a feed": ("F1200", "F1201"),
    "a switch": ("M8\n", ""),
    "a switch later": ("M8\nX10 Y10", "X10 Y10\nM8"),
    "a dwell": ("G4 P0.2", "G4 P0.3"),
    "a turn the other way": ("G3 X0 Y10", "G2 X0 Y10"),
    "there and back left out": ("X5 Y5\nX5 Y0\n", "X5 Y0\n"),
    "another order": ("X4 Y0\nX5 Y0\nX5 Y5\n", "X5 Y5\nX5 Y0\nX4 Y0\n"),
    "a rapid": ("G0 X0 Y30", "G1 X0 Y30"),
    "exact stops": ("X0 Y20", "G61.1 X0 Y20"),
    "a tolerance": ("X0 Y20", "G64 P0.5\nX0 Y20"),
    "a curve": ("I2 J3 P-2 Q4", "I2 J3 P-2 Q4.02"),
}
SOUND = (
    HEAD
    + "X4 Y0\nX5 Y0\nX5 Y5\nX5 Y0\nX10 Y0\nM8\nX10 Y10\nG4 P0.2\nG3 X0 Y10 I-5 J0\nG1 X0 Y20\nG5 X10 Y20 I2 J3 P-2 Q4\n"
    "G0 X0 Y30\nM2\n"
)


@pytest.mark.parametrize("fault", FAULTS)
def test_the_comparison_finds_what_differs(fault: str) -> None:
    old, new = FAULTS[fault]
    assert SOUND.count(old) == 1
    assert judged(SOUND, SOUND).within == 0.0
    assert judged(SOUND, SOUND.replace(old, new)).fault


def test_a_move_of_little_is_measured() -> None:
    found = judged(SOUND, SOUND.replace("X4 Y0", "X4 Y0.006"))
    assert not found.fault
    assert found.within == pytest.approx(0.006, abs=2e-4)
    assert found.within >= 0.006
