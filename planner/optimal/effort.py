"""How much work a plan is worth: grids and rounds of reshaping for `--effort quick`, `normal` and `best`.

Splines are reshaped on a coarse grid, on which motions take up to 1e-2 longer than on a fine one; which of two shapes is faster it
tells better than that. The last shape is solved again on the final grid, that of the plan. The error of a grid goes with the
square of its intervals, and so do its points with the root of its resolution: 16 times finer are about 4 times as many points.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

from planner.base.names import BEST, NORMAL, QUICK

# Interpolation error of the axis accelerations on the coarsest grid [share of the limit] (path/samples.py). Rounds of reshaping on a
# quarter of it end 2e-3 faster on the bracket and take 1.6 times as long.
COARSE = 3.2e-2


class Grids(NamedTuple):
    """Resolutions for a job that has `points` points at most on a grid of the resolution `COARSE`."""

    points: float
    rounds: float  # of the grid on which splines are reshaped
    final: float  # of the grid of the plan


@dataclass(frozen=True, kw_only=True)
class Search:
    """How a motion is searched for geometry and feed together (methods/free.py).

    steps_max : of constant jerk that it may have
    kept      : share of the time that this may leave as it was; where it leaves more it begins on reshaped splines too [-]
    per_unit  : steps in a unit of time where the jerk is at its limit (tube/guess.py) [-]
    of_leg    : steps of a leg at least [-]
    gap       : complementarity at the end, share of the time [-]
    at_once   : begin with a motion on the first splines that is not fit for delivery (methods/at_once.py)
    again     : begin with a plan where that leaves something
    """

    steps_max: float
    kept: float = 0.05
    per_unit: float = 4.0
    of_leg: float = 2.0
    gap: float = 1e-5
    at_once: bool = True
    again: bool = True


THOROUGH = Search(steps_max=float("inf"), kept=-1.0, at_once=False)


@dataclass(frozen=True, kw_only=True)
class Effort:
    """What a plan is worth.

    work   : grid points, counted over all rounds of reshaping
    rounds : of reshaping at most
    left   : no more of them where one promises less than this share of the time [-]
    sizes  : grids by the size of the job, ascending
    search : for geometry and feed together
    """

    work: int
    rounds: int
    left: float
    sizes: tuple[Grids, ...]
    search: Search

    def grids(self, points: int) -> Grids:
        """The grids for a job that has so many points on a grid of the resolution `COARSE`."""
        return next(size for size in self.sizes if points <= size.points)


# Rounds: on the bracket the first two gain 2.5e-2 of the time, the next four 5e-3, and the next four 5e-4. Final grids: motions on
# 8e-3, 2e-3 and 5e-4 take up to 4e-3, 1.5e-3 and 4e-4 longer than
# on 2e-4 (zig-zag on mill; a relief on peers 3e-4 on the first); the memory sets the limit. Rounds on the
# coarse grid leave small jobs 1e-3 slower.
_LARGE = Grids(float("inf"), COARSE, 8e-3)
EFFORTS = {
    QUICK: Effort(
        work=25_000,
        rounds=2,
        left=1e-3,
        search=Search(steps_max=30_000, per_unit=1.0, of_leg=1.0, gap=1e-3, again=False),
        sizes=(_LARGE,),
    ),
    NORMAL: Effort(
        work=150_000,
        rounds=40,
        left=1e-5,
        search=Search(steps_max=60_000),
        sizes=(Grids(1_500, 2e-3, 2e-4), Grids(4_000, 8e-3, 5e-4), Grids(40_000, COARSE, 2e-3), _LARGE),
    ),
    BEST: Effort(
        work=5_000_000,
        rounds=100,
        left=1e-6,
        search=THOROUGH,
        sizes=(Grids(4_000, 2e-3, 2e-4), Grids(40_000, 8e-3, 5e-4), Grids(400_000, COARSE, 2e-3), _LARGE),
    ),
}
