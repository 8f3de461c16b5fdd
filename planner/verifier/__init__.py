"""Judging a delivered motion by other code than that which made it.

`verify` sees the programmed path, the machine, the delivered samples and, between them, the motion they were
taken from, at times that it chooses itself; and nothing else of the package: no sampling of the path, no
constraint, no solver. What it checks, and how sharp each check is:

    reading.py    where it looks between the samples
    between.py    what lies between two of those times, where the motion is a cubic there: extremes, not samples
    claims.py     how each figure is known: exact, certified, sampled, assumed
    limits.py     velocity, acceleration, jerk per axis, normal acceleration: on the columns and on differences of the delivered
                  positions
    nearest.py    where a motion is nearest to a vertex, exactly where it runs on cubics
    switches.py   on which block the motion is: the F word of a block holds up to the place nearest to the vertex at its end
    passing.py    the record of that, and which chords need no look
    feed.py       the feed against the F word of that block, of every chord and every delivered speed
    worst.py      the worst of every quantity, and differences of positions
    tangential.py   the tangential acceleration and jerk
    power.py        the power of the drives
    user_limits.py  limits of the user that the machine came with, by their laws
    matching.py   contour, vertices, order, completeness: an in-order matching of motion and path
    stops.py      full stops, and how long they last
    contour.py    how far motion and path are apart, also where a motion was lost
    samples.py    periods, density and digits of the samples, their unit of time, rest at both ends
    given.py      what of a trajectory was delivered, and how exactly
    filtered.py   the motion behind the machine's filters, judged by the same matching
    pieces.py     the programmed path, laid out for the matching
    error_allocation.py
                  eq. 18 at every programmed corner, and the comparison with eq. 19 and 20, on the motion's
                  own curvature
    corners.py    the record of that
    excess.py     the kinds of faults, and the spans of time in which limits are exceeded
    exact.py      blocks under G61: the samples run along the path itself
    spindle_sync.py
                  threads: moves in step with the spindle
    extruder.py   what the extruder of a 3-D printer does
    joints.py     setpoints of the joints, with the tool centre point on
    rewritten.py  two programs: whether their paths and modes are the same within a distance
    ringing.py    what the machine's vibration modes do
    verdict.py    the records that come out
    judge.py      `verify` itself

The positions are the truth; `Trajectory.block`, `line`, `s` and `feed` are never looked at.
"""

from planner.verifier.claims import Claims, Known
from planner.verifier.corners import CornerCheck
from planner.verifier.excess import OF_CHORDS, Fault, Kind
from planner.verifier.given import DERIVATIVES, WHOLE, Given, fit_axes
from planner.verifier.joints import verify_joints
from planner.verifier.judge import NOT_LIMITED_NAMES, verify
from planner.verifier.rewritten import SamePath, same_path
from planner.verifier.ringing import Ringing
from planner.verifier.verdict import AfterFilters, LimitCheck, ThreadCheck, Verdict

__all__ = [
    "DERIVATIVES",
    "NOT_LIMITED_NAMES",
    "OF_CHORDS",
    "WHOLE",
    "AfterFilters",
    "Claims",
    "CornerCheck",
    "Fault",
    "Given",
    "Kind",
    "Known",
    "LimitCheck",
    "Ringing",
    "SamePath",
    "ThreadCheck",
    "Verdict",
    "fit_axes",
    "same_path",
    "verify",
    "verify_joints",
]
