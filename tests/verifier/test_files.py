"""Files made elsewhere: positions only, other axes, few digits, other times; what can be judged is, and what cannot is said."""

import numpy as np
import pytest
from motions import JERK_FREE, Moves, along, chain, helix, machine, polyline, rest_to_rest, sample, stay

from planner.base.errors import InputError
from planner.report.trajectory_file import read_trajectory
from planner.verifier import Given, verify
from planner.verifier.given import fit_axes

M = machine()
POINTS = [(0, 0, 0), (9, 0, 0), (9, 7, 0), (2, 11, 0)]


def program(points=POINTS):
    moves = Moves(points[0])
    for p in points[1:]:
        moves.line(*p)
    return moves.toolpath(M)


def columns(points=POINTS, axes="xyz"):
    motion = sample(polyline(points, jerk=2e5), M.dt)
    return {"t": motion.t} | {letter: motion.position[:, k] for k, letter in enumerate(axes)}


def judged(path, toolpath, *, limits=M, not_limited=(), **given):
    np.savez(path / "run.npz", **given)
    read = read_trajectory(path / "run.npz")
    trajectory, what, notes = fit_axes(read.trajectory, read.given, toolpath)
    verdict = verify(trajectory, toolpath, limits, given=what, not_limited=not_limited)
    return verdict, (*read.notes, *notes, *verdict.notes)


def test_positions_alone_pass_and_nothing_derived_is_judged(tmp_path):
    verdict, notes = judged(tmp_path, program(), **columns())
    assert verdict.passed, verdict.faults
    assert all(check.note in ("", "differences of position") for check in verdict.limits.values())
    assert verdict.limits["jerk.x"].ratio == pytest.approx(1.0, abs=1e-6)
    assert any("velocity derived" in note for note in notes)


@pytest.mark.parametrize("offset", [-0.003, 0.0, 250.0])
@pytest.mark.parametrize("kind", [np.float32, np.float64, "%.9g", "%.7f"])
def test_few_digits_and_any_first_time_are_judgeable(tmp_path, kind, offset):
    def written(values):
        if isinstance(kind, str):
            return np.array([float(kind % value) for value in values])
        return values.astype(kind)

    given = columns()
    given["t"] = given["t"] + (offset if kind is not np.float32 or offset < 1 else 1.0)
    verdict, notes = judged(tmp_path, program(), **{name: written(values) for name, values in given.items()})
    assert verdict.passed, (verdict.faults, notes)
    assert any("positions are written to" in note for note in notes) is (kind is not np.float64)


def test_what_too_few_digits_cannot_tell_is_a_fault(tmp_path):
    given = {name: np.round(values, 4) if name != "t" else values for name, values in columns().items()}
    verdict, _ = judged(tmp_path, program(), **given)
    assert any(text.startswith("samples: too few digits to judge jerk") for text in verdict.sentences)
    assert not any(text.startswith(("acceleration", "jerk")) for text in verdict.sentences)
    free, _ = judged(tmp_path, program(), not_limited=("jerk",), **given)
    assert free.passed, free.faults


def test_an_excess_beyond_the_digits_is_found(tmp_path):
    given = {name: values.astype(np.float32) for name, values in columns().items()}
    verdict, _ = judged(tmp_path, program(), limits=machine(acceleration=1900.0), **given)
    assert any(text.startswith("acceleration.x") for text in verdict.sentences)


def test_axes_that_the_program_does_not_move_may_be_missing(tmp_path):
    verdict, notes = judged(tmp_path, program(), **columns(axes="xy"))
    assert verdict.passed, verdict.faults
    assert any(note.startswith("z is missing") for note in notes)
    with pytest.raises(InputError, match="column 'y' is missing: the program moves y"):
        judged(tmp_path, program(), **columns(axes="x"))
    high = [(*p[:2], 4.0) for p in POINTS]
    verdict, notes = judged(tmp_path, program(high), **columns(high, axes="xy"))
    assert verdict.passed, verdict.faults
    assert "z is missing, and stands at 4 as in the program" in notes


def test_axes_that_the_program_does_not_have_must_stand_still(tmp_path):
    given = columns()
    verdict, notes = judged(tmp_path, program(), a=np.full(len(given["t"]), 0.3), **given)
    assert verdict.passed, verdict.faults
    assert any(note.startswith("a stands still") for note in notes)
    with pytest.raises(InputError, match="moves a"):
        judged(tmp_path, program(), a=given["x"], **given)


def test_an_axis_that_the_program_does_not_move_is_judged(tmp_path):
    given = columns()
    given["z"] = 0.06 * np.sin(np.linspace(0, np.pi, len(given["t"]))) ** 4
    verdict, _ = judged(tmp_path, program(), **given)
    assert not verdict.passed
    assert verdict.contour_error_mm == pytest.approx(0.06, rel=1e-3)


def test_standstill_before_and_after_is_no_fault(tmp_path):
    motion = chain(stay(POINTS[0], 0.0105), polyline(POINTS, jerk=2e5), stay(POINTS[-1], 0.2))
    motion = sample(motion, M.dt)
    verdict, _ = judged(tmp_path, program(), t=motion.t + 5.0, xyz=motion.position)
    assert verdict.passed, verdict.faults


@pytest.mark.parametrize("factor", [1e3, 1e6])
def test_times_in_another_unit_are_refused(tmp_path, factor):
    given = columns()
    given["t"] = factor * given["t"]
    with pytest.raises(InputError, match=f"divide it by {factor:.0f}"):
        judged(tmp_path, program(), **given)


def test_a_slow_motion_is_not_taken_for_milliseconds(tmp_path):
    slow = sample(polyline(POINTS, feed=0.5, jerk=2e5), M.dt)
    verdict, _ = judged(tmp_path, program(), t=slow.t, xyz=slow.position)
    assert verdict.passed, verdict.faults


def test_samples_too_coarse_to_judge_are_a_fault_and_others_a_note(tmp_path):
    def at(period):
        motion = sample(polyline(POINTS, jerk=2e5), period)
        return judged(tmp_path, program(), t=motion.t, xyz=motion.position)

    verdict, _ = at(0.05)
    bow = np.sqrt(3) * 2000 * 0.05**2 / 8
    assert any(
        text.startswith("samples: too coarse") and f"{bow:.4g} mm" in text for text in verdict.sentences
    )
    verdict, notes = at(0.004)
    assert verdict.passed, verdict.faults
    assert any("means over such periods" in note for note in notes)


@pytest.mark.parametrize("cut", [1, 2, 5])
def test_a_file_whose_end_is_cut_off_is_found(tmp_path, cut):
    verdict, _ = judged(tmp_path, program(), **{name: values[:-cut] for name, values in columns().items()})
    assert any(text.startswith("end") for text in verdict.sentences)
    verdict, _ = judged(tmp_path, program(), **{name: values[cut:] for name, values in columns().items()})
    assert any(text.startswith("start") for text in verdict.sentences)


def test_normal_acceleration_by_positions_is_never_above_the_true_one_and_an_excess_is_found():
    length, curve = helix((10.0, 0, 0), (0, 0), 2 * np.pi)
    motion = sample(along(length, curve, rest_to_rest(length, 50.0, 1000.0, 1e5)), M.dt)
    for limit, passes in ((250.0 * (1 + 1e-9), True), (200.0, False)):
        limited = machine(normal_acceleration=limit)
        toolpath = Moves((10.0, 0, 0)).arc((0, 0), 2 * np.pi).toolpath(limited)
        verdict = verify(motion, toolpath, limited, given=Given(columns=()), not_limited=JERK_FREE)
        check = verdict.limits["normal_acceleration"]
        assert check.value <= 250.0
        assert (check.ratio <= 1.0) is passes


@pytest.mark.parametrize("name", ["line", "block"])
def test_a_number_of_a_line_that_is_none_is_refused(tmp_path, name):
    """Found by fuzzing: it overflowed, with a warning of numpy."""
    given = columns()
    number = np.zeros(len(given["t"]))
    number[3] = 1e20
    with pytest.raises(InputError, match=rf"column '{name}', row 4: 1e\+20; every value must be between"):
        judged(tmp_path, program(), **given | {name: number})
