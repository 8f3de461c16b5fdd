"""Trajectories survive the three formats bit by bit; files made elsewhere are completed or refused by name."""

from __future__ import annotations

import gc
import json
from pathlib import Path

import numpy as np
import pytest
from hand_made import make_plan

import planner
from planner.base.errors import InputError
from planner.motion.trajectory import Trajectory
from planner.report.trajectory_file import (
    FORMATS,
    PlanColumns,
    read_trajectory,
    write_trajectory,
)
from planner.report.trajectory_reader import VALUE_MAX, divided_difference

TRAJECTORY = make_plan().trajectory
FIELDS = ("t", "position", "velocity", "acceleration", "jerk", "s", "feed", "block", "line")


@pytest.mark.shows("files", "exact: bit by bit")
@pytest.mark.parametrize("suffix", FORMATS)
def test_round_trip_is_exact(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"trajectory.{suffix}"
    about = {"run_id": "abc", "machine": {"name": "m"}, "units": PlanColumns(make_plan()).units}
    write_trajectory(path, TRAJECTORY, about)
    read = read_trajectory(path)
    assert read.metadata == about
    assert read.notes == ()
    assert read.trajectory.axes == TRAJECTORY.axes
    assert read.trajectory.dt == pytest.approx(TRAJECTORY.dt, rel=1e-12)
    for name in FIELDS:
        assert np.array_equal(getattr(read.trajectory, name), getattr(TRAJECTORY, name)), name


@pytest.mark.shows("files", "exact: bit by bit")
@pytest.mark.parametrize("suffix", FORMATS)
def test_every_float_survives(tmp_path: Path, suffix: str) -> None:
    """All sizes of float64 that are read, subnormal ones too, and negative zero."""
    random = np.random.default_rng(3).integers(0, 2**63, 2000, dtype=np.uint64).view(np.float64)
    column = np.concatenate([[0.0, -0.0, 5e-324, -VALUE_MAX, 0.1], random[np.abs(random) <= VALUE_MAX]])
    samples = {
        name: np.stack([column, -column], axis=1) for name in ("position", "velocity", "acceleration", "jerk")
    }
    count = np.arange(len(column))
    trajectory = Trajectory(
        axes=("x", "y"), dt=1.0, t=count, s=column, feed=column, block=count, line=count, **samples
    )
    write_trajectory(tmp_path / f"trajectory.{suffix}", trajectory)
    read = read_trajectory(tmp_path / f"trajectory.{suffix}").trajectory
    assert np.array_equal(read.position.view(np.uint64), trajectory.position.view(np.uint64))


def test_csv_is_plain(tmp_path: Path) -> None:
    write_trajectory(tmp_path / "trajectory.csv", TRAJECTORY, {"run_id": "abc"})
    lines = (tmp_path / "trajectory.csv").read_text().splitlines()
    assert lines[0] == "t,x,vx,ax,jx,y,vy,ay,jy,z,vz,az,jz,s,feed,line,block"
    assert len(lines) == len(TRAJECTORY) + 1
    assert json.loads((tmp_path / "trajectory.meta.json").read_text()) == {"run_id": "abc"}


def test_rotary_columns_are_in_radians() -> None:
    machine = planner.load_machine("mill")
    machine = machine.model_copy(update={"axes": {**machine.axes, "a": machine.axes["x"]}})
    plan = planner.plan(
        planner.read_program(text="G1 X10 A5 F1000\n", machine=machine), machine, method="stop"
    )
    units = PlanColumns(plan).units
    assert (units["va"], units["jx"]) == ("deg/s", "mm/s3")


def test_positions_are_enough(tmp_path: Path) -> None:
    """Missing derivatives of a smooth motion come out to second order in dt."""
    path = tmp_path / "elsewhere.csv"
    table = np.column_stack([TRAJECTORY.t, TRAJECTORY.position])
    np.savetxt(path, table, delimiter=",", header="T, X, Y, Z", comments="", fmt="%.17g")
    read = read_trajectory(path)
    assert [note.split()[0].rstrip(":") for note in read.notes] == [
        "velocity", "acceleration", "jerk", "s", "feed", "line", "block"
    ]  # fmt: skip
    assert read.metadata == {}
    # error of the central difference: jerk dt^2 / 6 = 15000 * 1e-6 / 6
    assert np.abs(read.trajectory.velocity - TRAJECTORY.velocity).max() < 0.0126
    assert np.array_equal(read.trajectory.position, TRAJECTORY.position)
    assert (read.trajectory.line == 0).all()
    assert (read.trajectory.block == -1).all()
    assert read.trajectory.s[-1] == pytest.approx(40.0, rel=1e-12)


def test_derived_from_the_highest_level_there_is(tmp_path: Path) -> None:
    path = tmp_path / "elsewhere.npz"
    p, v = TRAJECTORY.position, TRAJECTORY.velocity
    np.savez(path, t=TRAJECTORY.t, x=p[:, 0], y=p[:, 1], vx=v[:, 0], vy=v[:, 1])
    read = read_trajectory(path)
    assert read.trajectory.axes == ("x", "y")
    assert read.notes[0].startswith("acceleration derived from the velocity")
    assert read.notes[1].startswith("jerk derived from the velocity")


@pytest.mark.parametrize("order", [1, 2, 3])
def test_divided_differences_are_exact_on_polynomials(order: int) -> None:
    t = np.linspace(0.0, 1.0, 21)
    values = np.stack([t**order, 2.0 * t**order], axis=1)
    found = divided_difference(t, values, order)
    inner = slice(2, -3)
    exact = {1: 1.0, 2: 2.0, 3: 6.0}[order]
    assert found.shape == values.shape
    assert found[inner, 0] == pytest.approx(np.full(16, exact), rel=1e-9)
    assert found[inner, 1] == pytest.approx(np.full(16, 2 * exact), rel=1e-9)


def test_a_start_in_motion_is_seen() -> None:
    """A motion that jumps from rest to 100 mm/s shows the acceleration of that jump."""
    t = np.arange(10) * 1e-3
    acceleration = divided_difference(t, 100.0 * t[:, None], 2)
    assert acceleration[0, 0] == pytest.approx(100.0 / 1e-3)


def columns(**change: object) -> dict[str, object]:
    t = np.arange(5) * 1e-3
    return {name: column for name, column in {"t": t, "x": t, "y": t, **change}.items() if column is not None}


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"t": None}, "column 't' is missing"),
        ({"x": None, "y": None}, "no column of an axis"),
        ({"x": np.array([0.0, np.nan, 1, 2, 3])}, "column 'x', row 2: nan"),
        ({"vx": np.array([0.0, 1, 2, 3, np.inf]), "vy": np.zeros(5)}, "column 'vx', row 5: inf"),
        ({"x": np.array([0.0, 1, 2, 1e300, 4])}, "column 'x', row 4: 1e+300; every value must be between"),
        ({"x": np.zeros(4)}, "differ in length"),
        ({"x": np.zeros((5, 2))}, "column 'x' holds"),
        ({"x": np.array(list("1a345"))}, "column 'x', row 2: 'a'; a number is needed"),
        (
            {"vx": np.arange(5.0)},
            "there is a column vx, and none vy; give the velocity of every axis, or of none",
        ),
        ({"t": np.array([0.0, 1, 1, 2, 3])}, "column 't', row 3"),
        ({"t": np.array([0.0, 1, 0.5, 2, 3])}, "column 't', row 3"),
    ],
)
def test_bad_columns_are_named(tmp_path: Path, change: dict, said: str) -> None:
    path = tmp_path / "bad.npz"
    np.savez(path, **columns(**change))  # type: ignore[arg-type]
    with pytest.raises(InputError) as fault:
        read_trajectory(path)
    assert said in str(fault.value)
    assert str(fault.value).startswith(f"{path}: ")


def test_one_sample_is_refused(tmp_path: Path) -> None:
    np.savez(tmp_path / "one.npz", t=[0.0], x=[0.0], y=[0.0])
    with pytest.raises(InputError, match="at least 2"):
        read_trajectory(tmp_path / "one.npz")


def test_a_damaged_archive_is_closed_again(tmp_path: Path) -> None:
    path = tmp_path / "cut.npz"
    np.savez(path, **columns())  # type: ignore[arg-type]
    path.write_bytes(path.read_bytes()[:200])
    with pytest.raises(InputError, match="cannot be read"):
        read_trajectory(path)
    gc.collect()  # a file that is left open warns here, and warnings are errors


@pytest.mark.parametrize(
    ("at", "damage", "said"),
    [
        (6, b"\xcf", "zip file version 20.7"),  # found by benchmarks/fuzz: a bug
        (8, b"\x01", "encrypted"),
        (10, b"\x63", "compression"),
    ],
)
def test_an_archive_that_is_none_of_numpy_is_told(tmp_path: Path, at: int, damage: bytes, said: str) -> None:
    path = tmp_path / "other.npz"
    np.savez(path, **columns())  # type: ignore[arg-type]
    data = bytearray(path.read_bytes())
    begin = data.index(b"PK\x01\x02") + at  # the first file in the directory
    data[begin : begin + 1] = damage
    path.write_bytes(data)
    with pytest.raises(InputError, match=f"cannot be read: the archive: .*{said}"):
        read_trajectory(path)


def test_damaged_packed_columns_are_told(tmp_path: Path) -> None:
    path = tmp_path / "packed.npz"
    np.savez_compressed(path, **columns())  # type: ignore[arg-type]
    data = bytearray(path.read_bytes())
    begin = 30 + data[26] + data[28]  # behind the first local header: its name and extra field
    data[begin : begin + 4] = b"\xff" * 4
    path.write_bytes(data)
    with pytest.raises(InputError, match="cannot be read"):
        read_trajectory(path)


@pytest.mark.parametrize("damage", [b"(", b")"])
def test_a_damaged_header_is_told(tmp_path: Path, damage: bytes) -> None:
    path = tmp_path / "header.npz"
    np.savez(
        path, t=np.arange(2000.0)
    )  # more than is read at once, or the checksum is wrong before the header is
    path.write_bytes(path.read_bytes().replace(b"}", damage, 1))
    with pytest.raises(InputError, match=r"cannot be read: .*header"):
        read_trajectory(path)


@pytest.mark.parametrize("suffix", FORMATS)
@pytest.mark.parametrize("content", [b"", b"\x00\x01garbage\xff" * 10])
def test_files_that_are_none(tmp_path: Path, suffix: str, content: bytes) -> None:
    path = tmp_path / f"broken.{suffix}"
    path.write_bytes(content)
    with pytest.raises(InputError, match="broken"):
        read_trajectory(path)


def test_missing_file_and_unknown_format(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="not found"):
        read_trajectory(tmp_path / "none.parquet")
    (tmp_path / "some.xlsx").write_bytes(b"")
    with pytest.raises(InputError, match=r"unknown format '\.xlsx'"):
        read_trajectory(tmp_path / "some.xlsx")
    with pytest.raises(ValueError, match="unknown format"):
        write_trajectory(tmp_path / "none.xlsx", TRAJECTORY)


def test_an_array_named_by_its_axes_is_taken_apart_and_other_columns_are_left_alone(tmp_path: Path) -> None:
    t, xyz = np.arange(5) * 1e-3, np.random.default_rng(0).normal(size=(5, 3))
    np.savez(tmp_path / "run.npz", t=t - 0.003, xyz=xyz, vel=t, state=np.array(list("abcde")))
    read = read_trajectory(tmp_path / "run.npz")
    assert read.trajectory.axes == ("x", "y", "z")
    assert np.array_equal(read.trajectory.position, xyz)
    assert read.trajectory.t == pytest.approx(t, abs=1e-15)
    assert read.given.columns == ()


def test_what_is_delivered_is_known(tmp_path: Path) -> None:
    p, v = TRAJECTORY.position, TRAJECTORY.velocity
    np.savez(tmp_path / "v.npz", t=TRAJECTORY.t, x=p[:, 0], vx=v[:, 0], jx=v[:, 0])
    assert read_trajectory(tmp_path / "v.npz").given.columns == ("velocity", "jerk")
    write_trajectory(tmp_path / "all.csv", TRAJECTORY)
    given = read_trajectory(tmp_path / "all.csv").given
    assert given.columns == ("velocity", "acceleration", "jerk")
    assert not given.position_rounding.any()
    assert given.time_rounding == given.end_rounding == 0.0


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("0,0,0\n0.001,0,0\n", "1:1: the first line is '0, 0, 0'; it has to name each column once"),
        ("t,x,y,x\n0,0,0,0\n", "1:1: the first line is 't, x, y, x'"),
        ("t,x,y\n0,0,0\n0.001,a,0\n", "column 'x', row 2: 'a'; a number is needed"),
        ("t,x,y\n", "column 't', row 1: 'no row'; a number is needed"),
    ],
)
def test_a_table_without_names_or_with_words_is_told_where(tmp_path: Path, text: str, said: str) -> None:
    """What pyarrow says of them, 'Field "0.0" exists 4 times in schema', helps nobody."""
    path = tmp_path / "bad.csv"
    path.write_text(text)
    with pytest.raises(InputError) as fault:
        read_trajectory(path)
    assert said in str(fault.value)
