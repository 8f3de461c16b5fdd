"""Judging a delivered motion by other code than that which made it.

`verify` sees the programmed path, the machine and the delivered samples, and nothing else of the package: no sampling of the
path, no constraint, no solver. What it checks, and how sharp each check is:

    limits.py     velocity, acceleration, jerk per axis, feed, normal acceleration: on the columns and on differences of the
                  delivered positions
    matching.py   contour, vertices, order, completeness, stops and dwells: an in-order matching of motion and path
    pieces.py     the programmed path, laid out for the matching
    ringing.py    what the machine's vibration modes do
    verdict.py    the records that come out
    judge.py      `verify` itself

The positions are the truth; `Trajectory.block`, `line`, `s` and `feed` are never looked at.
"""

from planner.verify.judge import verify
from planner.verify.ringing import Ringing
from planner.verify.verdict import LimitCheck, Verdict

__all__ = ["LimitCheck", "Ringing", "Verdict", "verify"]
