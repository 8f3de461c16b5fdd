"""How two corners share the leg between them: d_i + d_{i+1} <= L, fairly and symmetrically.

Half the leg to each is wasteful: a corner that needs little leaves nothing to its neighbour. The corner speed
at a given normal acceleration is v^2 ~ d * g with g = cos^2(theta/2) / sin(theta/2) (eq. (17)), so a leg that
is too short is cut where both of its corners would be equally fast: d_i g_i = d_{i+1} g_{i+1}, the sharp
corner getting more. What a corner then cannot use, because its tolerance or its other leg stops it, goes to
the neighbour in a few rounds. Every round treats both ends alike, so reversing the path reverses the result;
every round keeps all legs feasible, so stopping early is safe.
"""

import numpy as np

from planner.base.arrays import FloatArray

# Rounds of handing over what is left. On a chain the rest shrinks by about half a round; 12 leave 2e-4 of it.
ROUNDS = 12


def share_legs(wanted: FloatArray, ease: FloatArray, length: FloatArray) -> FloatArray:
    """Tangent lengths d (R+1,) [mm] with d <= wanted and d_i + d_{i+1} <= length_i.

    wanted : (R+1,) what each corner would like [mm]; 0 where there is no corner
    ease   : (R+1,) g of each corner [-], > 0
    length : (R,) leg lengths [mm]
    """
    if not len(length):
        return wanted.copy()
    need = np.where(wanted > 0, 1.0 / ease, 0.0)  # what a corner needs per unit of v^2
    both = need[:-1] + need[1:]
    left = np.divide(need[:-1], both, out=np.zeros_like(both), where=both > 0)
    right = np.divide(need[1:], both, out=np.zeros_like(both), where=both > 0)
    d = np.zeros_like(wanted)
    for _ in range(ROUNDS):
        free = np.maximum(length - d[:-1] - d[1:], 0.0)
        # what a corner could still use: its wish, and what its legs have left
        can = np.maximum(wanted - d, 0.0)
        can[:-1] = np.minimum(can[:-1], free)
        can[1:] = np.minimum(can[1:], free)
        grow = can.copy()
        grow[:-1] = np.minimum(grow[:-1], _claim(free, left, can[1:]))
        grow[1:] = np.minimum(grow[1:], _claim(free, right, can[:-1]))
        d += grow
    return d


def _claim(free: FloatArray, fraction: FloatArray, other_can: FloatArray) -> FloatArray:
    """The share of one end in the free length (R,): its fraction, or what the other cannot use [mm]."""
    return np.maximum(free * fraction, free - other_can)
