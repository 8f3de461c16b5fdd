"""Judging a delivered motion by other code than that which made it.

`verify` (judge.py) sees the programmed path, the machine, the delivered samples and, between them, the motion they were
taken from, at times that it chooses itself; and nothing else of the package: no sampling of the path, no constraint, no
solver. Every module says what it checks, and how sharp that is; claims.py says it of each figure.

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
