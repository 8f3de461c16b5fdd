"""The settings of the interior-point method of interior_point.py: one record, the same for every problem.

Numbers in brackets are the iterations of 156 problems (benchmarks/solvers/jerk_campaign.py and three jobs)
with another value; 3889 with the values as they are.
"""

from dataclasses import dataclass, field
from typing import NamedTuple

from planner.base.sizes import SIZES


class InteriorPointSettings(NamedTuple):
    """Numbers without a unit; the problem's units are scaled to fastest feed 1 and largest acceleration 1.

    Start
    slack_min       : smallest of the first slacks; smaller ones block some starts (0.03: 4063)
    start_gap       : the first barrier, complementarity of every row per time. Larger than this the first
                      steps leave the start, one problem then fails (3: 4524); smaller, slacks that must grow
                      cannot (0.03: 4242)

    End
    residual        : of the rows, as a fraction of the limits; what is left is removed by slowing down, so
                      that it is far below `tol` (1e-5: 4 % fewer iterations, but multipliers whose sum was
                      0.7 % off on a job of two windows)
    defect          : of the kinematics, as a fraction of the largest feed. Nothing removes it, and starts
                      must have no more of it either: from 1e-7 windows behind motion begin to fail (1e-7:
                      4922)
    gap_floor       : the barrier stays above this fraction of the gap that is asked for (1e-3: 4034)

    Steps
    to_boundary     : fraction of the way to a slack or multiplier of zero that a step may take (0.9: 4311)
    domain_edge     : fraction of the kinematics' domain that a step may reach; rows ask for less
    shortening      : of a step that leaves the domain, until it does not
    shortest        : steps are not shortened below this; the next model is another one
    feed_sq_shrink  : largest fraction of x that one step may take away: x stays positive

    Barrier
    sigma_max       : the barrier falls by this factor at least; others would stay for ever
    predicted_min   : a shorter predictor step says nothing about second-order terms. Without these: 5276
    change_max      : while some x changes by more than this fraction the barrier stays: far from the solution
                      it must not fall first. Without: 3752, but one profile is 1.3e-4 slower

    Curvature
    fraction_less   : factor on the fraction of the curvature that counts, until the model is convex
    fraction_min    : a smaller fraction of the curvature is none. All or none: 4058

    Giving up
    stall_step      : steps shorter than this ...
    stall_rounds    : ... so often in a row lead nowhere: then another start is better (never: 4091)
    """

    slack_min: float = 0.3
    start_gap: float = 0.3
    residual: float = 1e-6
    defect: float = 1e-9
    gap_floor: float = 0.1
    to_boundary: float = 0.995
    domain_edge: float = 0.98
    shortening: float = 0.7
    shortest: float = 1e-3
    feed_sq_shrink: float = 0.9
    sigma_max: float = 0.9
    predicted_min: float = 0.1
    change_max: float = 0.4
    fraction_less: float = 0.25
    fraction_min: float = 0.05
    stall_step: float = 0.01
    stall_rounds: int = 10


SETTINGS = InteriorPointSettings()


@dataclass(frozen=True, kw_only=True)
class WindowSettings:
    """How a problem is solved in windows."""

    tol: float = 1e-4  # relative gap at which a window is optimal
    iterations: int = 100  # at most, per window
    window: int = SIZES.solved_window  # intervals solved at a time
    # of the interior-point method; the same for every problem
    settings: InteriorPointSettings = field(default=SETTINGS, repr=False)
