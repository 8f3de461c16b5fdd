"""Motions one after the other: nothing jumps where they meet, and standstills are as long as asked."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from rest_motion import along_x

from planner.joint.parts import Spliced, SplicedRun
from planner.motion.axis_motion import OF_PIECES
from planner.motion.slowed import Slowed

JERK = 1e4
FIRST, SECOND = along_x(1.0, JERK), along_x(2.0, JERK, start=1.0, slower=1.3)
HOLD = 0.05


def spliced(hold: float = HOLD) -> Spliced:
    return Spliced(
        runs=(
            SplicedRun(motion=FIRST, begin=0.0, end=FIRST.end, hold=hold),
            SplicedRun(motion=SECOND, begin=0.0, end=SECOND.end),
        )
    )


def test_it_lasts_as_long_as_its_runs():
    assert spliced().end == pytest.approx(FIRST.end + HOLD + SECOND.end, rel=1e-12)
    np.testing.assert_allclose(spliced().length, [0.0, 1.0, 3.0], atol=1e-9)


def test_every_part_is_where_it_was():
    made, dt = spliced(), 1e-3
    inside = np.linspace(0.0, 1.0, 50)[1:-1]
    for motion, begin in ((FIRST, 0.0), (SECOND, FIRST.end + HOLD)):
        there, own = made.at(begin + inside * motion.end, dt), motion.at(inside * motion.end, dt)
        for name in ("position", "velocity", "acceleration"):
            np.testing.assert_allclose(getattr(there, name), getattr(own, name), atol=1e-9 * JERK)
        assert (np.diff(there.s) > 0).all()


@pytest.mark.parametrize("slowed", [(0,), (1,), (0, 1)])
def test_lengths_do_not_depend_on_how_motions_are_given(slowed):
    """Axis by axis, all in one array, or each by itself."""
    made, times = spliced(), np.linspace(0.0, spliced().end, 41)
    runs = [
        dataclasses.replace(run, motion=Slowed(motion=run.motion, places=())) if k in slowed else run
        for k, run in enumerate(made.runs)
    ]
    other = Spliced(runs=tuple(runs))
    np.testing.assert_allclose(other.at(times, 1e-3).s, made.at(times, 1e-3).s, atol=1e-9)
    np.testing.assert_allclose(other.length[:3], made.length, atol=1e-9)


def test_pieces_are_kept_once():
    one, before = spliced(), {name: getattr(SECOND, name).copy() for name in OF_PIECES}
    one.at(np.array([0.0, one.end]), 1e-3)
    _, pieces = one._pieces
    for name, column in before.items():
        np.testing.assert_array_equal(getattr(SECOND, name), column)
        assert np.shares_memory(getattr(SECOND, name), getattr(pieces, name))


def test_at_no_times_it_has_columns_without_rows():
    """Corners are looked at in the samples beside them, and a straight program has none."""
    none = spliced().at(np.zeros(0), 1e-3)
    assert (len(none), none.position.shape, none.axes) == (0, (0, len(FIRST.axes)), FIRST.axes)


def test_it_stands_between_its_runs():
    still = spliced().at(FIRST.end + np.linspace(0.0, HOLD, 11)[1:-1], 1e-3)
    np.testing.assert_allclose(still.position[:, 0], 1.0, atol=1e-12)
    for name in ("velocity", "acceleration", "jerk", "feed"):
        assert not getattr(still, name).any()
    np.testing.assert_allclose(still.s, 1.0, atol=1e-9)


def test_waiting_is_added_where_it_stands():
    made = spliced()
    longer = made.waiting(np.array([FIRST.end]), np.array([0.2]))
    assert longer.end == pytest.approx(made.end + 0.2, rel=1e-12)
    late = longer.at(np.array([FIRST.end + HOLD + 0.2 + 0.5 * SECOND.end]), 1e-3)
    soon = made.at(np.array([FIRST.end + HOLD + 0.5 * SECOND.end]), 1e-3)
    np.testing.assert_allclose(late.position, soon.position, atol=1e-9)


def test_parts_without_standstills_are_one_motion():
    whole = spliced(hold=0.0).whole()
    times = np.linspace(0.0, whole.end, 101)[1:-1]
    there, own = whole.at(times, 1e-3), spliced(hold=0.0).at(times, 1e-3)
    np.testing.assert_allclose(there.position, own.position, atol=1e-9)
