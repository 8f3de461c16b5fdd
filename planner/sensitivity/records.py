"""The records of a plan, the same for every method: tables of corners, the profile on the grid, prices."""

import math
from dataclasses import dataclass, field

import numpy as np

from planner.base.arrays import Array, FloatArray, freeze

SAVED_MIN = 1e-6  # what saves less is not worth telling [s]
SHARE_DIGITS = 4  # of a share of the cycle time, in every output
WORDS = {"none": "nothing", "rest": "dwells"}  # for what no limit holds
PRICES_SHOWN = 4  # of a price list, in a line


@dataclass(frozen=True, eq=False, kw_only=True)
class GridHistory:
    """The profile at the solver's grid points, and the limits that are active there (activity.py).

    t, s, feed   : (P,) time [s], arc length [mm], feed [mm/s]
    active       : (P,) index in `active_names` of the limit that is shown for the interval to the right of
                   each point: of those that are active there the one with the largest price, or the closest
    reached      : (P, K) which of the K of `active_names` are active there
    active_names : names of limits, then "none" and "rest"
    share        : (K,) fraction of the cycle time in which each is active [-]; together they count in full
    """

    t: FloatArray
    s: FloatArray
    feed: FloatArray
    active: Array
    reached: Array
    active_names: tuple[str, ...]
    share: FloatArray

    def ranked(self) -> list[tuple[str, float]]:
        """Names and shares of the cycle time, to `SHARE_DIGITS`: limits, largest first, "none", "rest"."""
        share = np.round(self.share, SHARE_DIGITS)
        limits, others = np.flatnonzero(share[:-2]), len(share) - 2 + np.flatnonzero(share[-2:])
        order = [*limits[np.argsort(-share[limits], kind="stable")], *others]
        return [(self.active_names[k], float(share[k])) for k in order]

    def percents(self) -> list[tuple[str, int]]:
        """Those of `ranked` in whole per cent from 1 % on; "nothing" and "dwells" for "none" and "rest"."""
        found = [(WORDS.get(name, name), math.floor(100.0 * share + 0.5)) for name, share in self.ranked()]
        return [(name, percent) for name, percent in found if percent]


@dataclass(frozen=True, eq=False, kw_only=True)
class DearCorners:
    """The corners where more tolerance saves most, the largest saving first."""

    line: Array  # (C,) NC line of the block that ends at the corner
    position: FloatArray  # (C, A) vertex [mm]
    theta: FloatArray  # (C,) turning angle [rad]
    price: FloatArray  # (C,) dT/d(tolerance at that corner alone) [s/mm]
    saved: FloatArray  # (C,) time saved by `MORE_TOLERANCE` there [s]

    def __post_init__(self) -> None:
        corners = len(self.line)
        freeze(self, "line", np.int32, (corners,))
        freeze(self, "position", np.float64, (corners, None))
        freeze(self, "theta price saved", np.float64, (corners,))

    def __len__(self) -> int:
        return len(self.line)


@dataclass(frozen=True, eq=False, kw_only=True)
class PlacePrices:
    """The prices by place: at the M segments of the programmed path and the M+1 joints between them."""

    feed: FloatArray  # (M,) time saved by `MORE_LIMIT` more of the programmed feed of this segment alone [s]
    limits: FloatArray  # (M,) the same of every limit on this segment, feed and axes [s]
    tolerance: FloatArray | None  # (M+1,) dT/d(tolerance at this joint) [s/mm], negative where more saves

    def __post_init__(self) -> None:
        segments = len(self.feed)
        freeze(self, "feed limits", np.float64, (segments,))
        if self.tolerance is not None:
            freeze(self, "tolerance", np.float64, (segments + 1,))


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class PriceList:
    """The prices of limits and tolerance: derivatives of the cycle time T, negative where more saves.

    limits    : dT/d(axis limit) by name, "velocity.x" ... "jerk.z" [s per mm/s, mm/s2, mm/s3]; of limits of
                one's own dT/d(least bound on the path), in their own units, with the bound elsewhere in
                proportion
    feed      : dT/d(ln feed override) [s]
    tolerance : dT/d(tolerance) [s/mm]; None where it is not known
    saved     : time saved by `MORE_LIMIT` more of limits and feed, `MORE_TOLERANCE` more "tolerance" [s]
    ranges    : least and most time that a new plan may save [s]
    hints     : names whose saving is told by its range only; `saved` is its middle, and a hint only
    corners   : the corners with the largest savings; None where they are not known
    places    : the same by place, as straight lines foretell it; None where it is not known
    """

    limits: dict[str, float]
    feed: float
    tolerance: float | None
    saved: dict[str, float]
    corners: DearCorners | None
    ranges: dict[str, tuple[float, float]] = field(default_factory=dict)
    hints: tuple[str, ...] = ()
    places: PlacePrices | None = None

    def __repr__(self) -> str:
        """The largest savings, in a line."""
        most = ", ".join(f"{name} {saved:.3g} s" for name, saved in self.ranked()[:PRICES_SHOWN])
        return f"<PriceList: more would save {most or 'nothing'}>"

    def ranked(self) -> list[tuple[str, float]]:
        """Names and what `MORE_LIMIT` or `MORE_TOLERANCE` more saves [s], the largest saving first."""
        worth = [(name, saved) for name, saved in self.saved.items() if saved >= SAVED_MIN]
        return sorted(worth, key=lambda entry: -entry[1])
