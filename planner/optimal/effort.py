"""How much work a plan is worth: grids and rounds of reshaping for `--effort quick`, `normal` and `best`.

Splines are reshaped on a coarse grid, on which motions are within some 1e-3 of what they are on a fine one, and are compared with each
other much better than that. The last shape is solved again on the final grid, that of the plan. The error of a grid goes with the
square of its intervals, and so do its points with the root of its resolution: 16 times finer are about 4 times as many points.
"""

from __future__ import annotations

from dataclasses import dataclass

from planner.base.names import BEST, NORMAL, QUICK

# Interpolation error of the axis accelerations on the grid of the rounds [share of the limit] (path/samples.py). A quarter of it gives
# the same shapes to 1e-4 of the time, and takes twice as long; four times it loses 1e-2 on the bracket.
COARSE = 3.2e-2


@dataclass(frozen=True, kw_only=True)
class Effort:
    """What a plan is worth.

    work        : grid points, counted over all rounds of reshaping
    rounds      : of reshaping at most
    resolutions : pairs of points on the coarse grid and the resolution of the final one for jobs of so many points at most, ascending
    """

    work: int
    rounds: int
    resolutions: tuple[tuple[float, float], ...]

    def resolution(self, points: int) -> float:
        """The resolution of the final grid for a job that has so many points on the coarse one."""
        return next(resolution for most, resolution in self.resolutions if points <= most)


# Rounds: the first five gain 2e-2 of the time, the next five 2e-3, then ten 1e-3, and the last twenty 4e-4 (means over random jobs,
# benchmarks/ablation.py). Final grids: 8e-3 is within 1e-3 of the time on an infinitely fine grid, 2e-3 within 4e-4, 5e-4 within 1e-4
# (zig-zag, relief, bracket); the memory sets the limit.
EFFORTS = {
    QUICK: Effort(work=25_000, rounds=5, resolutions=((float("inf"), 8e-3),)),
    NORMAL: Effort(
        work=150_000, rounds=40, resolutions=((4_000, 5e-4), (40_000, 2e-3), (float("inf"), 8e-3))
    ),
    BEST: Effort(
        work=5_000_000, rounds=100, resolutions=((40_000, 5e-4), (400_000, 2e-3), (float("inf"), 8e-3))
    ),
}
