"""The reader and LinuxCNC's own interpreter read the same motion out of a program.

The oracle (`oracle.py`) works in inches, so its millimetres carry a few roundings of 2e-16 relative; incremental programs add them up
block by block. Lengths are compared to 1e-9 mm absolute plus 1e-12 relative, feeds to 1e-12. The
centre of an arc with R near half a turn magnifies a rounding by its square root: 1e-6 mm there.

Moves that go nowhere are left out on both sides: LinuxCNC also issues one for a lone G1 and before G28.
"""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from oracle import SHARED, Canon, ask_oracle, asked, needs_oracle
from random_splines import with_splines_whole

from planner.base.arrays import Array
from planner.base.errors import InputError
from planner.base.units import MM_PER_INCH
from planner.machine import Machine
from planner.nc.program import Kind, Program
from planner.nc.reader import interpret, read_program
from planner.nc.reading import Reading

NOT_NC = (".csv", ".plt", ".hpgl")  # plotter files: tests/nc/hpgl
PROGRAMS = sorted(p for p in (SHARED / "nc").glob("*") if p.suffix not in NOT_NC) if SHARED.is_dir() else []
NOWHERE = 1e-9  # [mm]
END_OF_FILE = "File ended with no percent sign"  # LinuxCNC wants M2, M30 or %; a file that just ends has moved all the same
HEAD = 40_000  # [bytes]
# Programs that cut threads: the oracle does not say at which feed.
THREADS = ("LinuxCNC__linuxcnc__lathe-g76.ngc",)


def moving(kind: Array, end: Array, keep: Array) -> Array:
    """Which rows move or stand still for a time, given which rows to keep anyway."""
    start = np.vstack([np.zeros(3), end])[:-1]
    return keep | ((kind <= 1) & (np.abs(end - start).max(axis=1) > NOWHERE))


def assert_same_motion(
    program: Program, canon: Canon, *, centre: float = NOWHERE, feeds: bool = True
) -> None:
    """feeds : compare them too; the oracle says nothing of the feed of threads"""
    move = canon.move.copy()
    # a dwell has no place of its own: it stays where it is
    for k in np.flatnonzero(move[:, 0] == 3):
        move[k, 2:5] = move[k - 1, 2:5] if k else 0.0
    move = move[moving(move[:, 0], move[:, 2:5], (move[:, 0] == 2) | ((move[:, 0] == 3) & (move[:, 5] > 0)))]
    keep = moving(program.kind, program.end, np.isin(program.kind, (Kind.ARC, Kind.DWELL, Kind.SPLINE)))
    move = with_splines_whole(program, np.flatnonzero(keep), move)
    kind, line, end = program.kind[keep], program.line[keep], program.end[keep]

    np.testing.assert_array_equal(kind, move[:, 0])
    still = kind == Kind.DWELL  # LinuxCNC issues those of compensated moves with the next move
    np.testing.assert_array_equal(line[~still], move[~still, 1])
    np.testing.assert_allclose(end, move[:, 2:5], rtol=1e-12, atol=NOWHERE)
    feed_moves = np.isin(kind, (Kind.LINE, Kind.ARC, Kind.SPLINE)) & feeds
    np.testing.assert_allclose(program.feed[keep][feed_moves] * 60, move[feed_moves, 5], rtol=1e-12)
    np.testing.assert_allclose(
        program.dwell[keep][kind == Kind.DWELL], move[kind == Kind.DWELL, 5], rtol=1e-12
    )

    arcs = move[kind == Kind.ARC]
    np.testing.assert_array_equal(program.arc_normal, arcs[:, 9])
    for plane in range(3):
        rows, axes = program.arc_normal == plane, [a for a in range(3) if a != plane]
        np.testing.assert_allclose(
            program.arc_center[rows][:, axes], arcs[rows][:, 6:9][:, axes], rtol=1e-12, atol=centre
        )
    np.testing.assert_array_equal(np.sign(program.arc_sweep), np.sign(arcs[:, 10]))
    np.testing.assert_array_equal(
        np.ceil(np.abs(program.arc_sweep) / (2 * np.pi) - 1e-6), np.abs(arcs[:, 10])
    )
    assert_sweeps_reach_ends(program)


def assert_sweeps_reach_ends(program: Program) -> None:
    """Turning the start by the sweep about the centre leads towards the end (1e-6 rad: an arc's own freedom)."""
    start = np.vstack([program.start, program.end])[:-1][program.arc_block] - program.arc_center
    end = program.end[program.arc_block] - program.arc_center
    first, second = (program.arc_normal + 1) % 3, (program.arc_normal + 2) % 3
    rows = np.arange(len(first))
    before = start[rows, first] + 1j * start[rows, second]
    after = end[rows, first] + 1j * end[rows, second]
    off = np.angle(after / (before * np.exp(1j * program.arc_sweep)))
    assert np.abs(off).max(initial=0.0) < 1.1e-6


needs_programs = pytest.mark.skipif(not PROGRAMS, reason=f"no folder of real programs at {SHARED}")


@pytest.mark.shows(
    "read-linuxcnc", "compared: LinuxCNC 2.9's rs274 on real programs, where both are installed"
)
@pytest.mark.slow
@needs_oracle
@needs_programs
def test_real_programs_agree(tmp_path: Path) -> None:
    """Of long ones what is before `HEAD` bytes: further on they are more of the same lines."""
    assert len(PROGRAMS) > 40, "the collection of real programs is not complete"
    read: dict[Path, Program] = {}
    for whole in PROGRAMS:
        path, text = tmp_path / whole.name, whole.read_bytes()
        path.write_bytes(text if len(text) <= HEAD else text[:HEAD].rpartition(b"\n")[0])
        with suppress(InputError):
            read[path] = read_program(path, reading=Reading(block_delete=False))
    compared = 0
    for (path, program), canon in zip(
        read.items(), ask_oracle([{"path": str(p)} for p in read], tmp_path), strict=True
    ):
        if canon.error and END_OF_FILE not in canon.error:
            with pytest.raises(InputError):  # what strict reading lets through, LinuxCNC reads
                read_program(path, reading=Reading(block_delete=False, strict=True))
            continue
        compared += 1
        assert_same_motion(program, canon, centre=1e-6, feeds=path.name not in THREADS)
    assert compared >= 25


# --- small programs made by chance, over the modes -------------------------------------------------------------------------

MACHINE = Machine(
    name="test",
    dt=1e-3,
    tolerance=0.05,
    axes={a: {"velocity": 1, "acceleration": 1, "jerk": 1} for a in "xyz"},  # type: ignore[dict-item]
    tools={"1": 25.0, "7": 88.25},
    positions={"g28": {"x": 100.0, "y": 3.0, "z": 50.0}, "g30": {"z": -7.5}},
    work_offsets={
        "g54": {"x": 1.0, "z": 2.0},
        "g55": {"x": -30.0, "y": 4.5},
        "g59.3": {"y": 12.0, "z": -3.25},
    },
)
OFFSETS = {
    "parameters": {
        5161: 100.0, 5162: 3.0, 5163: 50.0, 5183: -7.5,
        5221: 1.0, 5223: 2.0, 5241: -30.0, 5242: 4.5, 5382: 12.0, 5383: -3.25,
    },
    "tools": {1: 25.0, 7: 88.25},
}  # fmt: skip


def offsets_in_inches() -> dict:
    return {name: {str(k): v / MM_PER_INCH for k, v in given.items()} for name, given in OFFSETS.items()}


def random_program(rng: np.random.Generator) -> str:
    """A program of valid lines. Arcs in every form close by construction.

    A program has either inches or tool lengths: when units change, the module `gcode` takes a tool length in force for as
    many of the new units (G30 and G53 then end elsewhere), and under G20 it takes the millimetres of G43 for inches.
    Here a length is a length.
    """
    lines = ["G0 X1 Y2 Z3", "F120"]
    absolute, inches = True, bool(rng.integers(2))

    def number(scale: float = 20.0) -> str:
        return f"{rng.uniform(-scale, scale):.{rng.integers(1, 5)}f}"

    def axes() -> str:
        chosen = [a for a in "XYZ" if rng.random() < 0.5] or ["X"]
        return " ".join(a + number() for a in chosen)

    def arc() -> str:
        plane = rng.integers(3)
        a, b = ("XY", "ZX", "YZ")[plane]
        i, j = ("IJ", "KI", "JK")[plane]
        c = next(axis for axis in "XYZ" if axis not in (a, b))
        text = f"G{(17, 18, 19)[plane]} G{rng.choice([2, 3])} "
        helix = f" {c}{number()}" if rng.random() < 0.3 else ""
        turns = f" P{rng.integers(1, 4)}" if rng.random() < 0.3 else ""
        if rng.random() < 0.3:
            return text + f"{i}{number()} {j}5.5{helix}{turns} G91.1"
        # a circle about a centre 5 away along a, ended a quarter or half on, in incremental coordinates
        u, v = [(5.0, 5.0), (5.0, -5.0), (10.0, 0.0)][rng.integers(3)]
        if rng.random() < 0.4:
            u, v = rng.uniform(1, 9), rng.uniform(1, 9)
            size = np.hypot(u, v) / 2 * rng.uniform(1.01, 4) * rng.choice([-1, 1])
            return f"G91 {text}{a}{u:.4f} {b}{v:.4f} R{size:.5f}{helix}{turns}\nG{90 if absolute else 91}"
        return f"G91 {text}{a}{u} {b}{v} {i}5{helix}{turns} G91.1\nG{90 if absolute else 91}"

    for _ in range(rng.integers(5, 25)):
        choice = rng.integers(17)
        if choice <= 3:
            lines.append(
                f"G{rng.integers(2)} {axes()}"
                + (f" F{rng.uniform(1, 900):.2f}" if rng.random() < 0.5 else "")
            )
        elif choice == 4:
            lines.append("G1 " + axes() + "\n" + axes())
        elif choice <= 7:
            lines.append(arc())
        elif choice == 8:
            lines.append(f"G{rng.choice([20, 21]) if inches else 21} F{rng.uniform(1, 900):.1f} G1 {axes()}")
        elif choice == 9:
            absolute = bool(rng.integers(2))
            lines.append("G90" if absolute else "G91")
        elif choice == 10:
            lines.append(rng.choice(["G92 " + axes(), "G92.1", "G92.2", "G92.3"]))
        elif choice == 11:
            lines.append(rng.choice(["G28", "G30"]) + (" " + axes() if rng.random() < 0.6 else ""))
        elif choice == 12:
            lines.append(f"G90 G53 G{rng.integers(2)} {axes()}\nG{90 if absolute else 91}")
        elif choice == 13:
            lines.append(
                rng.choice(["G54", "G55", "G56", "G59.3"]) + (" G0 " + axes() if rng.random() < 0.5 else "")
            )
        elif choice == 14 and not inches:
            lines.append(rng.choice(["G43 H1", "G43 H7", "G49", "G43 H3", "G0 G43 H7 Z5"]))
        elif choice == 15:
            lines.append(f"G4 P{rng.uniform(0.1, 2):.2f}" + (" G1 " + axes() if rng.random() < 0.5 else ""))
        else:
            lines.append("G90 G90.1 G17 G0 X3 Y4\nG3 X13 Y4 I8 J4\nG91.1" + f"\nG{90 if absolute else 91}")
    return "\n".join(lines) + "\nM2\n"


# Lines on which both must agree whether they are read at all. (True: read.)
VERDICTS = {
    "G1 X1": False, "F0 G1 X1": False, "F-1": False, "X1": False, "G0 X1\nG80\nX2": False, "G80 X1": False,
    "G80 G0 X1": True, "G0 X1 G28": False, "G28 G0": False, "G53 X1": False, "G91 G0 X1\nG53 X1": False,
    "G53 G2 X1 Y1 R1 F1": False, "G0\nG53": False, "G92": False, "G92 X1 G1 F1 Y2": False, "F1 G2 X1": False,
    "F1 G2": False, "F1 G2 R1": False, "F1 G2 I1 R1 X1": False, "F1 G2 X1 Y1 K1": False, "F1 G2 X2 R0.99": False,
    "F1 G2 X2 R0.999": True, "F1 G2 X1 Y1 I0 J0": False, "F1 G3 I1 P0": False, "F1 G3 I1 P1.5": False,
    "F1 G90.1 G3 X2 I1": False, "F1 G2 I1\nI2": True, "F1 G2 X20.02 I10": True, "F1 G2 X20.03 I10": False,
    "F1 G2 X200.1 I100": True, "F1 G2 X200.11 I100": False, "G4": False, "G4 P-1": False, "G4 X1": False,
    "P1": False, "G0 X1 I1": False, "G0 X1 H1": False, "G0 X1 R1": False, "G0 X1 D1": False, "G0 X1 L1": False,
    "G0 X1 P1": False, "G0 X1 Q1": False, "G0 X1 X2": False, "G0 G1 X1": False, "G90 G91": False,
    "M3 M4": False, "M7 M8": False, "T1.5": False, "T-1": False, "S-5": False, "G43 H1.5": False, "G49 H1": False,
    "G 0 X 1 0 . 5": True, "G0X- 1": True, "G0 X.5Y5.Z+3": True, "G0 X.": False, "G0 X1e3": False,
    "g01x1f10": True, "G00.0 X1": True, "G0.00001 X1": True, "G1.1 X1": False, "G0 X1 (a(b)": False,
    "G0 X1 (a": False, "G0 (a) X1 (b) Y2 ; c": True, "G0 X1 )": False, "; (h\nG0 X1": True, "%1\nG0 X1": False,
    "G0 N1 X1": False, "N1 N2 G0 X1": False, "G0 /X1": False, "N1 /G0 X1": False, "G61 G64": False, "G15": False,
    "F1 G5 X4 I1 J1 P0 Q1": True, "F1 G5 X4 I1 J1 P0": False, "F1 G5 X4 I1 P0 Q1": False, "F1 G5 I1 J1 P0 Q1": False,
    "F1 G5 X4 Z1 I1 J1 P0 Q1": False, "F1 G18 G5 X4 I1 J1 P0 Q1": False, "F1 G5.1 X4 I1 J1": True, "F1 G5.1 X4": False,
    "F1 G5.1 X4 I1": False, "G5 X4 I1 J1 P0 Q1": False, "G5.3": False,
    "F1 G5.2 X1 Y1 P1 L3\nX2 Y0 P1\nX3 Y3 P2\nG5.3": True, "F1 G5.2 X1 Y1 P1 L3\nX2 P1": False,
    "F1 G5.2 X1 Y1 P1 L4\nG5.3": False, "F1 G5.2 X1 Y1 P1 L3\nX2 Y2 P1\nG1 X3\nG5.3": False, "F1 G1 X1 L2": False,
    "M48": True, "G8": True, "G97 S1": True, "G98": True, "G40 D1": False, "G0 X1.2.3": False, "G0 X1 @": False,
}  # fmt: skip


def _reads(text: str) -> bool:
    """Whether strict reading refuses nothing but what is not known: units, tools, offsets."""
    try:
        _, faults = interpret(text, None, Reading(strict=True), source="job.ngc")
    except InputError:
        return False
    return all("assumed without --strict" in fault.message for fault in faults)


@pytest.mark.parametrize(("text", "read"), VERDICTS.items())
def test_lines_are_read_or_refused(text: str, read: bool) -> None:
    assert _reads(text + "\nM2\n") == read


@needs_oracle
def test_linuxcnc_reads_or_refuses_the_same_lines(tmp_path: Path) -> None:
    answers = asked([text + "\nM2\n" for text in VERDICTS], {}, tmp_path)
    given = zip(VERDICTS.items(), answers, strict=True)
    assert not [(text, canon.error) for (text, read), canon in given if (not canon.error) != read]
