"""What LinuxCNC is given: the program's own words or the planned path, whichever a model of its planner finds faster.

Candidates are the program as it is, with G64 P of the whole tolerance, or with half of it for P and half for Q, which joins short
moves; and the planned path as chords, with G64 P for the room that they leave. The model (linuxcnc_model.py) was off by -2.1 to
+0.9 % on programs like these, so another candidate than the first is taken only where it is predicted to be faster by more than
`MARGIN`. A program that says its path mode keeps it, and is written as it is.
"""

from __future__ import annotations

import os
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.errors import InputError
from planner.base.units import MICROMETRE
from planner.control_files.chords import Polyline, planned_polyline, programmed_polyline
from planner.control_files.linuxcnc_model import joined_moves, linuxcnc_time
from planner.job.plan import Plan
from planner.nc.points import are_points
from planner.nc.program import Program
from planner.nc.reader import parse_program
from planner.nc.reading import LINUXCNC, Reading

SHARES = (0.6, 0.3, 0.1, 0.02)  # of the room for chords; the rest is P
FINEST = 2e-4  # chords closer than this [mm] are held up by the rounding of coordinates: 0.1 um of them made it 10 % slower
ROUND_MIN = 1e-3  # P below this [mm]: the model was up to 9 % too fast
OWN_CHORDS = 0.02  # share of the tolerance for chords on arcs of the program, for the model
MARGIN = 0.02  # of the predicted time: the model's error, see above
PATH_MODE = re.compile(rb"G\s*6\s*[14]", re.IGNORECASE)


@dataclass(frozen=True, kw_only=True)
class Candidate:
    """A program that LinuxCNC might be given.

    name : as printed
    mode : its G64, or "" where the program has its own
    line : its moves; None for the program's own words
    time : predicted [s]
    """

    name: str
    mode: str
    line: Polyline | None
    time: float


def candidates(plan: Plan, tolerance: float, room: float, text: bytes | None) -> list[Candidate]:
    """What LinuxCNC might be given, the program as it is first.

    tolerance : of the path [mm]
    room      : what of it the plan leaves to chords and corners [mm]; none where there is no room
    text      : the program's own words; None where LinuxCNC would read them otherwise, and moves are written
    """
    if text is not None and PATH_MODE.search(text):
        return [Candidate(name="program as it is, with its own path mode", mode="", line=None, time=np.nan)]
    own = programmed_polyline(plan, OWN_CHORDS * tolerance)
    found = []
    for name, p, q in (
        ("program as it is", tolerance, 0.0),
        ("program as it is, short moves joined", 0.5 * tolerance, 0.5 * tolerance),
    ):
        p = p if text is not None or own.miss == 0.0 else p - OWN_CHORDS * tolerance
        line = own if text is None else None
        found.append(Candidate(name=name, mode=_mode(p, q), line=line, time=_time(plan, own, p, q)))
    for share in SHARES:
        if share * room < FINEST or (1.0 - share) * room < ROUND_MIN:
            continue
        line, p = planned_polyline(plan, share * room), (1.0 - share) * room
        name = f"planned path, chords within {share * room / MICROMETRE:.3g} um"
        found.append(Candidate(name=name, mode=_mode(p, 0.0), line=line, time=_time(plan, line, p, 0.0)))
    return found


def best(found: list[Candidate]) -> Candidate:
    """The first candidate, unless another is predicted to be faster by more than the model's error."""
    fastest = min(found, key=lambda one: one.time)
    return fastest if fastest.time < (1.0 - MARGIN) * found[0].time else found[0]


def own_words(program: Program, plan: Plan) -> bytes | None:
    """The program's text, if LinuxCNC reads it as it was read; None otherwise, and for points."""
    text = program.text
    if text is None and os.path.isfile(program.source):
        text = Path(program.source).read_bytes()
    if text is None or program.pen or are_points(text):
        return None
    try:
        reading = Reading(dialect=LINUXCNC, ignore=program.reading.ignore)
        again = parse_program(text, plan.machine, reading, source=program.source)
    except InputError:
        return None
    same = again.end.shape == program.end.shape and np.array_equal(again.kind, program.kind)
    same = same and np.allclose(again.end, program.end, rtol=0.0, atol=1e-9)
    return text if same and np.array_equal(again.feed, program.feed) else None


def with_mode(text: bytes, mode: str) -> bytes:
    """A program's text with its path mode on a line of its own, after the percent sign if it begins with one."""
    if not mode:
        return text
    head = re.match(rb"\s*%[^\n]*\n", text)
    cut = head.end() if head else 0
    return text[:cut] + b"G21 " + mode.encode("ascii") + b"\n" + text[cut:]


def _mode(p: float, q: float) -> str:
    return "G64 P{:.4f} Q{:.4f}".format(*(np.floor(value * 1e4 + 1e-6) / 1e4 for value in (p, q)))


def standing(plan: Plan, line: Polyline) -> Array:
    """(n+1,) the points of a polyline at which the program has the motion stand still."""
    stands = np.zeros(len(line.points), dtype=bool)
    still = np.flatnonzero(~np.isin(np.arange(len(plan.program)), plan.toolpath.block))
    stands[np.searchsorted(line.block, still)] = True
    return stands


def _time(plan: Plan, line: Polyline, p: float, q: float) -> float:
    """Predicted time, dwells included [s]."""
    stands = standing(plan, line)
    feed: FloatArray = np.where(line.rapid, np.inf, line.feed)
    kept = joined_moves(line.points, feed, line.rapid, stands, q)
    moving = linuxcnc_time(
        line.points[kept], feed[kept[:-1]], stands[kept], plan.machine, plan.toolpath.axes, p
    )
    return moving + float(plan.program.dwell.sum())
