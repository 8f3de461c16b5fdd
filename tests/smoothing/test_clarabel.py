"""The interior-point methods of the smoothing end at Clarabel's optimum: on random corridors, and in windows of real plans."""

from __future__ import annotations

import functools
from collections.abc import Callable
from types import ModuleType
from typing import Any, NamedTuple

import numpy as np
import pytest
from test_corridor_problem import objective, random_corridor

from benchmarks.jobs import problems
from planner.base.arrays import FloatArray
from planner.base.threads import use_threads
from planner.nc.program import Program
from planner.planning.methods.optimal import OptimalMethod
from planner.smoothing import combined, relax
from planner.smoothing.combined_solver import MISSED, CombinedProblem, improve_window
from planner.smoothing.interior_point import Accuracy, Problem, minimise_in_corridor

pytest.importorskip("clarabel", reason="clarabel is not installed (pip install '.[test]')")

from clarabel_oracle import dense_rows, of_corridor, of_window

JOBS: dict[str, Callable[[], Program]] = {
    "pentagon": problems.pentagon,
    "zig-zag": functools.partial(problems.zigzag, 6),
    "spiral": functools.partial(problems.star_spiral, 40),
}
# Functions between a plan and the two solvers. Run as Python they call the solvers through their module, where calls are recorded.
ABOVE_CORRIDOR = ("_relax", "_finish", "_relax_run", "_relaxed_window")
ABOVE_WINDOW = ("_improve", "improve_range", "_finish", "_tighten", "_improve_window")
EACH = 5  # windows of a job that are compared: the first, the last, and some between
SAME = 1e-7  # of the objective at the start, or of the time of a window [-]; found: 1.4e-8 and 3e-10
TIGHT = 0.1 * SAME


class Windows(NamedTuple):
    """The arguments of both solvers' calls in a plan."""

    corridor: list[tuple[Any, ...]]
    combined: list[tuple[Any, ...]]


@functools.cache
def windows(job: str) -> Windows:
    found = Windows([], [])
    with pytest.MonkeyPatch.context() as patch:
        for module, names in ((relax, ABOVE_CORRIDOR), (combined, ABOVE_WINDOW)):
            for name in names:
                patch.setattr(module, name, getattr(module, name).py_func)
        _record(patch, relax, "minimise_in_corridor", found.corridor)
        _record(patch, combined, "improve_window", found.combined)
        use_threads(1)
        try:
            OptimalMethod(corner="spline", rounds=3).plan(JOBS[job](), problems.machine()).require()
        finally:
            use_threads(None)
    return found


def _record(patch: pytest.MonkeyPatch, module: ModuleType, name: str, calls: list[tuple[Any, ...]]) -> None:
    solve = getattr(module, name)

    def recorded(*given: Any) -> Any:
        calls.append((given[0], given[1].copy(), *given[2:]))
        return solve(*given)

    patch.setattr(module, name, recorded)


def some(calls: list[tuple[Any, ...]]) -> list[tuple[Any, ...]]:
    return [calls[k] for k in np.unique(np.linspace(0, len(calls) - 1, EACH).astype(int))]


def value(problem: CombinedProblem, y: FloatArray) -> float:
    flat = y.ravel()
    total = float(problem.linear.ravel() @ flat)
    for d in range(min(problem.H.shape[1], len(flat))):
        part = float((problem.H[: len(flat) - d, d] * flat[d:] * flat[: len(flat) - d]).sum())
        total += part if d else 0.5 * part
    return total


def tight(start: float) -> Accuracy:
    return Accuracy(value=0.0, first=abs(start), last=TIGHT * abs(start), relative=0.0)


@pytest.mark.parametrize("linear_part", [False, True])
@pytest.mark.parametrize("seed", range(6))
def test_random_corridors_have_clarabels_optimum(seed: int, linear_part: bool) -> None:
    problem, control = random_corridor(seed, 10 + 5 * seed, 1 + seed % 4, 20 + 10 * seed)
    if linear_part:
        problem = problem._replace(linear=np.random.default_rng(seed).normal(size=control.shape))
    problem.free[[0, -1]] = False
    start = objective(problem, control)
    found = minimise_in_corridor(problem, control, tight(start), 100)
    assert objective(problem, found.control) == pytest.approx(
        of_corridor(problem, control), abs=SAME * abs(start)
    )


@pytest.mark.slow
@pytest.mark.parametrize("job", JOBS)
def test_splines_of_plans_have_clarabels_optimum(job: str) -> None:
    """And a plan's own, looser search ends within the gap that it says."""
    calls = windows(job).corridor
    assert len(calls) >= 2
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


@pytest.mark.slow
@pytest.mark.parametrize("job", JOBS)
def test_steps_of_path_and_feed_have_clarabels_optimum(job: str) -> None:
    calls = windows(job).combined
    assert len(calls) >= 2
    for problem, start, time, gap, iterations in some(calls):
        best = of_window(problem, start)
        y, _ = improve_window(problem, start, time, TIGHT * time, 100)
        assert value(problem, y) == pytest.approx(best, abs=SAME * time)
        asked, took = improve_window(problem, start, time, gap, iterations)
        assert value(problem, asked) <= best + gap + SAME * time
        assert took < iterations
        every = dense_rows(problem.rows, len(y))
        moves = np.einsum("rnk,nk->r", every, asked)
        assert (moves <= problem.rows.factor[:, 5] + MISSED).all()
        assert (-moves <= problem.rows.factor[:, 4] + MISSED).all()
