"""The figures of a program against numbers worked out by hand, and every fault listed."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from planner.nc.info import ProgramInfo, inspect_program


def info(tmp_path: Path, text: str) -> ProgramInfo:
    path = tmp_path / "job.ngc"
    path.write_text(text)
    return inspect_program(path)


@pytest.mark.shows("info", "exact: figures worked out by hand")
def test_figures_of_a_small_program(tmp_path: Path) -> None:
    found = info(
        tmp_path,
        "T4 M6\nS100 M3\nG0 X10\nG1 Y10 F60\nX0\nX0\nF120 X5\nG4 P1.5\nG3 I5 Z2\nG3 X15 Y10 I5\nG0 X0\nM30\n",
    )
    assert found.blocks == {"rapid": 2, "line": 4, "arc": 2, "dwell": 1, "stop": 1}
    assert found.lines == 12
    assert found.events == {"M3": 1, "M6": 1, "S": 1, "T": 1}
    assert found.tools == (4,)
    assert (found.full_circles, found.helices) == (1, 1)
    assert found.dwell == 1.5
    assert found.feed == (1.0, 2.0)
    assert found.feed_changes == 1
    assert found.zero_moves == 1
    # the full circle about (10, 10) with radius 5, and the lower half turn after it
    np.testing.assert_allclose(found.extent_min, [0, 0, 0], atol=1e-12)
    np.testing.assert_allclose(found.extent_max, [15, 15, 2])
    circle = np.hypot(10 * np.pi, 2)
    assert found.length["line"] == pytest.approx(25)
    assert found.length["arc"] == pytest.approx(circle + 5 * np.pi)
    assert found.length["rapid"] == pytest.approx(10 + 15)
    assert found.segment_length == pytest.approx(
        (0, 2.5, 10, circle * 0.5 + 15.707963267948966 * 0.5, circle), rel=0.3
    )
    # 90 degrees, a reversal; the dwell separates; the helix leaves into a flat arc
    assert found.corners == {1.0: 3, 20.0: 2, 60.0: 2, 90.0: 1, 175.0: 1}
    assert not found.unsupported


@pytest.mark.parametrize(
    ("text", "low", "high"),
    [
        ("G3 X-1 Y1 I-1", [-1, 0, 0], [0, 1, 0]),
        ("G2 X-1 Y1 I-1", [-2, -1, 0], [0, 1, 0]),
        ("G18 G3 X-1 Z-1 I-1", [-1, 0, -1], [0, 0, 0]),
        ("G18 G2 X-1 Z-1 I-1", [-2, 0, -1], [0, 0, 1]),
        ("G19 G2 Y-1 Z1 J-1 X5", [0, -2, -1], [5, 0, 1]),
        ("G19 G3 J-1 P2", [0, -2, -1], [0, 0, 1]),
    ],
)
def test_extents_of_arcs(tmp_path: Path, text: str, low: list[float], high: list[float]) -> None:
    found = info(tmp_path, "F60\n" + text)
    np.testing.assert_allclose(found.extent_min, low, atol=1e-12)
    np.testing.assert_allclose(found.extent_max, high, atol=1e-12)


def test_tangent_arcs_make_no_corner(tmp_path: Path) -> None:
    found = info(tmp_path, "F60\nG1 X10\nG3 X15 Y5 J5\nG1 Y10\nG2 X20 Y15 I5\nG19 G1 X25\nG3 Y20 Z5 K5\n")
    assert found.corners == {1.0: 1, 20.0: 1, 60.0: 1, 90.0: 0, 175.0: 0}


def test_every_fault_is_listed(tmp_path: Path) -> None:
    text = "G0 X1 A5 B6\nG0 A6 B5\nG1 X2\nG38.2 Z-1 F10\nX3\nX4\nG80\nG0 X1 ?5\n(a\nG12 X1\nG1 X9\n"
    found = info(tmp_path, text)
    places = [(f.line, f.column, f.word) for f in found.unsupported]
    assert places == [
        (2, 4, "A6"), (2, 7, "B5"), (3, 1, "G1"), (4, 1, "G38.2"), (5, 1, "X3"), (6, 1, "X4"),
        (8, 7, "?"), (9, 1, "("), (10, 1, "G12"),
    ]  # fmt: skip
    assert all(f.message for f in found.unsupported)
    assert found.blocks["line"] == 1  # G1 X9, at the feed of line 3
    assert found.extent_max.tolist() == [9, 0, 0]
