"""What a control cannot read of a program that is right elsewhere: bytes, arcs, ends, numbers."""

from __future__ import annotations

from pathlib import Path

import pytest

import planner
from planner.controls.export.controls import CONTROLS
from planner.controls.export.program import AS_IT_IS, Candidates, best_first, candidates, write_program

HEAD = "G21 G90 G94 G17\nG0 X0 Y0 Z1\nG1 Z0 F600\n"


def job_of(text: str | bytes, control: str, tmp_path: Path) -> Candidates:
    """The export of a program that was planned within 0.04 mm, within 0.05 mm."""
    file = tmp_path / "job.ngc"
    file.write_bytes(text.encode() if isinstance(text, str) else text)
    made = planner.plan(file, "mill", tolerance=0.04, method="kinematic")
    return Candidates(made, CONTROLS[control], 0.05)


def lines_of(job: Candidates) -> list[str]:
    """The lines of the program's own path."""
    return job.written(job.own(0.01)[0])[0].decode().splitlines()


@pytest.mark.parametrize(
    ("arc", "taken"),
    [
        ("G2 X10 Y0 I5 J0", True),
        ("G2 I5 J0", False),  # error 26: no coordinate in the plane
        ("G2 Z-1 I5 J0", False),
        ("G2 X4.01 Y0 I2 J0", False),  # error 33: radii of 2 and 2.01 mm
        ("G2 X4.003 Y0 I2 J0", True),
        ("G2 X400.15 Y0 I200 J0", True),  # up to a thousandth of the radius
        ("G2 X10 Y0 R5.5", True),
        ("G2 X10 Y0 R4.9999", False),  # error 34: R is too short
        ("G2 X10 Y0 R5", False),  # so it may be by what single precision rounds
        ("G18 G3 X10 Z0 I5 K0", True),
        ("G19 G3 Y10.02 Z0 J5 K0", False),
        ("G20\nG2 X1 Y0 I0.5 J0", True),
    ],
)
def test_grbl_is_given_arcs_that_it_takes(arc: str, taken: bool, tmp_path: Path) -> None:
    """gcode.c of grbl 1.1; LinuxCNC takes all of these."""
    job = job_of(f"{HEAD}{arc} F2000\nG21 G17 G1 X30\nM2\n", "grbl", tmp_path)
    assert (job.why_not == "") == taken, job.why_not
    if not taken:
        assert not any(line.startswith(("G2", "G3")) and "I" in line for line in lines_of(job))
    assert job_of(f"{HEAD}{arc} F2000\nG21 G17 G1 X30\nM2\n", "linuxcnc", tmp_path).why_not == ""


@pytest.mark.parametrize(
    ("text", "linuxcnc", "grbl"),
    [
        (b"(stop!)\n", True, False),  # feed hold
        (b"(5 ~ 6)\n", True, False),  # cycle start
        ("(Größe Ä)\n".encode(), True, False),  # the bytes of Ä are the safety door's
        (b"(plain)\r\n", True, True),
        (b"G4\xc2\xa0P1\n", False, False),
        (b"(" + b"x" * 300 + b")\n", False, True),
        (b"(1)\rG4 P1\n", False, False),
        (b"N12345678 G4 P1\n", True, False),
        (b"N1234567 G4 P1\n", True, True),
        (b"T300\n", True, False),
    ],
)
def test_bytes_that_a_control_takes_otherwise(
    text: bytes, linuxcnc: bool, grbl: bool, tmp_path: Path
) -> None:
    program = HEAD.encode() + text + b"G1 X10\nM2\n"
    for control, taken in (("linuxcnc", linuxcnc), ("grbl", grbl)):
        job = job_of(program, control, tmp_path)
        assert (job.why_not == "") == taken, job.why_not
        if not taken:
            out = job.written(job.own(0.01)[0])[0]
            assert out.isascii()
            assert not set(out) & set(b"!~\0\r"), out


@pytest.mark.parametrize("control", list(CONTROLS))
def test_a_byte_order_mark_is_never_exported(control: str, tmp_path: Path) -> None:
    job = job_of(b"\xef\xbb\xbfG21\nG90\nG1 X10 F600\nG1 Y10\n", control, tmp_path)
    assert "byte order mark" in job.why_not
    assert lines_of(job)


def test_the_name_of_a_file_holds_no_grbl(tmp_path: Path) -> None:
    file = tmp_path / "stop!.ngc"
    file.write_text("G21 G90\n(!)\nG1 X10 F600\nM2\n")
    made = planner.plan(file, "mill", method="stop")
    text = write_program(tmp_path, made, "grbl", 0.05)
    assert "!" not in (tmp_path / text.file).read_text()


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("G1 X10 F600\n", "does not end with M2, M30 or %"),
        ("G1 X10 F600\nM30\n", ""),
        ("%\nG1 X10 F600\n%\n", ""),
        ("G1 X10 F600\n%\n", "does not end"),
    ],
)
def test_linuxcnc_is_given_an_end(text: str, why: str, tmp_path: Path) -> None:
    """rs274: File ended with no percent sign or program end."""
    job = job_of(text, "linuxcnc", tmp_path)
    assert (why in job.why_not) if why else not job.why_not, job.why_not
    assert lines_of(job)[-1] in ("M2", "M30", "%")


def test_spindle_and_coolant_end_with_the_program(tmp_path: Path) -> None:
    text = "G21 G90\nM3 S900\nM8\nG1 X10 F600\n"
    for end in ("", "M30\n"):
        assert lines_of(job_of(text + end, "marlin", tmp_path))[-3:] == ["M5", "M9", "M400"]
    assert lines_of(job_of(text + "M5\nM9\n", "marlin", tmp_path))[-3:] == ["M5", "M9", "M400"]


@pytest.mark.parametrize(
    ("macros", "end"),
    [
        ({"M5": "OFF", "M9": "DRY"}, ["OFF", "DRY", "M400"]),
        ({"M5": "OFF", "M9": "DRY", "M30": "DONE"}, ["OFF", "DRY", "DONE"]),
        ({"M5": "OFF", "M30": "DONE"}, ["G1 X10 F600", "OFF", "DONE"]),
        ({"M5": "OFF"}, "M9, as which M30 acts,"),
        ({"M9": "DRY"}, "M5, as which M30 acts,"),
    ],
)
def test_what_is_on_at_the_end_is_switched_off_by_a_macro_or_refused(
    macros: dict[str, str], end: list[str] | str
) -> None:
    """Klipper got an M5 that it does not know, the coolant stayed on, and a macro for M30 was not called."""
    machine = planner.load_machine("mill").model_copy(update={"macros": {"M3": "M3", "M8": "WET", **macros}})
    program = planner.read_program(text="G21 G90\nM3 S900\nM8\nG1 X10 F600\nM30\n", machine=machine)
    made = planner.plan(program, machine, tolerance=0.04, method="kinematic")
    job = Candidates(made, CONTROLS["klipper"], 0.05)
    if isinstance(end, list):
        assert lines_of(job)[-3:] == end
    else:
        with pytest.raises(planner.InputError, match=end) as fault:
            lines_of(job)
        assert fault.value.line == 5


def test_of_equal_times_the_program_as_it_is_is_written(tmp_path: Path) -> None:
    job = job_of("G21 G90 G94\nG0 X1 Y2 Z3\nG1 X10 F600\nG4 P1\nG1 Y10\nM2\n", "grbl", tmp_path)
    found = candidates(job)
    assert len(found) > 1
    assert best_first(job, found)[0].name == AS_IT_IS


def test_grbl_has_six_work_offsets(tmp_path: Path) -> None:
    text = "G21 G90 G94\nG0 X1 Y2 Z3\nG10 L2 P{} X0\nG1 X10 F600\nM2\n"
    assert not job_of(text.format(6), "grbl", tmp_path).why_not
    job = job_of(text.format(7), "grbl", tmp_path)
    with pytest.raises(planner.InputError, match="up to G59"):
        lines_of(job)
