"""The data of the free optimum: a run, the legs of the programmed path between two full stops, with their
budgets and limits.

A leg consists of collinear lines with one feed and one budget, or is an arc. Over the place x in [0, length]
on it both are

    P(x) = base + drift x + radius (cos(rate x) e1 + sin(rate x) e2)

with radius = 0 for a line, whose drift is its direction; or it is a segment of a curve of the program, P(x) of
geometry/curves.py, with drift = 0 and the radius of a circle that bends as much. Within the tolerance are to be the setpoints p
and what becomes of them, p + sag a: filters move them by sum T^2/24 a, and the middle of a chord is dt^2/8 a off
(corners/budget.py, eq. (18), as vectors).

A step whose cubic has the places s0 <= s1 <= s2 <= s3 runs along P(x(t)), x = sum B_k s_k. The cubic that
meets P(x(t)) at both ends with its velocity has the control points

    P(s0),   P(s0) + (s1 - s0) P'(s0),   P(s3) - (s3 - s2) P'(s3),   P(s3)

and differs from it by at most max |d4/dt4 P(x(t))|/384: kappa rate^2 dx^4/384 on an even step over dx, where
kappa, kappa rate and kappa rate^2 bound the second, third and fourth derivative of P. So these are the points
that the control points of a step belong to; on a line they are the places themselves.

An arc or a curve that bends with a radius below the tolerance is passed (`TubeRun.passed`): its steps have fixed
places, one after the other, and take as little time as they want to.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from planner.base.arrays import Array, FloatArray, freeze
from planner.joint.checks import Keeps
from planner.joint.laws import PUSH
from planner.joint.leg_shapes import (
    LegShapes,
    word_change,
)
from planner.joint.legs import LegFormulas
from planner.joint.own_laws import RunLaws
from planner.joint.step_limits import OfRun

# Fraction of the budget that a step on an arc or a curve may use for what that is off its own cubic [-], and
# the largest angle that it turns by meanwhile [rad], within which tangents tell where a control point belongs.
ARC_FRACTION, TURN_MAX = 0.005, 0.5
STRAIGHT = 1e-6  # differences of directions that count as one [-]
# Without limits of the jerk the scale of steps, as a share of the time in which the full acceleration moves an
# axis by the budget [-]: finer ones take more steps and end hardly sooner.
SHARP = 0.25
# An arc or a curve with a radius below so many times its budget [-] is passed (`TubeRun.passed`;
# `python -m benchmarks.net.ablation ROWS --net NET --without PASSED`).
PASSED = 2.0
MARK = np.pi / 8  # on an arc a point is to be passed every so often [rad]
TOGETHER = 2.0  # vertices may be passed together that are so many tolerances apart [-]


@dataclass(frozen=True, eq=False, kw_only=True)
class TubeRun(LegShapes):
    """R legs from rest to rest, or as `ends` says, over the A axes that move on them, and the R+1 vertices around them.

    axis                         : (A,) their indices among the axes of the toolpath
    first                        : (R+1,) leg r holds the toolpath's segments first[r] : first[r+1]
    curvature                    : (R,) bound of it on the leg [1/mm]
    budget, feed                 : (R,) tolerance [mm], programmed feed [mm/s]
    across_max                   : (R,) largest normal acceleration that the machine allows [mm/s2]; inf where
                                   the axes cannot exceed it
    vertex, vertex_budget        : (R+1, A), (R+1,) [mm]; the budget is 0 at both ends
    ends                         : (2, A) velocity where it begins and ends [mm/s], with no acceleration
    sag                          : how far the middles of chords between setpoints, behind filters, are from the motion per
                                   acceleration [s2]
    lag                          : (K, 2) times and weights of which filters behind the setpoints are the mean [s], [-]
    chord                        : what is half a period to that [s]
    velocity, acceleration, jerk : (A,) limits of the axes; the jerk is inf where nothing limits it
    laws                         : other limits (own_laws.py)
    word                         : (R, W) feed in the axes that F goes by [mm/s], W = 1 where others move with
                                   them, else 0
    counts                       : (A,) 1 for those axes, else 0
    left                         : why the search cannot look for a motion here, "" if it can
    """

    axis: Array
    first: Array
    curvature: FloatArray
    budget: FloatArray
    feed: FloatArray
    across_max: FloatArray
    vertex: FloatArray
    vertex_budget: FloatArray
    ends: FloatArray
    sag: float
    lag: FloatArray
    chord: float
    velocity: FloatArray
    acceleration: FloatArray
    jerk: FloatArray
    laws: RunLaws
    word: FloatArray
    counts: FloatArray
    left: str = ""

    def __post_init__(self) -> None:
        legs, axes = len(self.length), len(self.axis)
        freeze(self, "axis", np.int64, (axes,))
        freeze(self, "first", np.int64, (legs + 1,))
        freeze(self, "curve", np.int64, (legs,))
        freeze(self, "length radius rate curvature budget", np.float64, (legs,))
        freeze(self, "feed across_max", np.float64, (legs,), finite=False)
        freeze(self, "base drift e1 e2", np.float64, (legs, axes))
        freeze(self, "vertex", np.float64, (legs + 1, axes))
        freeze(self, "vertex_budget", np.float64, (legs + 1,))
        freeze(self, "ends", np.float64, (2, axes))
        freeze(self, "lag", np.float64, (None, 2))
        freeze(self, "velocity acceleration counts", np.float64, (axes,))
        freeze(self, "jerk", np.float64, (axes,), finite=False)
        freeze(self, "word", np.float64, (legs, None), finite=False)

    def __len__(self) -> int:
        return len(self.length)

    @cached_property
    def jerk_scale(self) -> FloatArray:
        """(A,) the jerk limits; without them what takes an axis to its full acceleration in `SHARP` of the
        time in which that moves it by the least budget [mm/s3]."""
        pushed = min((law.bound for law in self.laws.laws if law.kind == PUSH), default=np.inf)
        acceleration = np.minimum(self.acceleration, pushed)
        shaped = SHARP * np.sqrt(self.budget.min() / acceleration.max())
        return np.where(np.isfinite(self.jerk), self.jerk, acceleration / shaped)

    @cached_property
    def step_max(self) -> FloatArray:
        """(R,) largest length on a leg that one step may cover [mm]: where an even step is off by
        `ARC_FRACTION` of the budget (module text); inf on lines."""
        with np.errstate(divide="ignore"):
            fourth = 384.0 * ARC_FRACTION * self.budget / (self.curvature * self.rate**2)
            turning = np.where(self.curve < 0, np.abs(self.rate), self.curvature)
            return np.minimum(fourth**0.25, TURN_MAX / turning)

    @cached_property
    def room(self) -> FloatArray:
        """(R,) how far control points of a step may be from their places on the leg [mm]."""
        return np.where(self.curvature > 0, self.budget - ARC_FRACTION * self.budget, self.budget)

    @cached_property
    def off_by_jerk(self) -> float:
        """How far chords that pass a place at another share than the middle are off by jerk (step_limits.py) [mm]."""
        # without limits nothing is known of it
        jerk = np.linalg.norm(self.jerk) if np.isfinite(self.jerk).all() else 0.0
        return float(jerk) * self.chord**3 / 6.0

    @cached_property
    def of_steps(self) -> OfRun:
        """What the limits of steps are made of, for their kernel."""
        names = "room vertex_budget vertex offset feed across_max curvature step_max switch passed"
        return OfRun(
            **{name: getattr(self, name) for name in names.split()},
            by_jerk=self.off_by_jerk,
            fastest=float(np.linalg.norm(self.velocity)),
            strongest=float(np.linalg.norm(self.acceleration)),
            slowest=float(self.velocity.min()),
            jerky=bool(np.isfinite(self.jerk).all()),
        )

    @cached_property
    def keeps(self) -> Keeps:
        """The limits of steps, for the kernels that look at them."""
        formula = ("length", "base", "drift", "e1", "e2", "radius", "rate", "curve")
        same = ("velocity", "acceleration", "jerk", "feed", "budget", "curvature", "vertex_budget", "passed")
        of_legs, of_run = ({name: getattr(self, name) for name in names} for names in (formula, same))
        legs = LegFormulas(**of_legs, points=self.curves.points, weight=self.curves.weight)
        return Keeps(legs=legs, normal=self.across_max, lag=self.lag, chord=self.chord, **of_run)

    @cached_property
    def switch(self) -> FloatArray:
        """(R,) what the feed does where each leg begins: 1 where it falls, -1 where it rises, 0 where no
        motion is so fast."""
        feed = np.minimum(self.feed, np.linalg.norm(self.velocity))
        change = np.sign(np.diff(feed, prepend=feed[0]))
        return -np.where(change != 0.0, change, word_change(self.word))

    @cached_property
    def marks(self) -> Array:
        """(R,) in how many parts of equal length legs are, whose ends are to be passed in order: arcs of `MARK` at most."""
        turned = np.where(self.curve < 0, np.abs(self.rate) * self.length, 0.0)
        return np.maximum(np.ceil(turned / MARK - STRAIGHT), 1).astype(np.int64)

    @cached_property
    def crowded(self) -> Array:
        """(R,) whether what is to be passed next, before or behind the vertex where each leg begins, is so near that both may
        be passed together."""
        apart = self.length / self.marks
        return np.minimum(apart, np.roll(apart, 1)) <= TOGETHER * self.vertex_budget[:-1]

    @cached_property
    def passed(self) -> Array:
        """(R,) legs whose steps have their places by number, not where they are nearest: inside of so narrow a
        bend the nearest place stands still, goes back, or is on another branch while a motion goes on. Not
        where F changes: there the motion has to be nearest to the vertex."""
        narrow: Array = PASSED * self.curvature * self.budget > 1.0
        if not narrow.any():
            return narrow
        changes = np.append(self.switch, 0.0) != 0.0
        return narrow & ~(changes[:-1] | changes[1:])

    def word_share(self, leg: Array, velocity: FloatArray) -> FloatArray:
        """(n,) share of the feed that motions use, counted in the axes that F goes by; 0 where those are
        all [-].

        leg, velocity : (n,), (n, A) [mm/s]
        """
        if not self.word.shape[1]:
            return np.zeros(len(leg))
        return np.asarray(np.linalg.norm(velocity * self.counts, axis=1) / self.word[leg, 0])

    @cached_property
    def offset(self) -> FloatArray:
        """(R+1,) place of the vertices along the run [mm]."""
        return np.append(0.0, np.cumsum(self.length))

    def leg_at(self, place: FloatArray) -> Array:
        """(n,) legs at the places `place` (n,) along the run [mm]."""
        return np.clip(np.searchsorted(self.offset, place, side="right") - 1, 0, len(self) - 1)
