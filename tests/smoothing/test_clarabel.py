"""The interior-point method of the smoothing ends at Clarabel's optimum: on random corridors, and in windows of real plans."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from test_corridor_problem import objective, random_corridor

from benchmarks.jobs import problems
from planner.base.threads import use_threads
from planner.nc.program import Program
from planner.planning.methods.optimal import OptimalMethod
from planner.smoothing import relax
from planner.smoothing.interior_point import Accuracy, Problem, minimise_in_corridor

pytest.importorskip("clarabel", reason="clarabel is not installed (pip install '.[test]')")

from clarabel_oracle import of_corridor

JOBS: dict[str, Callable[[], Program]] = {
    "pentagon": problems.pentagon,
    "zig-zag": functools.partial(problems.zigzag, 6),
    "spiral": functools.partial(problems.star_spiral, 40),
}
# Functions between a plan and the solver. Run as Python they call it through its module, where calls are recorded.
ABOVE_CORRIDOR = ("_relax", "_relax_run", "_relaxed_window")
EACH = 5  # windows of a job that are compared: the first, the last, and some between
SAME = 1e-7  # of the objective at the start [-]; found: 1.4e-8
TIGHT = 0.1 * SAME


@functools.cache
def windows(job: str) -> list[tuple[Any, ...]]:
    """The arguments of the solver's calls in a plan."""
    found: list[tuple[Any, ...]] = []
    with pytest.MonkeyPatch.context() as patch:
        for name in ABOVE_CORRIDOR:
            patch.setattr(relax, name, getattr(relax, name).py_func)

        def recorded(*given: Any) -> Any:
            found.append((given[0], given[1].copy(), *given[2:]))
            return minimise_in_corridor(*given)

        patch.setattr(relax, "minimise_in_corridor", recorded)
        use_threads(1)
        try:
            OptimalMethod(corner="spline").plan(JOBS[job](), problems.machine()).require()
        finally:
            use_threads(None)
    return found


def some(calls: list[tuple[Any, ...]]) -> list[tuple[Any, ...]]:
    return [calls[k] for k in np.unique(np.linspace(0, len(calls) - 1, EACH).astype(int))]


def tight(start: float) -> Accuracy:
    return Accuracy(value=0.0, first=abs(start), last=TIGHT * abs(start), relative=0.0)


@pytest.mark.shows("splines", "compared: Clarabel and ipopt on the same problems")
@pytest.mark.parametrize("seed", range(6))
def test_random_corridors_have_clarabels_optimum(seed: int) -> None:
    problem, control = random_corridor(seed, 10 + 5 * seed, 1 + seed % 4, 20 + 10 * seed)
    problem.free[[0, -1]] = False
    start = objective(problem, control)
    found = minimise_in_corridor(problem, control, tight(start), 100)
    assert objective(problem, found.control) == pytest.approx(
        of_corridor(problem, control), abs=SAME * abs(start)
    )


@pytest.mark.shows("splines", "compared: Clarabel and ipopt on the same problems")
@pytest.mark.slow
@pytest.mark.parametrize("job", JOBS)
def test_splines_of_plans_have_clarabels_optimum(job: str) -> None:
    """And a plan's own, looser search ends within the gap that it says."""
    calls = windows(job)
    assert calls
    for problem, start, accuracy, iterations in some(calls):
        problem = Problem(*problem)
        best, begin = of_corridor(problem, start), objective(problem, start)
        scale = SAME * max(abs(begin), abs(best))
        assert objective(problem, minimise_in_corridor(problem, start, tight(begin), 100).control) == (
            pytest.approx(best, abs=scale)
        )
        found = minimise_in_corridor(problem, start, accuracy, iterations)
        missing = objective(problem, found.control) - best
        assert -scale <= missing <= found.gap + scale
        assert found.iterations < iterations
