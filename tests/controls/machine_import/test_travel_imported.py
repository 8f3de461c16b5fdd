"""The travel of the axes from the settings of controls."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.controls.machine_import.test_as_the_control import LEGACY, MILL, PRINTER, imported, said, travel


def test_marlin_s_ends_are_those_of_m211(tmp_path: Path) -> None:
    ends = "echo:Soft endstops: {}  Min:  X0.00 Y-2.50 Z0.00   Max:  X235.00 Y235.00 Z250.00\n"
    found = imported(tmp_path, LEGACY + ends.format("ON"))
    assert [travel(found, letter) for letter in "xyz"] == [(0, 235), (-2.5, 235), (0, 250)]
    assert travel(imported(tmp_path, LEGACY + ends.format("OFF")), "x") == (None, None)


def test_klipper_s_travel(tmp_path: Path) -> None:
    text = PRINTER + "[stepper_x]\nposition_min: -4\nposition_max: 301\n[stepper_y]\nposition_max: 280\n"
    found = imported(tmp_path, text)
    assert [travel(found, letter) for letter in "xyz"] == [(-4, 301), (0, 280), (None, None)]


def test_linuxcnc_s_travel(tmp_path: Path) -> None:
    """In the file's unit, the narrower of axis and joint; 1e99 is none, and so are two equal ends."""
    text = MILL.replace("[AXIS_Y]", "[AXIS_Y]\nMIN_LIMIT = 0\nMAX_LIMIT = 0")
    text = text.replace("[AXIS_Z]", "[AXIS_Z]\nMIN_LIMIT = -4\nMAX_LIMIT = 1")
    text = text.replace("[AXIS_A]", "[AXIS_A]\nMIN_LIMIT = -370\nMAX_LIMIT = 1e99")
    found = imported(tmp_path, text + "[JOINT_2]\nMAX_LIMIT = 0.5\n")
    assert travel(found, "x") == pytest.approx((-3 * 25.4, 4.5 * 25.4))
    assert travel(found, "y") == (None, None)
    assert travel(found, "a") == (-370, None)
    assert travel(found, "z") == pytest.approx((-4 * 25.4, 0.5 * 25.4))


def test_grbl_says_its_travel(tmp_path: Path) -> None:
    text = "$11=0.02\n$110=3000\n$111=3000\n$120=200\n$121=150\n$130=400.5\n$32=1\n$131=0\n"
    found = imported(tmp_path, text)
    assert travel(found, "x") == (-400.5, 0)
    assert travel(found, "y") == (None, None), "0 is none"
    off = imported(tmp_path, "$20=0\n" + text)
    assert travel(off, "x") == (None, None)
    assert said(off, "$20 is 0, no soft limits")
    assert said(found, "$32, laser mode, is left out")


def test_an_axis_without_a_joint_is_said(tmp_path: Path) -> None:
    found = imported(tmp_path, MILL.replace("coordinates=XYZA", "coordinates=XZA"))
    assert said(found, "[KINS] KINEMATICS moves no axis y, which COORDINATES names")
    for words in ("corexykins", "5axiskins", "maxkins"):
        other = imported(tmp_path, MILL.replace("trivkins coordinates=XYZA", words))
        assert said(other, f"[KINS] KINEMATICS is {words}: limits are those of the axes")
