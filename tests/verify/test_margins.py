"""What the judge allows where samples cannot tell: each allowance from the physics of the machine, passed just below it and not above.

Numbers of M: a period h of 1 ms, a = 2000 mm/s2, j = 2e5 mm/s3.
"""

from __future__ import annotations

import numpy as np
import pytest
from judging import M
from motions import Moves, chain, polyline, sample, stay
from setpoints import trajectory_of

from planner.nc.program import PathControl
from planner.verify import Given, verify

H, A, J = M.dt, 2000.0, 2e5
NO_COLUMNS = Given(columns=())


def said(kind, trajectory, toolpath, machine=M, **more):
    """The faults of a kind, by positions alone."""
    verdict = verify(trajectory, toolpath, machine, given=NO_COLUMNS, **more)
    return [text for text in verdict.faults if text.startswith(kind)]


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
    toolpath = Moves().line(1).line(0).toolpath(M)
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
