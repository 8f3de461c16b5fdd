"""The threading cycle G76 of Fanuc and Haas lathes: from its words to passes.

The thread runs from the start S = (z_S, x_S) to the root E = (z_E, x_E), x in radii; s = sign(x_S - x_E) points away from it and
t = sign(z_E - z_S) along it. A pass of depth c below the crest, x_E + s k, cuts at x_E + s (k - c), from z_S + t c tan(a / 2): with the
angle a of the tool it advances along the flank. A taper i moves the beginning of the cut by i. The depths are

    c_n = max(d sqrt(n), c_(n-1) + d_min)  while below k - r,    then k - r, then k, as often as the cycle says

so that every pass takes the same section of chip. A chamfer of length g leaves the thread at 45 degrees before z_E.

Sources: Haas' description of G76 (haascnc.com); the two-block format as in Fanuc's operator's manuals for series 0i-T.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

PASSES_MAX = 10_000  # of a thread: more are a mistake in its depths


class ThreadFault(ValueError):
    """The words of a thread contradict each other; the text says how."""


@dataclass(frozen=True)
class LatheThread:
    """A thread; lengths in mm, x as radii.

    start, end : (z, x) where the tool stands, and the root at the thread's end
    height     : k, from the crest to the root;  first : d;  least : d_min;  finish : r
    lead       : of a turn, along the longer of z and x
    springs    : how often the full depth is cut
    angle      : of the tool [degrees];  taper : i, x at the beginning less x at the end;  chamfer : g
    """

    start: complex
    end: complex
    height: float
    first: float
    lead: float
    least: float = 0.0
    finish: float = 0.0
    springs: int = 1
    angle: float = 0.0
    taper: float = 0.0
    chamfer: float = 0.0


@dataclass(frozen=True)
class Pass:
    """A move of the cycle to `end` (z + i x): fast, or in step with the spindle, `pitch` along it in each turn."""

    end: complex
    pitch: float = 0.0


def lathe_depths(thread: LatheThread) -> Iterator[float]:
    """Depths of the passes below the crest [mm]."""
    left, n, depth = thread.height - thread.finish, 1, thread.first
    while depth < left * (1.0 - 1e-12):
        yield depth
        n += 1
        depth = max(thread.first * math.sqrt(n), depth + thread.least)
    if thread.finish > 0.0:
        yield left
    for _ in range(thread.springs):
        yield thread.height


def thread_passes(thread: LatheThread) -> Iterator[Pass]:
    """The moves of the cycle, from its start and back to it. Raises ThreadFault."""
    _require(thread)
    start, end = thread.start, thread.end
    out, ahead = (math.copysign(1.0, start.imag - end.imag), math.copysign(1.0, end.real - start.real))
    slope = math.tan(math.radians(thread.angle / 2.0))
    for depth in lathe_depths(thread):
        begin = start.real + ahead * depth * slope
        low = end.imag + out * (thread.height - depth)
        cut, leave = complex(begin, low + thread.taper), complex(end.real, low)
        along = leave - cut
        pitch = thread.lead * abs(along) / max(abs(along.real), abs(along.imag))
        yield Pass(complex(begin, start.imag))
        yield Pass(cut)
        if thread.chamfer > 0.0:
            leave -= along * (thread.chamfer / abs(along.real))
            yield Pass(leave, pitch)
            leave += complex(ahead, out) * thread.chamfer
            yield Pass(leave, thread.lead * math.sqrt(2.0))
        else:
            yield Pass(leave, pitch)
        yield Pass(complex(leave.real, start.imag))
    yield Pass(start)


def _require(thread: LatheThread) -> None:
    along = abs(thread.end.real - thread.start.real)
    if thread.start.imag == thread.end.imag or not along > 0.0:
        raise ThreadFault("a thread needs room in x and z between where the tool stands and X Z")
    if not 0.0 < thread.first <= thread.height or not 0.0 <= thread.finish < thread.height:
        raise ThreadFault(
            "the first depth and the finishing allowance of a thread lie between 0 and its height"
        )
    if thread.first + thread.finish > thread.height * (1.0 + 1e-12) and thread.finish:
        raise ThreadFault("the first depth and the finishing allowance of a thread are more than its height")
    if not thread.lead > 0.0 or not 1 <= thread.springs <= PASSES_MAX:
        raise ThreadFault("a thread needs a lead above 0 and at least one pass at its full depth")
    if not 0.0 <= thread.angle < 180.0 or not 0.0 <= thread.chamfer < along:
        raise ThreadFault("a thread's angle is 0 to 180 degrees, and its chamfer shorter than the thread")
    if thread.height > thread.first * math.sqrt(PASSES_MAX):
        raise ThreadFault(f"the thread makes more than {PASSES_MAX} passes")
    if abs(thread.start.imag - thread.end.imag) < thread.height:
        raise ThreadFault("the tool stands below the thread's crest: between X and X plus its height")
