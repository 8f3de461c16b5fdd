"""The free optimum's program stage by stage, as fatrop asks for: the variables of a node, then those of its
step, then the next node's.

Of every stage the constraints are first the gaps of the next node, next - f(stage), then the rows of the
step. ipopt does not mind the order. Casadi's interface is told the stages: left to find them, it finds wrong
ones.
"""

from typing import Any, NamedTuple

import numpy as np

from planner.base.arrays import FloatArray
from planner.feedrate.solution import Status
from planner.joint.outcome import BROKE_DOWN, OUTCOMES

# Residual of the rows [-]: what is left is integrated away (joint/motion.py).
FEASIBILITY = 1e-6
# Barrier parameter at the beginning [-]; that of ipopt decreases monotonely. Adaptive ones drop early, hug
# the limits and trickle.
BARRIER = 0.1
# The search of ipopt may end when the time changes by less than this fraction in each of so many iterations
# [-], with all rows kept and the complementarity below the last of them [-].
SETTLED, SETTLED_ITERATIONS, COMPLEMENTARITY = 1e-7, 4, 1e-7
# CPU time that ipopt may take for a run [s]. Its iterations do not bound it: one random job of less than 120
# steps took 15 minutes.
SECONDS = 300.0


class Sizes(NamedTuple):
    """N steps, and of each of them S states of its node, C controls and R rows."""

    steps: int
    states: int
    controls: int
    rows: int


def staged(nodes: FloatArray, steps: FloatArray) -> FloatArray:
    """(N (S + C) + S,) the variables of nodes (N+1, S) and steps (N, C), stage by stage."""
    return np.append(np.hstack([nodes[:-1], steps]).ravel(), nodes[-1])


def options(solver: str, sizes: Sizes, tol: float, max_iterations: int) -> dict[str, Any]:
    """Of casadi's interface to "ipopt" or "fatrop".

    tol            : of optimality [-]
    max_iterations : at most
    """
    if solver == "ipopt":
        return {
            "print_time": False,
            "ipopt.print_level": 0,
            "ipopt.sb": "yes",
            "ipopt.mu_strategy": "monotone",
            "ipopt.mu_init": BARRIER,
            "ipopt.tol": tol,
            "ipopt.max_iter": max_iterations,
            "ipopt.max_cpu_time": SECONDS,
            "ipopt.constr_viol_tol": FEASIBILITY,
            "ipopt.acceptable_tol": 1e10,  # not asked for: the multipliers of equal optima need not settle
            "ipopt.acceptable_compl_inf_tol": COMPLEMENTARITY,
            "ipopt.acceptable_constr_viol_tol": FEASIBILITY,
            "ipopt.acceptable_obj_change_tol": SETTLED,
            "ipopt.acceptable_iter": SETTLED_ITERATIONS,
        }
    steps, states, controls, rows = sizes
    return {
        "print_time": False,
        "structure_detection": "manual",
        "equality": ([True] * states + [False] * rows) * steps,
        "N": steps,
        "nx": [states] * (steps + 1),
        "nu": [controls] * steps + [0],
        "ng": [rows] * steps + [0],
        "fatrop": {"print_level": 0, "tol": tol, "max_iter": max_iterations, "mu_init": BARRIER},
    }


def outcome(solver: str, stats: dict[str, Any], max_iterations: int) -> tuple[Status, str, int]:
    """Status, sentence and iterations. nlpsol returns numbers whatever happened; only its statistics tell."""
    iterations = int(stats["iter_count"])
    if solver == "ipopt":
        return *OUTCOMES.get(stats["return_status"], BROKE_DOWN), iterations
    if stats["success"]:
        return *OUTCOMES["Solve_Succeeded"], iterations
    if iterations >= max_iterations:  # fatrop has one code for every failure
        return *OUTCOMES["Maximum_Iterations_Exceeded"], iterations
    return *BROKE_DOWN, iterations
