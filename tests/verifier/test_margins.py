"""What the judge allows where samples cannot tell: each allowance from the physics of the machine, passed just below it and not above.

Numbers of M: a period h of 1 ms, a = 2000 mm/s2, j = 2e5 mm/s3.
"""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from judging import M
from motions import Moves, chain, machine, polyline, sample, stay

from benchmarks.judge.setpoints import trajectory_of
from planner.nc.program import PathControl
from planner.verifier import Given, Kind, verify

H, A, J = M.dt, 2000.0, 2e5
NO_COLUMNS = Given(columns=())


def said(kind, trajectory, toolpath, **more):
    """The faults of a kind, by positions alone."""
    verdict = verify(trajectory, toolpath, M, given=NO_COLUMNS, **more)
    return [text for text in verdict.sentences if text.startswith(kind)]


def along_x(x):
    """Positions (n,) [mm] a period apart."""
    x = np.asarray(x, dtype=float)
    position = np.stack([x, 0 * x, 0 * x], axis=1)
    return trajectory_of(H * np.arange(len(x)), position, 0 * position)


# ---- full stops: |chord| <= j h^3 / 6 over the period of a rest, and one end of it within j (h/2)^3 / 6 ----------------------------


@pytest.mark.parametrize(("ratio", "stops"), [(0.99, True), (1.01, False), (1.4, False)])
def test_a_stop_is_no_faster_than_samples_beside_a_rest_can_be(ratio, stops):
    step = ratio * J * H**3 / 6
    toolpath = Moves().line(100.5 * step, control=PathControl.EXACT_STOP).line(201 * step).toolpath(M)
    assert (not said("stop", along_x(step * np.arange(202)), toolpath)) == stops


@pytest.mark.parametrize(("ratio", "stops"), [(0.99, True), (1.01, False), (1.4, False)])
def test_a_stop_is_no_further_from_its_vertex_than_a_sample_beside_a_rest_can_be(ratio, stops):
    short = (
        1e-6 + ratio * np.sqrt(3) * J * H**3 / 48
    )  # of each of three axes; 1e-6 mm is what programs are written to
    toolpath = Moves().line(1, control=PathControl.EXACT_STOP).line(0).toolpath(M)
    motion = chain(
        polyline([(0, 0, 0), (1 - short, 0, 0)], jerk=J),
        stay((1 - short, 0, 0), 0.01),
        polyline([(1 - short, 0, 0), (0, 0, 0)], jerk=J),
    )
    assert (not said("stop", sample(motion, H), toolpath)) == stops


# ---- dwells: of a period with samples d0 and d1 away no more than h - (6 d0 / j)^(1/3) - (6 d1 / j)^(1/3) is rest ------------------

PHASES = np.arange(0.0, 1.0, 0.125)


def dwelling(seconds, phase, jerk=J, acceleration=A):
    """Samples of a motion that rests for so long between two moves; it begins a share `phase` of a period after a sample."""
    legs = [
        polyline([(p, 0, 0), (q, 0, 0)], acceleration=acceleration, jerk=jerk) for p, q in ((0, 1), (1, 2))
    ]
    return sample(chain(stay((0, 0, 0), phase * H), legs[0], stay((1, 0, 0), seconds), legs[1]), H)


@pytest.mark.parametrize("jerk", [J, J / 30, np.inf])
@pytest.mark.parametrize("asked", [0.0004, 0.0017, 0.02])
def test_a_dwell_is_long_enough_wherever_the_samples_fall(asked, jerk):
    toolpath = Moves().line(1).dwell(asked).line(2).toolpath(M)
    for phase in PHASES:
        judged = dwelling(asked, phase, jerk)
        assert said("dwell", judged, toolpath, not_limited=("jerk",) if np.isinf(jerk) else ()) == []


@pytest.mark.parametrize("asked", [0.0017, 0.02])
def test_a_dwell_may_not_be_short_by_a_period(asked):
    """Less than 2 (6e-6 mm / j)^(1/3) = 0.6 ms is not seen: places are good to 1e-6 mm."""
    toolpath = Moves().line(1).dwell(asked).line(2).toolpath(M)
    for phase in PHASES:
        short = 0.65 * H
        found = said("dwell", dwelling(asked - short, phase), toolpath)
        assert len(found) == 1
        assert f"{asked:g} s programmed" in found[0]


@pytest.mark.parametrize("share", [0.4, 0.5, 0.6])
def test_samples_beside_a_rest_tell_when_it_began_and_ended(share):
    """It begins so many periods behind a sample and ends so many behind another: places of 1e-6 mm are 0.11 ms there."""
    before = polyline([(0, 0, 0), (1, 0, 0)], acceleration=A, jerk=J)[0]
    judged = dwelling(0.02, (share - before / H) % 1.0)
    for asked, long_enough in ((0.02, True), (0.02015, False)):
        toolpath = Moves().line(1).dwell(asked).line(2).toolpath(M)
        assert (not said("dwell", judged, toolpath)) == long_enough


def test_digits_of_the_times_are_allowed_at_both_ends_of_a_dwell():
    toolpath = Moves().line(1).dwell(0.02).line(2).toolpath(M)
    for digits, allowed in ((0.4 * H, True), (0.2 * H, False)):
        given = Given(columns=(), time_rounding=digits)
        found = [
            verify(dwelling(0.02 - 0.79 * H, phase), toolpath, M, given=given).sentences for phase in PHASES
        ]
        short = [any(text.startswith("dwell") for text in faults) for faults in found]
        assert not any(short) if allowed else any(short)


@pytest.mark.parametrize(("digits", "long_enough"), [(0.0, False), (0.1 * H, True)])
def test_digits_of_the_last_time_are_allowed_to_a_dwell_at_the_end(digits, long_enough):
    toolpath = Moves().line(1).dwell(0.02).toolpath(M)
    leg = polyline([(0, 0, 0), (1, 0, 0)], jerk=J)
    first = stay((0, 0, 0), (0.6 - leg[0] / H) % 1.0 * H)  # the rest begins 0.6 periods behind a sample
    motion = sample(chain(first, leg, stay((1, 0, 0), 0.02)), H)
    t = motion.t.copy()
    t[-1] -= 0.1 * H
    given = Given(columns=(), end_rounding=digits)
    found = verify(dataclasses.replace(motion, t=t), toolpath, M, given=given).sentences
    assert (not any(text.startswith("dwell") for text in found)) == long_enough


def test_a_dwell_of_axes_without_limits_of_jerk_may_not_be_short_by_a_period():
    """The same by (2 d / a)^(1/2)."""
    toolpath = Moves().line(1).dwell(0.02).line(2).toolpath(M)
    for phase in PHASES:
        assert said("dwell", dwelling(0.02 - 0.1 * H, phase, np.inf), toolpath, not_limited=("jerk",))


def test_a_motion_above_its_jerk_is_not_called_short_by_that_too():
    toolpath = Moves().line(1).dwell(0.02).line(2).toolpath(M)
    for phase in PHASES:
        fast = dwelling(0.02, phase, 3.0 * J)
        assert said("jerk", fast, toolpath)
        assert not said("dwell", fast, toolpath)


# ---- rest at both ends: the period next to it moves by no more than j h^3 / 6, or a h^2 / 2 --------------------------------------


@pytest.mark.parametrize(("ratio", "rests"), [(0.99, True), (1.01, False), (2.9, False)])
@pytest.mark.parametrize("jerk_limited", [True, False])
def test_the_periods_at_both_ends_move_by_no_more_than_they_can_beside_a_rest(ratio, rests, jerk_limited):
    step = ratio * (J * H**3 / 6 if jerk_limited else A * H**2 / 2)
    toolpath = Moves().line(1).toolpath(M)
    motion = along_x(step * np.arange(20))
    for end in ("start", "end"):
        found = said(
            f"{end}: not at rest: x moves", motion, toolpath, not_limited=() if jerk_limited else ("jerk",)
        )
        assert (found == []) == rests


# ---- columns against the means of one period: (v0 + v1)/2 to min(A h / 4, J h^2 / 12), (a0 + a1)/2 to J h / 4 ---------------------

VELOCITY_DIGITS, ACCELERATION_DIGITS = 1e-6 * 100, 1e-6 * (100 / H + A)  # 1e-6 of the limits


@pytest.mark.parametrize(("ratio", "agrees"), [(0.99, True), (1.01, False), (1.9, False)])
@pytest.mark.parametrize(
    ("columns", "value", "limited"),
    [
        (("velocity",), VELOCITY_DIGITS + J * H**2 / 12 * 1j, ()),
        (("velocity",), VELOCITY_DIGITS + A * H / 4 * 1j, ("jerk",)),
        (("velocity", "acceleration"), ACCELERATION_DIGITS + J * H / 4 * 1j, ()),
    ],
    ids=["velocity by jerk", "velocity by acceleration", "acceleration"],
)
def test_columns_may_differ_from_the_mean_of_a_period_by_what_the_limits_allow(
    columns, value, limited, ratio, agrees
):
    """Of axes that stand still the last column is given as one number, with its rounding as the real part."""
    motion = along_x(np.zeros(20))
    wrong = np.zeros((20, 3))
    wrong[:, 0] = value.real + ratio * value.imag
    found = verify(
        dataclasses.replace(motion, **{columns[-1]: wrong}),
        Moves().line(1).toolpath(M),
        M,
        given=Given(columns=columns),
        not_limited=limited,
    )
    assert any(text.startswith(f"columns: {columns[-1]}.x") for text in found.sentences) != agrees


# ---- G61: a vertex of an arc is missed by its chord by no more than a h^2 / 8 ----------------------------------------------------


@pytest.mark.parametrize(("ratio", "exact"), [(0.99, True), (1.02, False), (3.5, False)])
def test_between_samples_on_an_exact_arc_its_vertices_are_missed_by_the_bow_of_the_acceleration(ratio, exact):
    radius, turn = 1.5, np.pi / 8 / 8  # of an arc; between samples: vertices are midway between two of them
    bow = radius * (1 - np.cos(turn / 2)) / ratio
    strong = machine(acceleration=(bow - 1e-6) / (np.sqrt(3) * H**2 / 8))  # 1e-6 mm for digits of places
    toolpath = Moves((radius, 0.0, 0.0)).arc((0.0, 0.0), 2 * np.pi).toolpath(strong)
    toolpath = dataclasses.replace(toolpath, exact=np.ones(1, dtype=bool))
    angle = np.concatenate([[0.0], turn * np.arange(0.5, 128), [2 * np.pi]])
    place = radius * np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    found = verify(
        trajectory_of(H * np.arange(len(angle)), place, 0 * place), toolpath, strong, given=NO_COLUMNS
    )
    assert any(text.startswith("exact path") for text in found.sentences) != exact


# ---- order within one chord --------------------------------------------------------------------------------------------------


def test_vertices_of_one_chord_are_passed_in_their_order():
    """From 5.05 to 5.1 mm in one chord: 5.06 and 5.09 are passed by a motion straight on, 5.09 and then 5.06 are not."""
    motion, fine = along_x(0.1 * np.arange(101)), machine(tolerance=0.005)
    for inner, in_order in (((5.06, 5.09), True), ((5.09, 5.06), False)):
        toolpath = Moves().line(inner[0]).line(inner[1]).line(10).toolpath(fine)
        verdict = verify(motion, toolpath, fine, given=NO_COLUMNS)
        assert (Kind.ORDER not in verdict.kinds) == in_order
