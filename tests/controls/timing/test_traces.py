"""Limits of axes from recorded motions: those that made the motion come back, through noise; other motions say nothing."""

from __future__ import annotations

import gzip
import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import planner
from planner.base.arrays import FloatArray
from planner.cli import app
from planner.controls.timing.times import control_times
from planner.controls.timing.traces import Trace, limits_of, read_trace, strokes
from planner.machine import Machine

RATE = 1000.0  # samples in a second
FINE = 8  # steps of the integration in each of them


def phases(length: float, limits: tuple[float, float, float]) -> tuple[float, float, float, float]:
    """Acceleration reached, its ramp, time of speeding up, time at speed of the fastest move of a length."""
    v, a, j = limits
    low, high = 0.0, v
    for k in range(80):
        speed = v if k == 0 else 0.5 * (low + high)
        ramp = a / j if speed * j >= a * a else float(np.sqrt(speed / j))
        up = speed / (j * ramp) + ramp
        if speed * up <= length and k == 0:
            break
        low, high = (speed, high) if speed * up <= length else (low, speed)
    return j * ramp, ramp, up, length / speed - up


def motion(lengths: FloatArray, limits: tuple[float, float, float], rest: float) -> FloatArray:
    """(T,) places of moves one after the other with a rest between them, their accelerations integrated twice."""
    dt, still = 1.0 / RATE / FINE, np.zeros(int(rest * RATE) * FINE)
    accelerations = [still]
    for length in lengths:
        a, ramp, up, at_speed = phases(abs(float(length)), limits)
        t = (np.arange(int(np.ceil((2 * up + at_speed) / dt))) + 0.5) * dt
        rising = np.interp(t, [0.0, ramp, up - ramp, up], [0.0, a, a, 0.0], right=0.0)
        falling = np.interp(t - up - at_speed, [0.0, ramp, up - ramp, up], [0.0, a, a, 0.0], left=0.0)
        place = np.cumsum(np.cumsum(rising - falling)) * dt * dt
        accelerations += [np.sign(length) * (rising - falling) * abs(float(length)) / place[-1], still]
    return (np.cumsum(np.cumsum(np.concatenate(accelerations))) * dt * dt)[::FINE]


def recorded(
    limits: tuple[float, float, float], noise: float, rest: float, seed: int
) -> tuple[FloatArray, FloatArray]:
    rng = np.random.default_rng(seed)
    lengths = rng.uniform(2.0, 60.0, 12) * np.where(np.arange(12) % 2, -1.0, 1.0)
    x = motion(lengths, limits, rest)
    return np.arange(len(x)) / RATE, x + rng.normal(0.0, noise, len(x))


@pytest.mark.shows("fit", "sampled: limits come back from noisy traces")
@pytest.mark.parametrize(
    ("limits", "noise", "rest"),
    [
        ((100.0, 2000.0, 1e9), 0.001, 0.1),
        ((100.0, 2000.0, 1e9), 0.005, 0.0),
        ((80.0, 400.0, 1e9), 0.02, 0.05),
        ((80.0, 400.0, 4000.0), 0.002, 0.05),
        ((300.0, 4000.0, 1e5), 0.005, 0.0),
        ((100.0, 2000.0, 2e5), 0.0005, 0.1),
    ],
)
def test_limits_come_back(limits: tuple[float, float, float], noise: float, rest: float) -> None:
    """Within 3 %, and no jerk where there is none; the times of a program that was not recorded within 1 %."""
    axis = {"velocity": 50.0, "acceleration": 1000.0, "jerk": 1e4}
    control = {"name": "grbl"}
    guess = Machine(name="m", dt=0.001, tolerance=0.05, axes={"x": axis, "y": axis}, control=control)
    t, x = recorded(limits, noise, rest, 1)
    found, settings, said = limits_of([Trace(t=t, position={"x": x}, source="-")], guess)
    known = dict(zip(("x.velocity", "x.acceleration", "x.jerk"), limits, strict=True))
    names = [name for name in known if limits[2] < 1e9 or name != "x.jerk"]
    assert [name for name, _, _ in settings] == names
    for name, _, value in settings:
        assert value == pytest.approx(known[name], rel=0.03), name
    assert ("x.jerk 10000 stays" in " ".join(said)) == (limits[2] == 1e9)
    true = {"velocity": limits[0], "acceleration": limits[1], "jerk": 1e4}
    machine = Machine(name="m", dt=0.001, tolerance=0.05, axes={"x": true, "y": axis}, control=control)
    rng = np.random.default_rng(2)
    unseen = planner.read_program(text="".join(f"G0 X{place:.3f}\n" for place in rng.uniform(0, 80, 60)))
    took, predicted = (control_times(unseen, one, "grbl").seconds for one in (machine, found))
    assert predicted == pytest.approx(took, rel=0.01)


def test_motions_of_another_shape_say_nothing() -> None:
    """A circle is no stroke between limits: its axes speed up as sines do."""
    t = np.arange(0.0, 3.0, 1.0 / RATE)
    turns = np.clip(t - 0.5, 0.0, 2.0)
    assert not len(strokes(t, 10.0 * np.sin(2.0 * np.pi * turns)))
    assert not len(strokes(t, np.random.default_rng(0).normal(0.0, 0.01, len(t))))


def written(folder: Path, kind: str, t: FloatArray, x: FloatArray) -> Path:
    file = folder / f"{kind}.csv"
    rows = [f"{one:.14f}" for one in x]
    head = "# Sampling period is 1000000 ns\njoint.0.motor-pos-cmd;joint.0.vel-cmd\n"
    text = {
        "plain": "t,x\n" + "".join(f"{a:.4f},{b}\n" for a, b in zip(t, rows, strict=True)),
        "ms": "Time [ms]\tX\n" + "".join(f"{1000 * a:.1f}\t{b}\n" for a, b in zip(t, rows, strict=True)),
        "halscope": head + "".join(f"{b};0.0\n" for b in rows),
        "old": "Sampling period is 1000000 nSec \n" + "".join(f"\naxis.x.pos-cmd +{b} " for b in rows),
    }
    file.write_text(text[kind])
    return file


@pytest.mark.parametrize("kind", ["plain", "ms", "halscope", "old"])
def test_files_hold_the_same(kind: str, tmp_path: Path) -> None:
    t, x = recorded((100.0, 2000.0, 1e9), 0.0, 0.1, 3)
    found = read_trace(written(tmp_path, kind, t, np.abs(x)))
    assert [*found.position] == ["x"]
    np.testing.assert_allclose(found.t, t, atol=1e-9)
    np.testing.assert_allclose(found.position["x"], np.abs(x), atol=1e-9)
    assert found.seconds == pytest.approx(t[-1] - 0.2, abs=0.02)


def test_the_motion_log_of_klipper(tmp_path: Path) -> None:
    """Pieces of constant acceleration, 20 mm along x at 50 mm/s and 1000 mm/s2."""
    pieces = [
        [5.0, 0.05, 0.0, 1000.0, [3, 4, 0], [1, 0, 0]],
        [5.05, 0.35, 50.0, 0.0, [4.25, 4, 0], [1, 0, 0]],
    ]
    pieces.append([5.4, 0.05, 50.0, -1000.0, [21.75, 4, 0], [1, 0, 0]])
    messages = [
        {"id": "info", "result": {}},
        *({"q": "trapq:toolhead", "params": {"data": [one]}} for one in pieces),
    ]
    file = tmp_path / "log.json.gz"
    file.write_bytes(gzip.compress(b"".join(json.dumps(one).encode() + b"\x03" for one in messages)))
    found = read_trace(file)
    assert found.position["x"][0] == 3.0
    assert found.position["x"][-1] == pytest.approx(23.0)
    (length, *times) = strokes(found.t, found.position["x"])[0]
    assert (length, times[0], times[1]) == (
        pytest.approx(20.0),
        pytest.approx(0.4, abs=1e-3),
        pytest.approx(0.05, abs=1e-3),
    )


def test_what_is_no_trace(tmp_path: Path) -> None:
    def said(text: str, *more: str) -> str:
        file = tmp_path / "bad.csv"
        file.write_text(text)
        done = CliRunner().invoke(app, ["machine", "fit", *more, str(file)])
        assert done.exit_code == 2, done.output
        return done.output

    good = "".join(f"{k / 1000},0.0\n" for k in range(100))
    assert "bad.csv:5: could not convert string 'a' to float64" in said("t,x\n0,1\n1,2\n2,3\n3,a\n")
    assert "bad.csv:3: the number of columns changed from 2 to 3" in said("t,x\n0,1\n0,5,1\n")
    assert "no column of an axis; found are t, load" in said("t,load\n" + good)
    assert "no column t; found are x, y" in said("x,y\n" + good)
    assert "sample 2: times must increase" in said("t,x\n" + "0,0\n" * 40)
    assert "2 samples of 2 numbers and 2 names; at least 32 are needed" in said("t,x\n0,1\n1,2\n")
    assert "nothing moves in this trace" in said("t,x\n" + good)
    assert "no trapq:toolhead" in said('{"q": "status"}')
    assert "no motion log of Klipper" in said("{half")
    assert "the trace is empty" in said("")


def test_a_trace_stands_for_a_time_and_for_limits(tmp_path: Path) -> None:
    t, x = recorded((100.0, 2000.0, 1e9), 0.001, 0.1, 4)
    file, out = written(tmp_path, "plain", t, x), tmp_path / "found.toml"
    done = CliRunner().invoke(app, ["machine", "fit", str(file), "-m", "shapeoko", "-o", str(out)])
    assert done.exit_code == 0, done.output
    assert "x.jerk" in done.output
    found = planner.load_machine(out)
    assert found.axes["x"].velocity == pytest.approx(100.0, rel=0.01)
    assert found.axes["y"] == planner.load_machine("shapeoko").axes["y"]
