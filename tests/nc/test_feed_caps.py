"""Feed caps: the lower of F and cap is the feed of each block, on the same path, in every file that a plan leaves."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import planner
from planner.base.errors import InputError
from planner.geometry.build import toolpath_from_program
from planner.geometry.toolpath import Toolpath
from planner.machine import Machine, load_machine
from planner.nc.feed_caps import read_feed_caps
from planner.nc.program import FEED_MOVES, Program
from tests.commands.command_line import run

JOB = """G21 G17 G90 G94 G64 P0.02
G0 X0 Y0 Z5
G1 Z-1 F600
G1 X40 F3000
G2 X60 Y20 I0 J20
G3 X70 Y30 Z-2 I10 J0
G1 Y60
X0
Y0
M2
"""


def capped(folder: Path, text: str, caps: str, machine: Machine | None = None) -> Program:
    (folder / "job.ngc").write_text(text)
    (folder / "caps.csv").write_text(caps)
    reading = planner.Reading(feed_caps=str(folder / "caps.csv"))
    return planner.read_program(folder / "job.ngc", machine, reading)


def place(path: Toolpath, share: float) -> np.ndarray:
    """A place of a path, at a share of its length, by the segments' own formulas."""
    along = np.append(0.0, np.cumsum(path.length))
    s = share * along[-1]
    k = min(int(np.searchsorted(along, s, side="right")) - 1, len(path) - 1)
    x, row = s - along[k], path.arc[k]
    if row < 0:
        return path.start[k] + x * path.tangent_start[k]
    a = path.arcs
    turn = a.rate[row] * x
    circle = a.radius[row] * (np.cos(turn) * a.e1[row] + np.sin(turn) * a.e2[row])
    return a.center[row] + circle + a.drift[row] * x


@pytest.mark.shows("feed-caps", "exact: the lower of F and cap, on a line")
def test_the_lower_of_f_and_cap_holds_on_a_line(tmp_path: Path) -> None:
    program = capped(tmp_path, JOB, "line,feed\n4,1200\n5,9000\n7,600\n7,900\n")
    feed = dict(zip(program.line.tolist(), (program.feed * 60.0).tolist(), strict=True))
    assert feed[4] == pytest.approx(1200.0)
    assert feed[7] == pytest.approx(600.0)
    assert feed[5] == feed[6] == feed[8] == pytest.approx(3000.0)
    assert feed[3] == pytest.approx(600.0)
    assert any("2 blocks, down to F600" in note for note in program.notes)


def test_inches_and_angles_are_those_of_the_program(tmp_path: Path) -> None:
    inches = capped(tmp_path, "G20 G90\nF100 G1 X1\nG1 X2\n", "line,feed\n3,10\n")
    assert inches.feed.tolist() == pytest.approx([100 * 25.4 / 60, 10 * 25.4 / 60])
    mill = load_machine("mill")
    table = mill.model_copy(update={"axes": {**mill.axes, "a": mill.axes["x"]}})
    turning = capped(tmp_path, "G20 G90\nF100 G1 X1\nG1 A90\nA80\n", "line,feed\n3,10\n", table)
    assert turning.feed[1] == pytest.approx(np.deg2rad(10) / 60)


@settings(deadline=None, max_examples=15)
@given(
    st.lists(st.tuples(st.floats(0, 230), st.floats(0.01, 60), st.floats(100, 5000)), min_size=1, max_size=6)
)
def test_a_cap_on_a_length_holds_there_and_nowhere_else(
    tmp_path_factory: pytest.TempPathFactory, rows: list[tuple[float, float, float]]
) -> None:
    """Against caps looked up place by place, on a path that stays the same to a nanometre."""
    folder = tmp_path_factory.mktemp("caps")
    table = "".join(f"{a!r},{a + more!r},{cap!r}\n" for a, more, cap in rows)
    whole = capped(folder, JOB, "line,feed\n4,99999\n")
    parts = capped(folder, JOB, "from_mm,to_mm,feed\n" + table)
    mill = load_machine("mill")
    plain, path = (toolpath_from_program(program, mill) for program in (whole, parts))
    for share in np.linspace(0.0, 1.0, 97):
        assert np.abs(place(plain, share) - place(path, share)).max() < 1e-6
    assert path.length.sum() == pytest.approx(plain.length.sum(), abs=1e-9)
    edges, asked = (np.append(0.0, np.cumsum(one.length)) for one in (path, plain))
    for s in np.linspace(0.05, edges[-1] - 0.05, 301):
        if min(abs(s - edge) for edge in (*edges, *asked)) < 0.002:
            continue
        programmed = plain.feed[int(np.searchsorted(asked, s)) - 1]
        caps = [cap / 60 for a, more, cap in rows if a < s < a + more and np.isfinite(programmed)]
        assert path.feed[int(np.searchsorted(edges, s)) - 1] == pytest.approx(min([programmed, *caps]))
    assert (parts.uncapped[np.isin(parts.kind, FEED_MOVES)] > 0).all()


@pytest.mark.parametrize(
    "caps",
    ["line,feed\n4,900\n6,300\n8,1500\n", "from_mm,to_mm,feed\n20,30,400\n50,52.5,200\n100,400,1000\n"],
)
def test_a_plan_keeps_caps_and_leaves_them_in_all_its_files(tmp_path: Path, caps: str) -> None:
    """The setpoints stay below the caps by a reading of their own, `verify` takes the caps of the directory, the F
    words of planned.ngc are no higher, and planning that again takes as long."""
    (tmp_path / "job.ngc").write_text(JOB)
    (tmp_path / "caps.csv").write_text(caps)
    out = tmp_path / "out"
    done = run(
        "plan",
        tmp_path / "job.ngc",
        "--feed-caps",
        tmp_path / "caps.csv",
        "--method",
        "kinematic",
        "-o",
        out,
        "--json",
    )
    assert done.exit_code == 0, done.output
    (tmp_path / "caps.csv").unlink()
    assert (out / "feed-caps.csv").read_text() == caps
    assert run("verify", out).exit_code == 0
    assert run("report", out).exit_code == 0
    saved = planner.Reading(feed_caps=str(out / "feed-caps.csv"))
    again = planner.read_program(out / "planned.ngc", reading=saved)
    assert (again.uncapped <= again.feed * (1 + 1e-9)).all()  # the caps lower nothing any more
    plain = planner.plan(out / "planned.ngc", method="kinematic").trajectory
    whole = json.loads((out / "summary.json").read_text())["cycle_time_s"]
    assert plain is not None
    assert plain.cycle_time >= whole - 0.02
    (out / "feed-caps.csv").unlink()
    refused = run("verify", out)
    assert refused.exit_code == 2
    assert "feed-caps.csv" in refused.output


@pytest.mark.shows("feed-caps", "sampled: a motion above a cap fails its verdict")
def test_a_motion_above_a_cap_fails(tmp_path: Path) -> None:
    (tmp_path / "job.ngc").write_text(JOB)
    (tmp_path / "caps.csv").write_text("from_mm,to_mm,feed\n20,30,400\n")
    out = tmp_path / "out"
    assert run("plan", tmp_path / "job.ngc", "--method", "kinematic", "-o", out).exit_code == 0
    judged = run("verify", out, tmp_path / "job.ngc", "--feed-caps", tmp_path / "caps.csv")
    assert judged.exit_code == 1
    assert re.search(r"feed", judged.output)


def test_caps_of_called_files_and_of_an_expanded_program(tmp_path: Path) -> None:
    (tmp_path / "pass.ngc").write_text("o<pass> sub\nG1 X#1\nG1 Y#1\no<pass> endsub\n")
    text = "G21 G90 G94 F2400\nG0 X0 Y0\no<pass> call [10]\no<pass> call [30]\nG1 X0\nM2\n"
    program = capped(tmp_path, text, "file,line,feed\npass.ngc,2,600\njob.ngc,5,300\n")
    assert (program.feed[1:] * 60).tolist() == pytest.approx([600, 2400, 600, 2400, 300])
    out = tmp_path / "out"
    done = run(
        "plan", tmp_path / "job.ngc", "--feed-caps", tmp_path / "caps.csv", "--method", "kinematic", "-o", out
    )
    assert done.exit_code == 0, done.output
    assert run("verify", out).exit_code == 0  # where the program is called program.ngc
    again = planner.read_program(out / "planned.ngc")
    assert (again.feed <= program.feed * (1 + 1e-9)).all()


def test_moves_whose_f_is_not_rewritten_leave_planned_ngc_out(tmp_path: Path) -> None:
    (tmp_path / "job.ngc").write_text("G21 G90\nG0 X0 Y0\nG93 G1 X10 F60\nX20 F60\nM2\n")
    (tmp_path / "caps.csv").write_text("line,feed\n4,60\n")
    out = tmp_path / "out"
    done = run(
        "plan", tmp_path / "job.ngc", "--feed-caps", tmp_path / "caps.csv", "--method", "kinematic", "-o", out
    )
    assert done.exit_code == 0
    assert "planned.ngc is left out" in done.output
    assert not (out / "planned.ngc").exists()


@pytest.mark.parametrize(
    ("caps", "line", "column", "why"),
    [
        ("", 1, 1, "line,feed or file,line,feed or from_mm,to_mm,feed"),
        ("line;feed\n4;100\n", 1, 1, "it names the columns"),
        ("line,feed\n", 1, 1, "no row"),
        ("line,feed\n4,100,5\n", 2, 1, "3 values; 2 are allowed"),
        ("line,feed\n4,fast\n", 2, 3, "feed is 'fast'"),
        ("line,feed\n4,0\n", 2, 3, "above 0"),
        ("line,feed\n\n4,nan\n", 3, 3, "above 0"),
        ("line,feed\n4.5,100\n", 2, 1, "a line number, 1 or more"),
        ("line,feed\n4,100\n40,100\n", 3, 1, "lines 1 to 10"),
        ("file,line,feed\nother.ngc,4,100\n", 2, 1, "it has job.ngc"),
        ("file,line,feed\njob.ngc,40,100\n", 2, 9, "lines 1 to 10"),
        ("from_mm,to_mm,feed\n5,5,100\n", 2, 3, "above 5"),
        ("from_mm,to_mm,feed\n-1,5,100\n", 2, 1, "0 or more"),
        ("from_mm,to_mm,feed\n900,950,100\n", 2, 1, "mm long"),
    ],
)  # fmt: skip
def test_wrong_files_are_refused_with_their_place(
    tmp_path: Path, caps: str, line: int, column: int, why: str
) -> None:
    with pytest.raises(InputError) as refused:
        capped(tmp_path, JOB, caps)
    assert (refused.value.line, refused.value.column) == (line, column)
    assert why in refused.value.message
    assert refused.value.source.endswith("caps.csv")


def test_what_cannot_be_capped_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be read"):
        read_feed_caps(tmp_path / "none.csv")
    with pytest.raises(InputError, match="thread") as refused:
        capped(tmp_path, "G21 G90 S600 M3\nG0 X0 Z5\nG33 Z-10 K1\nM2\n", "line,feed\n3,100\n")
    assert refused.value.line == 3
    (tmp_path / "caps.csv").write_text("line,feed\n2,100\n")
    for command in ("smooth", "expand"):
        assert (
            "no option --feed-caps"
            in run(command, tmp_path / "job.ngc", "--feed-caps", tmp_path / "caps.csv").output
        )


@pytest.mark.parametrize(("end", "said"), [("5", True), ("10", False)])
def test_lines_that_a_cap_holds_in_part_are_told(end: str, said: bool, tmp_path: Path) -> None:
    """An F word is of a line: planned.ngc has the cap for all of it."""
    (tmp_path / "job.ngc").write_text("G21 G90 F900\nG1 X10\nY10\nM2\n")
    (tmp_path / "caps.csv").write_text(f"from_mm,to_mm,feed\n0,{end},600\n")
    out = tmp_path / "out"
    done = run(
        "plan", tmp_path / "job.ngc", "--feed-caps", tmp_path / "caps.csv", "--method", "kinematic", "-o", out
    )
    assert ("has the cap for all of it" in done.output) is said


def test_programs_under_caps_are_exported_from_planned_ngc(tmp_path: Path) -> None:
    (tmp_path / "job.ngc").write_text(JOB)
    (tmp_path / "caps.csv").write_text("line,feed\n4,600\n")
    out = tmp_path / "out"
    run(
        "plan", tmp_path / "job.ngc", "--feed-caps", tmp_path / "caps.csv", "--method", "kinematic", "-o", out
    )
    refused = run("export", out, "--for", "grbl", "-o", tmp_path / "grbl", "--tolerance", "0.05")
    assert refused.exit_code == 2
    assert "planned.ngc" in refused.output
    assert run("export", out, "--for", "pvt", "-o", tmp_path / "pvt").exit_code == 0
