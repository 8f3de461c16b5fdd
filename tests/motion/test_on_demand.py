"""Trajectories that are evaluated when they are asked for: the same samples, verdicts and files as of those that are kept."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import planner
from benchmarks.jobs import problems
from planner.base import threads
from planner.base.sizes import USUAL
from planner.motion import on_demand, timing
from planner.motion.on_demand import TrajectoryOnDemand
from planner.motion.trajectory import COLUMNS, Lengths, Trajectory, joined
from planner.report import trajectory_file
from planner.report.export import write_plan
from planner.report.trajectory_file import write_trajectory
from planner.report.word_feed import planned_blocks
from planner.verifier import reading

METHODS = ("optimal", "stop", "bezier", "fir", "kinematic")


@pytest.fixture(scope="module", params=METHODS)
def both(request):
    """One job planned twice: with its samples kept, and without, in small chunks."""
    program, machine = problems.pentagon(), problems.machine()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(timing, "SAMPLES_KEPT", USUAL.samples_kept)
        kept = planner.plan(program, machine, method=request.param)
        patch.setattr(timing, "SAMPLES_KEPT", 50)
        patch.setattr(on_demand, "CHUNK", 77)
        yield kept, planner.plan(program, machine, method=request.param)


def test_the_samples_are_the_same_by_chunks_by_rows_and_as_a_whole(both):
    kept, asked = (plan.trajectory for plan in both)
    assert isinstance(asked, TrajectoryOnDemand)
    assert type(kept) is Trajectory
    assert (len(asked), asked.cycle_time, asked.axes, asked.dt) == (
        len(kept),
        kept.cycle_time,
        kept.axes,
        kept.dt,
    )
    assert repr(asked) == repr(kept)
    chunks = list(asked.chunks())
    assert [len(chunk) for chunk in chunks[:-1]] == [77] * (len(chunks) - 1)
    k = np.unique(np.random.default_rng(1).integers(0, len(kept), 40))
    rows = asked.rows(k)
    for name in COLUMNS:
        wanted = getattr(kept, name)
        scale = np.abs(wanted).max() or 1.0
        np.testing.assert_allclose(
            np.concatenate([getattr(c, name) for c in chunks]), wanted, atol=1e-12 * scale
        )
        np.testing.assert_allclose(getattr(rows, name), wanted[k], atol=1e-12 * scale)
        np.testing.assert_allclose(getattr(asked, name), wanted, atol=1e-12 * scale)
    assert len(asked.rows(k[:0])) == len(kept.rows(k[:0])) == 0
    with pytest.raises(AttributeError):
        _ = asked.colour
    later = dataclasses.replace(asked, t=asked.t + 1.0)
    assert type(later) is Trajectory
    assert later.t[0] == 1.0


def test_a_sample_is_found_by_its_time(both):
    kept, asked = (plan.trajectory for plan in both)
    rng = np.random.default_rng(2)
    times = np.concatenate([kept.t, rng.uniform(-0.01, kept.cycle_time + 0.01, 200)])
    np.testing.assert_array_equal(asked.first_not_before(times), kept.first_not_before(times))


def test_the_verdict_is_the_same(both):
    kept, asked = (plan.verdict for plan in both)
    assert asked.passed == kept.passed
    assert list(asked.limits) == list(kept.limits)
    for name, check in kept.limits.items():
        assert asked.limits[name].ratio == pytest.approx(check.ratio, rel=1e-9, abs=1e-12)
        assert asked.limits[name].line == check.line
    assert asked.contour_error_mm == pytest.approx(kept.contour_error_mm, rel=1e-9)
    np.testing.assert_allclose(asked.corners.budget_ratio, kept.corners.budget_ratio, rtol=1e-9)


@pytest.mark.parametrize("suffix", ["parquet", "csv", "npz"])
def test_files_hold_the_same_rows_in_as_many_groups_as_there_are(both, suffix, tmp_path, monkeypatch):
    kept, asked = (plan.trajectory for plan in both)
    monkeypatch.setattr(trajectory_file, "ROW_GROUP", 101)
    for name, trajectory in (("kept", kept), ("asked", asked)):
        write_trajectory(tmp_path / f"{name}.{suffix}", trajectory, {"run_id": "abc"})
    found = [trajectory_file.read_trajectory(tmp_path / f"{name}.{suffix}") for name in ("kept", "asked")]
    assert found[0].metadata == found[1].metadata == {"run_id": "abc"}
    assert (np.diff(found[1].trajectory.t) > 0).all()
    for name in COLUMNS:
        wanted = getattr(found[0].trajectory, name)
        np.testing.assert_allclose(
            getattr(found[1].trajectory, name), wanted, atol=1e-12 * (np.abs(wanted).max() or 1.0)
        )


def test_times_of_blocks_are_the_same(both):
    kept, asked = (planned_blocks(plan.trajectory, plan.toolpath) for plan in both)
    np.testing.assert_allclose(asked.duration, kept.duration, atol=1e-12)
    np.testing.assert_allclose(asked.highest, kept.highest, rtol=1e-9)


def test_a_directory_holds_the_same_program(tmp_path, monkeypatch):
    program = tmp_path / "turns.ngc"
    program.write_text("G21 G90 F6000\nG1 X2\nY2\nX4\nY4\nX6\nG3 X6 Y0 J-2\nG1 X0\nM2\n")
    written = {}
    for kept in (2**20, 50):
        monkeypatch.setattr(timing, "SAMPLES_KEPT", kept)
        made = planner.plan(program, problems.machine(), method="bezier")
        assert isinstance(made.trajectory, TrajectoryOnDemand) == (kept == 50)
        write_plan(made, tmp_path / str(kept))
        written[kept] = (tmp_path / str(kept) / "planned.ngc").read_bytes()
    assert written[50] == written[2**20] != program.read_bytes()


def test_the_verdict_is_the_same_on_any_number_of_threads(monkeypatch):
    """Samples and what lies between them, side by side and one after the other, in chunks that end at different times."""
    monkeypatch.setattr(timing, "SAMPLES_KEPT", 50)
    monkeypatch.setattr(on_demand, "CHUNK", 77)
    monkeypatch.setattr(reading, "SIDE_BY_SIDE", 0)
    monkeypatch.setattr(reading, "CELLS", 350)
    verdicts, used = [], []
    together = reading.side_by_side
    monkeypatch.setattr(reading, "side_by_side", lambda *work: (used.append(len(work[0])), together(*work)))
    for count in (1, 2, 3):
        threads.use_threads(count)
        try:
            verdicts.append(planner.plan(problems.pentagon(), problems.machine(), method="bezier").verdict)
        finally:
            threads.use_threads(None)
    assert set(used) == {4, 1}  # the last part is judged alone
    assert verdicts[0].passed
    for verdict in verdicts[1:]:
        assert verdict.summary() == verdicts[0].summary()
        for name, check in verdict.limits.items():
            assert (check.ratio, check.time, check.line) == (
                verdicts[0].limits[name].ratio,
                verdicts[0].limits[name].time,
                verdicts[0].limits[name].line,
            )


def test_the_arc_length_of_some_samples_is_not_asked_of_the_others():
    asked = []

    def of(times):
        asked.append(len(times))
        return times**2

    t, rest = np.arange(10.0), np.zeros((10, 1))
    block = np.zeros(10, np.int64)
    whole = Trajectory(
        axes=("X",),
        dt=1.0,
        t=t,
        position=rest,
        velocity=rest,
        acceleration=rest,
        jerk=rest,
        s=Lengths(of, (t,)),
        feed=t,
        block=block,
        line=block,
    )
    some = joined([whole.rows(np.array([1, 3, 4])), whole.rows(np.array([4, 7, 9]))]).rows(
        np.array([0, 2, 4])
    )
    assert asked == []
    assert some.s.tolist() == [1.0, 16.0, 81.0]
    assert asked == [3]
    both = joined([some, dataclasses.replace(whole, t=9.0 + t, s=t)])
    assert both.s.tolist() == [1.0, 16.0, 81.0, *t[1:]]
