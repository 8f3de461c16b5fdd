"""The solvers by their names: two of the problem without jerk limits, three of the problem with them.

    second order   reachability        our kernel (feedrate/reachability.py)
                   toppra              the package of that name, to compare with (feedrate/toppra_adapter.py)
    third order    own                 our interior-point kernel (feedrate/jerk/)
                   ipopt, fatrop       the problem as one nonlinear program, by casadi (feedrate/reference/nlp.py)

A solver is its settings; one with other settings is taken wherever a name is. Sizes up to which each is
sensible: docs/methods.md.
"""

from collections.abc import Callable, Container, Mapping
from typing import Protocol, TypeVar

from planner.base.errors import InputError
from planner.feedrate.constraints.problem import FeedrateProblem
from planner.feedrate.jerk.solver import JerkLimited
from planner.feedrate.reachability import Reachability
from planner.feedrate.reference.nlp import JerkLimitedNLP
from planner.feedrate.solution import FeedrateSolution, FeedrateSolver
from planner.feedrate.toppra_adapter import ToppraSolver

Solver = TypeVar("Solver")

REACHABILITY, OWN = "reachability", "own"  # the usual ones


class ThirdOrderSolver(Protocol):
    """A solver of third order; its repr is its row label in every table."""

    def solve(
        self, problem: FeedrateProblem, progress: Callable[[float], None] | None = None
    ) -> FeedrateSolution:
        """Solve all pieces of the problem, from rest to rest; failures are a status, not an exception.

        progress : called with the share of the points that is done [-]
        """
        ...


SECOND_ORDER: dict[str, FeedrateSolver] = {REACHABILITY: Reachability(), "toppra": ToppraSolver()}
THIRD_ORDER: dict[str, ThirdOrderSolver] = {
    OWN: JerkLimited(),
    "ipopt": JerkLimitedNLP(solver="ipopt"),
    "fatrop": JerkLimitedNLP(solver="fatrop"),
}


def second_order_solver(solver: str | FeedrateSolver) -> FeedrateSolver:
    """The solver without jerk limits of that name, or the one given. Raises InputError for another name."""
    return _named(solver, SECOND_ORDER, "second-order", THIRD_ORDER) if isinstance(solver, str) else solver


def third_order_solver(solver: str | ThirdOrderSolver) -> ThirdOrderSolver:
    """The solver with jerk limits of that name, or the one given. Raises InputError for another name."""
    return _named(solver, THIRD_ORDER, "optimal", SECOND_ORDER) if isinstance(solver, str) else solver


def _named(name: str, solvers: Mapping[str, Solver], method: str, others: Container[str]) -> Solver:
    if name in solvers:
        return solvers[name]
    said = f"solver = {name}: method {method} does not use it" if name in others else f"no solver '{name}'"
    raise InputError(f"{said}; there are {', '.join(solvers)}")
