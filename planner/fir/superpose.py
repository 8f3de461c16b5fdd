"""The command through both filters: the motion itself, exact, in pieces of constant jerk.

With w(t) the commanded velocity the filtered jerk is (docs/papers.md, universal identity)

    j(t) = [w(t) - w(t - T2) - w(t - T1) + w(t - Td)] / (T1 T2),

constant but where an edge of the command (w jumps by Dw at t_e) is 0, T2, T1 or Td old. Between such times the motion is integrated
exactly. So that nothing adds up over a long program, it is set anew every now and then, and where all filters have the same input,
by superposition of the edges that still have an effect, on what the interval that was commanded Td ago contributes by itself:

    p = p_e + w_e (t - t_e - Td/2) + sum Dw R(t - t_e),    v = w_e + sum Dw S(t - t_e),    a = sum Dw h(t - t_e).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planner.base.arrays import Array, FloatArray, freeze
from planner.base.kernels import njit
from planner.fir.command import Command

# Pieces shorter than this are left out, the jerk is that of the piece behind [s]: the order of edges that close is rounding.
SHORTEST_PIECE = 1e-12
# Pieces from one superposition to the next, at least; or twice the edges that it sums, so that its cost stays linear [-].
ANCHOR_EVERY = 32


@dataclass(frozen=True, eq=False, kw_only=True)
class Pieces:
    """L pieces of constant jerk, over the A axes and the course (column A), in S stretches.

    t            : (L,) start of each piece [s]
    position     : (L, A+1) there [mm]
    velocity     : (L, A+1) [mm/s]
    acceleration : (L, A+1) [mm/s2]
    jerk         : (L, A+1) on the piece [mm/s3]
    first        : (S+1,) first piece of each stretch
    end          : (S,) when each stretch is over, its dwell too [s]
    """

    t: FloatArray
    position: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    jerk: FloatArray
    first: Array
    end: FloatArray

    def __post_init__(self) -> None:
        pieces = len(self.t)
        freeze(self, "t", np.float64, (pieces,))
        for name in ("position", "velocity", "acceleration", "jerk"):
            freeze(self, name, np.float64, (pieces, None))
        freeze(self, "first", np.int64, (len(self.end) + 1,))
        freeze(self, "end", np.float64, (None,))

    def __len__(self) -> int:
        return len(self.t)


def superpose(command: Command) -> Pieces:
    """Filter a command."""
    most = 4 * len(command.t) + len(command.begin)
    t, state = np.empty(most), np.empty((4, most, command.velocity.shape[1]))
    first = np.zeros(len(command.begin) + 1, np.int64)
    for_all = (command.t, command.velocity, command.position)
    n = _superpose(
        *for_all, command.first, command.T1, command.T2, command.begin, command.dwell, t, state, first
    )
    return Pieces(
        t=t[:n],
        position=state[0, :n],
        velocity=state[1, :n],
        acceleration=state[2, :n],
        jerk=state[3, :n],
        first=first,
        end=command.end,
    )


@njit(cache=True, error_model="numpy")
def _superpose(t, velocity, position, first, T1, T2, begin, dwell, t_out, state, first_out):
    """Filter all stretches; returns the number of pieces."""
    axes = velocity.shape[1]
    now_p, now_v, now_a, now_j = np.zeros(axes), np.zeros(axes), np.zeros(axes), np.zeros(axes)
    n = 0
    for k in range(len(begin)):
        low, high = first[k], first[k + 1]
        age = (0.0, T2[k], T1[k], T1[k] + T2[k])
        passed = np.full(4, low)  # edges before passed[m] are at least age[m] old
        now, since, emitted = 0.0, ANCHOR_EVERY, -1.0
        first_out[k] = n
        while passed[3] < high:
            after = np.inf
            for m in range(4):
                if passed[m] < high:
                    after = min(after, t[passed[m]] + age[m])
            for c in range(axes):
                h = after - now
                now_p[c] += h * (now_v[c] + h * (now_a[c] / 2.0 + h * now_j[c] / 6.0))
                now_v[c] += h * (now_a[c] + h * now_j[c] / 2.0)
                now_a[c] += h * now_j[c]
            now, short = after, emitted >= 0.0 and after - emitted < SHORTEST_PIECE
            for m in range(4):
                while passed[m] < high and t[passed[m]] + age[m] <= now:
                    passed[m] += 1
            since += 1
            if passed[0] == passed[3] or since >= max(ANCHOR_EVERY, 2 * (passed[0] - passed[3])):
                _anchor(t, velocity, position, low, passed, T1[k], T2[k], now, now_p, now_v, now_a)
                since = 0
            for c in range(axes):
                now_j[c] = 0.0
                for m in range(4):
                    if passed[m] > low:
                        sign = 1.0 if m == 0 or m == 3 else -1.0
                        now_j[c] += sign * velocity[passed[m] - 1, c]
                now_j[c] /= T1[k] * T2[k]
            if short:
                n -= 1
            if passed[3] < high:
                for c in range(axes):
                    state[3, n, c] = now_j[c]
                if not short:
                    t_out[n], emitted = begin[k] + now, now
                    for c in range(axes):
                        state[0, n, c], state[1, n, c], state[2, n, c] = now_p[c], now_v[c], now_a[c]
                n += 1
        if dwell[k] > 0.0:
            t_out[n] = begin[k] + now
            for c in range(axes):
                state[0, n, c] = position[high - 1, c]
                state[1, n, c] = state[2, n, c] = state[3, n, c] = 0.0
            n += 1
    first_out[len(begin)] = n
    return n


@njit(cache=True, error_model="numpy")
def _anchor(t, velocity, position, low, passed, T1, T2, now, now_p, now_v, now_a):
    """Position, velocity and acceleration at `now` by superposition; passed (4,): edges that are 0, T2, T1, Td old."""
    axes, delay = velocity.shape[1], T1 + T2
    base = passed[3] - 1
    for c in range(axes):
        now_p[c], now_v[c], now_a[c] = position[low, c], 0.0, 0.0
        if base >= low:
            now_v[c] = velocity[base, c]
            now_p[c] = position[base, c] + now_v[c] * (now - t[base] - delay / 2.0)
    for e in range(passed[3], passed[0]):
        x = now - t[e]
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
            now_p[c] += step * r
            now_v[c] += step * s
            now_a[c] += step * h
