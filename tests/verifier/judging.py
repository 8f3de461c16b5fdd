"""What the tests of faults share: a square, its verdict, the one fault."""

import numpy as np
from motions import Asked, Moves, along, helix, machine, rest_to_rest, sample

from planner.base.kernels import njit  # not numba's, which would choose another processor for all kernels
from planner.verifier import verify
from planner.verifier.pieces import reach_piece

M = machine()
COLUMNS = ("t", "position", "velocity", "acceleration", "jerk", "s", "feed", "block", "line")
SQUARE = [(0, 0, 0), (10, 0, 0), (10, 10, 0), (0, 10, 0), (0, 20, 0)]


def square(**more):
    moves = Moves(SQUARE[0])
    for p in SQUARE[1:]:
        moves.line(*p, **more)
    return moves.toolpath(M)


def judge(motion, toolpath, machine=M, **more):
    """The verdict on delivered samples, and on the motion between them."""
    asked = Asked(motion, machine.dt)
    return verify(sample(motion, machine.dt), toolpath, machine, motion=asked, **more)


def fault(verdict, begins):
    """The sentence of the first fault that begins so; what its record knows stands in it."""
    assert not verdict.passed
    found = [each for each in verdict.faults if str(each).startswith(begins)]
    assert found, verdict.faults
    record, text = found[0], str(found[0])
    assert record.line is None or f"line {record.line}" in text
    assert record.time is None or f"{record.time:.6g} s" in text or "not at rest" in text
    assert record.ratio is None or record.ratio > 1.0
    return text


@njit(cache=True)
def distance_from(pieces, i, q):
    """How far a point q (3,) is from piece i [mm]."""
    return reach_piece(pieces, i, q, 0.0)[2]


def full_circle(start=(10.0, 0, 0), center=(0, 0), sweep=2 * np.pi, feed=50.0):
    length, curve = helix(start, center, sweep)
    return along(length, curve, rest_to_rest(length, feed, 500.0, 1e5))
