"""The solvers of the free optimum by name: the own one, and ipopt and fatrop on the same problem."""

from typing import Protocol

from planner.joint.groups import Search
from planner.joint.guess import Guess
from planner.joint.nlp import TubeNLP
from planner.joint.outcome import TubeSolution
from planner.joint.own import TubeOwn
from planner.joint.run import TubeRun


class TubeSolver(Protocol):
    """Finds the best motion near a guess."""

    @property
    def legs_max(self) -> float:
        """Legs, and steps on arcs, that a job may have."""
        ...

    def solve(self, run: TubeRun, guess: Guess) -> TubeSolution:
        """The best motion near the guess, never slower than it."""
        ...


SOLVERS: dict[str, TubeSolver] = {"own": TubeOwn(), "ipopt": TubeNLP(), "fatrop": TubeNLP(solver="fatrop")}


def tube_solver(solver: str | TubeSolver) -> TubeSolver:
    """The solver of that name (base/names.py), or the one that is given."""
    return SOLVERS[solver] if isinstance(solver, str) else solver


def search_with(solver: TubeSolver, run: TubeRun, guess: Guess) -> Search[TubeSolution]:
    """What a solver finds; the own one beside other searches."""
    if isinstance(solver, TubeOwn):
        return (yield from solver.search(run, guess))
    return solver.solve(run, guess)
