"""How much work a plan is worth: grids and searches for `--effort quick`, `normal` and `best`.

The error of a grid goes with the square of its intervals, and so do its points with the root of its
resolution: 16 times finer are about 4 times as many points.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass, field
from typing import NamedTuple

from planner.base.names import BEST, NORMAL, QUICK
from planner.base.sizes import SIZES
from planner.corners.bezier import BezierCorner
from planner.corners.smooth import CornerShape
from planner.feedrate.constraints.limits import JERK
from planner.joint.guess import Cut
from planner.planning.optimal.order import Order

# Interpolation error of the axis accelerations on the coarsest grid [share of the limit].
COARSE = 3.2e-2
# The same of the motion that a search begins with: a finer grid finds the same times and computes longer
# (`python -m benchmarks.cost.long_jobs stellabee1`).
BEGINNING = 0.1


# The first steps of a search, those of the second one, and the gaps of both [-].
FIRST_CUT, SECOND_CUT = Cut(per_unit=1.0, of_leg=1.0), Cut(per_unit=4.0, of_leg=1.0)
FIRST_GAP, SECOND_GAP = 1e-3, 1e-5
# Of large motions.
LARGE_GAP = 1e-4
# For the best of efforts.
BEST_CUT, BEST_GAP = Cut(per_unit=8.0, of_leg=1.0), 1e-6


class Grids(NamedTuple):
    """Resolutions for a job that has `points` points at most on a grid of the resolution `COARSE`."""

    points: float
    first: float  # of the grid on which corners are compared with splines at first
    final: float  # of the grid of the plan


@dataclass(frozen=True, kw_only=True)
class Search:
    """How a motion is searched for geometry and feed together (planning/joint_search.py)."""

    steps_max: float  # of constant jerk that it may have
    cut: Cut = FIRST_CUT  # how finely the first motion is cut into steps
    gap: float = FIRST_GAP  # complementarity at the end, share of the time [-]
    # how finely what is found is cut once more, and the gap of the search from there, one after the other
    finer: tuple[tuple[Cut, float], ...] = ((SECOND_CUT, SECOND_GAP),)
    smooth: float = 0.0  # weight of the jerk against the time at least [-]
    again: bool = True  # search once more where that has not ended
    # steps of the motions that `finer` and `again` are meant for; longer ones are searched once only
    small: float = float("inf")

    def of(self, steps: int) -> Search:
        """That of a motion of so many steps."""
        if steps <= self.small:
            return self
        return dataclasses.replace(self, finer=(), gap=LARGE_GAP, again=False)


# Steps that are searched with the usual effort at most; of a small motion.
STEPS_MAX, SMALL = SIZES.searched_most, SIZES.searched_finely
THOROUGH = Search(steps_max=float("inf"), finer=((SECOND_CUT, SECOND_GAP), (BEST_CUT, BEST_GAP)))


@dataclass(frozen=True, kw_only=True)
class Effort:
    """The effort of a plan."""

    sizes: tuple[Grids, ...]  # grids by the size of the job, ascending
    search: Search  # for geometry and feed together

    def grids(self, points: int) -> Grids:
        """The grids for a job that has so many points on a grid of the resolution `COARSE`."""
        return next(size for size in self.sizes if points <= size.points)


# Final grids are as fine as the memory allows: a motion on a coarser one is slower.
_TINY, _FEW, _MANY = SIZES.small_grids
_LARGE = Grids(float("inf"), COARSE, 8e-3)
EFFORTS = {
    QUICK: Effort(
        search=Search(steps_max=STEPS_MAX, finer=(), again=False, small=SMALL),
        sizes=(_LARGE,),
    ),
    NORMAL: Effort(
        search=Search(steps_max=STEPS_MAX, small=SMALL),
        sizes=(Grids(_TINY, 2e-3, 2e-4), Grids(_FEW, 8e-3, 5e-4), Grids(_MANY, COARSE, 2e-3), _LARGE),
    ),
    BEST: Effort(
        search=THOROUGH,
        sizes=(Grids(_FEW, 2e-3, 2e-4), Grids(_MANY, 8e-3, 5e-4), Grids(10.0 * _MANY, COARSE, 2e-3), _LARGE),
    ),
}


@dataclass(frozen=True, kw_only=True)
class Settings:
    """How a job is planned on a smooth path."""

    method: str  # what the plan is called
    corner: str | CornerShape  # "auto", "spline", the name of a corner shape, or a shape
    order: Order  # which limits are kept, and the solver for them
    # the corner of "bezier", and where there is no spline
    bezier: CornerShape = field(default_factory=BezierCorner)
    effort: Effort = EFFORTS[NORMAL]
    joint: bool = False  # whether path and feed are searched together (planning/joint_search.py)

    @property
    def not_limited(self) -> tuple[str, ...]:
        """Quantities that the motions do not limit."""
        return () if self.order.jerk_limited else (JERK.name,)

    @property
    def corner_name(self) -> str:
        """The name of the corner."""
        return self.corner if isinstance(self.corner, str) else self.corner.name
