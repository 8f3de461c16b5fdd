"""The parts of the contour error in linear and in rotary axes: offsets across lines, arcs and curves come out as they were put in."""

from __future__ import annotations

import numpy as np
import pytest

from planner.geometry.build import toolpath_from_program
from planner.geometry.chords import points_on
from planner.machine import Machine
from planner.motion.trajectory import Trajectory
from planner.nc.reader import parse_program
from planner.verifier import verify
from planner.verifier.pieces import both_apart, program_pieces

AXIS = {"velocity": 100.0, "acceleration": 2000.0, "jerk": 2e5}
MACHINE = Machine(name="m", dt=0.001, tolerance=0.01, axes=dict.fromkeys("xyzab", AXIS), rotary_radius=20.0)


@pytest.mark.parametrize(
    "moves",
    ["G1 X20 A30", "G2 X20 I10 A30", "G17 G3 X10 Y10 J10 A-20", "G5 I5 J8 P-4 Q9 X20 Y3\nG1 A5"],
)
def test_offsets_across_the_path(moves: str) -> None:
    program = parse_program(f"G21 F1000\nG1 X0 B1 Z1\n{moves}\n", MACHINE)
    path = toolpath_from_program(program, MACHINE)
    assert path.axes == ("x", "y", "z", "a", "b")
    pieces = program_pieces(path)
    segment = np.arange(1, len(path))
    for share in (0.1, 0.43, 0.8):
        at = path.start[segment] + share * (path.end - path.start)[segment]
        bent = ~path.straight[segment]
        at[bent] = points_on(path, segment[bent], share * path.length[segment[bent]])
        apart = np.linalg.norm(at[:, None] - pieces.vertex[None], axis=2)
        apart = apart[:, 1:] + apart[:, :-1]  # from both ends of a piece
        apart[pieces.piece["segment"] != segment[:, None]] = np.inf
        piece = apart.argmin(axis=1)
        off = np.array([0.0, 0.0, 0.003, 0.0, 0.004])  # z and b stand still there
        assert both_apart(pieces, piece, at + off, path.axes) == pytest.approx([0.003, 0.004], abs=1e-7)
        assert both_apart(pieces, piece, at, path.axes) == pytest.approx([0.0, 0.0], abs=1e-7)


def test_one_kind_of_axes_has_no_parts() -> None:
    path = toolpath_from_program(parse_program("G21 F1000\nG1 X10\n", MACHINE), MACHINE)
    found = both_apart(program_pieces(path), np.zeros(1, dtype=np.int64), np.ones((1, 3)), path.axes)
    assert found.tolist() == [0.0, 0.0]


def test_the_verdict_has_both() -> None:
    path = toolpath_from_program(parse_program("G21 F1000\nG1 X10 A10\n", MACHINE), MACHINE)
    u = np.linspace(0.0, 1.0, 2001)
    shape = (u**3 * (10 - 15 * u + 6 * u**2))[:, None]
    across = np.array([-path.end[0, 3], 0.0, 0.0, path.end[0, 0]]) / np.linalg.norm(path.end[0])
    bump = (64 * (u * (1 - u)) ** 3)[:, None]
    position = path.end[0] * shape + 0.005 * bump * across
    nothing = np.zeros_like(position)
    motion = Trajectory(
        axes=path.axes, dt=0.001, t=0.001 * np.arange(2001), position=position, velocity=nothing, acceleration=nothing,
        jerk=nothing, s=10 * u, feed=u, block=np.zeros(2001), line=np.full(2001, 2), radius=20.0,
    )  # fmt: skip
    found = verify(motion, path, MACHINE)
    assert found.contour_error_mm == pytest.approx(0.005, rel=1e-6)
    assert found.linear_error_mm == pytest.approx(0.005 * abs(across[0]), rel=1e-6)
    assert found.angle_error_deg == pytest.approx(np.rad2deg(0.005 * across[3] / 20.0), rel=1e-6)
    assert found.summary()["angle_error_deg"] == found.angle_error_deg
