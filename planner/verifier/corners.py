"""The record of eq. 18-20 at the programmed corners: the motion beside what the papers let it do.

Checked is eq. 18, the corner's tolerance with the chord error in it. The speed is compared. Eq. 19 with the
motion's own curvature follows from the limits of the axes' acceleration (error_allocation.py): it is not
broken unless they are, and says where they act. Eq. 20 may be exceeded, and no verdict fails for it.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from planner.base.arrays import Array, FloatArray, freeze
from planner.verifier.pieces import CONTOUR_ROUNDING, RATIO_ROUNDING

# A corner passed at less than this fraction of what eq. 20 and the programmed feed allow counts as a stop
# [-]: samples show a motion that rests there as 0.025 mm/s, where eq. 20 allows 10 to 30 mm/s.
STANDS = 0.01
# Where the path turns by more [rad] the paper's corner is next to a cusp, 0.044 sqrt(1.5 X eps) and slower:
# eq. (20) says nothing there, and a motion that turns back passes slowly without a rest.
CUSP = np.deg2rad(175.0)


@dataclass(frozen=True, eq=False, kw_only=True)
class CornerCheck:
    """One row per programmed corner, in order: a joint that turns and at which the program does not stop.

    All but line, position, theta, budget and feed_paper is NaN where the motion was not looked at.
    """

    line: Array  # (C,) source line of the block that ends there
    position: FloatArray  # (C, A) the programmed vertex [mm]
    theta: FloatArray  # (C,) turning angle [rad]
    budget: FloatArray  # (C,) eps [mm]
    time: FloatArray  # (C,) when the motion is nearest to the vertex [s]
    feed_planned: FloatArray  # (C,) its speed there [mm/s]
    feed_closed_form: (
        FloatArray  # (C,) sqrt(A(n)/kappa), eq. (19) with the motion's own curvature [mm/s]; inf if straight
    )
    feed_paper: (
        FloatArray  # (C,) eq. (20)'s speed of paper 002's own corner between long straight legs [mm/s]
    )
    feed_programmed: FloatArray  # (C,) the smaller one of the two blocks [mm/s]
    speed_ratio: FloatArray  # (C,) largest feed_planned / feed_closed_form of all readings of the motion [-]
    miss: FloatArray  # (C,) distance of the vertex from the motion [mm]; of samples alone from their chords
    chord_error: FloatArray  # (C,) kappa feed^2 dt^2 / 8 [mm]; 0 where `miss` contains it
    budget_ratio: (
        FloatArray  # (C,) the larger of miss + chord_error and the delivered chords' distance, over eps [-]
    )
    delivered_speed: FloatArray  # (C,) both ratios by the samples and their chords alone [-]
    delivered_budget: FloatArray
    judged: bool = True  # False if the limit behind eq. (19) is reported only

    def __post_init__(self) -> None:
        corners = len(self.line)
        freeze(self, "line", np.int32, (corners,))
        freeze(self, "position", np.float64, (corners, None))
        for name, column in vars(self).items():
            if name not in ("line", "position", "judged"):
                freeze(self, name, np.float64, np.shape(column), finite=False)

    def __len__(self) -> int:
        return len(self.line)

    @property
    def looked(self) -> Array:
        """(C,) True where the motion was looked at."""
        return np.isfinite(self.time)

    @property
    def count(self) -> int:
        """How many corners were looked at."""
        return int(self.looked.sum())

    @property
    def not_looked_at(self) -> int:
        """How many were not: the motion never comes there, or its samples are too far apart to tell."""
        return len(self) - self.count

    @property
    def too_fast(self) -> Array:
        """(C,) True where eq. (19) is broken."""
        return self.speed_ratio > 1.0 + RATIO_ROUNDING

    @property
    def overdrawn(self) -> Array:
        """(C,) True where eq. (18) is broken; distances are good to `CONTOUR_ROUNDING`."""
        return self.budget_ratio > 1.0 + RATIO_ROUNDING + CONTOUR_ROUNDING / self.budget

    @property
    def held(self) -> int:
        """How many of the corners looked at keep both."""
        return int((self.looked & ~self.too_fast & ~self.overdrawn).sum())

    @property
    def stands(self) -> Array:
        """(C,) True where the motion stops, or next to it (`STANDS`); not where the path turns back."""
        stops = self.feed_planned < STANDS * np.minimum(self.feed_paper, self.feed_programmed)
        return self.looked & (self.theta <= CUSP) & stops

    @property
    def gain(self) -> FloatArray:
        """(C,) speed over eq. (20)'s speed of the paper's own corner [-]; NaN where the path turns back."""
        return np.where(self.theta <= CUSP, self.feed_planned / self.feed_paper, np.nan)

    @property
    def compared(self) -> Array:
        """(C,) True where the gain tells something: the corner is run through, eq. (20) below the feed."""
        turns = self.looked & (self.theta <= CUSP)
        return turns & ~self.stands & (self.feed_paper < self.feed_programmed)

    def told(self) -> tuple[FloatArray, FloatArray]:
        """(C,) ratios of eq. (19) and (18) for people: as delivered, so that a plan and the verdict on its
        file say the same; where a corner is broken, the largest of all readings."""
        return (
            np.where(self.too_fast, self.speed_ratio, self.delivered_speed),
            np.where(self.overdrawn, self.budget_ratio, self.delivered_budget),
        )

    @property
    def worst_speed_ratio(self) -> float:
        """Largest ratio of eq. (19) in `told`; NaN without corners that were looked at."""
        return _largest(self.told()[0][self.looked])

    @property
    def worst_budget_ratio(self) -> float:
        """Largest ratio of eq. (18) in `told`; NaN without corners that were looked at."""
        return _largest(self.told()[1][self.looked])

    @property
    def worst_ratio(self) -> float:
        """The larger of the two; NaN without corners that were looked at."""
        return max(self.worst_speed_ratio, self.worst_budget_ratio)

    def gains(self) -> tuple[float, float, float]:
        """Median, least and largest gain of the corners `compared`; NaN without any."""
        gain = self.gain[self.compared]
        return (float(np.median(gain)), float(gain.min()), float(gain.max())) if len(gain) else (np.nan,) * 3

    def summary(self) -> dict[str, Any]:
        """The part of `summary.json` that is called `corners`."""
        median, least, largest = self.gains()
        return {
            "count": self.count,
            "not_looked_at": self.not_looked_at,
            "held": self.held,
            "worst_speed_ratio": self.worst_speed_ratio,
            "worst_budget_ratio": self.worst_budget_ratio,
            "stopped_at": int(self.stands.sum()),
            "gain": median,
            "gain_min": least,
            "gain_max": largest,
            "gain_count": int(self.compared.sum()),
        }

    def sentence(self) -> str:
        """What is checked, the budget of eq. 18, and what is compared, the speed with those of eq. 19 and 20,
        in one line: "eq. 18 holds at 4 of 4 corners, at most 0.9993 of the budget; compared: speed at most
        0.9981 of eq. 19, 1.54 of eq. 20 (median)"."""
        if not len(self):
            return "none: the program has no corner without a full stop"
        kept = int((self.looked & ~self.overdrawn).sum())
        said = f"eq. 18 holds at {kept:,} of {len(self):,} corners"
        if self.count:
            said += f", at most {_ratio(self.worst_budget_ratio)} of the budget"
            said += f"; compared: speed at most {_ratio(self.worst_speed_ratio)} of eq. 19"
        compared = int(self.compared.sum())
        if compared:
            of = "" if compared == len(self) else f" of the {compared:,} where it is below the feed"
            said += f", {self.gains()[0]:.2f} of eq. 20 (median{of})"
        return said + (f"; {self.not_looked_at:,} could not be checked" if self.not_looked_at else "")


def _ratio(value: float) -> str:
    """0.9993, and where it is beyond 1 with the digits that show it: 1.000002."""
    return f"{value:.6f}" if 1.0 + RATIO_ROUNDING < value < 1.001 else f"{value:.4f}"


def _largest(values: FloatArray) -> float:
    return float(values.max()) if len(values) else np.nan
