"""What the interior-point method of interior_point.py is set to: one record, the same for every problem."""

from __future__ import annotations

from typing import NamedTuple


class Settings(NamedTuple):
    """Numbers without a unit; the problem's units are scaled to fastest feed 1 and largest acceleration 1.

    Start
    slack_min         : smallest of the first slacks; smaller ones block the way of a start that violates other rows
    start_gap         : the first barrier, complementarity of every row per time; a start that keeps its limits has slacks of
                        about `slack_min`, so that its first multipliers are about 1, the size of the time's own gradient

    End
    residual          : of the rows, as a fraction of the limits; what is left the solver slows down by
    defect            : of the kinematics, as a fraction of the largest feed; nothing makes up for it afterwards
    gap_floor         : the barrier stays above this fraction of the gap asked for: multipliers of rows that nothing holds would
                        otherwise vanish, and the last steps gain nothing

    Steps
    to_boundary       : fraction of the way to the nearest slack or multiplier of zero that a step may take
    domain_edge       : fraction of the kinematics' domain that a step may reach; the rows ask for less (rows.DOMAIN), so that a
                        solution never lies here
    shortening        : of a step that leaves the domain, until it does not
    shortest          : steps are not shortened below this: the next model is another one
    feed_sq_shrink    : largest fraction of x that one step may take away: x stays positive, and so near that its model means something

    Barrier
    sigma_max         : the barrier falls by at least this factor; as a third power of the gap that the predictor leaves it may be 1
    predicted_min     : a predictor step shorter than this says nothing about second-order terms
    change_max        : while some x changes by more than this fraction the barrier stays: far from the solution it must not fall first

    Curvature
    hessian_min       : keeps the reduced Hessian positive where no row is near; far below any row's weight
    fraction_less     : factor on the fraction of the curvature that counts where the model is not convex ...
    fraction_more     : ... and at the start of the next iteration, so that Newton's step comes back soon
    fraction_min      : a smaller fraction of the curvature is none

    Giving up
    stall_step        : steps shorter than this ...
    stall_rounds      : ... so often in a row lead nowhere
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
    hessian_min: float = 1e-12
    fraction_less: float = 0.25
    fraction_more: float = 4.0
    fraction_min: float = 0.05
    stall_step: float = 0.01
    stall_rounds: int = 10


SETTINGS = Settings()
