"""What LinuxCNC is given: the program's own words or the planned path, whichever a model of its planner finds faster.

Candidates are the program as it is, with G64 P of the whole tolerance, or with half of it for P and half for Q, which joins short
moves; and the planned path as chords, with G64 P for the room that they leave. The model (linuxcnc_model.py) was off by -2.1 to
+0.9 % on programs like these, so another candidate than the first is taken only where it is predicted to be faster by more than
`MARGIN`. A program that says its path mode keeps it, and its own path.
"""

from __future__ import annotations

import dataclasses
import re

import numpy as np

from planner.base.arrays import FloatArray
from planner.base.units import MICROMETRE
from planner.controls.export.candidates import Candidate, Candidates, standing
from planner.controls.export.chords import Polyline
from planner.controls.export.linuxcnc_model import joined_moves, linuxcnc_time
from planner.controls.export.source import text_of

NAME = "linuxcnc"
SHARES = (0.6, 0.3, 0.1, 0.02)  # of the room for chords; the rest is P
FINEST = 2e-4  # chords closer than this [mm] are held up by the rounding of coordinates: 0.1 um of them made it 10 % slower
ROUND_MIN = 1e-3  # P below this [mm]: the model was up to 9 % too fast
OWN_CHORDS = 0.02  # share of the tolerance for chords on arcs of the program, for the model
MARGIN = 0.02  # of the predicted time: the model's error, see above
PATH_MODE = re.compile(rb"G\s*6\s*[14]", re.IGNORECASE)


def candidates(job: Candidates) -> list[Candidate]:
    """What LinuxCNC might be given, the program's own path first."""
    tolerance, room = job.tolerance, job.room or 0.0
    (own,) = job.own(OWN_CHORDS * tolerance)
    text = text_of(job.plan.program)
    if text is not None and PATH_MODE.search(text):
        return [dataclasses.replace(own, name=f"{own.name}, with its own path mode")]
    found = []
    for name, p, q in (
        (own.name, tolerance, 0.0),
        (f"{own.name}, short moves joined", 0.5 * tolerance, 0.5 * tolerance),
    ):
        chords = (
            0.0
            if own.replaced is None or not own.replaced.any() or own.line.miss == 0.0
            else OWN_CHORDS * tolerance
        )
        p -= chords
        one = dataclasses.replace(own, name=name, mode=_mode(p, q))
        found.append(one.at(_time(job, own.line, p, q)))
    for share in SHARES:
        if share * room < FINEST or (1.0 - share) * room < ROUND_MIN:
            continue
        p = (1.0 - share) * room
        for one in job.chords(
            share * room, f"planned path, chords within {share * room / MICROMETRE:.3g} µm"
        ):
            found.append(dataclasses.replace(one, mode=_mode(p, 0.0)).at(_time(job, one.line, p, 0.0)))
    return found


def best_first(found: list[Candidate]) -> list[Candidate]:
    """The candidates, the first in front unless another is predicted to be faster by more than the model's error."""
    fastest = min(found, key=lambda one: one.time)
    first = fastest if fastest.time < (1.0 - MARGIN) * found[0].time else found[0]
    return [first, *(one for one in found if one is not first)]


def _mode(p: float, q: float) -> str:
    return "G64 P{:.4f} Q{:.4f}".format(*(np.floor(value * 1e4 + 1e-6) / 1e4 for value in (p, q)))


def _time(job: Candidates, line: Polyline, p: float, q: float) -> float:
    """Predicted time, dwells included [s]."""
    plan = job.plan
    stands = standing(plan, line)
    feed: FloatArray = np.where(line.rapid, np.inf, line.feed)
    kept = joined_moves(line.points, feed, line.rapid, stands, q)
    moving = linuxcnc_time(
        line.points[kept], feed[kept[:-1]], stands[kept], plan.machine, plan.toolpath.axes, p
    )
    return moving + float(plan.toolpath.dwell.sum())
