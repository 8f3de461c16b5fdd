"""Step pulses: less than one off at every instant however long the job is; the paper's equations, which drift; drives; files."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pyarrow import csv, parquet
from typer.testing import CliRunner

from benchmarks.jobs import problems
from benchmarks.solvers.pulse_variants import SLOPES, VARIANTS, deviations, speeds
from planner.base.arrays import FloatArray
from planner.base.errors import InputError
from planner.cli import app
from planner.motion.pulses import HYSTERESIS, AxisPulses, Drive, overrun, pulses_of
from planner.motion.trajectory import Trajectory
from planner.planning.methods.kinematic import KinematicMethod
from planner.report.trajectory_file import write_pulses, write_trajectory

OFF_MAX = 0.5 + HYSTERESIS


def trajectory(
    t: FloatArray,
    position: FloatArray,
    velocity: FloatArray | None = None,
    axes: tuple[str, ...] = ("x", "y"),
) -> Trajectory:
    """Samples; velocities by differences unless given."""
    still = np.zeros_like(position)
    if velocity is None:
        velocity = np.gradient(position, t, axis=0)
    return Trajectory(
        axes=axes, dt=float(t[1] - t[0]), t=t, position=position, velocity=velocity, acceleration=still, jerk=still,
        s=t * 0.0, feed=t * 0.0, block=np.zeros(len(t)), line=np.arange(len(t)),
    )  # fmt: skip


def cubic_motion(seed: int, periods: int = 200, dt: float = 1e-3):
    """Two axes with a random jerk in every period: samples, and the motion itself at any time."""
    rng = np.random.default_rng(seed)
    jerk = rng.uniform(-1, 1, (periods, 2)) * 10 ** rng.uniform(3, 7)
    state = np.zeros((periods + 1, 3, 2))
    state[0, 0] = rng.uniform(-500, 500, 2)
    state[0, 1] = rng.normal(0, 10 ** rng.uniform(-1, 2), 2)
    for k in range(periods):
        p, v, a = state[k]
        state[k + 1] = (
            p + dt * (v + dt * (a / 2 + dt * jerk[k] / 6)),
            v + dt * (a + dt * jerk[k] / 2),
            a + dt * jerk[k],
        )
    t = np.arange(periods + 1) * dt

    def at(times: FloatArray) -> FloatArray:
        k = np.clip(np.searchsorted(t, times, side="right") - 1, 0, periods - 1)
        tau = (times - t[k])[:, None]
        p, v, a = (state[k, i] for i in range(3))
        return p + tau * (v + tau * (a / 2 + tau * jerk[k] / 6))

    return trajectory(t, state[:, 0], state[:, 1]), at


def counter(train: AxisPulses, times: FloatArray) -> FloatArray:
    return np.concatenate([[0], train.count])[np.searchsorted(train.time, times, side="right")]


@pytest.mark.shows("pulses", "certified: less than one pulse off at every instant")
@pytest.mark.slow
@given(seed=st.integers(0, 10**6), steps=st.floats(0.5, 4), other=st.floats(0.5, 3))
@settings(max_examples=25)
def test_less_than_one_pulse_off_at_every_instant(seed, steps, other):
    """Against the motion itself, with reversals inside periods, just before and after every pulse and at many other times."""
    samples, at = cubic_motion(seed)
    trains = pulses_of(samples, {"x": 10**steps, "y": 10**other})
    for k, train in enumerate(trains):
        if len(train) > 300_000:
            continue
        times = np.sort(
            np.concatenate([np.linspace(0, samples.t[-1], 5001), train.time, train.time[1:] - 1e-12])
        )
        exact = train.steps * (at(times)[:, k] - samples.position[0, k])
        rate = train.steps * np.abs(samples.velocity[:, k]).max() * 2
        off = np.abs(exact - counter(train, times))
        assert off.max() <= OFF_MAX + 1e-9 + rate * 2e-12
        assert (np.diff(train.time) >= 0).all()
        np.testing.assert_array_equal(np.cumsum(train.per_period), counter(train, samples.t[1:]))


@pytest.mark.slow
def test_a_million_periods_do_not_drift():
    """An hour of steps with random speeds: no remainder is ever added up."""
    rng = np.random.default_rng(1)
    periods = 1_000_000
    t = np.arange(periods + 1) * 1e-3
    speed = rng.uniform(0.0, 10.0, (periods, 2))
    position = np.vstack([np.zeros(2), np.cumsum(speed * 1e-3, axis=0)])
    for train, where in zip(
        pulses_of(trajectory(t, position), {"x": 400.0, "y": 127.3}), position.T, strict=True
    ):
        off = np.concatenate([[0], np.cumsum(train.per_period)]) - train.steps * where
        assert np.abs(off).max() <= OFF_MAX + 1e-6
        assert len(train) > 500_000


def test_pulses_of_an_even_motion_are_even():
    """10 mm/s at 400 per mm: a pulse every 0.25 ms, not once per period."""
    t = np.arange(101) * 1e-3
    train = pulses_of(trajectory(t, np.outer(t, [10.0, 0.0])), {"x": 400.0})[0]
    assert len(train) == 400
    np.testing.assert_allclose(np.diff(train.time), 2.5e-4, rtol=1e-9)
    assert train.frequency_max == pytest.approx(4000.0)
    assert train.time[0] == pytest.approx(OFF_MAX / 4000.0)


def test_standing_on_the_edge_between_two_counts_sends_nothing():
    """Half a pulse away, with the rounding of a control loop on top."""
    rng = np.random.default_rng(2)
    t = np.arange(2001) * 1e-3
    wobble = 0.04 * np.clip(rng.normal(size=2001), -1, 1)
    position = np.zeros((2001, 2))
    position[1000:, 0] = (10.5 + wobble[1000:]) / 400
    position[:1000, 0] = np.linspace(0, 10.5 / 400, 1000)
    train = pulses_of(trajectory(t, position, np.zeros((2001, 2))), {"x": 400.0})[0]
    assert len(train) in (10, 11)
    assert train.changes == 0


def test_a_reversal_inside_a_period_is_seen():
    """Out and back within 1 ms: the samples alone show nothing."""
    t = np.array([0.0, 1e-3])
    samples = trajectory(t, np.zeros((2, 2)), np.array([[100.0, 0.0], [-100.0, 0.0]]))
    train = pulses_of(samples, {"x": 400.0})[0]
    # v h / 4 = 0.025 mm = 10 pulses
    assert train.direction.tolist() == [1] * 10 + [-1] * 10
    assert train.changes == 1


def test_equations_11_and_12_as_printed_drift():
    """The remainder must be accumulated, and in pulses: the same on all profiles and slopes of the benchmark."""
    for name, fx in speeds().items():
        for slope in SLOPES:
            off = {variant: deviations(variant, fx, slope) for variant in VARIANTS}
            assert off["no carry"]["y_largest"] > 90
            assert off["eq. 11-12"]["y_largest"] > 40
            assert off["pulses"]["y_largest"] <= 1.0
            assert abs(off["pulses"]["x_missing"]) < 1.0
            assert off["seconds"]["x_missing"] > 100
            if name == "S-profile":
                assert off["seconds"]["y_largest"] < 3.0
            else:
                assert off["seconds"]["y_largest"] > 100


def test_rotary_axes_count_per_degree():
    t = np.arange(101) * 1e-3
    position = np.outer(t, [0.0, 0.0, np.pi])  # 180 degrees per second
    train = pulses_of(trajectory(t, position, axes=("x", "y", "a")), {"a": 100.0})[0]
    assert len(train) == pytest.approx(1800, abs=1)


@pytest.mark.parametrize(
    ("steps", "message"),
    [
        ({"x": 400.0}, "axis y moves by .* give its steps too"),
        ({"x": 400.0, "y": 0.0}, "y = 0.0; pulses per mm must be positive"),
        ({"x": np.nan, "y": 400.0}, "x = nan"),
        ({"x": 400.0, "y": 400.0, "w": 1.0}, "no axis 'w'; it has x, y"),
        ({"x": 1e9, "y": 1e9}, "at most 2e[+]08 are made"),
    ],
)
def test_bad_steps_are_refused(steps, message):
    t = np.arange(11) * 1e-3
    with pytest.raises(InputError, match=message):
        pulses_of(trajectory(t, np.outer(t, [100.0, 100.0])), steps)


def test_what_a_drive_cannot_take_is_named():
    t = np.arange(1001) * 1e-3
    speed = np.where(t < 0.5, 10.0, 100.0)[:-1]
    position = np.zeros((1001, 2))
    position[1:, 0] = np.cumsum(speed) * 1e-3
    velocity = np.zeros((1001, 2))
    velocity[:-1, 0] = speed
    trains = pulses_of(trajectory(t, position, velocity), {"x": 400.0})
    assert overrun(trains, Drive()) == []
    assert overrun(trains, Drive(frequency_max=1e5, width=5e-6)) == []
    (fault,) = overrun(trains, Drive(frequency_max=20_000.0))
    assert "axis x" in fault
    assert "the drive takes 20000" in fault
    (fault,) = overrun(trains, Drive(width=20e-6))
    assert "a pulse needs 40 us" in fault


@pytest.mark.parametrize("seconds", [0.25, 40.0])
def test_a_drive_at_its_largest_frequency_is_told_of_the_width_alone(seconds):
    """Pulses of 4000 per second, evenly: the rounding of their times is no excess, late in a job either."""
    t = np.arange(round(seconds * 100.0) + 1) * 0.01
    (train,) = pulses_of(trajectory(t, np.outer(t, [10.0, 0.0])), {"x": 400.0})
    assert overrun((train,), Drive(frequency_max=4000.0, width=125e-6)) == []
    assert overrun((train,), Drive(frequency_max=3999.9)) != []
    (fault,) = overrun((train,), Drive(frequency_max=4000.0, width=200e-6))
    assert "a pulse needs 400 us" in fault
    assert "the drive takes" not in fault
    (fault,) = overrun((train,), Drive(frequency_max=3000.0, width=125e-6))
    assert "a pulse needs" not in fault


@pytest.mark.parametrize("drive", [{"frequency_max": 0.0}, {"width": -1.0}, {"frequency_max": np.inf}])
def test_drives_that_make_no_sense_are_refused(drive):
    with pytest.raises(InputError, match=next(iter(drive))):
        Drive(**drive)


# ---- the file and the command ------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def planned():
    return KinematicMethod().plan(problems.pentagon(), problems.machine()).trajectory


@pytest.fixture
def file(planned, tmp_path: Path) -> Path:
    write_trajectory(tmp_path / "trajectory.parquet", planned, {"run_id": "abc", "program": "pentagon"})
    return tmp_path / "trajectory.parquet"


def run(*arguments: object):
    return CliRunner().invoke(app, ["pulses", *map(str, arguments)])


def test_both_formats_hold_the_same_pulses_in_order(planned, tmp_path):
    trains = pulses_of(planned, {"x": 400.0, "y": 800.0})
    write_pulses(tmp_path / "p.parquet", trains, {"run_id": "abc"})
    write_pulses(tmp_path / "p.csv", trains, {})
    one, other = parquet.read_table(tmp_path / "p.parquet"), csv.read_csv(tmp_path / "p.csv")
    assert one.column_names == other.column_names == ["t", "axis", "direction", "count", "line"]
    for name in one.column_names:
        assert one[name].to_pylist() == other[name].to_pylist()
    time, axis, count = (one[name].to_numpy() for name in ("t", "axis", "count"))
    assert (np.diff(time) >= 0).all()
    for train, where in zip(trains, planned.position[-1], strict=False):
        assert abs(count[axis == train.axis][-1] - train.steps * where) <= OFF_MAX + 1e-9
    about = json.loads(one.schema.metadata[b"planner"])
    assert about == {"run_id": "abc", "steps": {"x": 400.0, "y": 800.0}}


def test_a_file_that_cannot_be_finished_leaves_the_old_one(planned, tmp_path, monkeypatch):
    target = tmp_path / "p.parquet"
    trains = pulses_of(planned, {"x": 400.0, "y": 400.0})
    write_pulses(target, trains, {})
    before = target.read_bytes()

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.fsync", full)
    with pytest.raises(InputError, match="No space left"):
        write_pulses(target, pulses_of(planned, {"x": 800.0, "y": 800.0}), {})
    assert target.read_bytes() == before
    assert [entry.name for entry in tmp_path.iterdir()] == ["p.parquet"]


def test_the_command_writes_and_reports(file, tmp_path):
    result = run(file, "--steps", "x=400,Y=400", "-o", tmp_path / "p.csv")
    assert result.exit_code == 0, result.output
    assert "changes of direction" in result.stdout
    assert (tmp_path / "p.csv").exists()
    figures = json.loads(run(file, "--steps", "x=400,y=400", "--json").stdout)
    assert figures["faults"] == []
    assert figures["axes"]["x"]["highest_frequency_hz"] == pytest.approx(100 * 400, rel=1e-3)


def test_the_command_writes_nothing_that_the_drives_cannot_take(file, tmp_path):
    result = run(file, "--steps", "x=400,y=400", "--max-frequency", 1e4, "-o", tmp_path / "p.csv")
    assert result.exit_code == 1
    assert "the drive takes 10000" in result.stderr
    assert not (tmp_path / "p.csv").exists()


@pytest.mark.parametrize(
    ("steps", "message"),
    [("x400", "'x400'; write each axis once"), ("x=400,x=1", "write each axis once"), ("x=four", "write each axis once"),
     ("x=-1,y=1", "write each axis once"), ("x=400", "axis y moves")],
)  # fmt: skip
def test_bad_arguments_exit_2(file, steps, message):
    result = run(file, "--steps", steps)
    assert result.exit_code == 2
    assert message in result.stderr


def test_unknown_formats_exit_2(file, tmp_path):
    result = run(file, "--steps", "x=400,y=400", "-o", tmp_path / "p.xlsx")
    assert result.exit_code == 2
    assert ".parquet, .csv" in result.stderr


@pytest.mark.parametrize("suffix", [".csv", ".parquet"])
def test_the_command_overwrites_pulses_only(file, tmp_path, suffix):
    out = tmp_path / ("p" + suffix)
    out.write_text("mine")
    refused = run(file, "--steps", "x=400,y=400", "-o", out)
    assert refused.exit_code == 2
    assert "was not written by planner" in refused.stderr
    assert out.read_text() == "mine"
    assert run(file, "--steps", "x=400,y=400", "-o", out, "--force").exit_code == 0
    assert run(file, "--steps", "x=200,y=200", "-o", out).exit_code == 0


def test_the_command_does_not_overwrite_its_input(file, tmp_path):
    before = file.read_bytes()
    result = run(file, "--steps", "x=400,y=400", "-o", file, "--force")
    assert result.exit_code == 2
    assert "read as input" in result.stderr
    assert file.read_bytes() == before
