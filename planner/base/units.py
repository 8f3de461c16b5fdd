"""Units and symbols: all in mm, s, rad; conversions happen only at the edges, with the names below.

s         arc length along the path [mm]            feed      ds/dt [mm/s]
feed_sq   feed squared [mm2/s2]                     acc_s     d2s/dt2 [mm/s2]
jerk_s    d3s/dt3 [mm/s3]                           kappa     curvature [1/mm]
theta     turning angle at a corner [rad], 0 = straight on, pi = reversal
tol_*     a part of the contour error budget [mm]   dt        interpolation period [s]
*_max     a limit      *_grid  sampled along s      *_t       sampled in time      *_sq  squared
"""

import math
import re

MM_PER_INCH = 25.4  # by definition
# Of F words [mm/min] and of angles in files [deg].
SECONDS_PER_MINUTE = 60.0
RAD_PER_DEG = math.pi / 180.0
MICROMETRE = 1e-3  # [mm]
MILLISECOND = 1e-3  # [s]
_QUANTITY = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(.*?)\s*")


def number_and_unit(text: str) -> tuple[str, str] | None:
    """The number that a text begins with, as it is written, and what stands behind it; None for none."""
    found = _QUANTITY.fullmatch(text)
    return None if found is None else (found[1], found[2])
