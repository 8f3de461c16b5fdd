"""Where a motion is nearest to a vertex, from one time at which it was looked at to the next.

Where it runs on cubics there (between.py), p the way from the vertex, its distance falls or rises with

    f  =  p . p'  =  c0 + c1 x + ... + c5 x^5,        x = 0 to 1 over a cubic:

a place is nearest where f goes from below 0 to above, or at an end. Where c1 > |2 c2| + ... + |5 c5| there is but one such
place; else each of `PARTS` parts is looked at by itself. With g = p'^2 + p.p'' over v^2 there, v the speed, it is known to

    reach  =  sqrt( 2 (d + e) e / g )  +  2 (dp + d dv / v) / g        at the distance d,

the first for the rounding e of distances, the second for motions that are no cubics: the cubics of both ends stand for them, to
half of the time or to where a piece of the motion ends; over h, what these differ by there is dv, and dp = |x - x'| + h dv / 8.

Where only the ends are known the chord stands for the motion, which with |acceleration| <= a is within b = a h^2 / 8 of it, and
within a sine of r = (3/2) a h / w of its direction, w its mean speed (3/2 h is the farthest that the nearest places of both can be
apart, since the ends are exact). A nearest place has its direction across that to the vertex, so that it is at most

    reach  =  min( (d + b) r / (1 - r),  8 (d + b),  2 h (w + a h) )

away along the motion. The second is for slow motions, which may turn by any angle (r >= 1): the nearest places of both are at most
d + b from the vertex, and 2 (d + b) apart; the way between them is taken as at most four times that.
"""

import math

from planner.verifier.kernel import kernel
from planner.verifier.pieces import PLACE_ROUNDING

PARTS = 32  # of a cubic on which f may have several zeros
HALVED = 52  # times that a part is halved with a zero in it: to the last digit of x
FEED_AT_REST = 1e-6  # [mm/s] below it the direction of a velocity is rounding
AROUND = 8.0  # way between the nearest places of motion and chords, of their distance from the vertex (module text) [-]


@kernel(inline=True)
def _rise(c, x):
    """f at x."""
    return c[0] + x * (c[1] + x * (c[2] + x * (c[3] + x * (c[4] + x * c[5]))))


@kernel()
def nearest(vertex, ends, cut, h):
    """Least distance d of a motion from a vertex (A,) over h [s], which share of the chord is run there, its g and v.

    ends : (2, 4, A) position, velocity, acceleration and jerk at both ends
    cut  : how long the cubic of the first one lasts [s]; that of the last one is run from there on. NaN where only the
           positions are known: then of the chord, and g is 0
    """
    along, length_sq = 0.0, 0.0
    for k in range(len(vertex)):
        move = ends[1, 0, k] - ends[0, 0, k]
        along += (vertex[k] - ends[0, 0, k]) * move
        length_sq += move * move
    share, least, sharp, pace = min(max(along / length_sq, 0.0), 1.0), 0.0, 0.0, 0.0
    if math.isnan(cut):
        for k in range(len(vertex)):
            least += (ends[0, 0, k] + share * (ends[1, 0, k] - ends[0, 0, k]) - vertex[k]) ** 2
        return math.sqrt(least), share, sharp, pace
    least = math.inf
    for side in range(2):
        # outwards from the end of the side, on the last one backwards in time
        way, span = (1.0, cut) if side == 0 else (-1.0, h - cut)
        if span <= 0.0:
            continue
        c0, c1, c2, c3, c4, c5 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for k in range(len(vertex)):
            d, v = ends[side, 0, k] - vertex[k], way * span * ends[side, 1, k]
            a, j = span * span * ends[side, 2, k], way * span**3 * ends[side, 3, k]
            c0, c1, c2 = c0 + d * v, c1 + v * v + d * a, c2 + (3.0 * v * a + d * j) / 2.0
            c3, c4, c5 = c3 + a * a / 2.0 + v * j / 1.5, c4 + a * j / 2.4, c5 + j * j / 12.0
        c = (c0, c1, c2, c3, c4, c5)
        more = 2.0 * abs(c2) + 3.0 * abs(c3) + 4.0 * abs(c4) + 5.0 * abs(c5)
        parts = 1 if c1 > more else PARTS
        for part in range(parts + 1):
            low = high = part / parts
            if part < parts and _rise(c, low) < 0.0 < _rise(c, (part + 1) / parts):
                high = (part + 1) / parts
                for _ in range(HALVED):
                    middle = 0.5 * (low + high)
                    low, high = (middle, high) if _rise(c, middle) < 0.0 else (low, middle)
            x, square, v_sq, push, run = span * high, 0.0, 0.0, 0.0, 0.0
            for k in range(len(vertex)):
                v, a, j = way * ends[side, 1, k], ends[side, 2, k], way * ends[side, 3, k]
                p = ends[side, 0, k] - vertex[k] + x * (v + x * (a / 2.0 + x * j / 6.0))
                v, a = v + x * (a + x * j / 2.0), a + x * j
                square, v_sq, push = square + p * p, v_sq + v * v, push + p * a
                run += (p + vertex[k] - ends[0, 0, k]) * (ends[1, 0, k] - ends[0, 0, k])
            if square < least:
                least, share = square, min(max(run / length_sq, 0.0), 1.0)
                sharp, pace = 1.0 + push / v_sq if v_sq > 0.0 else 1.0, math.sqrt(v_sq)
    return math.sqrt(least), share, sharp, pace


@kernel()
def reach_of(found, ends, cut, h, acceleration, rounding):
    """How far the nearest place of a motion can be from what `nearest` has `found` between two ends [mm].

    ends, cut, h : (2, 4, A), [s], [s] as there
    acceleration : norm of the largest one [mm/s2], inf if not judged
    rounding     : of positions [mm]
    """
    apart, _, sharp, pace = found
    step, off, change = 0.0, 0.0, 0.0
    for k in range(ends.shape[2]):
        step += (ends[1, 0, k] - ends[0, 0, k]) ** 2
        where, speed = 0.0, 0.0
        for side in range(2):
            way, x = (1.0, cut) if side == 0 else (-1.0, cut - h)
            p, v, a, j = ends[side, 0, k], ends[side, 1, k], ends[side, 2, k], ends[side, 3, k]
            where += way * (p + x * (v + x * (a / 2.0 + x * j / 6.0)))
            speed += way * (v + x * (a + x * j / 2.0))
        off, change = off + where * where, change + speed * speed
    step, off, change = math.sqrt(step), math.sqrt(off), math.sqrt(change)
    if not math.isfinite(acceleration):
        reach = 4.0 * step
    else:
        push = acceleration * h
        turn, near = 1.5 * push * h / step, apart + push * h / 8.0
        reach = min(AROUND * near, 2.0 * (step + push * h))
        if turn < 1.0:
            reach = min(reach, near * turn / (1.0 - turn))
    if sharp > 0.0:
        own = off + h * change / 8.0 + apart * change / max(pace, FEED_AT_REST)
        reach = min(reach, math.sqrt(2.0 * (apart + rounding) * rounding / sharp) + 2.0 * own / sharp)
    return reach


@kernel(inline=True)
def reach_with_rounding(near, ends, chord, acceleration):
    """`reach_of` on a chord (switches.py), with all rounding [mm]."""
    own = reach_of(near, ends, chord["cut"], chord["h"], acceleration, chord["error"])
    return own + chord["error"] + PLACE_ROUNDING
