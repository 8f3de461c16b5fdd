"""The command through both filters: the motion itself, exact, in pieces of constant jerk.

With w(t) the commanded velocity the filtered jerk is (docs/papers.md, universal identity)

    j(t) = [w(t) - w(t - T2) - w(t - T1) + w(t - Td)] / (T1 T2),

constant but where an edge of the command (w jumps by Dw at t_e) is 0, T2, T1 or Td old. Between such times
the motion is integrated exactly. So that nothing adds up over a long program, it is set anew every now and
then, and where all filters have the same input, by superposition of the edges that still have an effect, on
what the step that was commanded Td ago contributes by itself:

    p = p_e + w_e (t - t_e - Td/2) + sum Dw R(t - t_e),    v = w_e + sum Dw S(t - t_e),    a = sum Dw h(t - t_e).
"""

from typing import NamedTuple

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.kernels import njit
from planner.baselines.fir.command import Command
from planner.geometry.toolpath import Toolpath
from planner.motion.axis_motion import AxisMotion

# Shorter pieces are left out, the jerk is that behind [s]: the order of edges that close is rounding.
SHORTEST_PIECE = 1e-12
# Pieces from one superposition to the next, at least; or twice the edges that it sums [-].
ANCHOR_EVERY = 32


class Filtered(NamedTuple):
    """L pieces of constant jerk, over the A axes and the guide (column A), in S runs."""

    t: FloatArray  # (L,) start of each piece [s]
    ends: FloatArray  # (L,) end of each piece [s]
    # (4, L, A+1) position [mm], velocity [mm/s], acceleration [mm/s2] there, and jerk [mm/s3]
    state: FloatArray
    first: Array  # (S+1,) first piece of each run

    @property
    def begin(self) -> FloatArray:
        """(S,) start of each run [s]."""
        return self.t[self.first[:-1]]


def superpose(command: Command) -> Filtered:
    """Filter a command: the motion behind T1 and T2 of each run, exact."""
    most = 4 * len(command.t) + len(command.begin)
    t, state = np.empty(most), np.empty((4, most, command.velocity.shape[1]))
    first = np.zeros(len(command.begin) + 1, np.int64)
    n = _superpose(command, t, state, first)
    ends = np.append(t[1:n], command.end[-1])
    return Filtered(t[:n], ends, state[:, :n].copy(), first)


def reached(motion: Filtered) -> FloatArray:
    """(P,) how far the middle of each piece has come along the guide, its last column [mm]."""
    middle, (s, v, a, j) = (motion.ends + motion.t) / 2 - motion.t, motion.state[:, :, -1]
    return np.asarray(s + middle * (v + middle * (a / 2 + middle * j / 6)))


def axes_of(
    motion: Filtered, segment: Array, first: int, toolpath: Toolpath, start: FloatArray
) -> AxisMotion:
    """The axes of a filtered motion of P pieces, a standstill before the first move included.

    segment : (P,) of the toolpath, that each piece belongs to
    first   : the segment that a standstill before the first move belongs to
    start   : (A,) where that is [mm]
    """
    t, state = motion.t, motion.state[:, :, :-1]
    if t[0] > 0:
        t, segment = np.insert(t, 0, 0.0), np.insert(segment, 0, first)
        state = np.insert(state, 0, 0.0, axis=1)
        state[0, 0] = start
    return AxisMotion.of(state, t, float(motion.ends[-1]), toolpath, segment)


@njit(cache=True, error_model="numpy")
def _superpose(command, t_out, state, first_out):
    """Filter all runs; returns the number of pieces."""
    t, velocity = command.t, command.velocity
    axes = velocity.shape[1]
    now = np.zeros((4, axes))  # position, velocity, acceleration, jerk
    n = 0
    for k in range(len(command.begin)):
        low, high, T1, T2 = command.first[k], command.first[k + 1], command.T1[k], command.T2[k]
        age = (0.0, T2, T1, T1 + T2)
        passed = np.full(4, low)  # edges before passed[m] are at least age[m] old
        at, since, emitted = 0.0, ANCHOR_EVERY, -1.0
        first_out[k] = n
        while passed[3] < high:
            after = np.inf
            for m in range(4):
                if passed[m] < high:
                    after = min(after, t[passed[m]] + age[m])
            h = after - at
            for c in range(axes):
                now[0, c] += h * (now[1, c] + h * (now[2, c] / 2.0 + h * now[3, c] / 6.0))
                now[1, c] += h * (now[2, c] + h * now[3, c] / 2.0)
                now[2, c] += h * now[3, c]
            at, short = after, emitted >= 0.0 and after - emitted < SHORTEST_PIECE
            for m in range(4):
                while passed[m] < high and t[passed[m]] + age[m] <= at:
                    passed[m] += 1
            since += 1
            if passed[0] == passed[3] or since >= max(ANCHOR_EVERY, 2 * (passed[0] - passed[3])):
                _anchor(command, k, passed, at, now)
                since = 0
            for c in range(axes):
                now[3, c] = 0.0
                for m in range(4):
                    if passed[m] > low:
                        sign = 1.0 if m == 0 or m == 3 else -1.0
                        now[3, c] += sign * velocity[passed[m] - 1, c]
                now[3, c] /= T1 * T2
            if short:
                n -= 1
            if passed[3] < high:
                for c in range(axes):
                    state[3, n, c] = now[3, c]
                    if short:  # or what its jerk adds to the acceleration would be missing up to the next superposition
                        state[2, n, c] = now[2, c] - now[3, c] * (at - emitted)
                if not short:
                    t_out[n], emitted = command.begin[k] + at, at
                    for m in range(3):
                        for c in range(axes):
                            state[m, n, c] = now[m, c]
                n += 1
        if command.dwell[k] > 0.0:
            t_out[n] = command.begin[k] + at
            state[0, n], state[1:, n] = command.position[high - 1], 0.0
            n += 1
    first_out[len(command.begin)] = n
    return n


@njit(cache=True, error_model="numpy")
def _anchor(command, k, passed, at, now):
    """Position, velocity and acceleration at `at` by superposition, into now; passed (4,): edges 0, T2, T1, Td old."""
    t, velocity, position = command.t, command.velocity, command.position
    low, T1, T2 = command.first[k], command.T1[k], command.T2[k]
    axes, delay, base = velocity.shape[1], T1 + T2, passed[3] - 1
    for c in range(axes):
        now[0, c], now[1, c], now[2, c] = position[low, c], 0.0, 0.0
        if base >= low:
            now[1, c] = velocity[base, c]
            now[0, c] = position[base, c] + now[1, c] * (at - t[base] - delay / 2.0)
    for e in range(passed[3], passed[0]):
        x = at - t[e]
        if e < passed[2]:
            rest = max(delay - x, 0.0)
            h, s = rest / (T1 * T2), 1.0 - rest * rest / (2.0 * T1 * T2)
            r = x - delay / 2.0 + rest**3 / (6.0 * T1 * T2)
        elif e < passed[1]:
            h, s = 1.0 / T1, (2.0 * x - T2) / (2.0 * T1)
            r = (3.0 * x * x - 3.0 * T2 * x + T2 * T2) / (6.0 * T1)
        else:
            h, s, r = x / (T1 * T2), x * x / (2.0 * T1 * T2), x**3 / (6.0 * T1 * T2)
        for c in range(axes):
            step = velocity[e, c] - (velocity[e - 1, c] if e > low else 0.0)
            now[0, c] += step * r
            now[1, c] += step * s
            now[2, c] += step * h
