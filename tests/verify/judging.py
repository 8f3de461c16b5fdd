"""What the tests of faults share: a square, its verdict, the one fault."""

import numpy as np
from motions import Asked, Moves, along, helix, machine, rest_to_rest, sample
from numba import njit

from planner.verify import verify
from planner.verify.pieces import reach_piece

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
    """The one fault that begins so."""
    assert not verdict.passed
    found = [text for text in verdict.faults if text.startswith(begins)]
    assert found, verdict.faults
    return found[0]


@njit
def distance_from(pieces, i, q):
    """How far a point q (3,) is from piece i [mm]."""
    return reach_piece(pieces, i, q, 0.0)[2]


def full_circle(start=(10.0, 0, 0), center=(0, 0), sweep=2 * np.pi, feed=50.0):
    length, curve = helix(start, center, sweep)
    return along(length, curve, rest_to_rest(length, feed, 500.0, 1e5))
