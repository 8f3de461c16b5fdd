"""Rotary angles from directions of the tool, and the pole.

A direction has two pairs of angles (`Chain.angles`), each up to full turns of c. Along a path of directions
the pairs are chosen that move the axes least in the sum of all steps (Viterbi over the two pairs; c always
the shortest way).

At the pole, tilt 0 or pi, the direction does not depend on c. Within e of it any c leaves the direction
within 2 e of the right one; with e half of the angular tolerance c is free there, and goes at an even rate
from where it was before the pole to where it has to be behind it. Closer passages are smooth in this way,
others turn c as far as the directions ask. Between two points the axes move in proportion; where the
direction then leaves the plane of the two directions by more than the tolerance, which happens near the pole
alone, the path has too few points for the machine, and is refused with the place.
"""

from collections.abc import Sequence

import numpy as np

from planner.base.arrays import FloatArray
from planner.base.errors import InputError
from planner.base.units import RAD_PER_DEG
from planner.machine.kinematics.chain import Chain

LOOKED_AT = np.linspace(0.0, 1.0, 9)[1:-1]  # places between two points where directions are compared [-]
PARALLEL = 1e-12  # below this sine two directions are the same, and have no plane [-]


def rotary_along(
    chain: Chain, directions: FloatArray, tolerance: float, lines: Sequence[int] | None = None
) -> FloatArray:
    """(n, 2) tilt and c for tool directions (n, 3), not of length 0 [rad]; module text.

    tolerance : of the direction, above 0 [rad]
    lines     : of the program, of each direction, for messages

    Raises InputError for other arrays, and where the path passes the pole too fast for its points.
    """
    given = np.asarray(directions, dtype=np.float64)
    if given.ndim != 2 or given.shape[1] != 3 or not len(given) or not np.isfinite(given).all():
        raise InputError(f"directions: shape {given.shape}; (n, 3) finite numbers are needed")
    if not tolerance > 0.0:
        raise InputError(f"tolerance of the direction: {tolerance:g} rad; it must be above 0")
    size = np.linalg.norm(given, axis=1)
    if not (size > 0.0).all():
        raise InputError(f"directions: row {int(size.argmin()) + 1} has no length")
    unit = given / size[:, None]
    angles = _least_motion(chain.angles(unit), 0.5 * tolerance)
    _check_between(chain, angles, unit, tolerance, lines)
    return angles


def _least_motion(pairs: FloatArray, free: float) -> FloatArray:
    """(n, 2) one of the pairs (n, 2, 2) each; c is free where |sin(tilt)| is up to `free`."""
    count = len(pairs)
    at_pole = np.abs(np.sin(pairs[:, :, 0])) <= free
    chosen = pairs.copy()
    cost, before = np.array([0.0, 1e-9]), np.zeros((count, 2), dtype=np.int64)  # of equals the first
    for n in range(1, count):
        found, ways = np.full(2, np.inf), []
        for k in range(2):
            for j in range(2):
                old, new = chosen[n - 1, j], pairs[n, k].copy()
                new[1] = old[1] if at_pole[n, k] else _nearest(new[1], old[1])
                step = cost[j] + float(np.abs(new - old).max())
                if step < found[k]:
                    found[k], best, at = step, j, new
            before[n, k] = best
            ways.append(at)
        chosen[n] = ways
        cost = found
    angles, k = np.empty((count, 2)), int(cost.argmin())
    for n in reversed(range(count)):
        angles[n], k = chosen[n, k], int(before[n, k])
    pole = np.abs(np.sin(angles[:, 0])) <= free
    if pole.any() and not pole.all():
        place = np.arange(count)
        angles[pole, 1] = np.interp(place[pole], place[~pole], angles[~pole, 1])
    return angles


def _nearest(angle: float, to: float) -> float:
    return float(angle + 2.0 * np.pi * np.round((to - angle) / (2.0 * np.pi)))


def _check_between(
    chain: Chain, angles: FloatArray, unit: FloatArray, tolerance: float, lines: Sequence[int] | None
) -> None:
    """Raise InputError where the axes take the tool out of the plane of two directions."""
    tilt, turn = chain.data.rotary
    normal = np.cross(unit[:-1], unit[1:])
    sine = np.linalg.norm(normal, axis=1)
    plane = sine > PARALLEL
    normal[plane] /= sine[plane, None]
    for share in LOOKED_AT:
        between = angles[:-1] + share * np.diff(angles, axis=0)
        seen = np.stack(chain.direction({tilt: between[:, 0], turn: between[:, 1]}), axis=1)
        away = np.where(
            plane,
            np.arcsin(np.clip(np.abs((seen * normal).sum(axis=1)), 0.0, 1.0)),
            np.arccos(np.clip((seen * unit[:-1]).sum(axis=1), -1.0, 1.0)),
        )
        if (away > tolerance).any():
            n = int(away.argmax())
            where = f"line {lines[n + 1]}" if lines is not None else f"direction {n + 2}"
            swing = abs(angles[n + 1, 1] - angles[n, 1]) / RAD_PER_DEG
            closest = np.abs(np.sin(angles[n : n + 2, 0])).min() / RAD_PER_DEG
            raise InputError(
                f"{where}: near the pole, {closest:.3g} deg from it, c turns by {swing:.4g} deg in one move and takes the tool "
                f"{away[n] / RAD_PER_DEG:.3g} deg from its direction, with {tolerance / RAD_PER_DEG:.3g} deg allowed; "
                "give more points there, a larger tolerance_angle, or tilt the workpiece"
            )
