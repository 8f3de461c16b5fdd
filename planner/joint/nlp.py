"""The free optimum inside the tolerance: the motion of the axes itself is what is sought, its path included.

The motion along a run of R legs has N steps of duration h_i and constant jerk j_i (a vector over the axes);
nodes between them have position p_i, velocity v_i, acceleration a_i. The kinematics are exact, and every
programmed vertex has a node. A step is a Bezier cubic with the control points

    c0 = p_i,   c1 = p_i + h v_i/3,   c2 = p_{i+1} - h v_{i+1}/3,   c3 = p_{i+1};     s0 <= s1 <= s2 <= s3 their places on the leg.

    minimise   T = sum_i h_i
    subject to p_{i+1} = p_i + v_i h + a_i h^2/2 + j_i h^3/6,    v_{i+1} = v_i + a_i h + j_i h^2/2,    a_{i+1} = a_i + j_i h
               |v_i|, |v_i + a_i h/2| <= v,    |a_i| <= a,    |j_i| <= j               per axis
               |v_i|, |v_i + a_i h/2| <= F                                             in the norm
               |c_k - q_k| <= room,    s3 - s0 <= step_max (arcs)                      the tolerance, both sides, in order
               |a - u v| <= a_n                                                        for some u, at places of a step, if limited
               m (p - V).v <= 0         at a vertex V, with m = 1 where the feed falls and -1 where it rises (rows.py)
               node at a vertex: s = the vertex;     v = a = 0, p = the vertex at both ends.

The smallest |a - u v| over u is the normal acceleration; rows of this kind have good derivatives down to
rest, |v x a| <= a_n |v| has not. What holds for the control points holds for the whole step: acceleration is
linear and velocity a parabola with the Bezier ordinates v_i, v_i + a_i h/2, v_{i+1}, so all limits but the
normal acceleration hold at every time. The q_k are the control points of the leg's own cubic along the places
s_k (run.py): P(s_k) on lines, and with the tangents at s0 and s3 on arcs. With the Bernstein weights B_k

    |sum B_k c_k - P(sum B_k s_k)| <= max |c_k - q_k| + what the leg is off its cubic

and the place sum B_k s_k never goes back: motion and path are within the budget in the sense of Frechet,
which is what the tolerance asks for: in order, every vertex reached, both sides.

Free durations leave the problem with many equal optima (a phase of constant jerk may be cut anywhere) and
ipopt trickling among them: a weak pull of every h to its guess makes it one, `PULL`, and weak ones of
every jerk to 0 and of nodes to their legs (step_limits.py). It is not convex and has no certificate: what is
found is the best near the guess. All quantities are in units in which the mean step of the guess has length 1
and duration 1, so that scaling a job scales its plan.
"""

import time
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Literal

import numpy as np

from planner.base.errors import InputError, import_needed
from planner.joint.guess import Guess
from planner.joint.laws import PUSH, REST
from planner.joint.motion import steps_of
from planner.joint.numbers import acceleration_along, formula, step_numbers
from planner.joint.outcome import BROKE_DOWN, NO_CURVES, SOLVED, STUCK, TubeSolution
from planner.joint.own_laws import Law
from planner.joint.run import TubeRun
from planner.joint.stages import FEASIBILITY, Sizes, options, outcome, staged
from planner.joint.step_limits import CENTRE, jerk_weights, weights

# Weight of ((h - guess)/guess)^2 against a step's time [-]: without it windows take more iterations, or do not
# converge; a larger one costs time.
PULL = 1e-4
# Steps may become this much longer or shorter than they were guessed [-].
LONGER = 4.0
# The guess is slowed down by these factors in turn until one leads to an optimum [-]: at the guess itself the
# limits hold, and ipopt begins between them with tiny steps.
SLOWER = (1.2, 1.5, 1.0)
# Where normal acceleration is limited it is watched at these places of every step [-], and steps become no
# more than this much longer: with the others' freedom one step reaches round the whole corner, with twice the
# limit between two places.
WATCHED, LONGER_WATCHED = (0.5, 1.0), 1.5
# It may also come to rest far from any optimum: what is slower than the guess by more than this fraction [-]
# does not count.
NOT_SLOWER = 1e-4
NODE_ROW = 2  # of the rows of a step: of the tolerance of the node at its end
# By how much rows of the tangential acceleration may be missed [-]: at rest they are 0 for every motion, and ipopt
# needs room there.
RELAXED = 1e-6
# A job may have this many legs (arcs count as many as the steps they need): what memory and time allow.
LEGS_MAX = 500


@dataclass(frozen=True, kw_only=True)
class TubeNLP:
    """The free optimum by ipopt or fatrop.

    solver         : "ipopt", or "fatrop", which uses the stages
    tol            : relative tolerance of optimality [-], > 0
    max_iterations : per run and start
    """

    solver: Literal["ipopt", "fatrop"] = "ipopt"
    tol: float = 1e-7
    max_iterations: int = 300
    legs_max: ClassVar[float] = LEGS_MAX

    def __post_init__(self) -> None:
        if self.solver not in ("ipopt", "fatrop"):
            raise ValueError(f"TubeNLP.solver: '{self.solver}'; there are ipopt and fatrop")
        if not self.tol > 0:
            raise ValueError(f"TubeNLP.tol: {self.tol} must be positive")

    def solve(self, run: TubeRun, guess: Guess) -> TubeSolution:
        """The best motion near the guess, never slower than it; a failure from every start is the status of
        the last.

        Raises InputError if casadi is missing.
        """
        if len(run.curves):
            return TubeSolution(status=NO_CURVES[0], sentence=NO_CURVES[1], iterations=0, solve_time=0.0)
        iterations, took = 0, 0.0
        for slower in SLOWER:
            found = self.solve_from(run, guess.slower(slower), guess)
            iterations, took = iterations + found.iterations, took + found.solve_time
            if found.steps is not None and found.steps.h.sum() > guess.h.sum() * (1.0 + NOT_SLOWER):
                found = TubeSolution(status=STUCK[0], sentence=STUCK[1], iterations=0, solve_time=0.0)
            if found.steps is not None:
                break
        return replace(found, iterations=iterations, solve_time=took)

    def solve_from(self, run: TubeRun, guess: Guess, given: Guess) -> TubeSolution:
        """Transcribe and solve once, from a guess of the same steps as the one given, to whose durations they
        are pulled. The whole formulation, from top to bottom."""
        ca = import_needed("casadi", "method tube")

        began = time.perf_counter()
        steps, axes, leg = len(guess), len(run.axis), guess.leg
        at_vertex = np.flatnonzero(np.diff(leg)) + 1  # nodes

        # ---- scaling: units in which the mean step has length 1 and duration 1
        # ---------------------------------------------
        second, length = guess.h.mean(), run.offset[-1] / steps
        speed, acc, jerk = length / second, length / second**2, length / second**3
        v_max, a_max, j_max = run.velocity / speed, run.acceleration / acc, run.jerk / jerk

        watched = len(WATCHED) if np.isfinite(run.across_max).any() else 0
        pushes = pushes_of(run)

        # ---- variables, stage by stage: state (p, v, a) and place of a node; jerk, duration and the other
        # places of its step -------- Legs may be a thousand times shorter than others: places, and what
        # orders them, are in units of the mean step of their leg.
        mean_step = (run.length / np.bincount(leg))[np.append(leg, leg[-1])]
        states, controls = 3 * axes + 1, axes + 4 + watched
        w = ca.MX.sym("w", (states + controls) * steps + states)
        stage = ca.reshape(w[: (states + controls) * steps], states + controls, steps)
        node, step = stage[:states, :], stage[states:, :]
        after = ca.horzcat(node[:, 1:], w[-states:])

        # ---- objective
        # ------------------------------------------------------------------------------------------------------
        h_guess = given.h / second
        h_all = step[axes, :]
        merit = ca.sum2(h_all) + PULL * ca.sumsqr(h_all / ca.DM(h_guess).T - 1)
        used = step[:axes, :] / ca.repmat(ca.DM(j_max), 1, steps)
        weight = jerk_weights(run.feed[leg], guess.state[:, 1], weights(0.0))
        merit += ca.sum2(ca.sum1(used**2) * ca.DM(weight * h_guess).T)

        # ---- dynamics of one step
        # -------------------------------------------------------------------------------------------
        p, v, a, j = (ca.SX.sym(name, axes) for name in ("p", "v", "a", "j"))
        places, h = [ca.SX.sym(name) for name in ("s0", "s1", "s2", "s3")], ca.SX.sym("h")
        p1, v1, a1 = p + h * (v + h * (a / 2 + h * j / 6)), v + h * (a + h * j / 2), a + h * j

        # ---- constraints of one step; its numbers are parameters
        # -------------------------------------------------------------
        base, drift, e1, e2 = (ca.SX.sym(name, axes) for name in ("base", "drift", "e1", "e2"))
        scalars = (
            "begin",
            "radius",
            "rate",
            "room",
            "room_end",
            "step_max",
            "feed",
            "feed_end",
            "normal",
            "mean_step",
            "pace",
            "mean_next",
        )
        begin, radius, rate, room, room_end, step_max, feed, feed_end, normal, own_mean, pace, mean_next = (
            map(ca.SX.sym, scalars)
        )
        s0, s1, s2, s3 = (place * own_mean for place in places)
        following = ca.vertcat(p1, v1, a1, s3 / mean_next)

        def apart(point: Any, place: Any, ahead: Any = 0.0) -> Any:
            """Squared distance of a point from the one so far ahead on the tangent at a place of its leg."""
            x = place - begin
            cos, sin = ca.cos(rate * x), ca.sin(rate * x)
            tangent = drift + radius * rate * (cos * e2 - sin * e1)
            return ca.sumsqr(point - base - drift * x - radius * (cos * e1 + sin * e2) - ahead * tangent)

        ordinate = v + a * h / 2
        vertex, switch = ca.SX.sym("vertex", axes), ca.SX.sym("switch")
        rows: list[tuple[Any, float, float]] = [
            row
            for sag in (0.0, run.sag / second**2)  # of setpoints, and of chords: they share their places
            for row in (
                (apart(p + sag * a + h * (v + sag * j) / 3, s0, s1 - s0) / room**2, -np.inf, 1.0),
                (apart(p1 + sag * a1 - h * (v1 + sag * j) / 3, s3, s2 - s3) / room**2, -np.inf, 1.0),
                (apart(p1 + sag * a1, s3) / room_end**2, -np.inf, 1.0),
            )
        ]
        rows += [
            (ca.vertcat(s1 - s0, s2 - s1, s3 - s2) / own_mean, 0.0, np.inf),
        ]
        if (run.feed > run.velocity.min()).any():
            rows.append((ordinate / v_max, -1.0, 1.0))
        if (run.feed < np.linalg.norm(run.velocity)).any():
            inner = ca.dot(v, ordinate), (2 * ca.sumsqr(ordinate) + ca.dot(v, v1)) / 3, ca.dot(ordinate, v1)
            rows.append(
                (ca.vertcat(*(row / feed**2 for row in inner), ca.sumsqr(v1) / feed_end**2), -np.inf, 1.0)
            )
        if run.switch.any():
            rows.append((switch * ca.dot(p1 - vertex, v1), -np.inf, 0.0))
        if (run.curvature > 0).any():
            rows.append(((s3 - s0) / step_max, -np.inf, 1.0))
        along = ca.SX.sym("along", watched)  # u of the places that are watched, times the pace
        for k, q in enumerate(WATCHED[:watched]):
            velocity, acceleration = v + h * q * (a + h * q * j / 2), a + h * q * j
            across = acceleration - along[k] * velocity / pace
            rows.append((ca.sumsqr(across) / normal**2, -np.inf, 1.0))
        from_rest, to_rest = (
            ca.SX.sym("from_rest"),
            ca.SX.sym("to_rest"),
        )  # 0 in the first and in the last step
        word = ca.SX.sym("word")
        if run.word.shape[1]:
            w0, w1, w2 = (ca.DM(run.counts) * one for one in (v, ordinate, v1))
            inner = ca.dot(w0, w1), (2 * ca.sumsqr(w1) + ca.dot(w0, w2)) / 3, ca.dot(w1, w2)
            rows.append((ca.vertcat(ca.sumsqr(w0), *inner, ca.sumsqr(w2)) / word**2, -np.inf, 1.0))
        for push in pushes:
            bound = push.bound / acc
            ordinates = formula(ca, (v, ordinate, v1), (a, a1), push.counts, REST * pace)
            for there, (pushed, along_it) in zip(
                (from_rest, from_rest * to_rest, from_rest * to_rest, to_rest), ordinates, strict=True
            ):
                row = [there * (sign * pushed / bound - along_it) / pace for sign in (1.0, -1.0)]
                rows += [(one, -np.inf, RELAXED) for one in row]

        # ---- constraints of all steps, stage by stage: gaps first
        # -----------------------------------------------------------
        of_stage = [ca.vertcat(p, v, a, places[0]), ca.vertcat(j, h, *places[1:], along)]
        numbers = ca.vertcat(*(base, drift, e1, e2, begin, radius, rate, room, room_end, step_max))
        numbers = ca.vertcat(numbers, feed, feed_end, normal, own_mean, pace, vertex, switch, mean_next)
        numbers = ca.vertcat(numbers, from_rest, to_rest, word)
        of_step = ca.Function(
            "step", [*of_stage, numbers], [following, ca.vertcat(*(row for row, _, _ in rows))]
        )
        words = run.word[leg, 0] / speed if run.word.shape[1] else np.ones(steps)
        moving = np.arange(steps) > 0, np.arange(steps) < steps - 1  # at both ends of a step
        data = step_numbers(run, guess, mean_step[:-1], length, speed, acc)
        reached, limited = of_step.map(steps)(
            node, step, ca.DM(np.column_stack([data, mean_step[1:] / length, *moving, words]).T)
        )
        constraints = ca.vec(ca.vertcat(after - reached, limited))
        merit += CENTRE / 2.0 * ca.sum2(limited[NODE_ROW, :] * ca.DM(h_guess).T)
        low, high = (np.concatenate([np.full(row[0].numel(), row[k]) for row in rows]) for k in (1, 2))
        row_min, row_max = (np.tile(np.append(np.zeros(states), bound), steps) for bound in (low, high))

        # ---- limits and boundary
        # ----------------------------------------------------------------------------------------------
        node_max = np.tile(np.concatenate([np.full(axes, np.inf), v_max, a_max, [np.inf]]), (steps + 1, 1))
        node_min = -node_max
        node_min[at_vertex, -1] = node_max[at_vertex, -1] = (run.offset[leg] / mean_step[:-1])[at_vertex]
        for end in (0, -1):
            rest = np.concatenate(
                [run.vertex[end] / length, np.zeros(2 * axes), [run.offset[end] / mean_step[end]]]
            )
            node_min[end] = node_max[end] = rest
        longer = LONGER_WATCHED if watched else LONGER
        step_high = np.column_stack(
            [np.tile(j_max, (steps, 1)), h_guess * longer, np.full((steps, 3 + watched), np.inf)]
        )
        step_low = np.column_stack(
            [np.tile(-j_max, (steps, 1)), h_guess / LONGER, np.full((steps, 3 + watched), -np.inf)]
        )

        # ---- initial guess
        # ----------------------------------------------------------------------------------------------------
        p0, v0, a0 = guess.state[:, 0] / length, guess.state[:, 1] / speed, guess.state[:, 2] / acc
        place = np.append(guess.place[:, 0], run.offset[-1]) / mean_step
        node_start = np.column_stack([p0, v0, a0, place])
        step_start = np.column_stack(
            [
                np.diff(a0, axis=0) / (guess.h / second)[:, None],
                guess.h / second,
                guess.place[:, 1:] / mean_step[:-1, None],
                np.tile(acceleration_along(guess)[:, None] / acc, (1, watched)),
            ]
        )

        # ---- solve
        # --------------------------------------------------------------------------------------------------------------
        program = {"x": w, "f": merit, "g": constraints}
        sizes = Sizes(steps, states, controls, len(low))
        solver = ca.nlpsol(
            "solver", self.solver, program, options(self.solver, sizes, self.tol, self.max_iterations)
        )
        lower, upper = (staged(*pair) for pair in ((node_min, step_low), (node_max, step_high)))
        x0 = staged(node_start, step_start)
        result = solver(x0=x0, lbx=lower, ubx=upper, lbg=row_min, ubg=row_max)
        status, sentence, iterations = outcome(self.solver, solver.stats(), self.max_iterations)
        g, x = np.array(result["g"]).ravel(), np.array(result["x"]).ravel()
        worst = max((g - row_max).max(), (row_min - g).max(), (x - upper).max(), (lower - x).max())
        if status in SOLVED and not worst <= 10 * FEASIBILITY:
            status, sentence = BROKE_DOWN
        took = time.perf_counter() - began
        if status not in SOLVED:
            return TubeSolution(status=status, sentence=sentence, iterations=iterations, solve_time=took)

        # ---- unpack
        # -------------------------------------------------------------------------------------------------------------
        found = x[: (states + controls) * steps].reshape(steps, -1)
        place = np.append(found[:, states - 1], x[-1]) * mean_step
        return TubeSolution(
            status=status,
            sentence=sentence,
            iterations=iterations,
            solve_time=took,
            steps=steps_of(
                run, guess, found[:, states + axes] * second, found[:, states : states + axes] * jerk
            ),
            place=place,
        )


def pushes_of(run: TubeRun) -> list[Law]:
    """The laws of the tangential acceleration. Raises InputError if the run has others than that and the
    feed."""
    found = []
    for law in run.laws.laws:
        if law.kind == PUSH and np.isfinite(law.bound):
            found.append(law)
        elif law.limit is not None or np.isfinite(law.bound):
            raise InputError(
                f"limit '{law.name}': the solvers ipopt and fatrop do not keep it; plan with own"
            )
    return found
