"""How a search for the free optimum ends: its steps, and what ipopt's messages mean."""

from dataclasses import dataclass

from planner.base.arrays import Array, FloatArray
from planner.feedrate.solution import Status
from planner.joint.motion import Steps

SOLVED = (Status.OPTIMAL, Status.ACCEPTABLE)
# What ipopt returns, as status and sentence.
OUTCOMES = {
    "Solve_Succeeded": (Status.OPTIMAL, "path and feed optimised together"),
    "Solved_To_Acceptable_Level": (
        Status.ACCEPTABLE,
        "path and feed optimised together, to about 1e-4 of its time",
    ),
    "Maximum_Iterations_Exceeded": (
        Status.ITERATION_LIMIT,
        "not converged within the iterations allowed; raise max_iterations, or plan with method optimal",
    ),
    "Maximum_CpuTime_Exceeded": (
        Status.ITERATION_LIMIT,
        "not converged in the computing time that a run may take; plan with method optimal",
    ),
    "Infeasible_Problem_Detected": (
        Status.INFEASIBLE,
        "no motion inside the tolerance was found from its start; raise the tolerance, or plan with method optimal",
    ),
}
# Everything else that it returns, and what it says is solved but is not.
BROKE_DOWN = (
    Status.NUMERICAL_ERROR,
    "the solver broke down; change the tolerance a little, or plan with method optimal",
)
# Solved, but slower than the guess.
STUCK = (
    Status.ITERATION_LIMIT,
    "the search came to rest at a motion slower than its start; change the tolerance a little, or plan with method optimal",
)
# Not tried.
NO_CURVES = (Status.INFEASIBLE, "this solver takes lines and arcs, not curves; take the solver own")


@dataclass(frozen=True, eq=False, kw_only=True)
class TubeSolution:
    """How the search ended, and N steps over A axes unless it failed (then None)."""

    status: Status  # what is known of the steps
    sentence: str  # the same for a reader, with what to do about a failure
    iterations: int  # of the solver
    solve_time: float  # [s]
    windows: int = 0  # into which the own solver cut the run, joins included; 0 of other solvers
    solved: int = 0  # of these, how many converged and kept everything without being divided
    steps: Steps | None = None  # the motion, exact and within all limits
    place: FloatArray | None = None  # (N+1,) places of the nodes along the run [mm]
    # (N,) steps that stand for the motion of the start, which stays there; None for none
    kept: Array | None = None
    # (N, 3 A + 5) what the limits of each step cost (price.py) [s], 0 where steps are kept; None where the
    # solver does not tell
    price: FloatArray | None = None
