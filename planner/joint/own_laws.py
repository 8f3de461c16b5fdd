"""The laws of a run (laws.py): which there are, and what a motion uses of them.

A limit of the user (machine/user_limit.py) bounds velocity, acceleration and jerk along the path, or of a
function q of the position. Its functions are Python, and no kernel calls them: what a search is told of them
is in law_window.py, and what it finds is looked at here, with the functions themselves.
"""

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.feedrate.constraints.limits import ACCELERATION, FEED, POWER, Limits
from planner.joint import laws as rows
from planner.machine.user_limit import (
    QUANTITIES,
    Moving,
    OwnLimit,
    Place,
    bounds_at,
    limit_derivatives,
)

# Where a step is looked at, and again where one of them shows more than `CLOSE` of a limit [-].
LOOKED, LOOKED_AGAIN, CLOSE = np.linspace(0.0, 1.0, 9), np.linspace(0.0, 1.0, 33), 0.9
PATH = (rows.SPEED, rows.PUSH, rows.JOLT)
JOINT = (rows.JOINT_SPEED, rows.JOINT_PUSH, rows.JOINT_JOLT)


class Law(NamedTuple):
    """A law of a run.

    name   : as it is printed, "feed" of the feed in the axes that F goes by
    kind   : of laws.py, as if a limit of the user were along the path
    counts : (A,) 1 for the axes of the run that count, else 0
    order  : slower by lam, a motion has 1/lam^order of what is limited
    limit, quantity : of the user, and which of its three quantities
    bound  : of a power [mm2/s3], and of the machine's tangential acceleration [mm/s2]
    """

    name: str
    kind: int
    counts: FloatArray
    order: int
    limit: OwnLimit | None = None
    quantity: int = 0
    bound: float = np.inf


class Where(NamedTuple):
    """Where a motion is looked at: n places on legs, and along the run [mm]."""

    leg: Array
    along: FloatArray


@dataclass(frozen=True, eq=False, kw_only=True)
class RunLaws:
    """The laws of a run over A of the axes of a toolpath.

    laws  : the feed in the axes that F goes by, if it is a law of its own; those of `Limits.along`; powers
    axes  : all axes of the toolpath
    axis  : (A,) which move
    still : (all,) where the others stand [mm]
    word  : (R, W) of `TubeRun`
    edges : of the segments along the run, without its ends [mm]
    block : of each of them
    """

    laws: tuple[Law, ...] = ()
    axes: tuple[str, ...] = ()
    axis: Array = field(default_factory=lambda: np.empty(0, dtype=np.int64))
    still: FloatArray = field(default_factory=lambda: np.empty(0))
    word: FloatArray = field(default_factory=lambda: np.empty((0, 0)))
    edges: FloatArray = field(default_factory=lambda: np.empty(0))
    block: Array = field(default_factory=lambda: np.empty(0, dtype=np.int64))

    def __len__(self) -> int:
        return len(self.laws)

    @property
    def orders(self) -> Array:
        """(M,) `Law.order`."""
        return np.array([law.order for law in self.laws], dtype=np.int64)

    @property
    def named(self) -> list[int]:
        """Those that have a name of their own: all but the feed."""
        return [m for m, law in enumerate(self.laws) if law.name != FEED.name]

    @property
    def moved(self) -> bool:
        """Whether a law is of the user: what it says depends on the place."""
        return any(law.limit is not None for law in self.laws)

    def shares(self, where: Where, motion: FloatArray) -> FloatArray:
        """(n, M) shares of the laws that a motion uses [-].

        motion : (n, 4, A) position, velocity, acceleration and jerk
        """
        found = np.zeros((len(motion), len(self.laws)))
        _, v, a, _ = (motion[:, k] for k in range(4))
        seen: dict[int, tuple[FloatArray, FloatArray]] = {}
        moving: Moving | None = None
        for m, law in enumerate(self.laws):
            if law.limit is not None:
                if id(law.limit) not in seen:
                    if moving is None:
                        whole = self._whole(motion)
                        moving = Moving.of(self.axes, [whole[:, k] for k in range(4)])
                    seen[id(law.limit)] = self._of_limit(law.limit, where, moving)
                value, bound = seen[id(law.limit)]
                found[:, m] = np.abs(value[law.quantity]) / bound[:, law.quantity]
            elif law.kind == rows.POWER:
                found[:, m] = np.abs((v * a) @ law.counts) / law.bound
            else:
                found[:, m] = np.linalg.norm(v * law.counts, axis=1) / self.word[where.leg, 0]
        return found

    def _of_limit(self, limit: OwnLimit, where: Where, moving: Moving) -> tuple[FloatArray, FloatArray]:
        """(3, n) what a limit bounds, and (n, 3) its bounds."""
        at = self._place(where, moving.table[0], moving.table[1])
        return limit_derivatives(limit, moving), bounds_at(limit, at, moving.table.shape[1])

    def _whole(self, motion: FloatArray) -> FloatArray:
        """(n, 4, all) a motion (n, 4, A) over all axes."""
        whole = np.zeros((*motion.shape[:2], len(self.axes)))
        whole[:, 0] = self.still
        whole[:, :, self.axis] = motion
        return whole

    def _place(self, where: Where, position: FloatArray, velocity: FloatArray) -> Place:
        speed = np.linalg.norm(velocity, axis=1)[:, None]
        direction = np.divide(velocity, speed, out=np.zeros_like(velocity), where=speed > 0.0)
        block = self.block[np.searchsorted(self.edges, where.along, side="right")]
        return Place(self.axes, list(position.T), direction, block)

    def bounds(self, where: Where, motion: FloatArray, which: Array) -> FloatArray:
        """(n, len(which)) bounds of those laws at a motion (n, 4, A), in mm or the unit of q, and s."""
        found, whole = np.empty((len(motion), len(which))), self._whole(motion)
        seen: dict[int, FloatArray] = {}
        for column, m in enumerate(which):
            law = self.laws[m]
            if law.limit is not None:
                if id(law.limit) not in seen:
                    at = self._place(where, whole[:, 0], whole[:, 1])
                    seen[id(law.limit)] = bounds_at(law.limit, at, len(whole))
                found[:, column] = seen[id(law.limit)][:, law.quantity]
            else:
                found[:, column] = law.bound if law.kind == rows.POWER else self.word[where.leg, 0]
        return found

    def kinds(self, which: Array, state: FloatArray) -> Array:
        """Those of laws.py of the laws `which` (M,); of the user's limits by whether they have a function of the position, at a node
        `state` (3, A)."""
        whole, found = self._whole(np.pad(state, ((0, 1), (0, 0)))[None]), []
        at = Place(self.axes, list(whole[:, 0].T), whole[:, 1], self.block[:1])
        for m in which:
            law = self.laws[m]
            along = law.limit is None or law.limit.value(at) is None
            found.append(law.kind if along else JOINT[law.quantity])
        return np.array(found, dtype=np.int64)

    def model(self, limit: OwnLimit, state: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """(n, A) first and (n, A, A) second derivatives of q at nodes `state` (n, 3, A), and (n,) the third one by the
        time at their velocity."""
        axes, many = len(self.axis), len(state)
        place = self._whole(np.pad(state, ((0, 0), (0, 1), (0, 0))))[:, 0]

        def along(way: FloatArray) -> FloatArray:
            ways = np.zeros((many, len(self.axes)))
            ways[:, self.axis] = way
            still = np.zeros_like(ways)
            return limit_derivatives(limit, Moving.of(self.axes, [place, ways, still, still]))

        unit = np.eye(axes)
        first, second = np.empty((many, axes)), np.empty((many, axes, axes))
        for k in range(axes):
            found = along(unit[k])
            first[:, k], second[:, k, k] = found[0], found[1]
        for k in range(axes):
            for c in range(k):
                both = along(unit[k] + unit[c])[1]
                second[:, k, c] = second[:, c, k] = 0.5 * (both - second[:, k, k] - second[:, c, c])
        return first, second, along(state[:, 1])[2]


def laws_of(limits: Limits, moves: Array, words: bool, counts: FloatArray) -> tuple[Law, ...]:
    """The laws of a run on which some of the axes move, `moves` (all,).

    words  : whether the feed in the axes that F goes by, `counts` (all,), is a law of its own
    """
    found = [Law(FEED.name, rows.SPEED, counts[moves], 1)] if words else []
    for limit in limits.along:
        counted = getattr(limit, "counts", None)
        own = np.isin(limits.axes, counted or limits.axes).astype(np.float64)[moves]
        most = getattr(limit, "largest", np.inf)
        bounded = getattr(limit, "bounded", QUANTITIES)
        if np.isfinite(most) and most >= np.linalg.norm(own * limits.acceleration[moves]):
            bounded = tuple(name for name in bounded if name != ACCELERATION.name)  # out of reach here
        found += [
            Law(f"{quantity}.{limit.name}", PATH[k], own, k + 1, limit, k, most)
            for k, quantity in enumerate(QUANTITIES)
            if quantity in bounded
        ]
    for k, letter in enumerate(limits.axes):
        if moves[k] and np.isfinite(limits.power[k]):
            one = (np.arange(len(moves)) == k).astype(np.float64)[moves]
            name = POWER.called(letter)
            found.append(Law(name, rows.POWER, one, POWER.order, bound=float(limits.power[k])))
    return tuple(found)


def motion_at(state: FloatArray, jerk: FloatArray, t: FloatArray) -> FloatArray:
    """(n, 4, A) motions from nodes `state` (n, 3, A) with the jerk (n, A) at the times t (n,)."""
    t = t[:, None]
    p, v, a = (state[:, k] for k in range(3))
    place = p + t * (v + t * (a / 2.0 + t * jerk / 6.0))
    return np.stack([place, v + t * (a + t * jerk / 2.0), a + t * jerk, jerk], axis=1)


def watched(
    laws: RunLaws, leg: Array, h: FloatArray, state: FloatArray, jerk: FloatArray, along: FloatArray
) -> FloatArray:
    """(N, M) the largest share of each law in every step; leg (N,), h (N,), state (N+1, 3, A), jerk (N, A),
    along (N+1,) places of the nodes along the run [mm]."""
    found = np.zeros((len(h), len(laws)))
    if not len(laws):
        return found
    steps = np.arange(len(h))
    for looked in (LOOKED, LOOKED_AGAIN):
        step, part = np.repeat(steps, len(looked)), np.tile(looked, len(steps))
        where = Where(leg[step], along[step] + part * (along[step + 1] - along[step]))
        shares = laws.shares(where, motion_at(state[step], jerk[step], part * h[step]))
        found[steps] = np.maximum(found[steps], shares.reshape(len(steps), len(looked), -1).max(axis=1))
        steps = np.flatnonzero((found > CLOSE).any(axis=1))
        if not len(steps):
            break
    return found
